#include "daemon/hub/hub_connection.hpp"

#include <fmt/format.h>
#include <libpq-fe.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace selfcal::hub {
namespace {

// libpq ends its messages with a line feed and may tell a cause on a further line.
std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) {
    text.pop_back();
  }
  for (std::string::size_type at; (at = text.find('\n')) != std::string::npos;) {
    text.replace(at, text.find_first_not_of(" \t\n", at) - at, "; ");
  }
  return text;
}

struct FreeOptions {
  void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
};

// A set's connection string with what keeps anybody else from being the hub: the server's certificate is verified, and
// SCRAM is bound to it (channel_binding), so that a password is of use to nobody in between.
Expected<std::string> guarded(const std::string& parameters) {
  char* complaint = nullptr;
  const std::unique_ptr<PQconninfoOption, FreeOptions> options(PQconninfoParse(parameters.c_str(), &complaint));
  if (!options) {
    const std::string text = complaint == nullptr ? "not a connection string" : one_line(complaint);
    PQfreemem(complaint);
    return fail(ErrorKind::bad_input, "hub: connection: " + text);
  }
  std::string host, mode;
  for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
    const std::string keyword = option->keyword, value = option->val == nullptr ? "" : option->val;
    host = keyword == "host" || (keyword == "hostaddr" && host.empty()) ? value : host;
    mode = keyword == "sslmode" ? value : mode;
  }
  if (host.starts_with('/')) {  // a Unix socket: nobody is in between
    return parameters;
  }
  if (host.empty()) {
    return fail(ErrorKind::bad_input, "hub: connection: no host: a set names its hub, or a Unix socket's folder");
  }
  if (mode != "verify-full") {
    return fail(ErrorKind::bad_input,
                fmt::format("hub: connection: sslmode={}: a set needs sslmode=verify-full and sslrootcert=FILE",
                            mode.empty() ? "(none)" : mode));
  }
  return parameters +
         " channel_binding=require keepalives_idle=15 keepalives_interval=5 keepalives_count=3 tcp_user_timeout=20000";
}

}  // namespace

void Rows::Clear::operator()(pg_result* result) const { PQclear(result); }

int Rows::size() const { return PQntuples(result_.get()); }

std::string Rows::text(int row, int column) const { return PQgetvalue(result_.get(), row, column); }

bool Rows::is_null(int row, int column) const { return PQgetisnull(result_.get(), row, column) != 0; }

// Object identifiers of PostgreSQL's own types are fixed (pg_type.dat): int8, int2, int4, float8, numeric; bool.
bool Rows::is_number(int column) const {
  const Oid type = PQftype(result_.get(), column);
  return type == 20 || type == 21 || type == 23 || type == 701 || type == 1700;
}

bool Rows::is_boolean(int column) const { return PQftype(result_.get(), column) == 16; }

std::int64_t Rows::integer(int row, int column) const {
  return std::strtoll(PQgetvalue(result_.get(), row, column), nullptr, 10);
}

double Rows::real(int row, int column) const {
  const char* text = PQgetvalue(result_.get(), row, column);
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  return end == text ? std::numeric_limits<double>::quiet_NaN() : value;
}

std::vector<double> Rows::reals(int row, int column) const {
  std::vector<double> values;
  const char* at = PQgetvalue(result_.get(), row, column);
  while (*at == '{' || *at == ',') {
    char* end = nullptr;
    ++at;
    const double value = std::strtod(at, &end);
    if (end == at) {
      break;
    }
    values.push_back(value);
    at = end;
  }
  return values;
}

