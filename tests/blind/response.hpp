// How strongly a concealed effect shows, at best: the generator's own bound, from the simulation alone.
//
// Two noise-free simulations, with the effect and without, are run through one pass of the calibration filter about
// the truth. The filter is linear, so the difference of the normalised innovations is the effect's mean in unit white
// noise with the 33 states projected out: its length is the effect's size over the least standard deviation of its
// coefficient (the Cramer-Rao bound with direction and constants known). The difference of the final states is what
// the omission does to the 24.
#pragma once

#include "estimator/models/sensor_model.hpp"
#include "protocol/error.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/physics.hpp"
#include "estimator/geometry/schedule.hpp"

namespace selfcal::blind {

struct Response {
  double sigmas = 0.0;        // size over the bound of its sigma
  ParameterVector shift;      // SI: what the estimates of the 24 move by
  ParameterVector sigma;      // SI: bound of the 24, effect not fitted
};

// `config` with its noise as the filter's; the base must be still but for the physics.
[[nodiscard]] Expected<Response> response_to(const sim::SimConfig& config, const Schedule& schedule,
                                             std::uint64_t seed, const sim::ConcealedPhysics& physics);

}  // namespace selfcal::blind
