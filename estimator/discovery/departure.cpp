#include "estimator/discovery/departure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "estimator/statistics/distributions.hpp"

namespace selfcal::discovery {
namespace {

// A form departs where one of these is large, and each group has its share of belief: what sensors do is mostly a quantity itself,
// with its sense or first harmonics. Their sizes and squares show where the form bends: a root, a saturation.
constexpr std::array themselves = {
    "fx",           "fy",           "fz",           "wx",           "wy",         "wz",
    "so",           "si",           "sin(outer)",   "cos(outer)",   "sin(inner)", "cos(inner)",
    "sin(2*outer)", "cos(2*outer)", "sin(2*inner)", "cos(2*inner)", "t",          "T"};
constexpr std::array bent = {"abs(fx)", "abs(fy)", "abs(fz)", "abs(wx)", "abs(wy)", "abs(wz)",
                             "abs(wo)", "abs(wi)", "fx**2",   "fy**2",   "fz**2",   "wx**2",
                             "wy**2",   "wz**2",   "wo**2",   "wi**2",   "t**2",    "T**2"};
constexpr double share_of_themselves = 0.65;  // as in the dictionary
// Of a law this share is the error of its linearisation as likely as a departure.
constexpr double least_share = 0.005;
// A departure that leaves less than this of itself beside the laws is one of them in other words.
constexpr double least_left = 1e-3;

}  // namespace

std::vector<Departure> departures_of(const LawTerm& law, const laws::VariableSet& available) {
  std::vector<Departure> all;
  const auto add = [&](std::span<const char* const> quantities, double share) {
    for (const char* quantity : quantities) {
      std::string text = law.expression.text();
      text.append("*").append(quantity);
      auto product = laws::Expression::parse(text);
      if (product && (product->variables() & ~available).none()) {
        all.push_back(
            {{law.axis, std::move(*product), law.constants}, quantity, share / static_cast<double>(quantities.size())});
      }
    }
  };
  add(themselves, share_of_themselves);
  add(bent, 1.0 - share_of_themselves);
  return all;
}

Departed departed(std::span<const Departure> departures, std::span<const SingleFit> fits, double gain) {
  Departed farthest;
  for (std::size_t d = 0; d < fits.size(); ++d) {
    if (fits[d].left > least_left && fits[d].gain > least_share * gain) {
      const double log_p = log_chi_squared_tail(fits[d].gain, 1.0) - std::log(departures[d].belief);
      farthest = log_p < farthest.log_p ? Departed{log_p, departures[d].quantity} : farthest;
    }
  }
  return farthest;
}

Departed departed(std::span<const LawRecording> recordings, const LawFit& fit, std::size_t k,
                  const laws::VariableSet& available, const std::stop_token& stop) {
  const std::vector<Departure> departures = departures_of(fit.terms[k], available);
  std::vector<LawTerm> terms;
  terms.reserve(departures.size());
  for (const Departure& d : departures) {
    terms.push_back(d.term);
  }
  return departed(departures, fit_each(recordings, fit.terms, terms, stop, GivenConstants::free), fit.gain[k]);
}

}  // namespace selfcal::discovery