Expected<std::unique_ptr<Connection>> Connection::open(const std::string& parameters, Security security) {
  auto all = security == Security::authenticated ? guarded(parameters) : Expected<std::string>(parameters);
  if (!all) {
    return tl::unexpected(all.error());
  }
  *all += " application_name=selfcal connect_timeout=10";
  std::unique_ptr<Connection> connection(new Connection(PQconnectdb(all->c_str())));
  PGconn* raw = connection->connection_;
  // libpq writes notices to standard error; what matters comes as an error too.
  PQsetNoticeProcessor(
      raw, [](void*, const char*) {}, nullptr);
  if (PQstatus(raw) != CONNECTION_OK) {
    return fail(ErrorKind::device, "hub: " + one_line(PQerrorMessage(raw)));
  }
  const char* ours = security == Security::authenticated
                         ? "SET search_path = selfcal, public; SET statement_timeout = '60s'; SET "
                           "idle_in_transaction_session_timeout = '60s'; SET TIME ZONE 'UTC'"
                         : "SET search_path = selfcal, public; SET TIME ZONE 'UTC'";
  if (auto ok = connection->execute(ours); !ok) {
    return tl::unexpected(ok.error());
  }
  return connection;
}

Expected<void> check_authenticated(const std::string& parameters) {
  return guarded(parameters).map([](const std::string&) {});
}

Connection::~Connection() { PQfinish(connection_); }

tl::unexpected<Error> Connection::failed(const pg_result* result) {
  const char* state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  const char* primary = PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY);
  sql_state_ = state == nullptr ? "" : state;
  const std::string words = one_line(primary == nullptr ? PQerrorMessage(connection_) : primary);
  return fail(ErrorKind::device, fmt::format("hub {}: {}", place(), words.empty() ? "no answer" : words));
}

Expected<Rows> Connection::ask(const std::string& sql, const std::vector<Value>& values) {
  std::vector<const char*> pointers;
  pointers.reserve(values.size());
  for (const Value& value : values) {
    pointers.push_back(value ? value->c_str() : nullptr);
  }
  PGresult* result = PQexecParams(connection_, sql.c_str(), static_cast<int>(values.size()), nullptr, pointers.data(),
                                  nullptr, nullptr, 0);
  Rows rows(result);
  const auto status = PQresultStatus(result);
  if (status != PGRES_TUPLES_OK && status != PGRES_COMMAND_OK) {
    return failed(result);
  }
  return rows;
}

Expected<void> Connection::execute(const std::string& sql) {
  PGresult* result = PQexec(connection_, sql.c_str());
  const Rows rows(result);
  const auto status = PQresultStatus(result);
  if (status != PGRES_TUPLES_OK && status != PGRES_COMMAND_OK) {
    return failed(result);
  }
  return {};
}

bool Connection::alive() const { return PQstatus(connection_) == CONNECTION_OK; }

std::string Connection::place() const {
  const char* host = PQhost(connection_);
  const char* name = PQdb(connection_);
  return fmt::format("{}/{}", host == nullptr ? "" : host, name == nullptr ? "" : name);
}

Expected<std::string> Connection::scram_verifier(const std::string& role, const std::string& password) const {
  char* text = PQencryptPasswordConn(connection_, password.c_str(), role.c_str(), "scram-sha-256");
  if (text == nullptr) {
    return fail(ErrorKind::device, "hub: " + one_line(PQerrorMessage(connection_)));
  }
  std::string verifier = text;
  PQfreemem(text);
  return verifier;
}

namespace {

std::string quoted(const std::string& text, char quote) {
  std::string result(1, quote);
  for (const char c : text) {
    result += c;
    if (c == quote) {
      result += c;
    }
  }
  return result + quote;
}

}  // namespace

std::string sql_name(const std::string& name) { return quoted(name, '"'); }

// standard_conforming_strings is on since PostgreSQL 9.1: only the quote itself is special.
std::string sql_text(const std::string& text) { return quoted(text, '\''); }

std::string sql_array(const std::vector<double>& values) {
  std::string text = "{";
  for (const double value : values) {
    text += fmt::format("{}{:.17g}", text.size() > 1 ? "," : "", value);
  }
  return text + "}";
}

std::string sql_array(const std::vector<std::int64_t>& values) { return fmt::format("{{{}}}", fmt::join(values, ",")); }

std::string sql_array(const std::vector<std::string>& texts) {
  std::string array = "{";
  for (const std::string& text : texts) {
    array += array.size() > 1 ? ",\"" : "\"";
    for (const char c : text) {
      if (c == '"' || c == '\\') {
        array += '\\';
      }
      array += c;
    }
    array += '"';
  }
  return array + "}";
}

}  // namespace selfcal::hub
