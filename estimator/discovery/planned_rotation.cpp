#include "estimator/discovery/planned_rotation.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/diagnosis/turn_ramp.hpp"

namespace selfcal::discovery {
namespace {

constexpr double planning_rate_hz = 10.0;

}  // namespace

Schedule walk_over_positions(const ExperimentLimits& limits, double dwell_s, unsigned seed, const Grid& grid) {
  std::mt19937 engine(seed);  // the standard fixes its bits; no distribution of the standard is used
  const auto below = [&engine](int n) { return static_cast<int>(engine() % static_cast<unsigned>(n)); };
  const int reach = static_cast<int>(limits.largest_move_deg / grid.step_deg);
  Schedule plan;
  plan.rotation_s = limits.rotation_s;
  GimbalPosition at{grid.first_deg, grid.first_deg};
  const auto count = static_cast<std::size_t>(std::max(3.0, limits.duration_s / (dwell_s + limits.rotation_s)));
  while (plan.positions.size() < count) {
    plan.positions.push_back(at);
    plan.dwell_s.push_back(dwell_s);
    GimbalPosition next = at;
    for (int tries = 0; tries < 20; ++tries) {
      next = {at.outer_deg + grid.step_deg * (below(2 * reach + 1) - reach),
              at.inner_deg + grid.step_deg * (below(2 * reach + 1) - reach)};
      const bool moves = next.outer_deg != at.outer_deg || next.inner_deg != at.inner_deg;
      const bool within = std::abs(next.outer_deg) <= 360.0 && std::abs(next.inner_deg) <= 360.0;
      const bool seen = std::any_of(plan.positions.begin(), plan.positions.end(), [&](const GimbalPosition& p) {
        return p.outer_deg == next.outer_deg && p.inner_deg == next.inner_deg;
      });
      if (moves && within && !seen) {
        break;
      }
      next = moves && within ? next : at;
    }
    at = next;
  }
  return plan;
}

bool needs_temperature(const laws::Expression& expression) {
  return expression.variables().test(static_cast<std::size_t>(laws::Variable::T)) ||
         expression.variables().test(static_cast<std::size_t>(laws::Variable::dT));
}

Eigen::MatrixXd information_of(const ImuData& data, const PassInput& input, const PlannedColumns& columns,
                               const std::stop_token& stop) {
  const diagnosis::RecordingContext context(data);
  const LawMotion motion(context);
  const NodeTable table = collect_nodes(motion, input);
  LawColumns laws(motion, table, columns.laws, false);
  EffectColumns effects(context, columns.effects);
  TwoSources both(laws, effects);
  return run_columns(input, trace_pass(input, stop), both, stop).information;
}

Planning::Planning(const UnitRecording& like) : like_(like), ramp_(diagnosis::turn_ramp(like.data)) {}

Eigen::MatrixXd Planning::information(const Schedule& plan, const Attitude& vehicle, const PlannedColumns& columns,
                                      const std::stop_token& stop) const {
  const diagnosis::IdealRecording ideal(plan, vehicle, like_.data.site, planning_rate_hz, ramp_);
  PassInput input = diagnosis::forward_pass(ideal.data(), like_.calibration);
  input.parameters.setZero();
  input.C_nb = ideal.C_nb_start();
  return information_of(ideal.data(), input, columns, stop);
}

}  // namespace selfcal::discovery
