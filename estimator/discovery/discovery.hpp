// Physics that no catalogue holds, written down as laws: found, fitted, held out, with all that explains it as well.
//
// README.md derives the search: wide and cheap over the pieces of the recording, few candidates exactly.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/effect_columns.hpp"
#include "estimator/discovery/law_fit.hpp"
#include "estimator/discovery/process.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal::discovery {

struct DiscoveryOptions {
  double false_alarm_rate = 0.004;  // of a whole recording, over all functions, axes and processes
  double departure_rate = 0.01;     // of laws of the true form that are described only, for they seem to depart from it
  int most_terms = 6;
  double least_odds = 0.01;  // of a member of a class against the best
  bool coloured =
      false;  // the sensors' quantum colours the innovations: of what the laws leave whiteness is not judged
  std::stop_token stop;
};

// Another expression of a function. The 24 beside it may differ: fy*cos(inner)**2 is fy less fy*sin(inner)**2, and fy is a misalignment.
struct OtherWords {
  std::string expression;
  double odds = 0.0;  // as in ClassMember
  bool only_here =
      false;  // no rotation tells them apart as long as the base stands as it does; another attitude of it would
};

struct ClassMember {
  std::string expression;
  int axis = 0;
  double odds = 0.0;             // of this function against the one that is reported, 1 for that
  std::vector<OtherWords> also;  // no rotation tells them apart (carry_over.hpp); `odds` holds theirs
};

struct Constant {
  std::string name, unit;
  double value = 0.0, sigma = 0.0;
};

struct DiscoveredLaw {
  LawTerm term;
  std::string
      effect;  // of the catalogue, named and rejected for what else is there, that makes the same (kept_names.hpp)
  std::string expression;                 // constants as numbers
  double coefficient = 0.0, sigma = 0.0;  // in unit_of(axis)
  std::vector<Constant> constants;
  double significance = 0.0;     // sigma, after correction for all that was tried
  double gain = 0.0;             // fall of the residuals' square
  double held_out_gain = 0.0;    // log-likelihood on dwells and rotations left out in turn
  double share = 0.0;            // of the misfit beyond noise
  double stability = 0.0;        // share of draws of three quarters of the dwells and rotations in which it, or what
                                 // cannot be told from it, explains most
  double departure_log_p = 0.0;  // that a true form departs as far (departure.hpp), the logarithm
  std::string departs_with;      // the quantity where it departs most
  bool in_step = false;          // a wave over the time that keeps step with the turns (step_with_turns.hpp)
  double lack_log_p = 0.0;       // that its axis, all laws on it true, leaves as much (lack_of_fit.hpp), the logarithm
  double overlap = 0.0;       // share of what the laws of its axis gain together that none gains alone (known_form.hpp)
  double carries_over = 0.0;  // probability that it leaves at most a tenth of the misfit on a plan never used
  std::string why;            // it is described only, the end of a sentence (known_form.hpp); empty: it is told
  bool unsure = false;        // described only because it more probably fails there than not (known_form.hpp)
  std::vector<ClassMember> ambiguous;  // what this recording cannot tell from it, itself included, simplest first
};

struct DiscoveredProcess {
  ProcessKind kind = ProcessKind::jump_per_turn;
  int axis = 0;
  double size = 0.0, sigma = 0.0;  // unit_of(axis), per sqrt(h) for a walk
  double log_likelihood_gain = 0.0;
  double ahead = 0.0;  // of the other kind's on the axis: logarithm of the odds between the two
};

// What explains the recordings in the place of all that is told: a walk may stand for a drift, and laws added up for a walk.
struct OtherExplanation {
  struct Law {
    int axis = 0;
    std::string expression;
  };
  std::vector<Law> laws;
  std::vector<DiscoveredProcess> processes;
  double odds = 0.0;  // against what is told, 1 at most
};

// The 24 over all equations that the recordings leave open (class_average.hpp).
struct ClassAverage {
  std::vector<ParameterVector> parameters;  // [recordings] SI, what is shared imposed
  std::vector<ParameterMatrix> covariance;  // [recordings], with the spread between the members
};

// What a recording shows without the laws that are told.
struct Left {
  diagnosis::Adequacy adequacy;
  std::vector<diagnosis::Located> places, by_quantity;  // largest first
};

struct Discovery {
  std::vector<DiscoveredLaw> laws;  // best first
  // Equations whose axis does something else still (known_form.hpp). The axis' form is none of them, and on another plan they
  // may be far off. The fit holds them too. Where they are too many, or beside a process, their class is not looked at: it is
  // the equation alone, and `carries_over` and `stability` are 0.
  std::vector<DiscoveredLaw> described;
  std::vector<DiscoveredProcess> processes;
  std::optional<OtherExplanation> instead;         // of odds of DiscoveryOptions::least_odds or better
  double misfit_before = 0.0, misfit_after = 0.0;  // squares of the residuals beyond their number
  double rows = 0.0;
  double log_determinant = 0.0;     // of the innovations' covariance
  double cost_of_processes = 0.0;   // twice minus the logarithm of their probability, with what their freedom costs
  double log_p_remaining = 0.0;     // of the best function that was not taken, corrected for all that was tried
  std::string refused;              // the best function that did not predict what was left out; empty: none
  std::size_t functions_tried = 0;  // functions times axes
  LawFit fit;                       // of the laws in the order in which they were found, with the 24 of each recording
  ClassAverage average;             // empty where nothing is told or described
  std::optional<Left>
      left;  // of the first recording, by what is told; beside a process none where something is only described
};

// One recording of the unit that is looked at. Both must outlive it.
struct UnitRecording {
  const ImuData& data;
  const CalibrationResult& calibration;  // that of the 24 alone (diagnosis/still_calibration.hpp) of `data`
  // Effects whose coefficients are unknown beside the 24, as they were taken out of `data`: projected out of all that is searched and fitted.
  std::span<const EffectTerm> beside = {};
};

using Progress = std::function<void(const std::string&)>;

// Recordings of one unit, one or more: a law has one coefficient and one set of constants in all of them, each recording has
// its own 24, attitude, site and noise (shared_parameters.hpp asks what of the 24 is common). Only variables that all of them
// have are looked at.
Discovery discover(std::span<const UnitRecording> recordings, const DiscoveryOptions& options,
                   const Progress& progress = {});

// The same in two steps, for who may have no use for the second one, which takes most of the time.
class LawSearch {
 public:
  // Laws and processes as fitted: `fit`, `processes`, misfits. `laws` and `described` are empty. `recordings` must outlive this.
  LawSearch(std::span<const UnitRecording> recordings, const DiscoveryOptions& options, const Progress& progress = {});
  LawSearch(LawSearch&&) noexcept;
  ~LawSearch();
  const Discovery& fitted() const;

  // What is told of them: classes, stability, the 24 over the classes. Once.
  Discovery told();

 private:
  class Search;
  std::unique_ptr<Search> search_;
};

}  // namespace selfcal::discovery
