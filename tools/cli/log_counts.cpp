#include "tools/cli/log_counts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/statistics/median.hpp"

namespace selfcal::cli {
namespace {

constexpr double word = 65536.0;

bool all_whole(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return v == std::floor(v) && std::abs(v) < 1e15; });
}

}  // namespace

std::optional<std::vector<double>> rows_by_counter(const std::vector<double>& counter) {
  constexpr std::array<double, 4> full = {256.0, word, 16777216.0, 4294967296.0};
  if (counter.size() < 3 || !all_whole(counter)) {
    return std::nullopt;
  }
  std::vector<double> steps;
  for (std::size_t k = 1; k < counter.size(); ++k) {
    steps.push_back(counter[k] - counter[k - 1]);
  }
  const double usual = median(steps);
  const double* end = std::find_if(
      full.begin(), full.end(), [&](double size) { return *std::max_element(counter.begin(), counter.end()) < size; });
  if (usual <= 0.0 || end == full.end()) {
    return std::nullopt;
  }
  std::vector<double> rows = {0.0};
  for (double step : steps) {
    step += step <= 0.0 ? *end : 0.0;
    if (step <= 0.0 || std::fmod(step, usual) != 0.0) {
      return std::nullopt;
    }
    rows.push_back(rows.back() + step / usual);
  }
  // A number that rises now and then, as that of a position, is none.
  constexpr double most_lost = 0.5;
  const auto kept = static_cast<double>(rows.size());
  return rows.back() + 1.0 - kept > most_lost * kept ? std::nullopt : std::optional(std::move(rows));
}

bool continue_full_words(std::vector<double>& values) {
  if (values.size() < 3 || !all_whole(values)) {
    return false;
  }
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  if (*low < -0.5 * word || *high >= word || *high - *low < 0.75 * word || *high - *low >= word) {
    return false;
  }
  std::vector<double> whole = {values.front()};
  std::size_t leaps = 0;
  double largest = 0.0;
  for (std::size_t k = 1; k < values.size(); ++k) {
    const double step = std::remainder(values[k] - values[k - 1], word);
    leaps += std::abs(values[k] - values[k - 1]) > 0.5 * word ? 1 : 0;
    largest = std::max(largest, std::abs(step));
    whole.push_back(whole.back() + step);
  }
  constexpr std::size_t least = 2;         // out and back
  constexpr double in_a_row = 0.25;        // of the word: a reading that goes on
  constexpr double once_and_a_half = 2.0;  // of the word, in all: a sum of increments goes farther
  const auto [bottom, top] = std::minmax_element(whole.begin(), whole.end());
  if (leaps < least || largest > in_a_row * word || *top - *bottom > once_and_a_half * word) {
    return false;
  }
  const double off = word * std::round(median(whole) / word);
  std::transform(whole.begin(), whole.end(), values.begin(), [off](double v) { return v - off; });
  return true;
}

}  // namespace selfcal::cli
