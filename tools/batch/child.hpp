// A program run as a child: its output into files, its end with what it cost. A child dies with its parent.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal::batch {

struct ChildCommand {
  std::vector<std::string> words;  // the first is a path, or a name that PATH has
  std::filesystem::path folder;    // that it works in
  std::filesystem::path output, errors;
  unsigned limit_s = 0;  // ended by SIGALRM after so long; 0: never
};

struct ChildEnd {
  pid_t child = 0;
  int exit_status = 0;
  int signal = 0;  // that ended it; 0: it ended itself
  double processor_s = 0.0;
};

// An error (device) where no process can be made. A program that cannot be run ends with status 127.
Expected<pid_t> start_child(const ChildCommand& command);

// The next of our children that ends; with `wait` false nullopt where none has ended yet.
Expected<std::optional<ChildEnd>> ended_child(bool wait = true);

// Runs it to its end, for programs that answer at once. `scratch`: where its output goes for a moment. An error (device)
// with the first line of its errors where its status is not 0.
Expected<std::string> answer_of(const std::vector<std::string>& words, const std::filesystem::path& scratch);

// The first line of a file, "" where there is none.
std::string first_line(const std::filesystem::path& file);

}  // namespace selfcal::batch
