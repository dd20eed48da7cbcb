#include "protocol/profile/dbc_file.hpp"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <regex>

#include "protocol/toml_file/toml_text.hpp"

namespace selfcal::profile {
namespace {

constexpr std::size_t longest_file = 4U << 20U, longest_line = 2000;  // std::regex recurses by the length of a line
constexpr std::uint32_t extended_bit = 0x80000000;
constexpr std::size_t longest_signal = 64, most_bytes = 64;

template <typename T>
bool read(const std::string& text, T& into) {
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto done = std::from_chars(begin, text.data() + text.size(), into);
  return done.ec == std::errc() && done.ptr == text.data() + text.size();
}

class Parser {
 public:
  // Why the line makes no sense; empty: it does, or is none of ours.
  std::string line(const std::string& text) {
    static const std::regex message(R"(^BO_ +(\d+) +(\w+) *: *(\d+) .*)");
    static const std::regex signal(
        R"(^\s+SG_ +(\w+) +[Mm\d]* *: *(\d+)\|(\d+)@([01])([+-]) *\(([^,()]+),([^,()]+)\) *\[[^\]]*\] *"([^"]*)\".*)");
    static const std::regex type(R"(^SIG_VALTYPE_ +(\d+) +(\w+) *:? *([0-3]) *;.*)");
    std::smatch m;
    if (text.starts_with("BO_ ")) {
      return std::regex_match(text, m, message) && take_message(m) ? "" : "no message: BO_ ID NAME: BYTES SENDER";
    }
    if (std::regex_search(text, std::regex(R"(^\s+SG_ )"))) {
      return std::regex_match(text, m, signal) && take_signal(m)
                 ? ""
                 : "no signal: SG_ NAME : START|LENGTH@ORDER SIGN (SCALE,OFFSET) [LEAST|MOST] \"UNIT\" RECEIVERS";
    }
    if (text.starts_with("SIG_VALTYPE_ ")) {
      return std::regex_match(text, m, type) && take_type(m) ? "" : "no type of a signal that is there";
    }
    return {};
  }
  Dbc take() { return std::move(messages_); }

 private:
  bool take_message(const std::smatch& m) {
    DbcMessage message;
    std::uint32_t id = 0;
    if (!read(m[1], id) || !read(m[3], message.bytes) || message.bytes > most_bytes) {
      return false;
    }
    message.extended = (id & extended_bit) != 0;
    message.id = id & ~extended_bit;
    const auto [at, fresh] = messages_.insert_or_assign(m[2], message);
    by_id_[id] = current_ = &at->second;
    return true;
  }

  bool take_signal(const std::smatch& m) {
    Signal s;
    s.name = m[1];
    if (current_ == nullptr || !read(m[2], s.start) || !read(m[3], s.length) || !read(m[6], s.scale) ||
        !read(m[7], s.offset) || s.length == 0 || s.length > longest_signal || s.scale == 0.0) {
      return false;
    }
    s.order = m[4] == "1" ? ByteOrder::little : ByteOrder::big;
    s.kind = m[5] == "-" ? Signal::Kind::with_sign : Signal::Kind::whole;
    s.unit = m[8];
    current_->signals.insert_or_assign(s.name, s);
    return true;
  }

  bool take_type(const std::smatch& m) {
    std::uint32_t id = 0;
    const auto message = read(m[1], id) ? by_id_.find(id) : by_id_.end();
    if (message == by_id_.end()) {
      return false;
    }
    const auto signal = message->second->signals.find(m[2].str());
    const bool single = m[3] == "1", floating = single || m[3] == "2";
    if (signal == message->second->signals.end() || (floating && signal->second.length != (single ? 32U : 64U))) {
      return false;
    }
    signal->second.kind = floating ? Signal::Kind::floating : signal->second.kind;
    return true;
  }

  Dbc messages_;
  std::map<std::uint32_t, DbcMessage*> by_id_;
  DbcMessage* current_ = nullptr;
};

}  // namespace

Expected<Dbc> parse_dbc(std::string_view text, const std::string& file) {
  if (text.size() > longest_file) {
    return fail(ErrorKind::bad_input, fmt::format("{}: more than {} bytes", file, longest_file));
  }
  Parser parser;
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string line(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    ++number;
    if (!line.empty() && line.back() == '\r') {
      line.pop_back();
    }
    const std::string why = line.size() > longest_line ? "longer than 2000 bytes" : parser.line(line);
    if (!why.empty()) {
      return fail(ErrorKind::bad_input, fmt::format("{}:{}: {}", one_line(file), number, why));
    }
  }
  return parser.take();
}

Expected<Dbc> load_dbc(const std::string& file) {
  std::error_code error;
  const bool regular = std::filesystem::is_regular_file(file, error);
  std::ifstream in(file);
  if (!regular || !in) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot be opened", file));
  }
  std::string content(longest_file + 1, '\0');
  in.read(content.data(), static_cast<std::streamsize>(content.size()));
  content.resize(static_cast<std::size_t>(in.gcount()));
  return parse_dbc(content, file);
}

}  // namespace selfcal::profile
