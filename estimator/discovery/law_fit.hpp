// Laws fitted exactly: signatures propagated through the filter, constants that the laws are not linear in refined.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/diagnosis/regression/corrected_recording.hpp"
#include "estimator/discovery/column_pass.hpp"
#include "estimator/discovery/effect_columns.hpp"
#include "estimator/discovery/law_motion.hpp"
#include "estimator/laws/expression.hpp"

namespace selfcal::discovery {

// One law: a sensor axis puts out coefficient * expression too much, in unit_of(axis).
struct LawTerm {
  int axis = 0;
  laws::Expression expression;
  std::vector<double> constants;  // of its `?`
  // The first constant is fitted within these: beyond them the kernel is a constant, or a polynomial with a large coefficient.
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();

  bool at_its_limit() const { return !constants.empty() && !(constants.front() > least && constants.front() < most); }
};

// Of the same form on the same axis, whatever their constants are.
bool same_law(const LawTerm& a, const LawTerm& b);

// One recording that laws are fitted to. All must outlive it; `table` and `trace` are those of a pass with this input, a
// forward pass about the calibrated recording.
struct LawRecording {
  const LawMotion& motion;
  const NodeTable& table;
  const PassInput& input;
  const PassTrace& trace;
  std::span<const EffectTerm> beside = {};  // projected out: UnitRecording
};

// The 24 of one recording with the laws, SI.
struct FittedRecording {
  ParameterVector parameters = ParameterVector::Zero();
  ParameterMatrix covariance = ParameterMatrix::Zero();        // that of the laws included
  ParameterMatrix covariance_alone = ParameterMatrix::Zero();  // were the laws known
  Eigen::MatrixXd shift;  // [24 x (terms + constants)] by what the 24 follow coefficients and constants
};

struct LawFit {
  std::vector<LawTerm> terms;   // with refined constants
  Eigen::VectorXd coefficient;  // [terms] in unit_of(axis)
  Eigen::MatrixXd covariance;   // [terms + constants], constants behind the coefficients in the order of the terms
  double square_before = 0.0, square_after = 0.0, rows = 0.0;
  std::vector<double> gain;       // [terms] fall of the square by each, the others fitted
  std::vector<double> collinear;  // [terms] share of the information that the other terms and constants take, 0 to 1
  std::vector<double> held_out_gain;  // [terms] log-likelihood on dwells and rotations left out in turn
  std::vector<FittedRecording> recordings;
};

// What turns a constant's derivative into the column of the constant: its term's coefficient. [terms + constants]
Eigen::VectorXd column_scale(const std::vector<LawTerm>& terms, const Eigen::VectorXd& coefficient);

// Columns of the terms, each with the derivative with respect to each of its constants behind all of them.
class LawColumns : public ColumnSource {
 public:
  // `table` is that of a pass with the same input: its nodes are those of this pass's stretches.
  LawColumns(const LawMotion& motion, const NodeTable& table, const std::vector<LawTerm>& terms, bool derivatives);
  int count() const override { return count_; }
  int active(double /*time_s*/) const override { return count_; }
  bool block_ends_before(std::size_t sample) const override { return motion_.context().divides(sample); }
  void block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
             Eigen::Ref<Eigen::Matrix3Xd> angle) override;

 private:
  const LawMotion& motion_;
  const NodeTable& table_;
  std::vector<int> axes_;      // of the columns
  Eigen::ArrayXXd integrals_;  // [nodes x columns] value times dt, SI
  int count_;
  std::size_t next_ = 0;  // node
};

// Coefficients and constants common to all recordings, each with 33 states of its own. Gauss-Newton in the constants, at
// most `rounds`.
LawFit fit_laws(std::span<const LawRecording> recordings, std::vector<LawTerm> terms, int rounds,
                const std::stop_token& stop = {});

struct SingleFit {
  double gain = 0.0;         // fall of the residuals' square
  double coefficient = 0.0;  // in unit_of(axis)
  double variance = 0.0;     // of the coefficient, the alternative's constants known
  double left = 0.0;         // share of its information that the given ones leave, 0 to 1
};

enum class GivenConstants { known, free };

// Each of the alternatives alone beside `given`, from one pass over each recording; its constants as they are, those of `given`
// as they are or, linearised, free.
std::vector<SingleFit> fit_each(std::span<const LawRecording> recordings, const std::vector<LawTerm>& given,
                                const std::vector<LawTerm>& alternatives, const std::stop_token& stop = {},
                                GivenConstants given_constants = GivenConstants::known);

// The recording less the laws, stretch by stretch, each spread evenly over its samples.
diagnosis::CorrectedRecording without_laws(const LawMotion& motion, const NodeTable& table, const PassInput& input,
                                           const std::vector<LawTerm>& terms, const Eigen::VectorXd& coefficient);

}  // namespace selfcal::discovery
