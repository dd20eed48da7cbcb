// A prepared statement with its values bound and its columns read in order.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal::sqlite {

// SQLite's message about its last failure, with the operating system's where that is the cause.
std::string failure_words(sqlite3* database);

// The database as an error: `what` was tried.
tl::unexpected<Error> database_error(sqlite3* database, std::string_view what);

class Statement {
 public:
  Statement(sqlite3* database, std::string_view sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(std::int64_t value);
  Statement& bind(double value);
  Statement& bind(const std::string& value);
  Statement& bind(const std::vector<std::uint8_t>& value);

  // True: there is a row; false: done.
  Expected<bool> step();
  // For statements without rows. It can be bound and run again then: a loop prepares its statement once.
  Expected<void> run();

  // The next column of the row.
  std::int64_t integer();
  double real();
  std::string text();
  std::vector<std::uint8_t> blob();

 private:
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  int prepared_;
  int bound_ = 0;
  int column_ = 0;
};

}  // namespace selfcal::sqlite
