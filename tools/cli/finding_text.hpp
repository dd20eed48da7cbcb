// Physics that a diagnosis named, with its coefficients, for people.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::cli {

// A coefficient nearer to zero than this is left out of the text, in sigma.
inline constexpr double shown_sigma = 3.0;

// What it is in words, its strength, its equation, its significant coefficients, its rivals: some lines, indented.
std::string finding_text(const diagnosis::Finding& finding);

// The symbols that the equations of `findings` use, each once; empty where there are none.
std::string symbols_text(const std::vector<diagnosis::Finding>& findings);

}  // namespace selfcal::cli
