#include "daemon/estimate/quantity_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace selfcal {
namespace {

// Fixed notation holds so many digits in all at most; beyond it powers of ten read better.
constexpr int most_decimals = 6;
constexpr double largest_fixed = 1e7;

// Decimal exponent of a number once it is rounded to so many significant digits: of two, 0.0996 counts as 0.10.
int exponent_of(double size, int digits) {
  const int exponent = static_cast<int>(std::floor(std::log10(size)));
  const double scaled = size / std::pow(10.0, exponent);
  return scaled >= 10.0 - 5.0 * std::pow(10.0, -digits) ? exponent + 1 : exponent;
}

}  // namespace

QuantityText quantity_text(double value, double sigma) {
  if (!std::isfinite(sigma) || sigma <= 0.0) {
    return {fmt::format("{:.4g}", value), "?"};
  }
  const int place = exponent_of(sigma, 2) - 1;  // of the last digit that sigma carries
  const int decimals = std::max(0, -place);
  if (decimals <= most_decimals && std::abs(value) < largest_fixed && sigma < largest_fixed) {
    return {fmt::format("{:.{}f}", value, decimals), fmt::format("{:.{}f}", sigma, decimals)};
  }
  const int above = value == 0.0 ? 0 : static_cast<int>(std::floor(std::log10(std::abs(value)))) - place;
  return {fmt::format("{:.{}e}", value, std::clamp(above, 0, 15)), fmt::format("{:.1e}", sigma)};
}

std::string with_sigma(double value, double sigma, const std::string& unit) {
  const QuantityText text = quantity_text(value, sigma);
  return fmt::format("{} +- {}{}{}", text.value, text.sigma, unit.empty() ? "" : " ", unit);
}

std::string number_text(double value) {
  const double size = std::abs(value);
  if (!std::isfinite(value) || value == 0.0 || size >= largest_fixed || size < 1e-4) {
    return fmt::format("{:.3g}", value);
  }
  const int decimals = std::max(0, 2 - exponent_of(size, 3));
  return fmt::format("{:.{}f}", value, decimals);
}

std::string whiteness_text(double log_p) {
  constexpr double likely = 0.001;
  constexpr double smallest = 1e-12;
  if (log_p < std::log(smallest)) {
    return "correlated in time (p below 1e-12)";
  }
  const double p = std::exp(log_p);
  return fmt::format("{} (p = {:.2g})", p < likely ? "correlated in time" : "white", p);
}

}  // namespace selfcal
