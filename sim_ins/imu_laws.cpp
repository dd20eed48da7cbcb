// Laws on the true motion: variables, expressions, processes.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "estimator/geometry/units.hpp"
#include "sim_ins/imu_simulator.hpp"

namespace selfcal::sim {
namespace {

constexpr std::uint64_t first_law_stream = 100;  // of random numbers, one a law
// A drive that misses its position by a degree has not turned.
constexpr double least_turn = 5.0 * units::degree;
constexpr double before_any_turn_s = 1e9;

void add_to_axis(int axis, double value, Vector3& gyro, Vector3& accel) {
  (axis < 3 ? gyro : accel)[axis % 3] += value;
}

}  // namespace

Expected<void> ImuSimulator::take(const Law& law, std::uint64_t seed) {
  if (law.uses_temperature && !config_.temperature.recorded) {
    return fail(ErrorKind::bad_input,
                "law: \"" + law.expression + "\" needs a temperature channel: temperature.recorded");
  }
  ActiveLaw active{law, {}, {}, 0.0, Random(seed, first_law_stream + laws_.size())};
  if (law.process == LawProcess::none) {
    auto evaluator = LawEvaluator::compile(law.expression);
    if (!evaluator) {
      return tl::unexpected(evaluator.error());
    }
    active.evaluator.push_back(std::move(*evaluator));
  }
  active.jumps.assign(motion_.gimbal().moves().size() + 1, 0.0);
  if (law.process == LawProcess::jump_per_turn) {  // the first dwell keeps the bias that it has
    std::generate(active.jumps.begin() + 1, active.jumps.end(),
                  [&] { return law.coefficient * active.random.normal(); });
  }
  if (law.process == LawProcess::line) {
    Line line{Vector3::Zero(), Vector3::Zero(), 2.0 * std::numbers::pi * law.frequency_hz,
              active.random.uniform(0.0, 2.0 * std::numbers::pi)};
    add_to_axis(law.axis, law.coefficient, line.domega, line.df);
    lines_.push_back(line);
  }
  laws_.push_back(std::move(active));
  return {};
}

void ImuSimulator::prepare_laws() {
  const std::vector<GimbalMove>& moves = motion_.gimbal().moves();
  senses_.assign(1, {0.0, 0.0});
  for (const GimbalMove& move : moves) {
    std::array<double, 2> sense = senses_.back();
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double turned = move.to[axis] - move.from[axis];
      sense[axis] = std::abs(turned) < least_turn ? sense[axis] : (turned > 0.0 ? 1.0 : -1.0);
    }
    senses_.push_back(sense);
  }
  // The last dwell is taken to be as long as the first.
  const double end_s = moves.empty() ? 0.0 : moves.back().end_s() + moves.front().start_s;
  constexpr int points = 1000;
  for (int k = 0; k < points; ++k) {
    mean_temperature_c_ += temperature_at(config_.temperature, end_s * (k + 0.5) / points) / points;
  }
}

LawVariables ImuSimulator::law_variables_at(double t, const MotionState& state) const {
  constexpr double standard_gravity = 9.80665;
  constexpr double difference_s = 0.5;  // of the temperature's rate, central
  const GimbalMotion& gimbal = motion_.gimbal();
  const GimbalState angles = gimbal.at(t);
  LawVariables v;
  v.f = state.f_ib_b / standard_gravity;
  v.omega = state.omega_ib_b / units::degree;
  v.outer = angles.angle[0];
  v.inner = angles.angle[1];
  v.outer_rate = angles.rate[0] / units::degree;
  v.inner_rate = angles.rate[1] / units::degree;
  v.t_h = t / units::hour;
  const double since = gimbal.since_move_end(t);
  v.since_s = since < 0.0 ? before_any_turn_s : since;
  v.rest_s = gimbal.turning(t, t) ? 0.0 : v.since_s;
  const auto begun = static_cast<std::size_t>(gimbal.last_move(t) + 1);
  v.n = static_cast<double>(begun);
  v.outer_sense = senses_[begun][0];
  v.inner_sense = senses_[begun][1];
  v.temperature = temperature_at(config_.temperature, t) - mean_temperature_c_;
  v.temperature_rate = (temperature_at(config_.temperature, t + difference_s) -
                        temperature_at(config_.temperature, std::max(0.0, t - difference_s))) /
                       (difference_s + std::min(t, difference_s)) * 60.0;
  return v;
}

void ImuSimulator::add_laws(double t, const MotionState& state, SensorDeviation& deviation) {
  const LawVariables variables = law_variables_at(t, state);
  for (ActiveLaw& active : laws_) {
    double value = active.jumps[static_cast<std::size_t>(variables.n)] + active.walk;
    if (!active.evaluator.empty()) {
      value = active.law.coefficient * active.evaluator.front()(variables);
    }
    add_to_axis(active.law.axis, value, deviation.domega, deviation.df);
  }
}

void ImuSimulator::add_law_noise(IdealIncrement& increment, double h) {
  for (ActiveLaw& active : laws_) {
    if (active.law.process == LawProcess::random_walk) {
      active.walk += active.law.coefficient * std::sqrt(h) * active.random.normal();
    } else if (active.law.process == LawProcess::white) {
      add_to_axis(active.law.axis, active.law.coefficient * std::sqrt(h) * active.random.normal(),
                  increment.delta_theta, increment.delta_v);
    }
  }
}

}  // namespace selfcal::sim
