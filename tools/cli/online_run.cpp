// selfcal run, amend, rollback: begin a run and follow it to its end.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/document/document_head.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/online_client.hpp"
#include "tools/cli/online_text.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

volatile sig_atomic_t interrupts = 0;

void on_interrupt(int) { interrupts = interrupts + 1; }

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;  // no SA_RESTART: the wait for news is to end
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

// The estimate of what has arrived so far: the parameter that needs most yet, and when all will be known.
std::string running_text(const Entries& progress) {
  const auto sigma = entry(progress, "sigma", std::vector<double>());
  const auto tolerance = entry(progress, "tolerance", std::vector<double>());
  if (sigma.size() != sensor_parameters.size() || tolerance.size() != sigma.size()) {
    return "no estimate";
  }
  std::size_t worst = 0;
  for (std::size_t i = 1; i < sigma.size(); ++i) {
    if (sigma[i] / tolerance[i] > sigma[worst] / tolerance[worst]) {
      worst = i;
    }
  }
  std::string text = fmt::format(
      "{} of {} to tolerance, {} {:.3g} of {:.3g} {}", entry<std::int32_t>(progress, "tolerances_met", 0), sigma.size(),
      sensor_parameters[worst].name, sigma[worst], tolerance[worst], sensor_parameters[worst].unit);
  const double met_at = entry(progress, "met_at_s", -1.0);
  if (met_at >= 0) {
    text += fmt::format(", all at {:.0f}:{:02.0f}", std::floor(met_at / 60), std::fmod(met_at, 60));
  }
  return text;
}

// One line of progress: what is done now, and how far.
std::string progress_text(const Entries& progress) {
  std::string text = entry<std::string>(progress, "words", "");
  const int position = entry<std::int32_t>(progress, "position", 0);
  const auto pulled = entry<std::uint32_t>(progress, "pages_pulled", 0);
  const auto expected = entry<std::uint32_t>(progress, "pages_expected", 0);
  const std::string state = entry<std::string>(progress, "state", "");
  if (state == "rotating") {
    const double left = std::max(0.0, entry(progress, "finish_in_s", 0.0));
    text += fmt::format(", position {} of {}, {:.0f}:{:02.0f} left", position,
                        entry<std::int32_t>(progress, "positions", 0), std::floor(left / 60), std::fmod(left, 60));
  }
  if (state == "rotating" && entry(progress, "running", false)) {
    text += ", " + running_text(progress);
  }
  if (state == "rotating" || state == "draining") {
    text += fmt::format(", pages {}/{}", pulled, expected);
  }
  if (state == "estimating" && progress.contains("sigma")) {
    const auto sigma = entry(progress, "sigma", std::vector<double>());
    text += fmt::format(", pass {} {:.0f} %", entry<std::int32_t>(progress, "pass", 0),
                        100 * entry(progress, "pass_fraction", 0.0));
    if (sigma.size() == sensor_parameters.size()) {
      text += fmt::format(
          ", sigma: bias {:.3g} ug, drift {:.3g} deg/h, scale {:.3g} ppm",
          *std::max_element(sigma.begin(), sigma.begin() + 3), *std::max_element(sigma.begin() + 3, sigma.begin() + 6),
          *std::max_element(sigma.begin() + parameter::gyro_scale, sigma.begin() + parameter::gyro_scale + 3));
    }
  }
  if (!entry(progress, "link_up", true)) {
    text += ", LINK LOST";
  }
  return text;
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
        line_.show(fmt::format("run {}: {}", run, progress_text(progress)));
      }
    };
    watch_.on_warning = [this](std::uint64_t run, const std::string& text) {
      if (run != run_) {
        return;
      }
      line_.show("");
      fmt::print(stderr, "warning: {}\n", text);
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
        return done->second;
      }
      if (interrupts != seen) {
        seen = interrupts;
        line_.show("");
        fmt::print(stderr, "stopping run {} safely\n", run);
        if (auto asked = manager_.abort(ins_, "interrupted"); !asked) {
          fmt::print(stderr, "{}\n", asked.error().message);
        }
      }
      if (auto news = wait_for_news(manager_.connection(), 500); !news) {
        return tl::unexpected(news.error());
      }
      // A daemon that was restarted has told nobody: look for oneself now and then.
      if (std::chrono::steady_clock::now() - looked < std::chrono::seconds(3)) {
        continue;
      }
      looked = std::chrono::steady_clock::now();
      if (auto ended = look(run)) {
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

  static constexpr int patience = 10;  // looks, 3 s apart: a restarted daemon is back by then
  ManagerClient& manager_;
  std::string ins_;
  InsWatch watch_;
  ProgressLine line_;
  std::uint64_t run_ = 0;
  int misses_ = 0;
  std::map<std::uint64_t, Ending> early_;
};

