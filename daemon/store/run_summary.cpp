#include "daemon/store/run_summary.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace selfcal {
namespace {

using nlohmann::ordered_json;

std::string sentence(const std::string& clause) {
  return clause.empty() || clause.ends_with(".") ? clause : clause + ".";
}

std::string drift_text(const RunRecord& run) {
  if (run.drift_old_m < 0 || run.drift_new_m < 0) {
    return {};
  }
  return fmt::format("Free-inertial drift {:.1f} m before, {:.1f} m after.", run.drift_old_m, run.drift_new_m);
}

std::string report_command(const RunRecord& run) {
  return fmt::format("selfcal report {} -o run-{}.html", run.id, run.id);
}

// The result's own next step, with the run's number where a command takes one.
std::string next_of(const Summary& result, const RunRecord& run, const ordered_json& document) {
  const auto diagnosis = document.find("diagnosis");
  const bool named = diagnosis != document.end() && diagnosis->value("verdict", std::string()) == "named";
  if (result.standing == SummaryStanding::bad && named && run.amends == 0) {
    return fmt::format("selfcal amend {}", run.id);
  }
  return result.next.find(" report ") != std::string::npos ? report_command(run) : result.next;
}

std::string in_force_text(const RunRecord& run, const InForce& force) {
  const std::string set = run.rollback ? "The former set is back" : "The new set is";
  if (force.now) {
    return fmt::format("{} in force since {}, confirmed after a power cycle.", set, force.from_utc);
  }
  if (!force.known) {
    return fmt::format("The set of this run was in force from {}; run {} broke off at {} and may have replaced it.",
                       force.from_utc, force.ended_by_run, force.until_utc);
  }
  return fmt::format("The set of this run was in force from {} until run {} of {}.", force.from_utc, force.ended_by_run,
                     force.until_utc);
}

Summary completed_summary(const RunRecord& run, const InForce& force, RunId rolled_back, const Summary& result,
                          const ordered_json& document) {
  if (run.rollback) {
    const std::string undone = rolled_back == 0 ? std::string() : fmt::format("Run {} was rolled back", rolled_back);
    return {force.now ? SummaryStanding::good : SummaryStanding::open,
            in_force_text(run, force),
            sentence(undone.empty() ? run.force_reason : undone + ": " + run.force_reason),
            {}};
  }
  if (!run.source.empty()) {
    return {result.standing, sentence("Not calibrated over the bus, nothing was written: " + result.verdict),
            sentence(result.cause.empty() ? "Imported from " + run.source : result.cause), report_command(run)};
  }
  if (run.dry_run) {
    return {result.standing, sentence("Dry run, nothing was written: " + result.verdict), result.cause,
            next_of(result, run, document)};
  }
  if (result.standing == SummaryStanding::bad) {  // written against the gate
    return {SummaryStanding::bad, in_force_text(run, force) + " The gate had refused it.",
            fmt::format("{} Written for: {}", result.verdict, sentence(run.force_reason)),
            next_of(result, run, document)};
  }
  const std::string drift = drift_text(run);
  Summary summary{
      force.now ? SummaryStanding::good : SummaryStanding::open, in_force_text(run, force), {}, report_command(run)};
  summary.cause = result.verdict + (drift.empty() ? "" : " " + drift);
  return summary;
}

}  // namespace

Expected<InForce> in_force(const RunStore& store, const RunRecord& run) {
  InForce answer;
  if (!wrote_its_set(run)) {
    return answer;
  }
  answer.now = true;
  answer.from_utc = run.ended_utc;
  const auto end = [&](const RunRecord& by, const std::string& utc, bool known) {
    answer.now = false;
    answer.known = known;
    answer.until_utc = utc;
    answer.ended_by_run = by.id;
  };
  const auto ours = store.set(run.id, SetRole::written);
  const auto runs = store.runs_of_serial(run.serial);
  if (!ours || !runs) {
    return tl::unexpected(ours ? runs.error() : ours.error());
  }
  for (const RunRecord& later : *runs) {
    if (run.serial.empty() || later.id <= run.id) {
      continue;
    }
    const auto found = store.set(later.id, SetRole::previous);
    const auto sent = store.set(later.id, SetRole::read_back);
    if (!found || !sent) {
      return tl::unexpected(found ? sent.error() : found.error());
    }
    if (*found && *ours) {  // what that run found in force is evidence, whatever was thought before
      if (**found == **ours) {
        answer.now = answer.known = true;
        answer.until_utc.clear();
        answer.ended_by_run = 0;
      } else {
        if (answer.now || !answer.known) {
          answer.now ? end(later, later.started_utc, true) : end(later, answer.until_utc, true);
        }
        return answer;
      }
    }
    if (wrote_its_set(later)) {
      end(later, later.ended_utc, true);
      return answer;
    }
    if (*sent && later.state != State::refused) {
      end(later, later.ended_utc.empty() ? later.started_utc : later.ended_utc, false);
    }
  }
  return answer;
}

Expected<RunId> rolled_back_run(const RunStore& store, const RunRecord& run) {
  if (!run.rollback) {
    return RunId{0};
  }
  const auto runs = store.runs_of_serial(run.serial);
  if (!runs) {
    return tl::unexpected(runs.error());
  }
  RunId last = 0;
  for (const RunRecord& earlier : *runs) {
    if (earlier.id < run.id && wrote_its_set(earlier)) {
      last = earlier.id;
    }
  }
  return last;
}

Summary run_summary(const RunRecord& run, const InForce& force, RunId rolled_back, const ordered_json& document) {
  const auto found = document.is_object() ? document.find("summary") : document.end();
  const Summary result = document.is_object() && found != document.end() ? read_summary(*found) : Summary{};
  switch (run.state) {
    case State::completed: return completed_summary(run, force, rolled_back, result, document);
    case State::refused:
      return {SummaryStanding::bad, "Not written: " + (result.verdict.empty() ? sentence(run.reason) : result.verdict),
              result.cause, run.source.empty() ? next_of(result, run, document) : report_command(run)};
    case State::aborted:
      return {
          SummaryStanding::open,
          fmt::format("This {} was stopped before it wrote anything: the former set stays in force.", run_kind(run)),
          sentence(run.reason),
          fmt::format("selfcal {}", run.rollback      ? "rollback " + run.serial + " --reason REASON"
                                    : run.amends != 0 ? fmt::format("amend {}", run.amends)
                                                      : "run " + run.ins)};
    case State::failed:
      return {SummaryStanding::bad,
              run.source.empty() ? fmt::format("This {} failed before its set was confirmed in force.", run_kind(run))
                                 : "This recording gives no result.",
              sentence(run.reason), fmt::format("selfcal show {}", run.id)};
    default:
      return {SummaryStanding::open,
              fmt::format("Run {} is under way: {}.", run.id, words(run.state)),
              {},
              run.source.empty() ? "selfcal status " + run.ins : fmt::format("selfcal show {}", run.id)};
  }
}

Summary run_summary(const RunStore& store, const RunRecord& run) {
  const auto force = in_force(store, run);
  const auto undone = rolled_back_run(store, run);
  const auto document = ordered_json::parse(run.result_json, nullptr, false);
  return run_summary(run, force ? *force : InForce{}, undone ? *undone : 0, document);
}

}  // namespace selfcal
