// A result in three sentences: the verdict, its cause, and what to do next. The same in every place that tells a
// result: `estimate`, `diagnose`, `run`, `show`, `amend`, the journal, LCM and the page.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace selfcal {

enum class SummaryStanding {
  good,  // may be used as it is
  bad,   // may not be used as it is
  open,  // nothing is concluded yet
};

struct Summary {
  SummaryStanding standing = SummaryStanding::open;
  std::string verdict;  // a sentence
  std::string cause;    // a sentence with the number that shows it; empty where there is none to give
  std::string next;     // a command, or a sentence; empty: nothing is left to do
};

std::string_view name(SummaryStanding standing);

// {"standing": "good" | "bad" | "open", "verdict", "cause", "next"}
nlohmann::ordered_json summary_json(const Summary& summary);
Summary read_summary(const nlohmann::ordered_json& json);  // empty strings where something is missing

// For people: verdict, cause and next, each broken to `columns` (0: not broken) with its later lines indented. Verdict and
// cause take `most_lines` at most (0: as many as they need) and are cut with "..."; what to do next is never cut.
std::string summary_text(const Summary& summary, bool colour, int columns = 0, int most_lines = 0);

}  // namespace selfcal
