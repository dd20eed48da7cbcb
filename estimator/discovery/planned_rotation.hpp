// A rotation that nobody has made yet, and what laws would do on it: signatures need no data (diagnosis/ideal_recording.hpp).
#pragma once

#include <Eigen/Core>
#include <stop_token>
#include <vector>

#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/effect_columns.hpp"
#include "estimator/geometry/schedule.hpp"

namespace selfcal::discovery {

struct ExperimentLimits {
  double duration_s = 3000.0;
  double largest_move_deg = 90.0;  // of one axis in one turn
  double rotation_s = 5.0;         // the gimbal makes the largest move in it
};

// Positions of both axes: the first, and how far apart they are.
struct Grid {
  double step_deg = 45.0, first_deg = 0.0;
};

// A walk over the positions of a grid that visits what it has not seen before where it can, within the limits. The same for
// the same seed.
Schedule walk_over_positions(const ExperimentLimits& limits, double dwell_s, unsigned seed, const Grid& grid = {});

// Nobody knows the temperature of a rotation that was not made.
bool needs_temperature(const laws::Expression& expression);

// What has columns on a rotation: the laws, per unit_of(axis), and behind them the effects' coefficients, per typical size.
struct PlannedColumns {
  std::vector<LawTerm> laws;
  std::vector<EffectTerm> effects = {};
};

// Information of the columns, the 33 states projected out. [columns x columns]
Eigen::MatrixXd information_of(const ImuData& data, const PassInput& input, const PlannedColumns& columns,
                               const std::stop_token& stop = {});
// A rotation of the unit of `like`, at its site, with its noise and its gimbal's way of turning.
class Planning {
 public:
  explicit Planning(const UnitRecording& like);

  // The same on a plan, with the vehicle in this attitude.
  Eigen::MatrixXd information(const Schedule& plan, const Attitude& vehicle, const PlannedColumns& columns,
                              const std::stop_token& stop = {}) const;

 private:
  UnitRecording like_;
  double ramp_;  // turn_ramp.hpp
};

}  // namespace selfcal::discovery
