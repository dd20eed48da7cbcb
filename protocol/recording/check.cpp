#include "protocol/recording/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "protocol/recording/gimbal_check.hpp"

namespace selfcal {
namespace {

constexpr double lowest_rate_hz = 1.0;
constexpr double highest_rate_hz = 20000.0;
constexpr double rate_tolerance = 1e-3;  // a crystal is within 1e-4; a wrong rate is wrong by percents
constexpr double gap_intervals = 1.5;    // half an interval of jitter is no gap; a lost sample is a whole one
constexpr double gravity_mps2 = 9.806;
constexpr double gravity_tolerance = 0.05;  // normal gravity differs by 0.3 %, no sensor error reaches 1 %
constexpr double lowest_height_m = -500.0;  // the Dead Sea's shore is at -430
constexpr double highest_height_m = 20000.0;

tl::unexpected<Error> bad(std::string message) { return fail(ErrorKind::bad_input, std::move(message)); }

Expected<void> check_in_range(std::string_view name, double value, double low, double high) {
  if (!(value >= low && value <= high)) {  // a NaN too
    return bad(fmt::format("{} = {} is outside {} to {}", name, value, low, high));
  }
  return {};
}

Expected<void> check_attributes(const Recording& recording) {
  const auto rate = check_in_range("sample_rate_hz", recording.sample_rate_hz, lowest_rate_hz, highest_rate_hz);
  const auto latitude = check_in_range("latitude_deg", recording.latitude_deg, -90.0, 90.0);
  const auto longitude = check_in_range("longitude_deg", recording.longitude_deg, -360.0, 360.0);
  const auto height = check_in_range("height_m", recording.height_m, lowest_height_m, highest_height_m);
  for (const auto* check : {&rate, &latitude, &longitude, &height}) {
    if (!*check) {
      return *check;
    }
  }
  constexpr double longest_s = 86400.0;
  if (recording.dwell_s) {
    if (auto dwell = check_in_range("dwell_s", *recording.dwell_s, 0.0, longest_s); !dwell) {
      return dwell;
    }
  }
  if (recording.rotation_s) {
    return check_in_range("rotation_s", *recording.rotation_s, 0.0, longest_s);
  }
  return {};
}

Expected<void> check_lengths(const Recording& recording) {
  const std::size_t rows = recording.size();
  constexpr std::size_t fewest = 2;
  if (rows < fewest) {
    return bad(fmt::format("time_s: {} rows, at least {} needed", rows, fewest));
  }
  const auto check = [rows](std::string_view name, std::size_t size) -> Expected<void> {
    if (size != rows) {
      return bad(fmt::format("{}: {} rows where time_s has {}", name, size, rows));
    }
    return {};
  };
  const auto theta = check("delta_theta_rad", recording.delta_theta_rad.size());
  const auto velocity = check("delta_v_mps", recording.delta_v_mps.size());
  const auto outer = check("gimbal_outer_rad", recording.gimbal_outer_rad.size());
  const auto inner = check("gimbal_inner_rad", recording.gimbal_inner_rad.size());
  for (const auto* length : {&theta, &velocity, &outer, &inner}) {
    if (!*length) {
      return *length;
    }
  }
  if (recording.temperature_channels > 0) {
    return check("temperature_c", recording.temperature_c.size() / recording.temperature_channels);
  }
  return {};
}

Expected<void> check_finite(std::string_view name, const double* values, std::size_t rows, std::size_t columns) {
  for (std::size_t k = 0; k < rows * columns; ++k) {
    if (!std::isfinite(values[k])) {
      const std::string column = columns > 1 ? fmt::format(", column {}", k % columns) : std::string();
      return bad(fmt::format("{}: row {}{}: {} is not a finite number", name, k / columns, column, values[k]));
    }
  }
  return {};
}

Expected<void> check_all_finite(const Recording& recording) {
  const std::size_t rows = recording.size();
  const auto time = check_finite("time_s", recording.time_s.data(), rows, 1);
  const auto theta = check_finite("delta_theta_rad", recording.delta_theta_rad.data()->data(), rows, 3);
  const auto velocity = check_finite("delta_v_mps", recording.delta_v_mps.data()->data(), rows, 3);
  const auto outer = check_finite("gimbal_outer_rad", recording.gimbal_outer_rad.data(), rows, 1);
  const auto inner = check_finite("gimbal_inner_rad", recording.gimbal_inner_rad.data(), rows, 1);
  const auto temperature = check_finite("temperature_c", recording.temperature_c.data(),
                                        recording.temperature_channels > 0 ? rows : 0, recording.temperature_channels);
  const auto schedule =
      recording.schedule_deg.empty()
          ? Expected<void>{}
          : check_finite("schedule_deg", recording.schedule_deg.data()->data(), recording.schedule_deg.size(), 2);
  for (const auto* check : {&time, &theta, &velocity, &outer, &inner, &temperature, &schedule}) {
    if (!*check) {
      return *check;
    }
  }
  return {};
}

Expected<std::optional<std::string>> check_time(const Recording& recording, const CheckPolicy& policy) {
  const std::vector<double>& time = recording.time_s;
  const double nominal = 1.0 / recording.sample_rate_hz;
  std::optional<std::string> gap;
  double lost_s = 0.0;  // in gaps: not the rate's fault
  std::size_t gaps = 0;
  for (std::size_t row = 1; row < time.size(); ++row) {
    const double interval = time[row] - time[row - 1];
    if (!(interval > 0.0)) {
      return bad(
          fmt::format("time_s: row {}: {} s is not after row {}'s {} s", row, time[row], row - 1, time[row - 1]));
    }
    if (interval > gap_intervals * nominal) {
      lost_s += interval - nominal;
      ++gaps;
      if (!gap) {
        gap = fmt::format("time_s: row {}: gap of {:.6g} s before {} s, {:.6g} s expected", row, interval, time[row],
                          nominal);
      }
    }
  }
  const double seconds = time.back() - time.front() - lost_s;
  const double rate = static_cast<double>(time.size() - 1) / seconds;
  // A gap only counts as one if the rest keeps the rate: else every interval is a "gap" and the rate is wrong. Few long ones are a logger that
  // was switched off.
  constexpr std::size_t one_in = 100;
  const bool few = gaps * one_in < time.size();
  const double span_rate = static_cast<double>(time.size() - 1) / (time.back() - time.front());
  const double lost_share = lost_s / (time.back() - time.front());
  // Rows that were late, with short intervals behind them, are no gaps: all rows are there.
  const bool complete = std::abs(span_rate / recording.sample_rate_hz - 1.0) <= rate_tolerance;
  const double judged = complete || (lost_share > 0.25 && !few) ? span_rate : rate;
  if (std::abs(judged / recording.sample_rate_hz - 1.0) > rate_tolerance) {
    return bad(fmt::format("sample_rate_hz = {} contradicts time_s, whose {} rows over {:.6g} s make {:.6g} Hz",
                           recording.sample_rate_hz, time.size(), time.back() - time.front(), judged));
  }
  if (gap && policy.gaps_are_errors) {
    return bad(*gap);
  }
  return gap;
}

// Specific force of each second, from the mean |delta_v|: one sample may be all quantum.
std::vector<double> force_of_seconds(const Recording& recording) {
  const auto window = static_cast<std::size_t>(std::ceil(recording.sample_rate_hz));
  std::vector<double> seconds;
  for (std::size_t first = 0; first < recording.size(); first += window) {
    const std::size_t last = std::min(first + window, recording.size());
    double sum = 0.0;
    for (std::size_t row = first; row < last; ++row) {
      const auto& d = recording.delta_v_mps[row];
      sum += std::hypot(d[0], d[1], d[2]);
    }
    seconds.push_back(sum / static_cast<double>(last - first) * recording.sample_rate_hz);
  }
  return seconds;
}

// The mean of |delta_v| is gravity times the interval, in any attitude and for any rotation of the gimbal. A sensor turned
// by hand is jerked for a part of its recording: then the median of the seconds may be let pass with a warning.
Expected<std::optional<std::string>> check_specific_force(const Recording& recording, const CheckPolicy& policy) {
  double sum = 0.0;
  for (const auto& d : recording.delta_v_mps) {
    sum += std::hypot(d[0], d[1], d[2]);
  }
  const double mean = sum / static_cast<double>(recording.size()) * recording.sample_rate_hz;
  const auto is_gravity = [](double force) { return std::abs(force / gravity_mps2 - 1.0) <= gravity_tolerance; };
  if (is_gravity(mean)) {
    return std::optional<std::string>{};
  }
  const std::string words =
      fmt::format("delta_v_mps: rows 0 to {} make a mean specific force of {:.6g} m/s^2, {} expected",
                  recording.size() - 1, mean, gravity_mps2);
  if (!policy.uneven_force_is_error && std::isfinite(mean)) {
    std::vector<double> seconds = force_of_seconds(recording);
    const auto middle = seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2);
    std::nth_element(seconds.begin(), middle, seconds.end());
    if (is_gravity(*middle)) {
      return std::optional<std::string>{fmt::format("{}; half of the seconds show {:.6g}", words, *middle)};
    }
  }
  return bad(words);
}

bool stands_still(const std::vector<double>& angle) {
  return std::all_of(angle.begin(), angle.end(), [&](double a) { return a == angle.front(); });
}

Expected<std::optional<std::string>> check_gimbal(const Recording& recording, const CheckPolicy& policy) {
  const bool still = stands_still(recording.gimbal_outer_rad) && stands_still(recording.gimbal_inner_rad);
  if (recording.gimbal_absent && still && !policy.gimbal_contradiction_is_error) {
    return std::optional<std::string>{};  // who recorded it said so
  }
  const auto found = find_gimbal_contradiction(recording);
  if (!found) {
    return std::optional<std::string>{};
  }
  const std::string words = fmt::format(
      "gimbal_outer_rad, gimbal_inner_rad: rows {} to {}: read-outs turned {:.1f} and {:.1f} deg, delta_theta_rad "
      "{:.1f} deg; {:.1f} deg apart, tolerance {:.1f}; 'selfcal diagnose' tells which of them is wrong",
      found->first_row, found->last_row, found->outer_turn_deg, found->inner_turn_deg, found->gyro_turn_deg,
      found->disagreement_deg, found->tolerance_deg);
  if (policy.gimbal_contradiction_is_error) {
    return bad(words);
  }
  if (still) {
    return std::optional<std::string>{fmt::format(
        "gimbal_outer_rad, gimbal_inner_rad: stand still in all rows while delta_theta_rad turns by {:.1f} deg in "
        "rows {} to {}: none were recorded, or a hand turned the sensor",
        found->gyro_turn_deg, found->first_row, found->last_row)};
  }
  return lags_alone(recording) ? std::optional<std::string>{} : std::optional<std::string>{words};
}

}  // namespace

Expected<std::vector<std::string>> check_recording(const Recording& recording, const CheckPolicy& policy) {
  for (const auto check : {check_attributes, check_lengths, check_all_finite}) {
    if (const Expected<void> sound = check(recording); !sound) {
      return tl::unexpected(sound.error());
    }
  }
  std::vector<std::string> warnings;
  const auto time = check_time(recording, policy);
  if (!time) {
    return tl::unexpected(time.error());
  }
  if (*time) {
    warnings.push_back(**time);
  }
  const auto force = check_specific_force(recording, policy);
  if (!force) {
    return tl::unexpected(force.error());
  }
  if (*force) {
    warnings.push_back(**force);
  }
  const auto gimbal = check_gimbal(recording, policy);
  if (!gimbal) {
    return tl::unexpected(gimbal.error());
  }
  if (*gimbal) {
    warnings.push_back(**gimbal);
  }
  return warnings;
}

}  // namespace selfcal
