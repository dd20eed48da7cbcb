// Forward selection over the catalogue, with a refit about the corrected recording after every step.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/diagnosis/chosen.hpp"
#include "estimator/diagnosis/form.hpp"
#include "estimator/diagnosis/linear_model.hpp"
#include "estimator/diagnosis/locate.hpp"
#include "estimator/diagnosis/selection.hpp"

namespace selfcal::diagnosis {

class Naming {
 public:
  // `input`: forward pass about the calibrated recording. `log_threshold`: of corrected p-values.
  Naming(const RecordingContext& context, PassInput input, double log_threshold);

  void run(const std::function<void(const std::string&)>& progress, const std::stop_token& stop = {});

  const std::vector<Chosen>& chosen() const { return chosen_; }
  const std::vector<WalkTest>& walks() const { return walks_; }
  // Best variant of every effect not chosen, given what is.
  std::vector<Suspect> suspects() const;
  // Every effect of the catalogue with the z that a typical size would give, nothing else fitted.
  const std::vector<Suspect>& prospects() const { return prospects_; }

  const Map& map_before() const { return map_before_; }
  Map map_after() const;
  // The same by gimbal angles, directions and temperature (quantities.hpp); takes no part in any verdict. One more pass.
  struct ByQuantity {
    std::vector<Located> before, after;
  };
  ByQuantity locate_by_quantities() const;
  const std::vector<InnovationLine>& lines_before() const { return lines_before_; }
  double square_before() const { return square_before_; }
  double square_after() const;
  double rows() const { return model_.evidence().rows; }
  // As filtered, beside what is named.
  const NoiseModel& noise() const { return point_.input.noise; }
  // Of one test's p, not corrected: as many independent ones as the catalogue and the walks count for share the rate.
  double log_p_limit() const { return log_threshold_ - std::log(independent_tests()); }
  double log_p_white_before() const { return white_before_; }
  double log_p_white_after() const;
  // Two effects chosen of which the one can stand for half of the other and more: together they describe a curve, and are no
  // explanation of it.
  bool entangled() const;
  // Of the biases that dwells, rotations, times since a turn and times of the recording still show, axis by axis: the
  // smallest p, corrected. A single one is the map's; this is what many together leave. `log_p_named`: where what is named
  // makes at least as much as is left (a walk: anywhere in its triad); 0: nowhere.
  struct Structure {
    double log_p_named = 0.0, log_p_elsewhere = 0.0;
    double log_p() const { return std::min(log_p_named, log_p_elsewhere); }
  };
  Structure structure() const;
  double log_p_structure() const { return structure().log_p(); }
  // Of slow curves that drifts as named leave on their axes, and of functions of the gimbal angles that gyro drifts
  // with the attitude leave on theirs: the smallest p, corrected. What is named after its likeness leaves some.
  double log_p_likeness() const { return log_p_likeness_; }
  // What the named effects differ from their equations by; the tests of what remains are made given it.
  const OpenForms& forms() const { return forms_; }
  // Share of the misfit, with the effects as named taken out of nothing, that a square is.
  double share_of_misfit(double square) const { return square / std::max(1.0, evidence().square - evidence().rows); }
  // Where the forms show: the map with the effects as equations alone.
  Map map_without_forms() const {
    return locate(evidence(), model_.map(), model_.first_map_column(), chosen_columns());
  }
  // The 24 as a mean over all explanations, and with the effects as named.
  ParameterVector value() const;
  ParameterVector value_as_named() const;
  ParameterMatrix covariance() const;

 private:
  const Evidence& evidence() const { return model_.evidence(); }
  std::vector<int> chosen_columns(std::size_t without = static_cast<std::size_t>(-1)) const;
  void refit();
  Correction correction() const;
  void linearise();
  void relinearise();
  std::vector<double> gains_around(const Chosen& chosen, double step);
  void refine_constant(Chosen& chosen);
  bool add_best();
  bool drop_weak();
  bool fell(const Candidate& candidate) const;
  bool open(const Candidate& candidate) const;
  bool exchange();
  void sharpen_observation();
  void refit_noise();
  double log_likelihood_as_named(const PassInput& input) const;
  void append_constants();
  void append_forms();
  bool drop_weak_walk();
  double largest_square(int triad) const;
  bool within_form(const WalkTest& walk) const;
  bool immaterial(const Candidate& candidate, const GroupTest& test) const;
  ParameterMatrix covariance_of_closed_forms() const;
  void size_forms();
  // Normal equations with the forms marginalised.
  const Evidence& given_forms() const { return forms_.empty() ? evidence() : given_forms_; }
  void test_likenesses();
  double test_leftover(const Chosen& chosen, const std::vector<Candidate>& beside);
  void average();
  void judge();
  double independent_tests() const;
  bool names(const Effect& effect) const;
  Significance significance() const;
  std::vector<Candidate> terms() const;

  const RecordingContext& context_;
  double log_threshold_;
  double effective_tests_ = 1.0;  // of the catalogue on this recording
  OperatingPoint point_;
  std::vector<Candidate> candidates_;  // those of the catalogue, chosen ones with their constants
  LinearModel model_;                  // of the candidates and the map
  std::vector<FormFamily> families_;   // columns of the model, for the effects as chosen
  OpenForms forms_;
  Evidence given_forms_;
  std::vector<Chosen> chosen_;
  std::vector<Candidate> fallen_;  // chosen once, too weak beside others
  std::vector<WalkTest> walks_;
  std::vector<Suspect> prospects_;
  Map map_before_;
  std::vector<InnovationLine> lines_before_;
  double square_before_ = 0.0, white_before_ = 0.0;
  ParameterVector averaged_ = ParameterVector::Zero();  // what the effects shift the 24 by, mean of all explanations
  ParameterMatrix spread_ = ParameterMatrix::Zero();    // its covariance
  double log_p_likeness_ = 0.0;
};

}  // namespace selfcal::diagnosis
