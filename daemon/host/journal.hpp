// One line for each event that matters, to systemd's journal with structured fields, or to standard error where
// there is no journal. Never a key, never a seed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace selfcal::journal {

enum class Level { error = 3, warning = 4, notice = 5, info = 6 };  // syslog's numbers

// Fields SELFCAL_RUN, SELFCAL_INS, SELFCAL_SERIAL, SELFCAL_STATE, SELFCAL_NRC, SELFCAL_BATCH, SELFCAL_STEP, SELFCAL_TASK,
// SELFCAL_KEY; empty or negative: left out.
struct Fields {
  std::int64_t run = 0;
  std::string ins{};
  std::string serial{};
  std::string state{};
  int nrc = -1;
  // Of a batch (tools/batch): its first 12 digits; its task by name and by key.
  std::string batch{}, step{}, task{}, key{};
};

// The fields as journald takes them, NAME=value.
std::vector<std::string> entry(Level level, std::string_view message, const Fields& fields);

void write(Level level, std::string_view message, const Fields& fields = {});

// To the journal alone, for commands that tell people by their own output. False where there is no journal.
bool note(Level level, std::string_view message, const Fields& fields);

}  // namespace selfcal::journal
