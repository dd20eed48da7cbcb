#include "tools/cli/log_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/import/incomplete_rows.hpp"

namespace selfcal::cli {
namespace {

using Values = std::vector<std::vector<double>>;

// Whether columns `first` to `last` of a row are numbers.
std::vector<bool> complete(const Values& values, std::size_t first, std::size_t last, std::size_t rows) {
  std::vector<bool> all(rows, true);
  for (std::size_t column = first; column < last; ++column) {
    for (std::size_t row = 0; row < rows; ++row) {
      all[row] = all[row] && std::isfinite(values[column][row]);
    }
  }
  return all;
}

// Puts into each row that `slow` has the mean of the rows since the one before that `fast` has; false where there is none.
std::vector<bool> take_means(const std::vector<bool>& slow, const std::vector<bool>& fast, std::size_t first,
                             std::size_t last, Values& values) {
  std::vector<bool> kept(slow.size(), false);
  std::vector<double> sum(last - first, 0.0);
  double count = 0.0;
  for (std::size_t row = 0; row < slow.size(); ++row) {
    if (fast[row]) {
      for (std::size_t column = first; column < last; ++column) {
        sum[column - first] += values[column][row];
      }
      count += 1.0;
    }
    if (!slow[row]) {
      continue;
    }
    kept[row] = count > 0.0;
    for (std::size_t column = first; column < last && kept[row]; ++column) {
      values[column][row] = sum[column - first] / count;
    }
    std::fill(sum.begin(), sum.end(), 0.0);
    count = 0.0;
  }
  return kept;
}

// What stands in few rows, as a temperature does, holds until the next one.
void hold(std::vector<double>& values) {
  const auto first = std::find_if(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  double before = first == values.end() ? 0.0 : *first;
  for (double& value : values) {
    before = std::isfinite(value) ? value : before;
    value = before;
  }
}

}  // namespace

bool fill_incomplete(const PoseLayout& layout, TimedRows& rows) {
  import::ColumnData& data = rows.data;
  const std::size_t gyros = layout.gyro.size(), sensors = gyros + layout.accel.size();
  const std::vector<bool> gyro = complete(data.values, 0, gyros, data.rows);
  const std::vector<bool> accel = complete(data.values, gyros, sensors, data.rows);
  const auto counted = [](const std::vector<bool>& all) {
    return static_cast<std::size_t>(std::count(all.begin(), all.end(), true));
  };
  const std::size_t of_gyros = counted(gyro), of_accel = counted(accel);
  constexpr std::size_t least = 100, few = 100;  // rows; one in a hundred
  if (std::min(of_gyros, of_accel) < least) {
    return false;
  }
  for (std::size_t column = sensors; column < data.values.size(); ++column) {
    hold(data.values[column]);
  }
  std::vector<bool> kept = complete(data.values, 0, sensors, data.rows);
  const std::size_t lack = data.rows - counted(kept);
  std::string words = fmt::format("{} rows that lack a number are left out", lack);
  if (lack * few > data.rows) {
    const bool slow_accel = of_accel <= of_gyros;
    kept = slow_accel ? take_means(accel, gyro, 0, gyros, data.values)
                      : take_means(gyro, accel, gyros, sensors, data.values);
    if (counted(kept) < least) {
      return false;
    }
    words = fmt::format("{} of {} rows hold gyros, {} accelerometers: of the {} the means between rows of the {}",
                        of_gyros, data.rows, of_accel, slow_accel ? "gyros" : "accelerometers",
                        slow_accel ? "accelerometers" : "gyros");
  }
  kept.flip();
  import::leave_out(kept, data);
  if (lack > 0) {
    rows.notes += (rows.notes.empty() ? "" : "; ") + words;
  }
  return true;
}

}  // namespace selfcal::cli
