// selfcal run, amend, rollback: begin a run and follow it to its end.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

#include "protocol/document/document_head.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/online_client.hpp"
#include "tools/cli/online_text.hpp"
#include "tools/cli/run_progress.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

volatile sig_atomic_t interrupts = 0;

void on_interrupt(int) { interrupts = interrupts + 1; }
void on_resize(int) {}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;  // no SA_RESTART: the wait for news is to end
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = on_resize;  // ends the wait too (poll is never restarted): the line is drawn anew at once
  action.sa_flags = SA_RESTART;
  sigaction(SIGWINCH, &action, nullptr);
}

RunProgressView view_of(const Entries& progress) {
  RunProgressView view;
  view.words = entry<std::string>(progress, "words", "");
  view.state = entry<std::string>(progress, "state", "");
  view.link_up = entry(progress, "link_up", true);
  view.left_s = entry(progress, "finish_in_s", -1.0);
  view.position = entry<std::int32_t>(progress, "position", 0);
  view.positions = entry<std::int32_t>(progress, "positions", 0);
  view.pages_pulled = entry<std::uint32_t>(progress, "pages_pulled", 0);
  view.pages_expected = entry<std::uint32_t>(progress, "pages_expected", 0);
  view.pass = entry<std::int32_t>(progress, "pass", 0);
  view.pass_fraction = entry(progress, "pass_fraction", 0.0);
  view.sigma = entry(progress, "sigma", std::vector<double>());
  view.tolerance = entry(progress, "tolerance", std::vector<double>());
  return view;
}

struct Ending {
  int exit_status = 0;
  std::string reason;
};

class Follower {
 public:
  Follower(ManagerClient& manager, std::string ins)
      : manager_(manager), ins_(std::move(ins)), watch_(manager.connection(), ins_) {
    watch_.on_progress = [this](std::uint64_t run, const Entries& progress) {
      if (run == run_) {
        view_ = view_of(progress);
        draw();
      }
    };
    watch_.on_warning = [this](std::uint64_t run, const std::string& text) {
      if (run != run_) {
        return;
      }
      line_.clear();
      fmt::print(stderr, "warning: {}\n", text);
      draw();
    };
    watch_.on_finished = [this](std::uint64_t run, int exit_status, const std::string& reason) {
      if (run == run_ || run_ == 0) {
        early_[run] = {exit_status, reason};
      }
    };
  }

  Expected<Ending> follow(std::uint64_t run) {
    run_ = run;
    int seen = 0;
    auto looked = std::chrono::steady_clock::now();
    while (true) {
      if (const auto done = early_.find(run); done != early_.end()) {
        line_.clear();
        return done->second;
      }
      if (interrupts != seen) {
        seen = interrupts;
        line_.clear();
        fmt::print(stderr, "stopping run {} safely\n", run);
        if (auto asked = manager_.abort(ins_, "interrupted"); !asked) {
          fmt::print(stderr, "selfcal: {}\n", asked.error().message);
        }
      }
      if (auto news = wait_for_news(manager_.connection(), 500); !news) {
        return tl::unexpected(news.error());
      }
      draw();
      // A daemon that was restarted has told nobody: look for oneself now and then.
      if (std::chrono::steady_clock::now() - looked < std::chrono::seconds(3)) {
        continue;
      }
      looked = std::chrono::steady_clock::now();
      if (auto ended = look(run)) {
        line_.clear();
        return *ended;
      }
    }
  }

 private:
  std::optional<Expected<Ending>> look(std::uint64_t run) {
    const auto document = manager_.show(run);
    if (!document) {
      if (++misses_ < patience) {
        return std::nullopt;
      }
      return Expected<Ending>(tl::unexpected(document.error()));
    }
    misses_ = 0;
    const auto json = nlohmann::json::parse(*document);
    if (json.at("exit_status").is_null()) {
      return std::nullopt;
    }
    return Expected<Ending>(Ending{json.at("exit_status").get<int>(), json.at("reason").get<std::string>()});
  }

  void draw() {
    if (view_) {
      line_.show(progress_line(run_, *view_, line_.room()));
    }
  }

  static constexpr int patience = 10;  // looks, 3 s apart: a restarted daemon is back by then
  ManagerClient& manager_;
  std::string ins_;
  InsWatch watch_;
  ProgressLine line_;
  std::optional<RunProgressView> view_;  // the latest
  std::uint64_t run_ = 0;
  int misses_ = 0;
  std::map<std::uint64_t, Ending> early_;
};

// The last that is seen of a run: three sentences in six lines at most. What went wrong is also one line on standard
// error, where that is not the same screen.
Expected<int> report(ManagerClient& manager, std::uint64_t run, const Ending& ending, bool json) {
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
  return report(**manager, *id, *ending, options.json);
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
  return report(manager, *id, *ending, json);
}

struct AmendOptions {
  std::uint64_t run = 0;
  std::string force;
  bool dry_run = false, json = false;
};

Expected<int> amend(const AmendOptions& options) {
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
  return follow_begun(**manager, (*manager)->amend(options.run, wanted), options.json);
}

CommandRun configure_amend(Options& options) {
  auto arguments = std::make_shared<AmendOptions>();
  options.whole("RUN", arguments->run, range::run, "the run whose recording it is", Needed::yes);
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
