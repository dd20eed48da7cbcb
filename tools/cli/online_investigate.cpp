// selfcal investigate: rotation after rotation until one explanation is left, then the set that follows from it.
//
// The service does all of it as runs like any other, with the same gate, lock, journal and abort: an amendment as dry run says what the
// recordings show and which rotation would tell more; a dry run of that schedule makes the next recording; the last amendment
// writes. Whoever interrupts leaves complete runs behind, from which the same command goes on (--with).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/document/document_head.hpp"
#include "protocol/document/summary.hpp"
#include "protocol/schedule_file/schedule_file.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/online_client.hpp"
#include "tools/cli/online_follow.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

using nlohmann::ordered_json;

struct Arguments {
  std::uint64_t run = 0;
  std::vector<std::string> with;
  std::string time = "60m";
  bool dry_run = false, json = false;
};

// "90s", "60m", "2h".
Expected<double> seconds_of(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
  const double factor = unit == "s" ? 1.0 : unit == "m" ? 60.0 : unit == "h" ? 3600.0 : 0.0;
  if (error != std::errc{} || factor == 0.0 || !(value >= 0.0 && value * factor <= 7 * 24 * 3600.0)) {
    return fail(ErrorKind::usage, fmt::format("--time {}: 90s, 60m or 2h is expected, a week at most", text));
  }
  return value * factor;
}

// What one amendment as dry run says.
struct Analysis {
  std::uint64_t amendment = 0;
  std::vector<std::uint64_t> runs;
  ordered_json document;  // of that amendment
  std::optional<Schedule> next;

  const ordered_json& result() const { return document.at("result"); }
  bool acceptable() const { return result().at("acceptable").get<bool>(); }
  const ordered_json& laws() const { return laws_in("discovered"); }
  // Only described, for none of their class holds elsewhere more probably than not: a rotation may show which.
  ordered_json unsure() const {
    ordered_json all = ordered_json::array();
    for (const ordered_json& law : laws_in("described")) {
      if (law.value("unsure", false)) {
        all.push_back(law);
      }
    }
    return all;
  }
  const ordered_json& laws_in(const char* key) const {
    static const ordered_json none = ordered_json::array();
    const auto found = result().at("diagnosis").find(key);
    return found == result().at("diagnosis").end() ? none : *found;
  }
  // Equations that explain as well as those that are told.
  std::size_t others() const {
    std::size_t count = 0;
    for (const ordered_json& law : laws()) {
      count += law.at("class").size() - std::min<std::size_t>(1, law.at("class").size());
    }
    return count;
  }
  // Laws in the place of what is named, with odds that ask for an experiment; null: none.
  const ordered_json& instead() const {
    constexpr double worth_an_experiment = 0.1;
    static const ordered_json none;
    const auto found = result().at("diagnosis").find("instead_of_names");
    const bool there = found != result().at("diagnosis").end() && found->at("odds").get<double>() > worth_an_experiment;
    return there ? *found : none;
  }
  // One equation in each class, and no name in doubt.
  bool settled() const { return others() == 0 && instead().is_null(); }
  // Whether another attitude of the base would part what no rotation of the gimbal does.
  bool on_this_base_only() const {
    return std::any_of(laws().begin(), laws().end(), [](const ordered_json& law) { return !here_only(law).empty(); });
  }
  static std::vector<std::string> here_only(const ordered_json& law) {
    std::vector<std::string> words;
    for (const ordered_json& member : law.at("class")) {
      const auto some = member.find("only_here");
      if (some != member.end()) {
        words.insert(words.end(), some->begin(), some->end());
      }
    }
    return words;
  }
};

