// selfcal run, amend, rollback: begin a run and follow it to its end.
#include <fmt/format.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "protocol/document/document_head.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/online_client.hpp"
#include "tools/cli/online_follow.hpp"
#include "tools/cli/online_run.hpp"
#include "tools/cli/online_text.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {

Expected<int> report_ending(ManagerClient& manager, std::uint64_t run, const Ending& ending, bool json) {
  const auto document = manager.show(run);
  if (!document) {
    return tl::unexpected(document.error());
  }
  fmt::print("{}", json ? *document + "\n" : run_ending_text(*document, use_colour(stdout), text_columns(stdout)));
  std::fflush(stdout);
  const bool same_screen = !json && isatty(STDOUT_FILENO) == 1 && isatty(STDERR_FILENO) == 1;
  if (ending.exit_status != 0 && !same_screen) {
    fmt::print(stderr, "selfcal: run {}: {}\n", run, ending.reason);
  }
  return ending.exit_status;
}

namespace {

struct RunOptions {
  std::string ins, schedule, force;
  bool dry_run = false, stop_when_met = false, json = false, detach = false;
};

Expected<int> run(const RunOptions& options) {
  auto manager = ManagerClient::connect();
  if (!manager) {
    return tl::unexpected(manager.error());
  }
  auto ins = choose_ins(**manager, options.ins);
  if (!ins) {
    return tl::unexpected(ins.error());
  }
  catch_signals();
  Follower follower(**manager, *ins);
  Entries wanted;
  if (!options.schedule.empty()) {
    wanted["schedule"] = options.schedule;
  }
  if (options.dry_run) {
    wanted["dry_run"] = true;
  }
  if (options.stop_when_met) {
    wanted["stop_when_met"] = true;
  }
  if (!options.force.empty()) {
    wanted["force"] = options.force;
  }
  const auto id = (*manager)->start(*ins, wanted);
  if (!id) {
    return tl::unexpected(id.error());
  }
  if (options.detach) {
    fmt::print("{}\n", options.json ? document::with_head(document::request, {{"run", *id}}).dump()
                                    : fmt::format("run {}", *id));
    return 0;
  }
  const auto ending = follower.follow(*id);
  if (!ending) {
    return tl::unexpected(ending.error());
  }
  return report_ending(**manager, *id, *ending, options.json);
}

CommandRun configure_run(Options& options) {
  auto arguments = std::make_shared<RunOptions>();
  options.text("INS", arguments->ins, "which INS (a section of selfcald.toml); may be left out where there is one");
  options.text("--schedule", arguments->schedule, "table2, horizontal, or a file that the daemon can read");
  options.flag("--dry-run", arguments->dry_run, "estimate and judge, write nothing to the INS");
  options.flag("--stop-when-met", arguments->stop_when_met, "end the rotation as soon as every tolerance is met");
  options.text("--force", arguments->force, "write a result that the gate refuses; the reason is recorded");
  options.flag("--detach", arguments->detach, "print the run's number and do not wait");
  options.flag("--json", arguments->json, "the run's document on standard output");
  return [arguments] { return run(*arguments); };
}

// Follows a run that is of another's making; its document says which INS.
Expected<int> follow_begun(ManagerClient& manager, const Expected<std::uint64_t>& id, bool json) {
  if (!id) {
    return tl::unexpected(id.error());
  }
  const auto document = manager.show(*id);
  if (!document) {
    return tl::unexpected(document.error());
  }
  Follower follower(manager, nlohmann::json::parse(*document).at("ins").get<std::string>());
  const auto ending = follower.follow(*id);
  if (!ending) {
    return tl::unexpected(ending.error());
  }
  return report_ending(manager, *id, *ending, json);
}

struct AmendOptions {
  std::uint64_t run = 0;
  std::vector<std::string> with;
  std::string force;
  bool dry_run = false, json = false;
};

Expected<int> amend(const AmendOptions& options) {
  const auto with = run_numbers(options.with);
  if (!with) {
    return tl::unexpected(with.error());
  }
  auto manager = ManagerClient::connect();
  if (!manager) {
    return tl::unexpected(manager.error());
  }
  catch_signals();
  Entries wanted;
  if (options.dry_run) {
    wanted["dry_run"] = true;
  }
  if (!options.force.empty()) {
    wanted["force"] = options.force;
  }
  if (!with->empty()) {
    wanted["with"] = *with;
  }
  return follow_begun(**manager, (*manager)->amend(options.run, wanted), options.json);
}

CommandRun configure_amend(Options& options) {
  auto arguments = std::make_shared<AmendOptions>();
  options.whole("RUN", arguments->run, range::run, "the run whose recording it is", Needed::yes);
  options.texts("--with", arguments->with,
                "a further run of the same INS whose recording is looked at together with it; repeated");
  options.flag("--dry-run", arguments->dry_run, "diagnose, estimate and judge, write nothing to the INS");
  options.text("--force", arguments->force, "write a result that the gate refuses; the reason is recorded");
  options.flag("--json", arguments->json, "the run's document on standard output");
  return [arguments] { return amend(*arguments); };
}

struct RollbackOptions {
  std::string serial, reason;
  bool json = false;
};

Expected<int> rollback(const RollbackOptions& options) {
  auto manager = ManagerClient::connect();
  if (!manager) {
    return tl::unexpected(manager.error());
  }
  catch_signals();
  return follow_begun(**manager, (*manager)->rollback(options.serial, options.reason), options.json);
}

CommandRun configure_rollback(Options& options) {
  auto arguments = std::make_shared<RollbackOptions>();
  options.text("SERIAL", arguments->serial, "serial number of the INS", Needed::yes);
  options.text("--reason", arguments->reason, "why; it is recorded", Needed::yes);
  options.flag("--json", arguments->json, "the run's document on standard output");
  return [arguments] { return rollback(*arguments); };
}

const CommandRegistration run_registration{{"run", "calibrate an INS through the daemon", configure_run}};
const CommandRegistration amend_registration{
    {"amend", "calibrate with the physics that the diagnosis names in a run's recording", configure_amend}};
const CommandRegistration rollback_registration{
    {"rollback", "put back the set that was in force before the last calibration", configure_rollback}};

}  // namespace
}  // namespace selfcal::cli
