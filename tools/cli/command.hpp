// The commands of `selfcal`: each file of this folder that holds one registers it, and main.cpp offers them all.
//
//   namespace {
//   CommandRun configure(Options& options) {
//     auto arguments = std::make_shared<Arguments>();
//     options.text("FILE", arguments->file, "...", Needed::yes);
//     return [arguments]() -> Expected<int> { ...; return 0; };
//   }
//   const CommandRegistration registration{{"estimate", "the 24 sensor errors of a recording", configure}};
//   }  // namespace
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "protocol/command_line/command_line.hpp"
#include "protocol/error.hpp"

namespace selfcal::cli {

// Runs the command once its options are parsed: 0 done, 1 done but the answer is no. An Error's message is printed
// on one line of standard error, and its kind is the exit status.
using CommandRun = std::function<Expected<int>()>;

struct Command {
  std::string name;
  std::string description;
  std::function<CommandRun(Options&)> configure;  // adds its options
};

class CommandRegistration {
 public:
  // Not explicit: a file with several commands lists them in one array.
  CommandRegistration(Command command);
};

// All registered, by name.
const std::vector<Command>& commands();

}  // namespace selfcal::cli