// "2 others explain it too (odds): wi*so 0.12, wy*fz 0.031"
std::string rivals_text(const ordered_json& law) {
  constexpr std::size_t most = 3;
  std::vector<std::pair<double, std::string>> rivals;
  for (const ordered_json& member : law.at("class")) {
    if (member.at("expression") != law.at("expression") || member.at("axis") != law.at("axis")) {
      const bool same_axis = member.at("axis") == law.at("axis");
      rivals.emplace_back(-member.at("odds").get<double>(),
                          fmt::format("{}{}", same_axis ? "" : member.at("axis").get<std::string>() + " ",
                                      member.at("expression").get<std::string>()));
    }
  }
  if (rivals.empty()) {
    return "nothing else explains it as well";
  }
  std::sort(rivals.begin(), rivals.end());
  std::vector<std::string> some;
  for (std::size_t k = 0; k < std::min(most, rivals.size()); ++k) {
    some.push_back(fmt::format("{} {:.2g}", rivals[k].second, -rivals[k].first));
  }
  return fmt::format("{} other{} explain{} it too (odds): {}{}", rivals.size(), rivals.size() > 1 ? "s" : "",
                     rivals.size() > 1 ? "" : "s", fmt::join(some, ", "), rivals.size() > most ? ", ..." : "");
}

Schedule schedule_in(const ordered_json& next) {
  Schedule schedule;
  for (const ordered_json& p : next.at("schedule").at("positions")) {
    schedule.positions.push_back({p.at(0).get<double>(), p.at(1).get<double>()});
  }
  schedule.dwell_s = next.at("schedule").at("dwell_s").get<std::vector<double>>();
  schedule.rotation_s = next.at("schedule").at("rotation_s").get<double>();
  return schedule;
}

class Investigation {
 public:
  Investigation(ManagerClient& manager, std::string ins, double time_s, bool json)
      : manager_(manager), ins_(std::move(ins)), left_s_(time_s), json_(json) {}

  // Status 0: a set was written and is in force (dry run: could be).
  Expected<int> run(std::vector<std::uint64_t> runs, bool dry_run) {
    while (true) {
      const auto analysis = analyse(runs);
      if (!analysis) {
        return tl::unexpected(analysis.error());
      }
      tell(*analysis);
      if (const std::string end = why_it_ends(*analysis); !end.empty()) {
        return finish(*analysis, end, dry_run);
      }
      const auto experiment = turn(*analysis->next);
      if (!experiment) {
        return tl::unexpected(experiment.error());
      }
      runs.push_back(*experiment);
    }
  }

 private:
  // The latest recording is the one that is amended: its biases are those of now.
  Expected<std::uint64_t> amend(const std::vector<std::uint64_t>& runs, bool dry_run) {
    Entries wanted;
    if (dry_run) {
      wanted["dry_run"] = true;
    }
    if (runs.size() > 1) {
      wanted["with"] = std::vector<std::uint64_t>(runs.begin(), runs.end() - 1);
    }
    return manager_.amend(runs.back(), wanted);
  }

  Expected<ordered_json> document(std::uint64_t run) {
    const auto text = manager_.show(run);
    return text ? Expected<ordered_json>(ordered_json::parse(*text)) : tl::unexpected(text.error());
  }

  Expected<ordered_json> follow(const Expected<std::uint64_t>& run) {
    if (!run) {
      return tl::unexpected(run.error());
    }
    Follower follower(manager_, ins_);
    const auto ending = follower.follow(*run);
    if (!ending) {
      return tl::unexpected(ending.error());
    }
    if (interrupted()) {
      return fail(ErrorKind::device, fmt::format("run {}: interrupted", *run));
    }
    return document(*run);
  }

  Expected<Analysis> analyse(const std::vector<std::uint64_t>& runs) {
    const auto amendment = amend(runs, true);
    auto answer = follow(amendment);
    if (!answer) {
      return tl::unexpected(answer.error());
    }
    if (answer->at("result").is_null()) {
      return fail(ErrorKind::device, fmt::format("run {}: {}", *amendment, answer->at("reason").get<std::string>()));
    }
    Analysis analysis{*amendment, runs, std::move(*answer), std::nullopt};
    if (const auto next = analysis.result().find("next_experiment"); next != analysis.result().end()) {
      analysis.next = schedule_in(*next);
    }
    return analysis;
  }

