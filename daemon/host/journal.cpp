#include "daemon/host/journal.hpp"

#define SD_JOURNAL_SUPPRESS_LOCATION
#include <fmt/format.h>
#include <sys/uio.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <cstdio>
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
                                 fmt::format("PRIORITY={}", static_cast<int>(level)), "SYSLOG_IDENTIFIER=selfcald"};
  if (fields.run > 0) {
    lines.push_back(fmt::format("SELFCAL_RUN={}", fields.run));
  }
  if (!fields.ins.empty()) {
    lines.push_back("SELFCAL_INS=" + fields.ins);
  }
  if (!fields.serial.empty()) {
    lines.push_back("SELFCAL_SERIAL=" + fields.serial);
  }
  if (!fields.state.empty()) {
    lines.push_back("SELFCAL_STATE=" + fields.state);
  }
  if (fields.nrc >= 0) {
    lines.push_back(fmt::format("SELFCAL_NRC=0x{:02X}", fields.nrc));
  }
  return lines;
}

void write(Level level, std::string_view message, const Fields& fields) {
  if (journal_is_there()) {
    std::vector<std::string> lines = entry(level, message, fields);
    std::vector<iovec> parts;
    parts.reserve(lines.size());
    for (std::string& line : lines) {
      parts.push_back({line.data(), line.size()});
    }
    if (sd_journal_sendv(parts.data(), static_cast<int>(parts.size())) >= 0) {
      return;
    }
  }
  std::string line = fmt::format("<{}>selfcald: ", static_cast<int>(level));
  if (isatty(STDERR_FILENO) != 0) {
    line = "selfcald: ";
  }
  if (!fields.ins.empty()) {
    line += fields.ins + ": ";
  }
  if (fields.run > 0) {
    line += fmt::format("run {}: ", fields.run);
  }
  fmt::print(stderr, "{}{}\n", line, message);
}

}  // namespace selfcal::journal
