#include "estimator/diagnosis/data/side_channels.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "estimator/diagnosis/data/axes.hpp"
#include "estimator/geometry/angles.hpp"
#include "estimator/geometry/rotation.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

struct Stretch {
  std::size_t first = 0, last = 0;
};

// The fastest that the gyros turn within a time on either side of each sample, rad a sample: read-outs may come late.
std::vector<double> fastest_around(const ImuData& data) {
  constexpr double around_s = 1.5;
  const auto reach = static_cast<std::size_t>(std::max(1.0, around_s * data.sample_rate_hz));
  const std::size_t blocks = data.size() / reach + 1;
  std::vector<double> of_block(blocks, 0.0), around(data.size());
  for (std::size_t i = 0; i < data.size(); ++i) {
    double& block = of_block[i / reach];
    block = std::max(block, Eigen::Map<const Vector3>(data.delta_theta[i].data()).norm());
  }
  for (std::size_t i = 0; i < data.size(); ++i) {
    const std::size_t b = i / reach;
    around[i] =
        std::max({of_block[b], of_block[b - std::min<std::size_t>(b, 1)], of_block[std::min(b + 1, blocks - 1)]});
  }
  return around;
}

// Jumps that are back within half a second where they would be without.
std::vector<Stretch> glitches(const ImuData& data, std::span<const double> angles, const std::vector<double>& fastest) {
  constexpr double longest_s = 0.5, more = 2.0, least = 1.0 * units::degree;
  const auto longest = static_cast<std::size_t>(std::max(1.0, longest_s * data.sample_rate_hz));
  const auto jumps = [&](std::size_t from, std::size_t to) {
    const double samples = (data.time_s[to] - data.time_s[from]) * data.sample_rate_hz;  // rows may be lost
    const double could = more * fastest[from] * samples + least;
    return std::abs(within_half_a_turn(angles[to] - angles[from])) > could;
  };
  std::vector<Stretch> found;
  for (std::size_t i = 1; i < angles.size(); ++i) {
    if (!jumps(i - 1, i)) {
      continue;
    }
    for (std::size_t back = i + 1; back < std::min(angles.size(), i + longest + 1); ++back) {
      if (!jumps(i - 1, back)) {
        found.push_back({i, back});
        i = back;
        break;
      }
    }
  }
  return found;
}

void bridge(std::vector<double>& angles, const Stretch& s) {
  const double from = angles[s.first - 1], turn = within_half_a_turn(angles[s.last] - from);
  for (std::size_t i = s.first; i < s.last; ++i) {
    angles[i] = from + turn * static_cast<double>(i + 1 - s.first) / static_cast<double>(s.last + 1 - s.first);
  }
}

// Where one value stands for five seconds and more while the gyros turn by ten degrees and more that the other axis does not show. A read-out
// that comes late stands for two seconds more at either end.
std::vector<Stretch> holds(const ImuData& data, const std::vector<double>& angles, const std::vector<double>& other) {
  constexpr double least_s = 5.0, end_s = 2.0, block_s = 0.5, least_turn = 10.0 * units::degree,
                   least_rate = 2.0 * units::degree, most_of_all = 0.5, by_other = 0.3;
  const auto block = static_cast<std::size_t>(std::max(1.0, block_s * data.sample_rate_hz));
  const auto ends = static_cast<std::size_t>(end_s * data.sample_rate_hz);
  std::vector<Stretch> found;
  for (std::size_t first = 0, last = 0; first < angles.size(); first = last) {
    for (last = first + 1; last < angles.size() && angles[last] == angles[first]; ++last) {
    }
    if (static_cast<double>(last - first) < least_s * data.sample_rate_hz) {
      continue;
    }
    double turned = 0.0;
    for (std::size_t i = first + ends; i + block + ends <= last; i += block) {
      Vector3 turn = Vector3::Zero();
      for (std::size_t k = i; k < i + block; ++k) {
        turn += Eigen::Map<const Vector3>(data.delta_theta[k].data());
      }
      const double shown = std::abs(within_half_a_turn(other[i + block - 1] - other[i]));
      const bool turns = turn.norm() > least_rate * block_s && shown < by_other * turn.norm();
      turned += turns ? turn.norm() : 0.0;
    }
    const bool all_along = static_cast<double>(last - first) > most_of_all * static_cast<double>(angles.size());
    if (turned > least_turn && !all_along && first > 0 && last < angles.size()) {
      found.push_back({first, last});
    }
  }
  return found;
}

// `held` through a stretch by the gyros; what they are off by at its end (the Earth's rate, the IMU's axes) goes over the stretch.
void turn_on(const ImuData& data, std::vector<double>& outer, std::vector<double>& inner, bool of_outer,
             const Stretch& s) {
  Matrix3 C_vb = gimbal_matrix(outer[s.first - 1], inner[s.first - 1]);
  std::vector<double>& held = of_outer ? outer : inner;
  double before = held[s.first - 1];
  for (std::size_t i = s.first; i <= s.last; ++i) {
    C_vb = C_vb * matrix_from_rotation_vector(Eigen::Map<const Vector3>(data.delta_theta[i].data()));
    const GimbalAngles now = gimbal_angles(C_vb);
    const double angle = before + within_half_a_turn((of_outer ? now.outer : now.inner) - before);
    if (i == s.last) {
      const double off = within_half_a_turn(held[i] - angle);
      for (std::size_t k = s.first; k < i; ++k) {
        held[k] += off * static_cast<double>(k + 1 - s.first) / static_cast<double>(i + 1 - s.first);
      }
    } else {
      before = held[i] = angle;
    }
  }
}