  // Empty: another rotation is to come.
  std::string why_it_ends(const Analysis& a) const {
    if (a.acceptable() && a.settled()) {
      return a.laws().empty()        ? "the catalogue explains it"
             : a.on_this_base_only() ? "one equation is left as long as the base stands as it does"
                                     : "one equation is left";
    }
    if (!a.next && !a.instead().is_null()) {
      return "no further rotation would tell what is named from what may stand in its place";
    }
    if (!a.next) {
      return a.settled()
                 ? "no further rotation would tell more"
                 : fmt::format(
                       "no further rotation would tell apart the equations that are left ({} told, {} beside them)",
                       a.laws().size(), a.others());
    }
    if (a.next->duration_s() > left_s_) {
      return fmt::format("the next rotation takes {:.0f} min, {:.0f} min are left", a.next->duration_s() / 60.0,
                         left_s_ / 60.0);
    }
    return {};
  }

  // A dry run, so that nothing is written on the way. It is refused by the gate as the first one was; its recording is what counts.
  Expected<std::uint64_t> turn(const Schedule& schedule) {
    Entries wanted;
    wanted["schedule_toml"] = format_schedule(schedule);
    wanted["dry_run"] = true;
    const auto run = manager_.start(ins_, wanted);
    const auto answer = follow(run);
    if (!answer) {
      return tl::unexpected(answer.error());
    }
    if (answer->at("recording").get<std::string>().empty()) {
      return fail(ErrorKind::device, fmt::format("run {}: {}", *run, answer->at("reason").get<std::string>()));
    }
    left_s_ -= schedule.duration_s();
    story_.back()["experiment"] = *run;
    say(fmt::format("   run {} made it\n", *run));
    return *run;
  }

  void tell(const Analysis& a) {
    const Summary summary = read_summary(a.result().at("summary"));
    ordered_json step = {{"runs", a.runs},
                         {"amendment", a.amendment},
                         {"summary", a.result().at("summary")},
                         {"discovered", a.laws()},
                         {"experiment", nullptr}};
    say(fmt::format("{}. run{} {}: {}\n", story_.size() + 1, a.runs.size() > 1 ? "s" : "", fmt::join(a.runs, ", "),
                    summary.verdict));
    for (const ordered_json& law : a.laws()) {
      say(fmt::format("   {} = ({:.4g} +- {:.2g} {}) * {}; {}\n", law.at("axis").get<std::string>(),
                      law.at("coefficient").get<double>(), law.at("sigma").get<double>(),
                      law.at("unit").get<std::string>(), law.at("expression").get<std::string>(), rivals_text(law)));
      if (const auto words = Analysis::here_only(law); !words.empty()) {
        say(fmt::format("   no rotation parts that from {}{}; another attitude of the base would\n", words.front(),
                        words.size() > 1 ? fmt::format(" and {} more", words.size() - 1) : std::string()));
      }
    }
    const ordered_json unsure = a.unsure();
    for (const ordered_json& law : unsure) {
      say(fmt::format("   {} may follow {}, which fails on another plan more probably than not; {}\n",
                      law.at("axis").get<std::string>(), law.at("expression").get<std::string>(), rivals_text(law)));
    }
    if (!unsure.empty()) {
      step["unsure"] = unsure;
    }
    if (!a.instead().is_null()) {
      for (const ordered_json& law : a.instead().at("laws")) {
        const auto process = law.at("process").get<std::string>();
        const std::string size = fmt::format("{:.4g} +- {:.2g} {}", law.at("coefficient").get<double>(),
                                             law.at("sigma").get<double>(), law.at("unit").get<std::string>());
        say(fmt::format("   or in the place of {} {}{}, odds {:.2g}\n",
                        fmt::join(a.instead().at("names").get<std::vector<std::string>>(), " and "),
                        law.at("axis").get<std::string>(),
                        process.empty() ? fmt::format(" = ({}) * {}", size, law.at("expression").get<std::string>())
                                        : fmt::format(": {}, {}", process, size),
                        a.instead().at("odds").get<double>()));
      }
      step["instead_of_names"] = a.instead();
    }
    if (a.next && !(a.acceptable() && a.settled())) {
      const ordered_json& next = a.result().at("next_experiment");
      step["next_experiment"] = next;
      say(fmt::format("   next: {} positions, {:.0f} min, {}\n", a.next->positions.size(), a.next->duration_s() / 60.0,
                      next.at("splits").empty()
                          ? std::string("to see the same in other positions")
                          : fmt::format("{:.1f} sigma between it and {}", next.at("separation_sigma").get<double>(),
                                        next.at("splits").front().get<std::string>())));
    }
    story_.push_back(std::move(step));
  }

