#include "estimator/diagnosis/regression/recording_context.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "estimator/geometry/angles.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double division_s = 0.02;
constexpr double creeping_s = 15.0;
constexpr std::size_t creeping_divisions = 10;
constexpr double margin_s = 0.5;        // between a turn as found and as it was
constexpr double piece_s = 0.1;         // of a turn that is remembered
constexpr double turn_margin_s = 0.25;  // segments are told apart by quarters of a second

// Where a rate c (E - t)^p that was averaged over stretches around the times given runs out: E, with p = 1 or 2 (a
// trapezoid, a smooth ramp), whichever fits better. NaN where there are less than three.
double rate_runs_out(const std::vector<double>& time, const std::vector<double>& rate, double length_s) {
  const auto n = static_cast<Eigen::Index>(time.size());
  if (n < 3) {
    return NAN;
  }
  const Eigen::Map<const Eigen::VectorXd> w(rate.data(), n);
  const Eigen::VectorXd t = Eigen::Map<const Eigen::VectorXd>(time.data(), n).array() - time.front();
  Eigen::MatrixXd A(n, 2);
  A << Eigen::VectorXd::Ones(n), t;
  const auto line = [&A](const Eigen::VectorXd& y) -> Eigen::Vector2d { return A.colPivHouseholderQr().solve(y); };
  const Eigen::Vector2d even = line(w);
  // The mean of c (E - t)^2 over a stretch is c times its square at the middle and length^2/12.
  Eigen::Vector2d root = line(w.cwiseSqrt());
  for (int round = 0; round < 3; ++round) {
    root = line((w.array() - root(1) * root(1) * length_s * length_s / 12.0).cwiseMax(0.0).sqrt());
  }
  const double stretch = root(1) * root(1) * length_s * length_s / 12.0;
  const double misfit_even = (A * even - w).norm();
  const double misfit_smooth = ((A * root).array().square() + stretch - w.array()).matrix().norm();
  const Eigen::Vector2d& best = misfit_even < misfit_smooth ? even : root;
  return time.front() - best(0) / best(1);
}

// Of samples [first, last).
Vector3 sum_over(std::span<const std::array<double, 3>> increments, std::size_t first, std::size_t last) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = first; i < last; ++i) {
    sum += Eigen::Map<const Vector3>(increments[i].data());
  }
  return sum;
}

// A read-out is that of the end of its sample: of an odd number of samples the middle lies between two of them.
double angle_in_the_middle(std::span<const double> angle, const SensorBlock& block) {
  const std::size_t ends = block.first + block.last;
  const double before = angle[ends > 1 ? (ends - 2) / 2 : 0], after = angle[(ends - 1) / 2];
  return before + 0.5 * within_half_a_turn(after - before);
}

}  // namespace

Vector3 dipole_field(double latitude) {
  constexpr double equator = 0.31;
  return equator * Vector3(std::cos(latitude), -2.0 * std::sin(latitude), 0.0);
}

RecordingContext::RecordingContext(const ImuData& data, ReferenceResidual reference)
    : data_(data),
      reference_(std::move(reference)),
      segments_(find_segments(data)),
      samples_per_division_(static_cast<std::size_t>(std::max(1.0, std::round(division_s * data.sample_rate_hz)))),
      start_s_(data.time_s.front() - 1.0 / data.sample_rate_hz),
      field_n_(dipole_field(data.site.latitude)) {
  if (has_temperature()) {
    mean_temperature_ = std::accumulate(data.temperature.begin(), data.temperature.end(), 0.0) /
                        static_cast<double>(data.temperature.size());
  }
  for (const Segment& s : segments_) {
    if (s.rotation) {
      turns_.push_back({start_of_turn(s), end_of_turn(s)});
    }
  }
  remember_turns();
}

Vector3 RecordingContext::load(std::size_t first, std::size_t last) const {
  return sum_over(data_.delta_v, first, last) * data_.sample_rate_hz /
         (units::standard_gravity * static_cast<double>(last - first));
}

