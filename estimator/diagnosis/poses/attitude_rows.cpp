#include "estimator/diagnosis/poses/attitude_rows.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {
namespace {

double usual_interval(const std::vector<double>& time_s) {
  return (time_s.back() - time_s.front()) / static_cast<double>(time_s.size() - 1);
}

// Of samples about TIME the later one's index, 1 to size - 1.
std::size_t after(const GyroTrack& track, double time) {
  const auto found = std::upper_bound(track.time_s.begin(), track.time_s.end(), time);
  const auto index = static_cast<std::size_t>(found - track.time_s.begin());
  return std::clamp<std::size_t>(index, 1, track.time_s.size() - 1);
}

struct Reading {
  Vector3 gyro, slope, wide_slope;
};

Reading gyro_at(const GyroTrack& track, std::size_t k, double time) {
  const double h = track.time_s[k] - track.time_s[k - 1], s = (time - track.time_s[k - 1]) / h;
  const Vector3 &g0 = track.gyro[k - 1], &g1 = track.gyro[k], &d0 = track.slope[k - 1], &d1 = track.slope[k];
  const double s2 = s * s, s3 = s2 * s;
  return {
      (2.0 * s3 - 3.0 * s2 + 1.0) * g0 + (s3 - 2.0 * s2 + s) * h * d0 + (3.0 * s2 - 2.0 * s3) * g1 + (s3 - s2) * h * d1,
      d0 + s * (d1 - d0), track.wide_slope[k - 1] + s * (track.wide_slope[k] - track.wide_slope[k - 1])};
}

// One stretch between two samples, or a part of it.
class Integral {
 public:
  Integral(const GyroTrack& track, const AttitudeModel& model, const Eigen::Quaterniond& q_rm, AttitudeRow& row)
      : track_(track), model_(model), C_(q_rm), row_(row) {}

  Vector3 rate(std::size_t k, double time) const { return rate_of(gyro_at(track_, k, time)); }
  void set_bias(const Vector3& bias) { bias_ = bias; }

  // Simpson's rule, and the term of the fourth order for rates that change linearly (Magnus): h^2/12 omega_0 x omega_1.
  void add(std::size_t k, double from, double to) {
    const double h = to - from;
    const Reading first = gyro_at(track_, k, from), last = gyro_at(track_, k, to);
    const Vector3 reading = (first.gyro + 4.0 * gyro_at(track_, k, 0.5 * (from + to)).gyro + last.gyro) / 6.0 - bias_;
    const Vector3 bend = last.wide_slope - first.wide_slope;
    const Vector3 phi = h * (model_.W * reading - C_.conjugate() * model_.earth) - model_.smoothing * model_.W * bend +
                        h * h / 12.0 * rate_of(first).cross(rate_of(last));
    const Matrix3 C = (C_ * quaternion_from_rotation_vector(0.5 * phi)).toRotationMatrix();
    const Vector3 read = reading * h - model_.smoothing * bend;
    for (Eigen::Index l = 0; l < 3; ++l) {
      row_.by_W.middleCols<3>(3 * l) += C * read(l);
    }
    row_.by_bias -= C * model_.W * h;
    row_.by_smoothing -= C * model_.W * bend;
    const Eigen::Quaterniond turn = quaternion_from_rotation_vector(phi);
    C_ = C_ * turn;
    turned_ = turned_ * turn;
  }

  const Eigen::Quaterniond& attitude() const { return C_; }
  const Eigen::Quaterniond& turned() const { return turned_; }

 private:
  Vector3 rate_of(const Reading& reading) const {
    return model_.W * (reading.gyro - bias_) - C_.conjugate() * model_.earth;
  }

  const GyroTrack& track_;
  const AttitudeModel& model_;
  Eigen::Quaterniond C_, turned_ = Eigen::Quaterniond::Identity();
  AttitudeRow& row_;
  Vector3 bias_ = Vector3::Zero();
};

constexpr double within_s = 0.04;

// Of a line through as many samples before I as behind it, evenly in time.
Vector3 slope_about(const GyroTrack& track, std::size_t i, std::size_t reach) {
  if (reach == 0) {
    return track.slope[i];
  }
  Vector3 sum = Vector3::Zero();
  double square = 0.0;
  for (std::size_t j = 1; j <= reach; ++j) {
    const auto off = static_cast<double>(j);
    sum += off * (track.gyro[i + j] - track.gyro[i - j]);
    square += 2.0 * off * off;
  }
  const double step = (track.time_s[i + reach] - track.time_s[i - reach]) / (2.0 * static_cast<double>(reach));
  return sum / (square * step);
}

}  // namespace