DataFault fault_of(const char* id, const char* name, const std::vector<Stretch>& stretches, const char* words) {
  DataFault fault{id, std::string(name) + words, stretches.front().first, 0};
  for (const Stretch& s : stretches) {
    fault.count += s.last - s.first;
    fault.stretches.push_back({s.first, s.last, false});
  }
  return fault;
}

void mend_angles(const ImuData& data, MendedSideChannels& mended) {
  if (mended.outer.empty() || mended.inner.empty() || read_outs_in_degrees(data)) {
    return;
  }
  const std::vector<double> fastest = fastest_around(data);
  const auto name = [](bool of_outer) { return of_outer ? "gimbal_outer_rad" : "gimbal_inner_rad"; };
  for (const bool of_outer : {true, false}) {
    std::vector<double>& angles = of_outer ? mended.outer : mended.inner;
    const auto all = glitches(data, angles, fastest);
    for (const Stretch& s : all) {
      bridge(angles, s);
    }
    if (!all.empty()) {
      mended.faults.push_back(
          fault_of("read_out", name(of_outer), all,
                   " jumps and comes back, and the gyros do not; its neighbours stand in its place"));
    }
  }
  for (const bool of_outer : {true, false}) {
    const auto all = of_outer ? holds(data, mended.outer, mended.inner) : holds(data, mended.inner, mended.outer);
    for (const Stretch& s : all) {
      turn_on(data, mended.outer, mended.inner, of_outer, s);
    }
    if (!all.empty()) {
      mended.faults.push_back(
          fault_of("read_out", name(of_outer), all,
                   " holds one value while the gyros turn; what they make of it stands in its place"));
    }
  }
}

// By more than a mass changes from sample to sample, and back within a minute; or in the first or the last minute, and for good.
std::vector<Stretch> temperature_jumps(const ImuData& data, const std::vector<double>& temperature) {
  constexpr double longest_s = 60.0, least = 2.0, usual_steps = 10.0, least_of_quantum = 3.5;
  const auto longest = static_cast<std::size_t>(longest_s * data.sample_rate_hz);
  const std::size_t n = temperature.size();
  std::vector<double> steps;
  double quantum = 0.0;
  for (std::size_t i = 1; i < n; ++i) {
    const double step = std::abs(temperature[i] - temperature[i - 1]);
    steps.push_back(step);
    quantum = step > 0.0 && (quantum == 0.0 || step < quantum) ? step : quantum;
  }
  const auto at = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() * 9 / 10);
  std::nth_element(steps.begin(), at, steps.end());
  const double jump = std::max({least, usual_steps * *at, least_of_quantum * quantum});
  std::vector<Stretch> found;
  for (std::size_t i = 1; i < n; ++i) {
    if (std::abs(temperature[i] - temperature[i - 1]) <= jump) {
      continue;
    }
    std::size_t back = i + 1;
    while (back < std::min(n, i + longest) && std::abs(temperature[back] - temperature[i - 1]) > jump) {
      ++back;
    }
    if (back < std::min(n, i + longest)) {
      found.push_back({i, back});
      i = back;
    } else if (i < longest && found.empty()) {
      found.push_back({0, i});
    } else if (i + longest > n) {
      found.push_back({i, n});
      break;
    }
  }
  return found;
}

void mend_temperature(const ImuData& data, MendedSideChannels& mended) {
  constexpr std::size_t enough = 100;
  std::vector<double>& temperature = mended.temperature;
  if (temperature.size() < enough) {
    return;
  }
  const std::vector<Stretch> all = temperature_jumps(data, temperature);
  for (const Stretch& s : all) {
    const double from = s.first > 0 ? temperature[s.first - 1] : temperature[s.last];
    const double to = s.last < temperature.size() ? temperature[s.last] : from;
    for (std::size_t i = s.first; i < s.last; ++i) {
      temperature[i] =
          from + (to - from) * static_cast<double>(i + 1 - s.first) / static_cast<double>(s.last + 1 - s.first);
    }
  }
  if (!all.empty()) {
    mended.faults.push_back(
        fault_of("temperature", "temperature_c", all,
                 " jumps by more than sensors warm from sample to sample; its neighbours stand in its place"));
  }
}

}  // namespace

MendedSideChannels mend_side_channels(const ImuData& data) {
  MendedSideChannels mended;
  mended.outer.assign(data.gimbal_outer.begin(), data.gimbal_outer.end());
  mended.inner.assign(data.gimbal_inner.begin(), data.gimbal_inner.end());
  mended.temperature.assign(data.temperature.begin(), data.temperature.end());
  mend_angles(data, mended);
  mend_temperature(data, mended);
  return mended.faults.empty() ? MendedSideChannels{} : mended;
}

}  // namespace selfcal::diagnosis
