#include "estimator/discovery/departure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "estimator/statistics/distributions.hpp"

namespace selfcal::discovery {
namespace {

// Senses and harmonics beside the quantities themselves.
constexpr std::array quantities = {
    "fx",           "fy",           "fz",           "wx",           "wy",         "wz",
    "so",           "si",           "sin(outer)",   "cos(outer)",   "sin(inner)", "cos(inner)",
    "sin(2*outer)", "cos(2*outer)", "sin(2*inner)", "cos(2*inner)", "t",          "T"};
// Of a law this share is the error of its linearisation as likely as a departure.
constexpr double least_share = 0.005;
// A departure that leaves less than this of itself beside the laws is one of them in other words.
constexpr double least_left = 1e-3;

}  // namespace

double log_p_of_departure(std::span<const LawRecording> recordings, const LawFit& fit, std::size_t k,
                          const laws::VariableSet& available, const std::stop_token& stop) {
  const LawTerm& law = fit.terms[k];
  std::vector<LawTerm> departures;
  for (const char* quantity : quantities) {
    std::string text = law.expression.text();
    text.append("*").append(quantity);
    auto product = laws::Expression::parse(text);
    if (product && (product->variables() & ~available).none()) {
      departures.push_back({law.axis, std::move(*product), law.constants});
    }
  }
  double most = 0.0;
  for (const SingleFit& f : fit_each(recordings, fit.terms, departures, stop, GivenConstants::free)) {
    if (f.left > least_left && f.gain > least_share * fit.gain[k]) {
      most = std::max(most, f.gain);
    }
  }
  return std::min(0.0, log_chi_squared_tail(most, 1.0) + std::log(static_cast<double>(departures.size())));
}

}  // namespace selfcal::discovery