GyroTrack track_of(const PoseInput& input) {
  GyroTrack track;
  track.time_s = input.time_s;
  track.integral.emplace_back(Vector3::Zero());
  const std::vector<Clipping> clipped = find_clipping(input);
  constexpr double gap = 3.0, at_the_end = 1.0 - 1e-9;
  const double usual = usual_interval(input.time_s);
  const auto clips = [&](std::size_t i) {
    return std::any_of(clipped.begin(), clipped.end(), [&](const Clipping& c) {
      return c.gyro && std::abs(input.gyro[i].at(static_cast<std::size_t>(c.axis))) >= at_the_end * c.limit;
    });
  };
  for (std::size_t i = 0; i < input.time_s.size(); ++i) {
    track.gyro.push_back(at(input.gyro, i));
    const double step = i == 0 ? 0.0 : input.time_s[i] - input.time_s[i - 1];
    track.lost.push_back(step > gap * usual || clips(i) || (i > 0 && clips(i - 1)));
    if (i > 0) {
      track.integral.emplace_back(track.integral.back() + 0.5 * step * (track.gyro[i] + track.gyro[i - 1]));
    }
  }
  const std::size_t last = track.gyro.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, next = std::min(last, i + 1);
    track.slope.emplace_back((track.gyro[next] - track.gyro[before]) / (track.time_s[next] - track.time_s[before]));
  }
  const auto reach = static_cast<std::size_t>(std::clamp(within_s / usual, 2.0, 100.0));
  for (std::size_t i = 0; i <= last; ++i) {
    track.wide_slope.push_back(slope_about(track, i, std::min({reach, i, last - i})));
  }
  return track;
}

Vector3 integral_at(const GyroTrack& track, double time_s) {
  const double time = std::clamp(time_s, track.time_s.front(), track.time_s.back());
  const std::size_t k = after(track, time);
  const double h = time - track.time_s[k - 1];
  const Vector3 chord = (track.gyro[k] - track.gyro[k - 1]) / (track.time_s[k] - track.time_s[k - 1]);
  return track.integral[k - 1] + h * track.gyro[k - 1] + 0.5 * h * h * chord;
}

AttitudeModel::At AttitudeModel::walk_at(double time_s) const {
  const double at = std::clamp((time_s - begin_s) / node_s, 0.0, static_cast<double>(walk.cols() - 1));
  const auto node = std::min(static_cast<Eigen::Index>(at), walk.cols() - 2);
  return {node, at - static_cast<double>(node)};
}

Vector3 AttitudeModel::bias_at(double time_s) const {
  const At at = walk_at(time_s);
  return bias + slope * (time_s - middle_s) + (1.0 - at.share) * walk.col(at.node) + at.share * walk.col(at.node + 1);
}

Vector3 rotation_vector(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const double sine = q.vec().norm();
  constexpr double small = 1e-12;
  return sine < small ? Vector3(2.0 * sign * q.vec())
                      : Vector3(2.0 * std::atan2(sine, sign * q.w()) / sine * sign * q.vec());
}

std::vector<AttitudeRow> integrate(const GyroTrack& track, const Knots& knots,
                                   const std::vector<Eigen::Quaterniond>& q_rm, const AttitudeModel& model) {
  std::vector<AttitudeRow> rows;
  bool begins = true;
  for (std::size_t k = 1; k < knots.all.size(); ++k) {
    const Knot &before = knots.all[k - 1], &now = knots.all[k];
    const double from = model.true_time(before.time_s), to = model.true_time(now.time_s);
    if (now.begins || from < track.time_s.front() || to > track.time_s.back() || !(to > from)) {
      begins = true;
      continue;
    }
    AttitudeRow row;
    row.by_W.setZero();
    row.by_bias.setZero();
    row.by_smoothing.setZero();
    Integral integral(track, model, q_rm[k - 1], row);
    integral.set_bias(model.bias_at(0.5 * (from + to)));
    std::size_t i = after(track, from);
    row.rate_before = q_rm[k - 1] * integral.rate(i, from);
    bool lost = false;
    for (double at = from; at < to; ++i) {
      const double next = i + 1 < track.time_s.size() ? std::min(to, track.time_s[i]) : to;
      lost = lost || track.lost[i];
      integral.add(i, at, next);
      at = next;
    }
    if (lost) {
      begins = true;
      continue;
    }
    row.rate = integral.attitude() * integral.rate(after(track, to), to);
    const Eigen::Quaterniond more = integral.turned().conjugate() * q_rm[k - 1].conjugate() * q_rm[k];
    row.more = q_rm[k] * rotation_vector(more.normalized());
    row.knot = k;
    row.begins = begins;
    row.held = now.held;
    row.length_s = now.time_s - before.time_s;
    row.stamp_s = now.time_s;
    row.time_s = 0.5 * (from + to);
    rows.push_back(row);
    begins = false;
  }
  return rows;
}

}  // namespace selfcal::diagnosis
