#include "estimator/diagnosis/data_faults.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "estimator/geometry/units.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {
namespace {

using Triple = std::array<double, 3>;

std::string number(const char* format, double a, double b = 0.0, double c = 0.0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

void note(DataFault& fault, std::size_t sample) {
  if (fault.count++ == 0) {
    fault.first_sample = sample;
  }
}

bool same(const ImuData& d, std::size_t i, std::size_t j) {
  return d.delta_theta[i] == d.delta_theta[j] && d.delta_v[i] == d.delta_v[j];
}

// Zero increments never come by chance: gravity is always there. Repeated ones do, where the quantum is coarse: their
// number is held against that of samples equal to the last but one.
void lost_samples(const ImuData& data, std::vector<DataFault>& faults) {
  constexpr Triple zero{};
  DataFault zeros{"lost_samples", {}, 0, 0}, repeats{"lost_samples", {}, 0, 0}, gaps{"lost_samples", {}, 0, 0};
  std::size_t by_chance = 0;
  double missing = 0.0;
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (data.delta_v[i] == zero) {
      note(zeros, i);
    } else if (i > 0 && same(data, i, i - 1)) {
      note(repeats, i);
    } else if (i > 1 && same(data, i, i - 2)) {
      ++by_chance;
    }
    const double steps = i > 0 ? (data.time_s[i] - data.time_s[i - 1]) * data.sample_rate_hz : 1.0;
    if (steps > 1.5) {
      note(gaps, i);
      missing += steps - 1.0;
    }
  }
  const auto chance = static_cast<double>(by_chance);
  const double excess = static_cast<double>(repeats.count) - chance;
  if (zeros.count > 0) {
    zeros.words = number("%.0f samples have zero velocity increments", static_cast<double>(zeros.count));
    faults.push_back(zeros);
  }
  // Difference of two counts, 5 sigma; on a moving base neighbours are alike a little more often than that.
  constexpr double moving_excess = 40.0;
  if (excess > std::max(moving_excess, 5.0 * std::sqrt(2.0 * chance + 1.0))) {
    repeats.words = number("%.0f samples repeat the one before (%.0f expected by chance)",
                           static_cast<double>(repeats.count), chance);
    faults.push_back(repeats);
  }
  if (gaps.count > 0) {
    gaps.words = number("%.0f gaps, %.0f samples missing", static_cast<double>(gaps.count), missing);
    faults.push_back(gaps);
  }
}

void time_base(const ImuData& data, std::vector<DataFault>& faults) {
  std::vector<double> dt;
  for (std::size_t i = 1; i < data.size(); ++i) {
    dt.push_back(data.time_s[i] - data.time_s[i - 1]);
  }
  std::nth_element(dt.begin(), dt.begin() + static_cast<std::ptrdiff_t>(dt.size() / 2), dt.end());
  const double rate = 1.0 / dt[dt.size() / 2];
  if (std::abs(rate / data.sample_rate_hz - 1.0) > 1e-3) {
    faults.push_back({"time_base", number("time stamps run at %.6g Hz, the rate is stated as %.6g Hz", rate,
                                          data.sample_rate_hz), 0, data.size()});
  }
}

// An axis that gives one value for long. Gyros of coarse quantum rest at a count for seconds; accelerometers do not.
void frozen_axes(const ImuData& data, std::vector<DataFault>& faults) {
  constexpr double gyro_s = 30.0, accel_s = 2.0;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const auto value = [&](std::size_t i) { return axis < 3 ? data.delta_theta[i][axis] : data.delta_v[i][axis - 3]; };
    const double longest = (axis < 3 ? gyro_s : accel_s) * data.sample_rate_hz;
    std::size_t start = 0;
    DataFault fault{"frozen_axis", {}, 0, 0};
    for (std::size_t i = 1; i <= data.size(); ++i) {
      if (i < data.size() && value(i) == value(start)) {
        continue;
      }
      if (static_cast<double>(i - start) > longest) {
        fault.first_sample = fault.count == 0 ? start : fault.first_sample;
        fault.count += i - start;
      }
      start = i;
    }
    if (fault.count > 0) {
      fault.words = std::string(axis < 3 ? "gyro " : "accelerometer ") + "xyz"[axis % 3] +
                    number(" gives one value for %.1f s", static_cast<double>(fault.count) / data.sample_rate_hz);
      faults.push_back(fault);
    }
  }
}

