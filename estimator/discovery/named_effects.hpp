// The recordings of a unit without the effects that the diagnosis of each named: what discovery is to look at beside them.
#pragma once

#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/regression/corrected_recording.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/joint_fit.hpp"

namespace selfcal::discovery {

// How much an effect is seen: its sizes' square in sigmas.
double square_of(const diagnosis::ModelEffect& effect);
// Whether a random walk or an instability of a bias is named. It follows any slow curve, and may be a law that no catalogue holds.
bool names_process(const diagnosis::Diagnosis& diagnosis);

// A recording and what the catalogue says of it. Both must outlive it.
struct DiagnosedRecording {
  const ImuData& data;
  const diagnosis::Diagnosis& diagnosis;
};

// Recordings of one unit, less what was named, calibrated anew. Of one recording an effect is taken out as it was named; of several,
// as fitted together (joint_fit.hpp) on all of them that can hold it, whether they named it or not. Beside one recording its coefficients
// are unknown still: its size was fitted where no law was. Several recordings tell them by themselves. Where the catalogue explains some of the
// recordings and leaves another unexplained, only what all of them name is taken out: a name that one recording gives may stand for the law
// that the other one lacks, and one unit has one physics. Motions of the base and noise stay: they are in the calibrations.
class UnexplainedRest {
 public:
  // The failure is that of a calibration, or "stopped". What `unit` refers to must outlive this.
  static tl::expected<UnexplainedRest, std::string> of(std::span<const DiagnosedRecording> unit,
                                                       const std::stop_token& stop = {});

  std::span<const UnitRecording> recordings() const { return recordings_; }
  // Of the catalogue, each once.
  const std::vector<const diagnosis::Effect*>& taken_out() const { return taken_out_; }
  // Those of sensors, as they were taken out of each recording.
  const std::vector<UnitEffect>& effects() const { return start_.effects; }

  // What was taken out fitted anew beside these laws, all of it together on all recordings. Failures as above.
  tl::expected<JointFit, std::string> beside(const std::vector<LawTerm>& laws, const Eigen::VectorXd& coefficient,
                                             const std::stop_token& stop = {}) const;

 private:
  std::vector<std::unique_ptr<diagnosis::CorrectedRecording>> corrected_;
  std::vector<std::unique_ptr<CalibrationResult>> calibrations_;
  std::vector<std::vector<EffectTerm>> beside_;  // [recordings]
  std::vector<UnitRecording> recordings_;
  std::vector<const diagnosis::Effect*> taken_out_;
  std::vector<JointRecording> unit_;
  JointStart start_;  // the effects
};

}  // namespace selfcal::discovery
