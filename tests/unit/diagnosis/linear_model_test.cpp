// A recording without noise in which an accelerometer creeps: linearised, corrected, linearised again.
#include "estimator/diagnosis/regression/linear_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal::diagnosis {
namespace {

const Effect& creep() {
  for (const Effect& e : catalogue()) {
    if (e.id == "accel_relaxation") {
      return e;
    }
  }
  ADD_FAILURE() << "no creep in the catalogue";
  return catalogue().front();
}

constexpr double tau_s = 35.0;

// Perfect sensors but for a creep of 1.5 typical sizes, 75 ug, on z.
class CreepingRecording : public testing::Test {
 protected:
  CreepingRecording() : ideal_(*named_schedule("horizontal", 60.0, 5.0), {0.02, -0.03, 0.6}, {0.7, 0.2, 0.0}, 50.0) {
    input_.C_nb = ideal_.C_nb_start();
    input_.noise.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
    input_.noise.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
    input_.noise.observation.sigma = 3e-6;
    input_.prior.parameter_sigma = 2.0 * plausible_limit();
    Correction added;
    added.add(creep(), tau_s, -size_);
    creeping_ = CorrectedRecording(RecordingContext(ideal_.data()), input_, added);
  }

  LinearModel about(const RecordingContext& context, const OperatingPoint& point, double constant = tau_s) const {
    return LinearModel::about(context, point, {{}, {}, input_.noise}, {{&creep(), constant, constant}}, true);
  }

  IdealRecording ideal_;
  PassInput input_;
  Eigen::VectorXd size_ = Eigen::Vector3d(0.0, 0.0, 1.5);
  CorrectedRecording creeping_;
};

// The signature is linear in the size to the second order of the creep, 75 ug against 1 g, and of what it turns the attitude by:
// parts in a thousand.
constexpr double linear_to = 5e-3;

TEST_F(CreepingRecording, HasTheSizeThatWasPutIn) {
  const RecordingContext context(creeping_.data());
  const LinearModel model = about(context, {input_, CorrectedRecording(creeping_.data())});
  const Eigen::VectorXd found = model.evidence().fit({0, 1, 2}).value;
  EXPECT_NEAR(found(2), 1.5, 1.5 * linear_to);
  EXPECT_NEAR(found(0), 0.0, 1.5 * linear_to);
}

// What was taken out counts as still in: half of the creep out of the increments, and the whole of it in the equations. What
// explains the rest is the other half.
TEST_F(CreepingRecording, TakenOutOfTheIncrementsStaysInTheEquations) {
  const RecordingContext context(creeping_.data());
  Term half;
  half.effect = &creep();
  half.tried = half.constant = tau_s;
  half.amplitude = 0.5 * size_;
  const OperatingPoint whole{input_, CorrectedRecording(creeping_.data())};
  const OperatingPoint settled = settle(context, whole, {{half}, {}, input_.noise});
  const LinearModel model = about(context, settled);
  EXPECT_NEAR(model.evidence().fit({0, 1, 2}).value(2), 1.5, 1.5 * linear_to);
  // Beside what the recording made here leaves by itself (its velocity increments are those of each sample's middle).
  const RecordingContext perfect(ideal_.data());
  const Eigen::VectorXd own = about(perfect, {input_, CorrectedRecording(ideal_.data())}).rows().residual;
  const Eigen::VectorXd all = about(context, whole).rows().residual - own;
  EXPECT_NEAR((model.rows().residual - own).norm() / all.norm(), 0.5, linear_to);
  EXPECT_NEAR((model.residual() - own).norm() / all.norm(), 1.0, linear_to);
  // Another constant's column is another column: what was taken out keeps its own.
  const LinearModel beside = about(context, settled, 2.0 * tau_s);
  EXPECT_EQ(beside.alternatives().size(), 1U);
  EXPECT_NEAR(beside.residual().norm(), model.residual().norm(), linear_to * model.residual().norm());
}

// A value: a copy outlives what it was made from.
TEST_F(CreepingRecording, OwnsItsIncrements) {
  CorrectedRecording copy;
  std::array<double, 3> last{};
  {
    const RecordingContext context(ideal_.data());
    Correction out;
    out.add(creep(), tau_s, size_);
    const CorrectedRecording made(context, input_, out);
    copy = made;
    last = made.data().delta_v.back();
  }
  EXPECT_EQ(copy.data().delta_v.back(), last);
  EXPECT_NE(copy.data().delta_v.data(), ideal_.data().delta_v.data());
  EXPECT_EQ(copy.data().time_s.data(), ideal_.data().time_s.data());
  EXPECT_EQ(copy.taken_out().effects.size(), 1U);
  const CorrectedRecording nothing(RecordingContext(ideal_.data()), input_, {});
  EXPECT_EQ(nothing.data().delta_v.data(), ideal_.data().delta_v.data());
}

// Read-outs that come 60 ms before the gyros end each turn as much too early. What the clock of the turn before says in those 60 ms is no
// time after this one: of dwells of 58 s none is 60 s after its turn.
TEST(Places, NoDwellIsAsLongAfterItsTurnAsTheTurnBefore) {
  const IdealRecording ideal(*named_schedule("horizontal", 58.0, 5.0), {0.02, -0.03, 0.6}, {0.7, 0.2, 0.0}, 50.0);
  constexpr std::size_t early = 3;  // samples
  ImuData data = ideal.data();
  std::vector<double> outer(data.gimbal_outer.begin(), data.gimbal_outer.end());
  std::vector<double> inner(data.gimbal_inner.begin(), data.gimbal_inner.end());
  for (std::vector<double>* angle : {&outer, &inner}) {
    std::rotate(angle->begin(), angle->begin() + early, angle->end());
    std::fill(angle->end() - early, angle->end(), *(angle->end() - early - 1));
  }
  data.gimbal_outer = outer;
  data.gimbal_inner = inner;
  PassInput input;
  input.data = &data;
  input.C_nb = ideal.C_nb_start();
  input.noise.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
  input.noise.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
  input.noise.observation.sigma = 3e-6;
  input.prior.parameter_sigma = 2.0 * plausible_limit();
  const RecordingContext context(data);
  SignaturePass pass(context, {}, true);
  const SignatureRows rows = pass.run(input);
  int late = 0, sooner = 0;
  for (std::size_t k = 0; k < pass.map().size(); ++k) {
    const LocatedColumn& m = pass.map()[k];
    const double norm = rows.columns.col(static_cast<Eigen::Index>(k)).norm();
    if (m.kind == LocatedColumn::Kind::after_turn && m.start_s >= 60.0) {
      EXPECT_EQ(norm, 0.0) << m.axis;
      ++late;
    } else if (m.kind == LocatedColumn::Kind::after_turn) {
      EXPECT_GT(norm, 0.0);
      ++sooner;
    }
  }
  EXPECT_EQ(late, 6);
  EXPECT_EQ(sooner, 24);
}

}  // namespace
}  // namespace selfcal::diagnosis
