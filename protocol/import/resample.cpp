#include "protocol/import/resample.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selfcal::import {
namespace {

// Grid times lie between samples `before` and `before + 1`, at `part` of the way.
struct Between {
  std::size_t before = 0;
  double part = 0.0;
};

double mixed(double from, double to, double part) { return from + part * (to - from); }

std::vector<std::array<double, 3>> resampled(const std::vector<std::array<double, 3>>& increments,
                                             const std::vector<Between>& grid) {
  std::vector<std::array<double, 3>> sums(increments.size());
  std::array<double, 3> sum{};
  for (std::size_t row = 0; row < increments.size(); ++row) {
    for (std::size_t k = 0; k < 3; ++k) {
      sum[k] += increments[row][k];
    }
    sums[row] = sum;
  }
  std::vector<std::array<double, 3>> all(grid.size());
  std::array<double, 3> last{};
  for (std::size_t n = 0; n < grid.size(); ++n) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double here = mixed(sums[grid[n].before][k], sums[grid[n].before + 1][k], grid[n].part);
      all[n][k] = here - last[k];
      last[k] = here;
    }
  }
  return all;
}

// Read-outs may be kept within one turn.
std::vector<double> resampled_angle(const std::vector<double>& angle, const std::vector<Between>& grid) {
  std::vector<double> all(grid.size());
  for (std::size_t n = 0; n < grid.size(); ++n) {
    const double from = angle[grid[n].before];
    all[n] = from + grid[n].part * std::remainder(angle[grid[n].before + 1] - from, 2.0 * std::numbers::pi);
  }
  return all;
}

}  // namespace

Expected<std::string> resample(Recording& recording) {
  const std::vector<double>& time = recording.time_s;
  const double step = 1.0 / recording.sample_rate_hz;
  const double steps = std::floor((time.back() - time.front()) / step + 1e-9);
  if (steps > 2.0 * static_cast<double>(time.size())) {
    return fail(ErrorKind::bad_input,
                fmt::format("time.resample: {} samples over {:.6g} s at {} Hz: gaps fill more than half of it",
                            time.size(), time.back() - time.front(), recording.sample_rate_hz));
  }
  const auto count = static_cast<std::size_t>(steps) + 1;
  std::vector<Between> grid(count);
  std::vector<double> grid_time(count);
  double furthest = 0.0;
  std::size_t before = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const double at = time.front() + static_cast<double>(n) * step;
    while (before + 2 < time.size() && time[before + 1] <= at) {
      ++before;
    }
    const double width = time[before + 1] - time[before];
    grid[n] = {before, std::clamp((at - time[before]) / width, 0.0, 1.0)};
    grid_time[n] = at;
    furthest = std::max(furthest, std::min(at - time[before], std::abs(time[before + 1] - at)));
  }
  std::vector<double> temperature(count * recording.temperature_channels);
  for (std::size_t n = 0; n < count; ++n) {
    for (std::size_t k = 0; k < recording.temperature_channels; ++k) {
      const double* from = &recording.temperature_c[grid[n].before * recording.temperature_channels + k];
      temperature[n * recording.temperature_channels + k] =
          mixed(*from, from[recording.temperature_channels], grid[n].part);
    }
  }
  const std::size_t held = time.size();
  recording.delta_theta_rad = resampled(recording.delta_theta_rad, grid);
  recording.delta_v_mps = resampled(recording.delta_v_mps, grid);
  recording.gimbal_outer_rad = resampled_angle(recording.gimbal_outer_rad, grid);
  recording.gimbal_inner_rad = resampled_angle(recording.gimbal_inner_rad, grid);
  recording.temperature_c = std::move(temperature);
  recording.time_s = std::move(grid_time);
  return fmt::format("resampled: {} samples onto {} at {} Hz, none further than {:.3g} s from a sample", held, count,
                     recording.sample_rate_hz, furthest);
}

}  // namespace selfcal::import
