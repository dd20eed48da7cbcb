// Strapdown navigation over the update intervals of a recording, forward or in reverse, with the linearised error
// model of each interval.
//
// The reference is the base at rest at its site: at each update epoch the computed position and velocity are put back
// to it, exactly, because what they had drifted is handed on as `drive`. Attitude is integrated from the gyros.
// Equations (N1)-(N6) of estimator/README.md.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>

#include "estimator/models/imu_data.hpp"
#include "estimator/models/sensor_model.hpp"
#include "estimator/navigation/error_dynamics.hpp"

namespace selfcal {

// A stretch inside an interval in which b turned by less than about 3 mrad.
struct SensorBlock {
  std::size_t first = 0, last = 0;  // samples [first, last)
  double start_s = 0.0, end_s = 0.0;
  SensorIntegrals integrals;           // compensated, in b at the middle
  Matrix3 C_nb = Matrix3::Identity();  // at the middle
};

// Sensor errors beyond the 24: signatures that are to be propagated as further constant parameters.
class ExtraSignatures {
 public:
  virtual ~ExtraSignatures() = default;
  virtual int count() const = 0;
  // Whether no block may hold both this sample and the one before: a signature counts as spread evenly over its block.
  virtual bool block_ends_before(std::size_t /*sample*/) const { return false; }
  // Integrals over the block of d(df)/d(parameter) [3 x count] m/s and d(dw)/d(parameter) [3 x count] rad, in b.
  virtual void block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
                     Eigen::Ref<Eigen::Matrix3Xd> angle) = 0;
};

struct Interval {
  double start_s = 0.0, end_s = 0.0;  // chronological, start < end
  double length_s = 0.0;
  double sign = 1.0;                               // +1 forward, -1 reverse
  std::size_t first = 0, last = 0;                 // samples [first, last)
  Vector3 f_n;                                     // mean specific force, m/s^2
  Vector3 angle_b;                                 // integral of the compensated rate, b (no commutation), rad
  Matrix9 Phi;                                     // of the navigation states
  Eigen::Matrix<double, 9, Eigen::Dynamic> Gamma;  // [9 x (24 + extra)]
  Vector9 drive;  // minus the drift of the computed position and velocity, zero attitude
  // Samples without observation: position and velocity start anew at its end, which Phi, Gamma and drive say already.
  bool coasted = false;
  int turned = -1;  // number of the coast that begins here and opens the attitude
};

// Where the sensitivities to force come from. Of the accelerometers' output they hold its noise: beside a quantum of
// millimetres a second a scale factor then fits the noise itself (errors in variables). Gravity through the attitude
// has none, and is all the force there is on a still base.
enum class ForceSource { accelerometers, gravity };

class IntervalNavigator {
 public:
  // C_nb: attitude at the start (forward) or at the end (reverse) of the recording. `data` and `extra` must outlive
  // the navigator.
  IntervalNavigator(const ImuData& data, const ParameterVector& parameters, const Matrix3& C_nb, double sign,
                    double interval_s, ExtraSignatures* extra = nullptr,
                    ForceSource force = ForceSource::accelerometers);

  // Navigates the next interval; false at the end of the data.
  bool next(Interval& interval);

  // Attitude where the navigation stands now.
  Matrix3 C_nb() const { return q_nb_.toRotationMatrix(); }
  const SiteModel& site() const { return site_; }

 private:
  struct Moments;
  void sample(std::size_t index, double length, Moments& m, Interval& interval);
  const Coast* coast_at(std::size_t index) const;
  void coast(const Coast& coast, std::size_t index, double length, Moments& m, Interval& interval);
  void close_block(Moments& m, double length);
  void finish(const Moments& m, Interval& interval);
  double sample_dt(std::size_t index) const;
  void load(std::size_t index);

  const ImuData& data_;
  SensorCompensation compensation_;
  SiteModel site_;
  Eigen::Quaterniond q_nb_;
  double sign_;
  std::size_t samples_per_interval_;
  std::size_t done_ = 0;  // samples navigated so far
  ExtraSignatures* extra_;
  ForceSource force_;
  Vector3 previous_angle_ = Vector3::Zero(), previous_velocity_ = Vector3::Zero();  // of the sample before, in time
  Vector3 angle_ = Vector3::Zero(), velocity_ = Vector3::Zero();
  std::size_t loaded_ = static_cast<std::size_t>(-1);
};

}  // namespace selfcal
