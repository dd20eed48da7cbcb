// Numbers for people: as many digits as sigma carries, whatever the scale.
#pragma once

#include <string>

namespace selfcal {

struct QuantityText {
  std::string value, sigma;
};

// Two significant digits of sigma, the value to the same place: 269.12 and 0.63; -2.61e-07 and 1.2e-08 where fixed
// digits would be mostly zeros. Where sigma is zero or no number the value has four digits and sigma is "?".
QuantityText quantity_text(double value, double sigma);

// "269.12 +- 0.63 ug"
std::string with_sigma(double value, double sigma, const std::string& unit);

// Three significant digits, fixed where that is readable.
std::string number_text(double value);

// A test on whiteness in words, from the natural logarithm of its p value: "white (p = 0.32)", "correlated in time
// (p below 1e-12)".
std::string whiteness_text(double log_p);

}  // namespace selfcal
