#include "estimator/diagnosis/regression/hypothesis.hpp"

#include <algorithm>

namespace selfcal::diagnosis {

bool same(const Variant& a, const Variant& b) {
  return a.effect == b.effect && (a.tried == b.tried || (std::isnan(a.tried) && std::isnan(b.tried)));
}

bool Hypothesis::names(const Effect& effect) const {
  return std::any_of(terms.begin(), terms.end(), [&](const Term& t) { return t.effect == &effect; });
}

Correction Hypothesis::correction() const {
  Correction correction;
  for (const Term& t : terms) {
    correction.add(*t.effect, t.constant, t.amplitude);
  }
  return correction;
}

Hypothesis without_term(Hypothesis h, std::size_t i) {
  h.terms.erase(h.terms.begin() + static_cast<std::ptrdiff_t>(i));
  return h;
}

}  // namespace selfcal::diagnosis
