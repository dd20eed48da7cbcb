#include "tools/cli/log_counts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/statistics/median.hpp"
#include "protocol/import/full_words.hpp"

namespace selfcal::cli {
std::optional<std::vector<double>> rows_by_counter(const std::vector<double>& counter) {
  constexpr std::array<double, 4> full = {256.0, 65536.0, 16777216.0, 4294967296.0};
  if (counter.size() < 3 || !import::all_whole(counter)) {
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

}  // namespace selfcal::cli
