// Commands that this program was built without: tools/demo builds only what it runs.
#include "tools/cli/command.hpp"

namespace selfcal::cli {
namespace {

[[maybe_unused]] CommandRun configure(Options& options) {
  options.take_anything();
  return []() -> Expected<int> {
    return fail(ErrorKind::usage, "this program was built without it; `tools/setup programs` builds it");
  };
}

#ifdef SELFCAL_WITHOUT_REPORT
const CommandRegistration report{
    {"report", "a calibration as a page with plots (not built into this program)", configure}};
#endif
#ifdef SELFCAL_WITHOUT_METRICS
const CommandRegistration metrics{{"metrics", "figures for Prometheus (not built into this program)", configure}};
#endif
#ifdef SELFCAL_WITHOUT_HUB
const CommandRegistration batch{{"batch", "the same work on many recordings (not built into this program)", configure}};
const CommandRegistration fleet{{"fleet", "a depot's units and sets (not built into this program)", configure}};
const CommandRegistration hub{{"hub", "a depot's memory (not built into this program)", configure}};
#endif
#ifdef SELFCAL_WITHOUT_ANALYSIS
const CommandRegistration diagnose{{"diagnose", "which physics was left out (not built into this program)", configure}};
const CommandRegistration poses{
    {"poses", "hand-turned sensors without a gimbal (not built into this program)", configure}};
const CommandRegistration import_file{
    {"import", "a recording from a file of another form (not built into this program)", configure}};
#endif

}  // namespace
}  // namespace selfcal::cli
