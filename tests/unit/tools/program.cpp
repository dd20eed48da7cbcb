#include "tests/unit/tools/program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

#include "protocol/recording/atomic_file.hpp"
#include "tests/unit/recording/sample_recording.hpp"

extern char** environ;

namespace selfcal::test {

Finished run_selfcal(const std::vector<std::string>& arguments) {
  const TemporaryFolder folder;
  std::vector<char*> argv;
  std::vector<std::string> words{SELFCAL_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::transform(words.begin(), words.end(), std::back_inserter(argv), [](std::string& word) { return word.data(); });
  argv.push_back(nullptr);
  const std::string out = folder / "out";
  const std::string error = folder / "error";
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT, 0600);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, error.c_str(), O_WRONLY | O_CREAT, 0600);
  pid_t child = 0;
  const int spawned = ::posix_spawn(&child, SELFCAL_PROGRAM, &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (spawned != 0) {
    throw std::runtime_error("cannot start " SELFCAL_PROGRAM);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  constexpr std::size_t longest = 1 << 26;
  constexpr int signal_base = 128;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : signal_base + WTERMSIG(status),
          read_text_file(out, longest).value(), read_text_file(error, longest).value()};
}

std::string failure_fault(const Finished& finished, int status) {
  if (finished.status != status) {
    return "status " + std::to_string(finished.status) + ", said: " + finished.error;
  }
  if (std::count(finished.error.begin(), finished.error.end(), '\n') != 1 || !finished.error.ends_with('\n')) {
    return "not one line: " + finished.error;
  }
  return finished.out.empty() ? "" : "wrote to standard output: " + finished.out;
}

}  // namespace selfcal::test