  // The set that follows, written and proved; or why there is none.
  Expected<int> finish(const Analysis& last, const std::string& why, bool dry_run) {
    ordered_json end = {{"steps", story_}, {"ended", why}, {"written_by", nullptr}, {"exit_status", 1}};
    say(fmt::format("end: {}\n", why));
    if (!last.acceptable()) {
      say(fmt::format("not written: {}\n", last.document.at("reason").get<std::string>()));
    } else if (dry_run) {
      end["exit_status"] = 0;
      say(fmt::format("nothing is written (--dry-run); selfcal amend {}{} would\n", last.runs.back(), with_text(last)));
    } else {
      const auto run = amend(last.runs, false);
      const auto answer = follow(run);
      if (!answer) {
        return tl::unexpected(answer.error());
      }
      end["written_by"] = *run;
      end["exit_status"] = answer->at("exit_status");
      say(fmt::format("run {}: {}\n", *run, read_summary(answer->at("summary")).verdict));
    }
    if (json_) {
      fmt::print("{}\n", document::with_head(document::investigation, end).dump());
    }
    return end.at("exit_status").get<int>();
  }

  static std::string with_text(const Analysis& a) {
    std::string text;
    for (std::size_t k = 0; k + 1 < a.runs.size(); ++k) {
      text += fmt::format(" --with {}", a.runs[k]);
    }
    return text;
  }

  void say(const std::string& text) const {
    if (!json_) {
      fmt::print("{}", text);
      std::fflush(stdout);
    }
  }

  ManagerClient& manager_;
  std::string ins_;
  double left_s_;
  bool json_;
  ordered_json story_ = ordered_json::array();
};

Expected<int> investigate(const Arguments& arguments) {
  const auto time_s = seconds_of(arguments.time);
  if (!time_s) {
    return tl::unexpected(time_s.error());
  }
  auto runs = run_numbers(arguments.with);
  if (!runs) {
    return tl::unexpected(runs.error());
  }
  runs->push_back(arguments.run);
  auto manager = ManagerClient::connect();
  if (!manager) {
    return tl::unexpected(manager.error());
  }
  const auto first = (*manager)->show(arguments.run);
  if (!first) {
    return tl::unexpected(first.error());
  }
  catch_signals();
  return Investigation(**manager, ordered_json::parse(*first).at("ins").get<std::string>(), *time_s, arguments.json)
      .run(std::move(*runs), arguments.dry_run);
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  options.whole("RUN", arguments->run, range::run, "the run whose recording and model differ", Needed::yes);
  options.texts("--with", arguments->with, "a further run of the same INS that is there already; repeated");
  options.text("--time", arguments->time, "of the gimbal, for all rotations together: 90s, 60m, 2h");
  options.flag("--dry-run", arguments->dry_run, "turn and diagnose, write nothing to the INS");
  options.flag("--json", arguments->json, "the story as one JSON document on standard output");
  return [arguments] { return investigate(*arguments); };
}

const CommandRegistration registration{
    {"investigate", "turn the INS again until one explanation of a run is left, then write what follows", configure}};

}  // namespace
}  // namespace selfcal::cli
