// Regressions on the means of poses. Private to this folder.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

struct Regression {
  double square = 0.0;
  Eigen::Index rank = 0;
  double held_out_rms = 0.0;  // e / (1 - h)
  Eigen::VectorXd value, sigma;
};
Regression regress(const Eigen::MatrixXd& X, const Eigen::VectorXd& y);
Eigen::MatrixXd joined(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
// F test of the columns that `with` adds.
double log_p_of(const Regression& without, const Regression& with, Eigen::Index n);

// y = X b + random walk + white: whitens X and y by the walk of greatest restricted likelihood.
class Whitener {
 public:
  Whitener(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const std::vector<double>& time_s);
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& columns) const;

 private:
  Eigen::MatrixXd lower_;  // Cholesky factor of the covariance; empty: white
};

// Columns of one axis' readings (or of |f|, axis 3) for one effect: [poses x coefficients], those that vanish left out.
struct Trial {
  const Effect* effect = nullptr;
  double constant = 0.0;
  Eigen::MatrixXd columns;
  std::vector<std::string> names;
};
Trial trial_of(const Effect& effect, double constant, const std::vector<Pose>& poses, double duration_s, int axis);
// Whether a pose that lasts for ever would show it.
bool changes_with_time(const Effect& effect, double duration_s, int axis);
// How many tests the grid of an effect's constant is worth: time constants that are near each other ask the same. By the
// eigenvalues of the correlation of their columns beside a constant, (sum sqrt(l))^2 / sum l (Galwey 2009).
double tests_worth(const Effect& effect, const std::vector<Pose>& poses, double duration_s, int axis);
bool acts_on(const Effect& effect, bool gyro);

}  // namespace selfcal::diagnosis