Expected<int> report(ManagerClient& manager, std::uint64_t run, const Ending& ending, bool json) {
  if (json) {
    const auto document = manager.show(run);
    if (!document) {
      return tl::unexpected(document.error());
    }
    fmt::print("{}\n", *document);
  } else if (ending.exit_status == 0) {
    const auto document = manager.show(run);
    if (!document) {
      return tl::unexpected(document.error());
    }
    fmt::print("{}", run_text(*document, use_colour(stdout), false));
  }
  if (ending.exit_status != 0) {
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
  catch_interrupts();
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

CommandRun configure_run(CLI::App& app) {
  auto options = std::make_shared<RunOptions>();
  app.add_option("INS", options->ins, "which INS (a section of selfcald.toml); may be left out where there is one");
  app.add_option("--schedule", options->schedule, "table2, horizontal, or a file that the daemon can read");
  app.add_flag("--dry-run", options->dry_run, "estimate and judge, write nothing to the INS");
  app.add_flag("--stop-when-met", options->stop_when_met, "end the rotation as soon as every tolerance is met");
  app.add_option("--force", options->force, "write a result that the gate refuses; the reason is recorded");
  app.add_flag("--detach", options->detach, "print the run's number and do not wait");
  app.add_flag("--json", options->json, "the run's document on standard output");
  return [options] { return run(*options); };
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
  catch_interrupts();
  Entries wanted;
  if (options.dry_run) {
    wanted["dry_run"] = true;
  }
  if (!options.force.empty()) {
    wanted["force"] = options.force;
  }
  return follow_begun(**manager, (*manager)->amend(options.run, wanted), options.json);
}

CommandRun configure_amend(CLI::App& app) {
  auto options = std::make_shared<AmendOptions>();
  app.add_option("RUN", options->run, "the run whose recording it is")->required();
  app.add_flag("--dry-run", options->dry_run, "diagnose, estimate and judge, write nothing to the INS");
  app.add_option("--force", options->force, "write a result that the gate refuses; the reason is recorded");
  app.add_flag("--json", options->json, "the run's document on standard output");
  return [options] { return amend(*options); };
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
  catch_interrupts();
  return follow_begun(**manager, (*manager)->rollback(options.serial, options.reason), options.json);
}

CommandRun configure_rollback(CLI::App& app) {
  auto options = std::make_shared<RollbackOptions>();
  app.add_option("SERIAL", options->serial, "serial number of the INS")->required();
  app.add_option("--reason", options->reason, "why; it is recorded")->required();
  app.add_flag("--json", options->json, "the run's document on standard output");
  return [options] { return rollback(*options); };
}

const CommandRegistration run_registration{{"run", "calibrate an INS through the daemon", configure_run}};
const CommandRegistration amend_registration{
    {"amend", "calibrate with the physics that the diagnosis names in a run's recording", configure_amend}};
const CommandRegistration rollback_registration{
    {"rollback", "put back the set that was in force before the last calibration", configure_rollback}};

}  // namespace
}  // namespace selfcal::cli
