// The rotation that would tell the laws of a class apart: planned before anything turns.
//
// With z_A the whitened signature of the law as found and z_B that of a rival, the rival fitted in its place leaves a misfit
// of |z_A|^2 - (z_A . z_B)^2 / |z_B|^2, summed over the recording and the planned one: the square of the separation in sigma.
// A planned recording needs no data for that (diagnosis/ideal_recording.hpp). Half the square is the expected logarithm of
// the odds. The plan is taken that most probably leaves one member, and of those the shortest (plan_search.hpp); where no rotation would,
// one that would together with a second one alike.
#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/planned_rotation.hpp"

namespace selfcal::discovery {

struct NextExperiment {
  Schedule schedule;
  double separation_now =
      0.0;  // sigma, of the rival that stands behind most of what the plan tells, on the recordings alone
  double separation = 0.0;  // with the planned one
  double log_odds = 0.0;    // expected, of the law against that rival
  std::string closest;      // that rival, an equation or an effect of the catalogue
};

// The plan that tells most apart, given the recordings that there are. None where the class has one member, or no plan helps. The base stands as in the last recording.
std::optional<NextExperiment> plan_experiment(std::span<const UnitRecording> recordings, const DiscoveredLaw& law,
                                              const ExperimentLimits& limits, const std::stop_token& stop = {});

// The plan that most probably excludes what is not true: the names of the diagnosis, or the laws that explain the recording in their place
// (Diagnosis::instead). None where there are none, where something follows the temperature, or where no plan helps.
std::optional<NextExperiment> plan_against_names(const UnitRecording& recording, const diagnosis::Diagnosis& diagnosis,
                                                 const ExperimentLimits& limits, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