// Samples at the extreme value in runs that are entered from a slope. A drive comes up to its rate smoothly, and where
// the noise is below the quantum the rate is one count all along: no clipping. Over the last 0.05 s before a rate is
// reached with continuous acceleration, ramps of a second and more change it by less than 0.7 %; a clipped ramp by 3 %.
template <typename Value>
std::size_t steeply_met(const ImuData& data, const Value& value, double largest) {
  constexpr double steep = 0.01;
  const auto back = static_cast<std::size_t>(std::max(1.0, std::round(0.05 * data.sample_rate_hz)));
  std::size_t met = 0;
  bool run = false, counts = false;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const bool extreme = std::abs(value(i)) == largest;
    if (extreme && !run) {
      counts = i > back && std::abs(value(i - 1) - value(i - 1 - back)) > steep * largest;
    }
    run = extreme;
    met += extreme && counts ? 1 : 0;
  }
  return met;
}

// Single samples far from both neighbours in dwells; and extreme values that are met again and again.
void spikes_and_saturation(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  const auto margin = static_cast<std::size_t>(0.5 * data.sample_rate_hz);   // a dwell's edge may hold part of a turn
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const auto value = [&](std::size_t i) { return axis < 3 ? data.delta_theta[i][axis] : data.delta_v[i][axis - 3]; };
    const std::string name = std::string(axis < 3 ? "gyro " : "accelerometer ") + "xyz"[axis % 3];
    std::vector<std::pair<double, std::size_t>> curvature;
    double largest = 0.0;
    std::size_t met = 0, first_met = 0;
    for (std::size_t i = 0; i < data.size(); ++i) {
      if (std::abs(value(i)) > largest) {
        largest = std::abs(value(i));
        met = 0;
        first_met = i;
      }
      met += std::abs(value(i)) == largest ? 1 : 0;
    }
    for (const Segment& s : segments) {
      for (std::size_t i = s.first + 1 + margin; !s.rotation && i + 1 + margin < s.last; ++i) {
        curvature.emplace_back(std::abs(value(i) - 0.5 * (value(i - 1) + value(i + 1))), i);
      }
    }
    if (curvature.size() < 1000) {
      continue;
    }
    auto middle = curvature.begin() + static_cast<std::ptrdiff_t>(curvature.size() * 9 / 10);
    std::nth_element(curvature.begin(), middle, curvature.end());
    const double limit = 12.0 * middle->first / 1.645;   // the 90 % point is 1.645 sigma: 12 sigma
    DataFault spike{"spike", {}, data.size(), 0};
    for (const auto& [size, i] : curvature) {
      if (size > limit && limit > 0.0) {
        ++spike.count;
        spike.first_sample = std::min(spike.first_sample, i);
      }
    }
    if (spike.count > 0) {
      spike.words = name + number(": %.0f samples in dwells stand more than 12 sigma from their neighbours",
                                  static_cast<double>(spike.count));
      faults.push_back(spike);
    }
    met = steeply_met(data, value, largest);
    constexpr std::size_t often = 100;
    constexpr double rest_rate = 0.5 * units::degree;   // below it the largest count of a gyro is only noise
    const bool loud = axis < 3 ? largest * data.sample_rate_hz > rest_rate : largest * data.sample_rate_hz > 11.0;
    if (met > often && loud) {
      faults.push_back({"saturation", name + number(" meets its extreme value %.0f times", static_cast<double>(met)),
                        first_met, met});
    }
  }
}

