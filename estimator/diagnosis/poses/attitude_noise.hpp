// Noise of an attitude held against gyros: equation (A3) of attitude.hpp. Private to this folder.
//
// One axis of r: e_k+1 = e_k + N sqrt(dt) w_k, delta_k+1 = a delta_k + s sqrt(1 - a^2) v_k, z_k = e_k + delta_k. Innovations of its Kalman filter are
// white. Each piece without a gap begins with e unknown.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimator/diagnosis/poses/attitude_rows.hpp"

namespace selfcal::diagnosis {

struct AttitudeNoise {
  double walk_psd = 0.0;  // N^2, rad^2/s
  double variance = 1.0;  // s^2, rad^2
  double keeps = 0.0;     // a, over `interval_s`
  double interval_s = 1.0;
};

// The scalar part: gains and variance, step by step.
class LevelFilter {
 public:
  explicit LevelFilter(const AttitudeNoise& noise) : noise_(noise) { begin(); }
  void begin();
  struct Step {
    double keeps = 0.0;               // of delta, from the stamp before
    double level = 0.0, error = 0.0;  // gains
    double variance = 0.0;            // of the innovation
  };
  Step predict(double length_s);
  void update(const Step& step);

 private:
  AttitudeNoise noise_;
  double P11_ = 0.0, P12_ = 0.0, P22_ = 0.0;
};

// Which rows end in a value that is used. A value that is not leaves e to be predicted.
using Used = std::vector<bool>;

// Innovations of the rows, and their variance.
struct Innovations {
  std::vector<Vector3> value;
  std::vector<double> variance;
};
Innovations innovations_of(const std::vector<AttitudeRow>& rows, const Used& used, const AttitudeNoise& noise);

// Of the greatest likelihood.
AttitudeNoise fit_noise(const std::vector<AttitudeRow>& rows, const Used& used, double interval_s);

// The same with the gyros' noise times FACTOR beside that of the attitude, and the scale of both of the greatest likelihood.
struct WeighedNoise {
  AttitudeNoise noise;
  double log_likelihood = 0.0;
};
WeighedNoise beside(const AttitudeNoise& noise, double factor, const std::vector<AttitudeRow>& rows, const Used& used);

// Information about parameters of which SIZE columns a row has: whitened normal equations, and the score of each of 40 equal parts of the rows.
struct AttitudeInformation {
  Eigen::MatrixXd H;
  Eigen::VectorXd h;
  Eigen::MatrixXd scores;  // [columns x parts]
};
class RowColumns {
 public:
  virtual ~RowColumns() = default;
  virtual Eigen::Index size() const = 0;
  // Derivatives of what the gyros turned in the row, [3 x size].
  virtual void fill(const AttitudeRow& row, Eigen::Ref<Eigen::MatrixXd> columns) const = 0;
};
AttitudeInformation information_of(const std::vector<AttitudeRow>& rows, const Used& used, const AttitudeNoise& noise,
                                   const RowColumns& columns);

}  // namespace selfcal::diagnosis
