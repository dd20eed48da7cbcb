#include "daemon/store/sqlite.hpp"

#include <fmt/format.h>

#include <system_error>

namespace selfcal::sqlite {

std::string failure_words(sqlite3* database) {
  if (database == nullptr) {
    return "out of memory";
  }
  std::string words = sqlite3_errmsg(database);
  const int kind = sqlite3_errcode(database) & 0xff;  // without the extension
  const int system_error = sqlite3_system_errno(database);
  // Elsewhere the number is that of some earlier failure.
  const bool from_system = kind == SQLITE_CANTOPEN || kind == SQLITE_IOERR || kind == SQLITE_FULL;
  if (!from_system || system_error == 0) {
    return words;
  }
  return fmt::format("{}: {}", words, std::generic_category().message(system_error));
}

tl::unexpected<Error> database_error(sqlite3* database, std::string_view what) {
  const char* file = database == nullptr ? nullptr : sqlite3_db_filename(database, "main");
  return fail(ErrorKind::device,
              fmt::format("database {}: {}: {}", file == nullptr ? "" : file, what, failure_words(database)));
}

Statement::Statement(sqlite3* database, std::string_view sql) : database_(database) {
  prepared_ = sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &statement_, nullptr);
}

Statement::~Statement() { sqlite3_finalize(statement_); }

Statement& Statement::bind(std::int64_t value) {
  sqlite3_bind_int64(statement_, ++bound_, value);
  return *this;
}

Statement& Statement::bind(double value) {
  sqlite3_bind_double(statement_, ++bound_, value);
  return *this;
}

Statement& Statement::bind(const std::string& value) {
  sqlite3_bind_text(statement_, ++bound_, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
  return *this;
}

Statement& Statement::bind(const std::vector<std::uint8_t>& value) {
  sqlite3_bind_blob(statement_, ++bound_, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
  return *this;
}

Expected<bool> Statement::step() {
  if (prepared_ != SQLITE_OK) {
    return database_error(database_, "prepare");
  }
  column_ = 0;
  const int result = sqlite3_step(statement_);
  if (result == SQLITE_ROW) {
    return true;
  }
  if (result == SQLITE_DONE) {
    return false;
  }
  return database_error(database_, "execute");
}

Expected<void> Statement::run() {
  const auto done = step();
  sqlite3_reset(statement_);
  bound_ = 0;
  if (!done) {
    return tl::unexpected(done.error());
  }
  return {};
}

std::int64_t Statement::integer() { return sqlite3_column_int64(statement_, column_++); }

double Statement::real() { return sqlite3_column_double(statement_, column_++); }

std::string Statement::text() {
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column_));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column_++));
  return data == nullptr ? std::string() : std::string(data, size);
}

std::vector<std::uint8_t> Statement::blob() {
  const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_, column_));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column_++));
  return data == nullptr ? std::vector<std::uint8_t>() : std::vector<std::uint8_t>(data, data + size);
}

}  // namespace selfcal::sqlite
