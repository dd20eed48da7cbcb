#include "protocol/import/full_words.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "protocol/import/median.hpp"

namespace selfcal::import {
namespace {

constexpr double word = 65536.0;

}  // namespace

bool all_whole(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return v == std::floor(v) && std::abs(v) < 1e15; });
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

std::string continue_full_columns(const ColumnSource& source, const std::vector<NamedColumn>& named,
                                  std::vector<std::vector<double>>& values) {
  std::string full;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const Role role = named[k].role;
    if (role != Role::time && role != Role::counter && role != Role::other && continue_full_words(values[k])) {
      full += (full.empty() ? "" : ", ") + source.title(k);
    }
  }
  return full.empty() ? full : "words of 16 bits that are full at 65536 are continued: " + full;
}

}  // namespace selfcal::import
