// One pass of the calibration filter that carries the signatures of left-out effects alongside.
//
// With x the state, x^ its estimate and s theta = x - x^ the part of the error that an effect of size theta makes,
//   s <- Phi s + Gamma_effect,   nu_s = h s,   s <- s - K nu_s,
// so that innovation = nu_s theta + white (Willsky and Jones, IEEE Trans. AC-21, 1976). Divided by its predicted
// sigma, every innovation is one row of a linear regression with unit noise in which the 33 states are projected out.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "estimator/diagnosis/regression/recording_context.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal::diagnosis {

// A factor on the effect's sensor errors.
using Modulation = double (*)(const EffectContext&);

struct Candidate {
  const Effect* effect = nullptr;
  double constant = 0.0;            // NaN: none
  int first = 0, count = 0;         // columns
  Modulation modulation = nullptr;  // none: the effect as its equation says
};

// Adds the candidate's columns over one stretch, per typical size; [candidate.count] columns each, zero before. Nothing for what is
// no sensor's.
void add_signature(const Candidate& candidate, const EffectContext& context, Columns velocity, Columns angle);

std::vector<int> columns_of(const Candidate& candidate);
// Of all of them, but of that number `without`.
std::vector<int> columns_of(const std::vector<Candidate>& candidates,
                            std::size_t without = static_cast<std::size_t>(-1));

// Where a sensor's bias is off, for the map: the columns behind those of the candidates.
struct LocatedColumn {
  enum class Kind { dwell, rotation, after_turn, time } kind = Kind::dwell;
  int index = 0;                      // dwell or rotation number from 0, bin number
  int axis = 0;                       // 0..2 gyro x y z, 3..5 accelerometer x y z
  double start_s = 0.0, end_s = 0.0;  // since the turn, or since the start
};

// Rows: epoch by epoch, north, up, east. Columns in units of the typical size of the coefficient (map: 0.01 deg/h,
// 10 ug).
struct SignatureRows {
  Eigen::VectorXd residual;    // [rows], unit variance where nothing is left out
  Eigen::MatrixXd columns;     // [rows x columns]
  std::vector<double> time_s;  // [rows], middle of the interval, recording's time
  Eigen::MatrixXd shift;       // [24 x columns]: truth minus estimate of the 24 per unit column
  PassOutput pass;
};

using AngleVelocity = std::vector<std::array<double, 3>>;

// Increments from which the effects were taken out, column by column times `size`.
struct Correction {
  std::vector<Candidate> effects;
  Eigen::VectorXd size;  // [sum of counts], in typical sizes

  // `own`: one size a coefficient. An effect that is no sensor's is not in the increments.
  void add(const Effect& effect, double constant, const Eigen::VectorXd& own);
};

class SignaturePass {
 public:
  SignaturePass(const RecordingContext& context, std::vector<Candidate> candidates, bool map);

  const std::vector<Candidate>& candidates() const { return candidates_; }
  const std::vector<LocatedColumn>& map() const { return map_; }
  int first_map_column() const { return effect_columns_; }
  int count() const { return effect_columns_ + static_cast<int>(map_.size()); }

  // `input` is a forward pass; its data may be corrected increments of the same recording.
  SignatureRows run(const PassInput& input);

 private:
  const RecordingContext* context_;
  std::vector<Candidate> candidates_;
  std::vector<LocatedColumn> map_;
  int effect_columns_ = 0;
};

// Scales of the map's columns.
double map_unit(int axis);
// Subtracts the effects from increments; C_nb along the recording comes from navigating `input`.
void subtract_effects(const RecordingContext& context, const PassInput& input, const Correction& correction,
                      AngleVelocity& delta_theta, AngleVelocity& delta_v);

}  // namespace selfcal::diagnosis
