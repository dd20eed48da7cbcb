// How far a law whose form is not known moves the 24 without a trace in what they leave.
#pragma once

#include <Eigen/Core>
#include <span>

#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/law_motion.hpp"
#include "estimator/models/sensor_model.hpp"

namespace selfcal::discovery {

// 1 sigma of each of the 24, SI; 0 on axes on which nothing is described. What the described equations of an axis do beside its parameters (the
// part that shows) is the size of the law at each time; its sign is not known. The parameters, fitted by least squares over the time, move
// farthest where the law always has the sign that moves them. A law that is nearly one of them moves it farther still: nothing bounds that.
ParameterVector absorbed(const NodeTable& table, std::span<const DiscoveredLaw> described);

}  // namespace selfcal::discovery
