#include "tools/report/run_words.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

// Empty or null for what is not there, or of another type.
std::string text(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

Json part(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? *found : Json();
}

bool is_true(const Json& value) { return value.is_boolean() && value.get<bool>(); }

std::string number(const Json& value) { return value.is_number() ? value.dump() : std::string("?"); }

Json summary(const char* standing, std::string verdict, std::string cause = {}, std::string next = {}) {
  return {
      {"standing", standing}, {"verdict", std::move(verdict)}, {"cause", std::move(cause)}, {"next", std::move(next)}};
}

std::string clauses(const Json& list) {
  std::vector<std::string> words;
  for (const Json& one : list.is_array() ? list : Json::array()) {
    if (one.is_string()) {
      words.push_back(one.get<std::string>());
    }
  }
  return fmt::format("{}", fmt::join(words, "; "));
}

Json summary_of_result(const Json& document) {
  const Json consistency = part(document, "consistency");
  const bool fits = text(consistency, "verdict") == "consistent";
  if (fits && is_true(part(document, "acceptable"))) {
    return summary("good", "All 24 parameters are determined to tolerance, and recording and model agree.");
  }
  const std::string why = clauses(part(document, "objections"));
  return summary("bad", why.empty() ? "Not accepted." : "Not accepted: " + why + ".",
                 fits ? std::string() : text(consistency, "words"));
}

Json summary_of_end(const Json& run) {
  const std::string state = text(run, "state");
  const std::string reason = text(run, "reason");
  const std::string verdict =
      fmt::format("Run {} {}{}.", number(part(run, "run")), state.empty() ? "is in an unknown state" : state,
                  reason.empty() ? "" : ": " + reason);
  const Json status = part(run, "exit_status");
  return summary(status == 0 ? "good" : status.is_null() ? "open" : "bad", verdict);
}

}  // namespace

Json page_summary(const Json& document) {
  const Json run = part(document, "run");
  const Json told = part(run, "summary");
  if (told.is_object()) {
    return told;
  }
  const Json own = part(document, "summary");
  const bool result = part(document, "parameters").is_array();
  Json found = own.is_object() ? own : result ? summary_of_result(document) : summary_of_end(run);
  if (!run.is_object() || part(run, "exit_status") == 0) {
    return found;
  }
  Json end = summary_of_end(run);
  if (text(found, "standing") == "good") {
    return end;
  }
  if (text(found, "cause").empty() && result) {
    found["cause"] = end["verdict"];
  }
  return found;
}

Json force_of_run(const Json& run) {
  const Json sets = part(run, "coefficients");
  const Json force = part(run, "in_force");
  if (!force.is_object()) {
    const bool confirmed = is_true(part(sets, "in_force"));
    return {
        {"now", false},
        {"words",
         confirmed ? "The INS confirmed the set after its reset; this document does not say whether it still uses it."
                   : "The INS did not take a new set over by this run."}};
  }
  const std::string from = text(force, "from_utc");
  const std::string until = text(force, "until_utc");
  const bool now = is_true(part(force, "now"));
  if (now) {
    return {{"now", true},
            {"words", from.empty() ? "The set of this run is in force."
                                   : "The set of this run is in force since " + from + "."}};
  }
  if (from.empty()) {
    return {{"now", false}, {"words", "The set of this run was never in force."}};
  }
  const Json by = part(force, "ended_by_run");
  const std::string ended = by.is_number() ? fmt::format("run {}", number(by)) : std::string("another set");
  if (part(force, "known") == false) {
    return {{"now", false},
            {"words", fmt::format("The set of this run was in force from {}; {} broke off {} and may have replaced it.",
                                  from, ended, until)}};
  }
  return {{"now", false},
          {"words", fmt::format("The set of this run was in force from {} until {}; {} replaced it.", from,
                                until.empty() ? "a time that is not known" : until, ended)}};
}

}  // namespace selfcal::report
