// rosbag2's SQLite storage: tables topics(id, name, type, serialization_format) and messages(topic_id, timestamp, data).
#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <map>

#include "protocol/import/bag.hpp"

namespace selfcal::import {
namespace {

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
struct Finalize {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

// 0 where there is none.
std::uintmax_t size_of_file(const std::filesystem::path& file) {
  std::error_code fault;
  const std::uintmax_t size = std::filesystem::file_size(file, fault);
  return fault ? 0 : size;
}

std::string uri_of(const std::filesystem::path& file) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(file).string()) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '/' ||
                       c == '.' || c == '_' || c == '-';
    uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  // Nothing is written beside the file, unless a recorder that was killed left the rest of its messages there.
  if (size_of_file(file.string() + "-wal") > 0 || size_of_file(file.string() + "-journal") > 0) {
    return uri + "?mode=ro";
  }
  return uri + "?mode=ro&immutable=1";
}

// The files that a folder's metadata.yaml lists, where FILE is one of them.
std::size_t files_of_the_bag(const std::filesystem::path& file) {
  std::ifstream in(file.parent_path() / "metadata.yaml");
  constexpr std::size_t most_lines = 100000;
  std::size_t files = 0;
  bool own = false;
  bool listing = false;
  std::string line;
  for (std::size_t k = 0; k < most_lines && std::getline(in, line); ++k) {
    const std::size_t begin = line.find_first_not_of(' ');
    const std::string_view text =
        begin == std::string::npos ? std::string_view() : std::string_view(line).substr(begin);
    if (text.starts_with("relative_file_paths:")) {
      listing = true;
    } else if (listing && text.starts_with("- ")) {
      ++files;
      own = own || text.find(file.filename().string()) != std::string_view::npos;
    } else {
      listing = false;
    }
  }
  return own ? files : 1;
}

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file)
      : file_(file), builder_(file.string(), "ROS 2 bag (SQLite)", Encoding::cdr) {}

  Expected<Bag> read() {
    if (const std::size_t files = files_of_the_bag(file_); files > 1) {
      return bad(
          fmt::format("one of {} files of a bag that was split, as its metadata.yaml says; `ros2 bag convert` "
                      "writes one file",
                      files));
    }
    sqlite3* opened = nullptr;
    const int status = sqlite3_open_v2(uri_of(file_).c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
    database_.reset(opened);
    if (status != SQLITE_OK) {
      return bad(words());
    }
    // A file is no program: no views, triggers or functions of its own; no value longer than the file.
    sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(opened, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    size_ = size_of_file(file_) + size_of_file(file_.string() + "-wal");
    constexpr std::uintmax_t least = 100000;  // of SQLite's own
    constexpr std::uintmax_t most = 1000000000;
    sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, static_cast<int>(std::clamp(size_, least, most)));
    return check_tables()
        .and_then([this] { return read_topics(); })
        .and_then([this] { return read_messages(); })
        .map([this] { return builder_.finish(); });
  }

 private:
  tl::unexpected<Error> bad(const std::string& what) const {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", file_.string(), what));
  }
  std::string words() const {
    return fmt::format("SQLite cannot read it: {}",
                       database_ == nullptr ? "out of memory" : sqlite3_errmsg(database_.get()));
  }

  Expected<Statement> prepare(const char* sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql, -1, &statement, nullptr) != SQLITE_OK) {
      return bad(words());
    }
    return Statement(statement);
  }

  // Calls ROW for each; an error ends it.
  template <typename Row>
  Expected<void> each(const char* sql, const Row& row) {
    const Expected<Statement> statement = prepare(sql);
    if (!statement) {
      return tl::unexpected(statement.error());
    }
    int status = sqlite3_step(statement->get());
    for (; status == SQLITE_ROW; status = sqlite3_step(statement->get())) {
      if (Expected<void> done = row(statement->get()); !done) {
        return done;
      }
    }
    return status == SQLITE_DONE ? Expected<void>() : bad(words());
  }

  // A view or a virtual table has no root page: it is a program.
  Expected<void> check_tables() {
    int tables = 0;
    Expected<void> counted =
        each("SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name IN ('topics', 'messages') AND rootpage > 0",
             [&tables](sqlite3_stmt*) {
               ++tables;
               return Expected<void>();
             });
    if (counted && tables != 2) {
      return bad("an SQLite database, but no ROS 2 bag: tables topics and messages are expected");
    }
    return counted;
  }

  static std::string text_of(sqlite3_stmt* statement, int column) {
    const unsigned char* text = sqlite3_column_text(statement, column);
    return text == nullptr ? std::string() : reinterpret_cast<const char*>(text);
  }

  Expected<void> read_topics() {
    return each("SELECT id, name, type, serialization_format FROM topics", [this](sqlite3_stmt* row) -> Expected<void> {
      constexpr std::size_t most_topics = 2000;
      const std::string name = text_of(row, 1);
      const std::string format = text_of(row, 3);
      const Expected<std::size_t> topic = builder_.topic(name, text_of(row, 2));
      if (!topic) {
        return tl::unexpected(topic.error());
      }
      if (builder_.wanted(*topic) && format != "cdr") {
        return bad(fmt::format("{}: serialised as '{}'; cdr is expected", name, format.substr(0, 40)));
      }
      topics_[sqlite3_column_int64(row, 0)] = *topic;
      return topics_.size() > most_topics ? Expected<void>(bad(fmt::format("more than {} topics", most_topics)))
                                          : Expected<void>();
    });
  }

  // In the order of the table, whose messages the builder then sorts: a sort in SQLite would carry the images along.
  Expected<void> read_messages() {
    return each("SELECT topic_id, timestamp, data FROM messages", [this](sqlite3_stmt* row) -> Expected<void> {
      const auto topic = topics_.find(sqlite3_column_int64(row, 0));
      // A damaged tree may lead to one page again and again.
      bytes_ += 1 + (topic == topics_.end() || !builder_.wanted(topic->second)
                         ? 0
                         : static_cast<std::uintmax_t>(sqlite3_column_bytes(row, 2)));
      if (bytes_ > size_) {
        return bad(fmt::format("damaged: more messages than its {} bytes hold", size_));
      }
      if (topic == topics_.end() || !builder_.wanted(topic->second)) {
        return {};
      }
      if (sqlite3_column_type(row, 1) != SQLITE_INTEGER || sqlite3_column_type(row, 2) != SQLITE_BLOB) {
        return bad(fmt::format("a message of topic {} has no time in ns or no bytes", topic->first));
      }
      const void* bytes = sqlite3_column_blob(row, 2);
      const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row, 2));
      if (bytes == nullptr && size > 0) {
        return bad(words());
      }
      return builder_.message(topic->second, sqlite3_column_int64(row, 1), {static_cast<const char*>(bytes), size});
    });
  }

  std::filesystem::path file_;
  BagBuilder builder_;
  std::unique_ptr<sqlite3, Close> database_;
  std::map<std::int64_t, std::size_t> topics_;
  std::uintmax_t size_ = 0;
  std::uintmax_t bytes_ = 0;  // of the messages read so far
};

}  // namespace

Expected<Bag> read_sqlite_bag(const std::filesystem::path& file) { return Reader(file).read(); }

}  // namespace selfcal::import
