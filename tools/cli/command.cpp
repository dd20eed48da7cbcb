#include "tools/cli/command.hpp"

#include <algorithm>

namespace selfcal::cli {
namespace {

// A function's static, so that it exists before the first registration of any file.
std::vector<Command>& registry() {
  static std::vector<Command> all;
  return all;
}

}  // namespace

CommandRegistration::CommandRegistration(Command command) {
  std::vector<Command>& all = registry();
  const auto place = std::lower_bound(all.begin(), all.end(), command,
                                      [](const Command& a, const Command& b) { return a.name < b.name; });
  all.insert(place, std::move(command));
}

const std::vector<Command>& commands() { return registry(); }

}  // namespace selfcal::cli