// By read-outs where there are any; the gyros sense the Earth's rate and the base's too.
double RecordingContext::travelled(std::size_t first, std::size_t last) const {
  if (data_.gimbal_outer.empty() || data_.gimbal_inner.empty()) {
    return mean_rate(first, last).norm() * static_cast<double>(last - first) / data_.sample_rate_hz;
  }
  const auto by = [&](std::span<const double> angle) {  // read-outs are those of the ends of samples
    return std::abs(within_half_a_turn(angle[last - 1] - angle[first - 1]));
  };
  return by(data_.gimbal_outer) + by(data_.gimbal_inner);
}

// In pieces of a tenth of a second, the load from the mean of the dwell before a turn to that of the dwell after it: a base that sways
// makes no load of its own.
void RecordingContext::remember_turns() {
  const auto piece = static_cast<std::size_t>(std::max(1.0, std::round(piece_s * data_.sample_rate_hz)));
  std::vector<Vector3> means;  // of the load in dwells
  for (const Segment& s : segments_) {
    means.push_back(s.rotation ? Vector3::Zero() : load(s.first, s.last));
  }
  std::vector<TurnChanges> loads, travels;
  for (std::size_t k = 1; k + 1 < segments_.size(); ++k) {
    const Segment& turn = segments_[k];
    if (!turn.rotation || turn.last <= turn.first) {
      continue;
    }
    TurnChanges of_load, of_travel;
    of_load.step_s = of_travel.step_s = static_cast<double>(piece) / data_.sample_rate_hz;
    of_load.first_s = data_.time_s[turn.first] - 1.0 / data_.sample_rate_hz - start_s_;
    of_travel.first_s = of_load.first_s + 0.5 * of_load.step_s;
    Vector3 before = means[k - 1];
    for (std::size_t first = turn.first; first < turn.last; first += piece) {
      const std::size_t last = std::min(first + piece, turn.last);
      const Vector3 now = load(first, last);
      of_load.change.emplace_back(now - before);
      of_travel.change.emplace_back(travelled(first, last), 0.0, 0.0);
      before = now;
    }
    of_load.change.emplace_back(means[k + 1] - before);
    loads.push_back(std::move(of_load));
    travels.push_back(std::move(of_travel));
  }
  load_memory_ = TurnMemory(loads);
  travel_memory_ = TurnMemory(travels);
}

std::size_t RecordingContext::segment_at(double t) const {
  const auto after = std::upper_bound(segments_.begin(), segments_.end(), t,
                                      [](double value, const Segment& s) { return value < s.end_s; });
  return std::min(static_cast<std::size_t>(after - segments_.begin()), segments_.size() - 1);
}

// A rotation is found a few samples after it sets in, and ends as late.
bool RecordingContext::turns_around(double t) const {
  return segments_[segment_at(t - margin_s)].rotation || segments_[segment_at(t + margin_s)].rotation;
}

bool RecordingContext::divides(std::size_t sample) const {
  if (sample % samples_per_division_ != 0) {
    return false;
  }
  const double t = data_.time_s[std::min(sample, data_.size() - 1)];
  const bool creeps =
      sample % (creeping_divisions * samples_per_division_) == 0 && segment_at(t - creeping_s) != segment_at(t);
  return creeps || turns_around(t);
}

// Segments are told apart by quarters of a second. A creep of 400 ug that is taken to begin 10 ms late leaves 40 um/s,
// which the position shows within a second: the end is where the rate runs out, to a millisecond.
double RecordingContext::end_of_turn(const Segment& rotation) const {
  const std::size_t n = samples_per_division_;
  std::vector<double> time, rate;  // of stretches of n samples, from the last to the first
  std::size_t last =
      std::min(data_.size(), rotation.last + static_cast<std::size_t>(turn_margin_s * data_.sample_rate_hz));
  for (; last > rotation.first + n && collect_ramp(last - n, last, time, rate); last -= n) {
  }
  const double length = static_cast<double>(n) / data_.sample_rate_hz;
  const double end = rate_runs_out(time, rate, length);
  return std::abs(end - rotation.end_s) < turn_margin_s + length ? end
                                                                 : rotation.end_s;  // a swaying base is never still
}