// What the gyros integrate to in every rotation against the gimbal's read-outs, in b: angle = M * expected.
void axes_against_gimbal(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  if (data.gimbal_outer.empty() || data.gimbal_inner.empty()) {
    return;
  }
  Matrix3 cross = Matrix3::Zero(), normal = Matrix3::Zero();
  for (const Segment& s : segments) {
    if (!s.rotation || s.first == 0 || s.last >= data.size()) {
      continue;
    }
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    for (std::size_t i = s.first; i < s.last; ++i) {
      q = q * quaternion_from_rotation_vector(Eigen::Map<const Vector3>(data.delta_theta[i].data()));
    }
    const Matrix3 from = gimbal_matrix(data.gimbal_outer[s.first - 1], data.gimbal_inner[s.first - 1]);
    const Matrix3 to = gimbal_matrix(data.gimbal_outer[s.last], data.gimbal_inner[s.last]);
    const Vector3 expected = rotation_vector_from_matrix(from.transpose() * to);
    const Vector3 measured = rotation_vector_from_matrix(q.toRotationMatrix());
    cross += measured * expected.transpose();
    normal += expected * expected.transpose();
  }
  const Eigen::JacobiSVD<Matrix3> svd(normal, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.singularValues()(0) == 0.0) {
    return;
  }
  Vector3 inverse = Vector3::Zero();
  Matrix3 seen = Matrix3::Zero();
  for (int k = 0; k < 3; ++k) {
    if (svd.singularValues()(k) > 0.05 * svd.singularValues()(0)) {
      inverse(k) = 1.0 / svd.singularValues()(k);
      seen += svd.matrixV().col(k) * svd.matrixV().col(k).transpose();
    }
  }
  const Matrix3 M = cross * svd.matrixV() * inverse.asDiagonal() * svd.matrixU().transpose();
  constexpr double plausible = 0.05;   // gimbal good to 1 deg in 90, sensors to 1 deg
  const Matrix3 off = M - seen;
  if (off.cwiseAbs().maxCoeff() > plausible) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "gyros against gimbal: turns along b come out as [%.3f %.3f %.3f; %.3f %.3f %.3f; %.3f %.3f %.3f]",
                  M(0, 0), M(0, 1), M(0, 2), M(1, 0), M(1, 1), M(1, 2), M(2, 0), M(2, 1), M(2, 2));
    faults.push_back({"wrong_axes", text, 0, data.size()});
  }
}

// Mean size of the specific force in dwells against normal gravity; sensors are within 5000 ppm.
void gravity_size(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  const double expected = earth::normal_gravity(data.site.latitude, data.site.height);
  double sum = 0.0;
  int dwells = 0;
  for (const Segment& s : segments) {
    if (s.rotation || s.last <= s.first) {
      continue;
    }
    Vector3 velocity = Vector3::Zero();
    for (std::size_t i = s.first; i < s.last; ++i) {
      velocity += Eigen::Map<const Vector3>(data.delta_v[i].data());
    }
    sum += velocity.norm() * data.sample_rate_hz / static_cast<double>(s.last - s.first);
    ++dwells;
  }
  constexpr double plausible = 0.015;
  if (dwells > 0 && std::abs(sum / dwells / expected - 1.0) > plausible) {
    faults.push_back({"wrong_scale", number("specific force at rest is %.5f m/s^2, gravity there is %.5f m/s^2",
                                            sum / dwells, expected), 0, data.size()});
  }
}

}  // namespace

std::vector<DataFault> find_data_faults(const ImuData& data) {
  std::vector<DataFault> faults;
  const std::vector<Segment> segments = find_segments(data);
  lost_samples(data, faults);
  time_base(data, faults);
  frozen_axes(data, faults);
  spikes_and_saturation(data, segments, faults);
  axes_against_gimbal(data, segments, faults);
  gravity_size(data, segments, faults);
  return faults;
}

}  // namespace selfcal::diagnosis
