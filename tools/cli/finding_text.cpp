#include "tools/cli/finding_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daemon/estimate/effect_words.hpp"
#include "daemon/estimate/quantity_text.hpp"

namespace selfcal::cli {
namespace {

bool significant(const diagnosis::FindingParameter& p) {
  return !(std::abs(p.value) < shown_sigma * p.sigma);  // a sigma that is not known hides nothing
}

// The coefficient that is most sigma from zero where none is `shown_sigma` from it but all together are; null: not so.
const diagnosis::FindingParameter* only_together(const diagnosis::Finding& f) {
  if (f.parameters.size() < 2 || f.significance < shown_sigma ||
      std::any_of(f.parameters.begin(), f.parameters.end(), significant)) {
    return nullptr;
  }
  return &*std::max_element(f.parameters.begin(), f.parameters.end(), [](const auto& a, const auto& b) {
    return std::abs(a.value) / a.sigma < std::abs(b.value) / b.sigma;
  });
}

}  // namespace

std::string finding_text(const diagnosis::Finding& f) {
  const std::string words = effect_words(f.effect);
  // A share of 100 % belongs to the only name.
  const std::string share =
      f.share > 0.0 && f.share < 0.995 ? fmt::format(", {:.2g} % of the misfit", 100.0 * f.share) : "";
  std::string text = fmt::format("  {}{}{}, {:.1f} sigma{}\n", f.effect, words == f.effect ? "" : ": ",
                                 words == f.effect ? "" : words, f.significance, share);
  if (!f.equation.empty()) {
    text += fmt::format("    {}\n", f.equation);
  }
  // Of coefficients that the recording knows only together the largest one stands for them.
  const diagnosis::FindingParameter* const largest = only_together(f);
  std::vector<std::string> small;
  for (const diagnosis::FindingParameter& p : f.parameters) {
    if (significant(p) || &p == largest) {
      text += fmt::format("    {:<10} {}{}\n", p.name, with_sigma(p.value, p.sigma, p.unit),
                          &p == largest ? ", the largest; known only together with others" : "");
    } else {
      small.push_back(p.name);
    }
  }
  if (!small.empty()) {
    text += fmt::format("    within {:.0f} sigma of zero: {}\n", shown_sigma, fmt::join(small, ", "));
  }
  if (!f.equivalent.empty()) {
    text += fmt::format("    this recording cannot tell it from: {}\n", fmt::join(f.equivalent, ", "));
    if (!f.experiment.empty()) {
      text += fmt::format("    what would: {}\n", f.experiment);
    }
  }
  return text;
}

std::string symbols_text(const std::vector<diagnosis::Finding>& findings) {
  std::vector<Symbol> all;
  for (const diagnosis::Finding& f : findings) {
    for (const Symbol& symbol : symbols_of(f.equation)) {
      const bool known = std::any_of(all.begin(), all.end(), [&](const Symbol& s) { return s.name == symbol.name; });
      if (!known) {
        all.push_back(symbol);
      }
    }
  }
  std::string text;
  for (const Symbol& symbol : all) {
    text += fmt::format("  {} {:<5} {}\n", text.empty() ? "where" : "     ", symbol.name, symbol.meaning);
  }
  return text;
}

}  // namespace selfcal::cli
