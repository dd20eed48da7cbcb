#include "daemon/host/journal.hpp"

#define SD_JOURNAL_SUPPRESS_LOCATION
#include <fmt/format.h>
#include <sys/uio.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <utility>
#include <vector>

namespace selfcal::journal {
namespace {

// Standard error goes to the journal by itself under systemd; then the fields are what is wanted. In a terminal or
// a test's log the line is.
bool journal_is_there() {
  static const bool there = access("/run/systemd/journal/socket", W_OK) == 0;
  return there;
}

}  // namespace

std::vector<std::string> entry(Level level, std::string_view message, const Fields& fields) {
  std::vector<std::string> lines{fmt::format("MESSAGE={}", message),
                                 fmt::format("PRIORITY={}", static_cast<int>(level)),
                                 fmt::format("SYSLOG_IDENTIFIER={}", program_invocation_short_name)};
  if (fields.run > 0) {
    lines.push_back(fmt::format("SELFCAL_RUN={}", fields.run));
  }
  for (const auto& [name, value] :
       {std::pair("INS", &fields.ins), std::pair("SERIAL", &fields.serial), std::pair("STATE", &fields.state),
        std::pair("BATCH", &fields.batch), std::pair("STEP", &fields.step), std::pair("TASK", &fields.task),
        std::pair("KEY", &fields.key)}) {
    if (!value->empty()) {
      lines.push_back(fmt::format("SELFCAL_{}={}", name, *value));
    }
  }
  if (fields.nrc >= 0) {
    lines.push_back(fmt::format("SELFCAL_NRC=0x{:02X}", fields.nrc));
  }
  return lines;
}

bool note(Level level, std::string_view message, const Fields& fields) {
  if (!journal_is_there()) {
    return false;
  }
  std::vector<std::string> lines = entry(level, message, fields);
  std::vector<iovec> parts;
  parts.reserve(lines.size());
  for (std::string& line : lines) {
    parts.push_back({line.data(), line.size()});
  }
  return sd_journal_sendv(parts.data(), static_cast<int>(parts.size())) >= 0;
}

void write(Level level, std::string_view message, const Fields& fields) {
  if (note(level, message, fields)) {
    return;
  }
  std::string line = isatty(STDERR_FILENO) != 0 ? "" : fmt::format("<{}>", static_cast<int>(level));
  line += fmt::format("{}: ", program_invocation_short_name);
  if (!fields.ins.empty()) {
    line += fields.ins + ": ";
  }
  if (fields.run > 0) {
    line += fmt::format("run {}: ", fields.run);
  }
  fmt::print(stderr, "{}{}\n", line, message);
}

}  // namespace selfcal::journal
