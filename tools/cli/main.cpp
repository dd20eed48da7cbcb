// selfcal: the operator's program. What it can do stands in the other files of this folder.
#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "tools/cli/command.hpp"

namespace {

using namespace selfcal;

int report(const std::string& command, const Error& error) {
  fmt::print(stderr, "selfcal {}: {}\n", command, error.message);
  return static_cast<int>(error.kind);
}

struct Offered {
  std::string name;
  Options options;
  cli::CommandRun run;
};

int parse_and_run(int argc, char** argv) {
  CommandLine line("selfcal", SELFCAL_VERSION,
                   "Calibrates an inertial navigation system on its own gimbal.\n"
                   "Exit status: 0 done; 1 done, but the answer is no; 2 usage; 3 bad input; 4 INS, bus or daemon; "
                   "5 internal.");
  std::vector<Offered> offered;
  for (const cli::Command& command : cli::commands()) {
    Options options = line.options().command(command.name, command.description);
    cli::CommandRun run = command.configure(options);
    offered.push_back({command.name, std::move(options), std::move(run)});
  }
  if (const std::optional<int> ended = line.parse(argc, argv)) {
    return *ended;
  }
  for (const Offered& command : offered) {
    if (!command.options.chosen()) {
      continue;
    }
    const Expected<int> status = command.run();
    if (!status) {
      return report(command.name, status.error());
    }
    // Output that could not be written (a full disk, a closed pipe) is a failure, not a success.
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
      return report(command.name, {ErrorKind::internal, "standard output: cannot write"});
    }
    return *status;
  }
  return static_cast<int>(ErrorKind::internal);  // parse() lets nothing pass without a command
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return parse_and_run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "selfcal: internal error: {}\n", error.what());
    return static_cast<int>(ErrorKind::internal);
  }
}
