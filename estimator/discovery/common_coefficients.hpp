// Which coefficients of one effect several recordings share. The data decide.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "estimator/discovery/joint_gaussian.hpp"

namespace selfcal::discovery {

// A coefficient of an effect that two recordings do not share.
struct UnsharedCoefficient {
  int coefficient = 0;                   // of the effect's parameters; their number: the constant
  std::size_t recording = 0;             // against the first that has it
  double difference = 0.0, sigma = 0.0;  // typical sizes; of a constant, of its logarithm
};

// Where in a vector of unknowns each recording has the coefficient.
struct CoefficientPlaces {
  std::vector<std::size_t> recordings;
  std::vector<Eigen::Index> places;

  void add(std::size_t recording, Eigen::Index place) {
    recordings.push_back(recording);
    places.push_back(place);
  }
};

struct CommonCoefficients {
  double log_p = 0.0;        // of "all are the same in all recordings", the logarithm; 0 where one recording has them
  std::vector<bool> common;  // [coefficients]
  std::vector<UnsharedCoefficient> differing;  // of those that are not common, each recording against the first
};

// Common and imposed on `all`: all coefficients where that passes at `rate`; else those that pass once the ones that contradict it
// most have been set free one by one.
CommonCoefficients decide_common(const std::vector<CoefficientPlaces>& coefficients, JointGaussian& all,
                                 double rate = 0.01);

}  // namespace selfcal::discovery