double RecordingContext::start_of_turn(const Segment& rotation) const {
  const std::size_t n = samples_per_division_;
  const auto margin = static_cast<std::size_t>(turn_margin_s * data_.sample_rate_hz);
  std::vector<double> time, rate;  // of stretches of n samples, from the first to the last
  std::size_t first = rotation.first > margin ? rotation.first - margin : 0;
  for (; first + n < rotation.last && collect_ramp(first, first + n, time, rate); first += n) {
  }
  const double length = static_cast<double>(n) / data_.sample_rate_hz;
  const double start = rate_runs_out(time, rate, length);
  return std::abs(start - rotation.start_s) < turn_margin_s + length ? start : rotation.start_s;
}

// Adds the stretch [first, last) to the ramp of a turn; what was not yet the ramp is forgotten. False: the ramp is whole.
bool RecordingContext::collect_ramp(std::size_t first, std::size_t last, std::vector<double>& time,
                                    std::vector<double>& rate) const {
  constexpr double least = 2e-3, most = 0.03;  // rad/s: a hundred quanta; within tenths of a second of the end
  const double w = mean_rate(first, last).norm();
  if (w > most && !rate.empty()) {
    return false;
  }
  if (w > least) {
    rate.push_back(w);
    time.push_back(0.5 * (data_.time_s[first] + data_.time_s[last - 1] - 1.0 / data_.sample_rate_hz));
  } else {
    rate.clear();
    time.clear();
  }
  return true;
}

// Mean over as much on either side of the boundary: exact while the rate rises evenly.
Vector3 RecordingContext::rate_at(std::size_t sample) const {
  if (!turns_around(data_.time_s[std::min(sample, data_.size() - 1)])) {
    return Vector3::Zero();
  }
  return mean_rate(sample > samples_per_division_ ? sample - samples_per_division_ : 0,
                   std::min(sample + samples_per_division_, data_.size()));
}

Vector3 RecordingContext::mean_rate(std::size_t first, std::size_t last) const {
  return sum_over(data_.delta_theta, first, last) * data_.sample_rate_hz / static_cast<double>(last - first);
}

EffectContext RecordingContext::of(const SensorBlock& block) const {
  EffectContext c;
  c.start_s = block.start_s - start_s_;
  c.end_s = block.end_s - start_s_;
  c.dt = block.integrals.dt;
  c.angle = block.integrals.angle;
  c.velocity = block.integrals.velocity_pos - block.integrals.velocity_neg;
  c.rate = c.angle / c.dt;
  c.force = c.velocity / c.dt;
  c.u = c.force / 9.80665;
  c.rate_change = rate_at(block.last) - rate_at(block.first);
  c.C_nb = block.C_nb;
  c.field_b = block.C_nb.transpose() * field_n_;
  c.earth_rate_b = block.C_nb.transpose() * Vector3(std::cos(data_.site.latitude), std::sin(data_.site.latitude), 0.0);
  c.duration_s = data_.time_s.back() - start_s_;
  // What creeps after a turn goes on creeping while the next one is made.
  const auto next = std::lower_bound(turns_.begin(), turns_.end(), block.end_s,
                                     [](const Turn& turn, double t) { return turn.end_s < t; });
  if (next != turns_.begin()) {
    c.since_turn_start_s = std::max(0.0, block.start_s - next[-1].end_s);
    c.since_turn_end_s = block.end_s - next[-1].end_s;
  }
  c.load_memory = &load_memory_;
  c.travel_memory = &travel_memory_;
  c.turning = next != turns_.end() && 0.5 * (block.start_s + block.end_s) > next->start_s;
  if (!data_.gimbal_outer.empty() && !data_.gimbal_inner.empty()) {
    c.outer = angle_in_the_middle(data_.gimbal_outer, block);
    c.inner = angle_in_the_middle(data_.gimbal_inner, block);
  }
  if (has_temperature()) {
    double sum = 0.0;
    for (std::size_t i = block.first; i < block.last; ++i) {
      sum += data_.temperature[i];
    }
    c.temperature = sum / static_cast<double>(block.last - block.first) - mean_temperature_;
  }
  return c;
}

}  // namespace selfcal::diagnosis
