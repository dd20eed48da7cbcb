// How strongly a concealed effect shows, at best: the generator's own bound, from the simulation alone.
//
// Two noise-free simulations, with the effect and without, are run through one pass of the calibration filter about
// the truth. The filter is linear, so the difference of the normalised innovations is the effect's mean in unit white
// noise with the 33 states projected out: its length is the effect's size over the least standard deviation of its
// coefficient (the Cramer-Rao bound with direction and constants known). The difference of the final states is what
// the omission does to the 24. The same with one run per coefficient, D the differences of the innovations and S those
// of the 24 per unit, gives the bound of the augmented model: P + S (D'D + V^-1)^-1 S', V what is known of the sizes.
#pragma once

#include <vector>

#include "estimator/geometry/schedule.hpp"
#include "estimator/models/sensor_model.hpp"
#include "estimator/passes/pass.hpp"
#include "protocol/error.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/physics.hpp"

namespace selfcal::blind {

struct Response {
  double sigmas = 0.0;                              // size over the bound of its sigma
  ParameterVector shift = ParameterVector::Zero();  // SI: what the estimates of the 24 move by
  ParameterVector sigma = ParameterVector::Zero();  // SI: bound of the 24, effect not fitted
};

// A direction of the augmented model: (plus - minus) / step, whose size is known beforehand to be 0 +-prior.
struct Column {
  sim::ConcealedPhysics plus, minus;
  double step = 1.0;
  double prior = 1.0;
  double plus_warm_up_s = 0.0, minus_warm_up_s = 0.0;  // time constants of the block's temperature; 0: as configured
};

// One installation, schedule and seed without physics, and what any physics changes. `config` with its noise as the
// filter's; the base must be still but for the physics.
class Filtered {
 public:
  [[nodiscard]] static Expected<Filtered> make(const sim::SimConfig& config, const Schedule& schedule,
                                               std::uint64_t seed);
  [[nodiscard]] Expected<Response> response(const sim::ConcealedPhysics& physics) const;
  // Sigmas of physics that the columns with sizes of their own leave unexplained.
  [[nodiscard]] Expected<double> unlike(const sim::ConcealedPhysics& physics, const std::vector<Column>& columns) const;
  // Bound of the 24 (SI) of a filter that also estimates the sizes of all columns.
  [[nodiscard]] Expected<ParameterVector> augmented_sigma(const std::vector<Column>& columns) const;

 private:
  struct Difference {
    Eigen::VectorXd innovation;  // normalised
    ParameterVector shift;
  };
  struct Design {
    Eigen::MatrixXd D, S;  // one column each: of innovations, of the 24
  };
  Expected<Design> design(const std::vector<Column>& columns) const;
  Expected<Difference> difference(const sim::ConcealedPhysics& physics, double warm_up_s = 0.0) const;
  ParameterMatrix covariance() const;

  sim::SimConfig assumed_, quiet_;  // with the noise that the filter assumes; without any
  Schedule schedule_;
  std::uint64_t seed_ = 0;
  ParameterVector truth_;
  Matrix3 C_nb_;
  PassOutput without_;
};

}  // namespace selfcal::blind
