#include "protocol/import/guess_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

namespace selfcal::import {
namespace {

bool increasing(const std::vector<long double>& values) {
  return values.size() > 2 &&
         std::adjacent_find(values.begin(), values.end(), [](auto a, auto b) { return !(b > a); }) == values.end();
}

bool even(const std::vector<long double>& values) {
  std::vector<long double> steps;
  for (std::size_t k = 1; k < values.size(); ++k) {
    steps.push_back(values[k] - values[k - 1]);
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  const long double typical = *middle;
  const auto like = std::count_if(steps.begin(), steps.end(),
                                  [typical](auto s) { return s > typical / 2 && s < typical + typical / 2; });
  return static_cast<double>(like) > 0.9 * static_cast<double>(steps.size());
}

}  // namespace

bool rises_evenly(const std::vector<long double>& stamps) { return increasing(stamps) && even(stamps); }

std::string why_uneven(const std::vector<double>& times) {
  std::size_t places = 0, first = 0;
  for (std::size_t k = 1; k < times.size(); ++k) {
    if (times[k] <= times[k - 1]) {
      first = places++ == 0 ? k : first;
    }
  }
  constexpr double most = 0.01;  // more is no fault of a time, but no time
  if (places == 0 || static_cast<double>(places) > most * static_cast<double>(times.size())) {
    return "does not increase evenly";
  }
  return fmt::format(
      "does not increase in {} place{}, first from {:.10g} to {:.10g} at row {} of the numbers: cut the file where it "
      "begins anew, take "
      "out rows that stand twice",
      places, places == 1 ? "" : "s", times[first - 1], times[first], first + 1);
}

}  // namespace selfcal::import
