// selfcal report, in a program that was built without it: the plotting library of its pages comes from npm.
#include "tools/cli/command.hpp"

namespace selfcal::cli {
namespace {

CommandRun configure(Options& options) {
  options.take_anything();
  return []() -> Expected<int> {
    return fail(ErrorKind::usage, "this program was built without it; `tools/setup programs` builds it");
  };
}

const CommandRegistration registration{
    {"report", "a calibration as a page with plots (not built into this program)", configure}};

}  // namespace
}  // namespace selfcal::cli
