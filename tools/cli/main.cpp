// selfcal: the operator's program. What it can do stands in the other files of this folder.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <map>

#include "tools/cli/command.hpp"

namespace {

using namespace selfcal;

constexpr int usage_status = static_cast<int>(ErrorKind::usage);
constexpr int internal_status = static_cast<int>(ErrorKind::internal);

int report(const std::string& command, const Error& error) {
  fmt::print(stderr, "selfcal {}: {}\n", command, error.message);
  return static_cast<int>(error.kind);
}

int parse_and_run(int argc, char** argv) {
  CLI::App app(
      "Calibrates an inertial navigation system on its own gimbal.\n"
      "Exit status: 0 done; 1 done, but the answer is no; 2 usage; 3 bad input; 4 INS, bus or daemon; "
      "5 internal.",
      "selfcal");
  app.require_subcommand(1);
  app.set_version_flag("--version", "selfcal " SELFCAL_VERSION);
  std::map<const CLI::App*, cli::CommandRun> runs;
  for (const cli::Command& command : cli::commands()) {
    CLI::App* subcommand = app.add_subcommand(command.name, command.description);
    runs.emplace(subcommand, command.configure(*subcommand));
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {  // --help
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    const auto chosen = app.get_subcommands();
    fmt::print(stderr, "selfcal{}{}: {}\n", chosen.empty() ? "" : " ", chosen.empty() ? "" : chosen.front()->get_name(),
               error.what());
    return usage_status;
  }
  const CLI::App* chosen = app.get_subcommands().front();
  const Expected<int> status = runs.at(chosen)();
  if (!status) {
    return report(chosen->get_name(), status.error());
  }
  // Output that could not be written (a full disk, a closed pipe) is a failure, not a success.
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    return report(chosen->get_name(), {ErrorKind::internal, "standard output: cannot write"});
  }
  return *status;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return parse_and_run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "selfcal: internal error: {}\n", error.what());
    return internal_status;
  }
}
