// A connection to the hub: PostgreSQL by libpq, its errors as ours.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"

struct pg_conn;
struct pg_result;

namespace selfcal::hub {

// The rows of an answer, as text.
class Rows {
 public:
  explicit Rows(pg_result* result) : result_(result) {}
  int size() const;
  std::string text(int row, int column) const;  // empty where null
  bool is_null(int row, int column) const;
  bool is_number(int column) const;  // by the server's type
  bool is_boolean(int column) const;
  std::int64_t integer(int row, int column) const;       // 0 where it is none
  double real(int row, int column) const;                // NaN where it is none
  std::vector<double> reals(int row, int column) const;  // of a one-dimensional array; empty where it is none

 private:
  struct Clear {
    void operator()(pg_result* result) const;
  };
  std::unique_ptr<pg_result, Clear> result_;
};

using Value = std::optional<std::string>;  // nullopt: null

enum class Security {
  any,           // people's commands: what the connection string and the server agree on
  authenticated  // sets: TLS to a verified server and SCRAM bound to it, or a Unix socket
};

class Connection {
 public:
  // `parameters`: a libpq connection string ("host=hub dbname=selfcal user=set_a", "" for libpq's defaults). An error
  // (device) tells where and why on one line; it never holds a password.
  static Expected<std::unique_ptr<Connection>> open(const std::string& parameters, Security security = Security::any);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // One statement with $1, $2, ...; an error is the server's, on one line.
  Expected<Rows> ask(const std::string& sql, const std::vector<Value>& values = {});
  // Any number of statements without rows.
  Expected<void> execute(const std::string& sql);

  bool alive() const;
  const std::string& sql_state() const { return sql_state_; }  // of the last error, five characters
  std::string place() const;                                   // "host/database", for messages
  // SCRAM verifier of a password, so that the server never reads the password itself.
  Expected<std::string> scram_verifier(const std::string& role, const std::string& password) const;

 private:
  explicit Connection(pg_conn* connection) : connection_(connection) {}
  tl::unexpected<Error> failed(const pg_result* result);

  pg_conn* connection_;
  std::string sql_state_;
};

// What Connection::open asks of an authenticated set's connection string, without a server. An error (bad_input) says what is missing.
Expected<void> check_authenticated(const std::string& parameters);

// Quoted for SQL, as a name and as a text.
std::string sql_name(const std::string& name);
std::string sql_text(const std::string& text);
// Text of an array, as a parameter of a statement. "{1,2.5}": 17 digits give the same bits back.
std::string sql_array(const std::vector<double>& values);
std::string sql_array(const std::vector<std::int64_t>& values);
std::string sql_array(const std::vector<std::string>& texts);

}  // namespace selfcal::hub
