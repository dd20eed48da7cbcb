// Regressions on the means of poses. Private to this folder.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

struct Regression {
  double square = 0.0;    // of what is left
  double rounding = 0.0;  // of `square`: as much is left of equal numbers
  Eigen::Index rank = 0;
  double held_out_rms = 0.0;  // e / (1 - h)
  Eigen::VectorXd value, sigma;
};
Regression regress(const Eigen::MatrixXd& X, const Eigen::VectorXd& y);
Eigen::MatrixXd joined(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
// F test of the columns that `with` adds; 0 where rounding alone is left without them.
double log_p_of(const Regression& without, const Regression& with, Eigen::Index n);

// y = X b + random walk + white: whitens X and y by the walk of greatest restricted likelihood.
class Whitener {
 public:
  Whitener(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const std::vector<double>& time_s);
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& columns) const;

 private:
  Eigen::MatrixXd lower_;  // Cholesky factor of the covariance; empty: white
};

// With and without the columns. Of the pose an effect is asked beside a random walk, for poses that follow one another differ in time
// too; what changes with time (`of_time`) is asked beside white noise, for a walk would be its rival.
struct RowComparison {
  Regression with;
  double log_p = 0.0;
};
RowComparison compare(const Eigen::MatrixXd& known, const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                      const std::vector<double>& time_s, bool of_time);
// The same of a gyro beside the white noise of its means and a 1/f noise as large as the halves of the poses differ by beyond that: a poor
// gyro's bias wanders by it, and the lowest frequency of a few poses looks like any slow drift. Minus infinity where the halves show none.
// S(f) = h/f has the Allan variance 2 ln 2 h; means over the time a of it that lie d apart differ by 2 h (ln(d/a) + 3/2) in the square.
// With `sure` the 1/f noise is larger than that by so many of its own sigma: halves of a few poses tell its size poorly.
double log_p_beside_flicker(const std::vector<Pose>& poses, const std::vector<double>& time_s, int axis,
                            const Eigen::MatrixXd& known, const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                            double sure = 0.0);
// Sigma of what was fitted beside white noise, from column `first` on, no less than that 1/f noise makes it.
void hold_flicker(const std::vector<Pose>& poses, const std::vector<double>& time_s, int axis,
                  const Eigen::MatrixXd& columns, Eigen::Index first, Regression& r);
std::vector<double> middles(const std::vector<Pose>& poses);

// Columns of one axis' readings (or of |f|, axis 3) for one effect: [poses x coefficients], those that vanish left out.
struct Trial {
  const Effect* effect = nullptr;
  double constant = 0.0;
  Eigen::MatrixXd columns;
  std::vector<std::string> names;
};
// Adds the trial's coefficients to an effect: those behind the first `known` ones of the comparison.
void add_coefficients(const Trial& trial, const RowComparison& c, Eigen::Index known, PoseEffect& effect);
// An effect in |f|, as the comparison has it.
PoseEffect effect_in_force(const Trial& trial, const RowComparison& c, Eigen::Index known);
// d(specific force)/d(coefficient) at a pose, SI, [3 x coefficients], of an effect that changes neither with time nor with a constant.
Eigen::Matrix3Xd force_at(const Effect& effect, const Pose& pose, double duration_s);
Trial trial_of(const Effect& effect, double constant, const std::vector<Pose>& poses, double duration_s, int axis);
// Whether a pose that lasts for ever would show it.
bool changes_with_time(const Effect& effect, double duration_s, int axis);
// How many tests the grid of an effect's constant is worth: time constants that are near each other ask the same. By the
// eigenvalues of the correlation of their columns beside a constant, (sum sqrt(l))^2 / sum l (Galwey 2009).
double tests_worth(const Effect& effect, const std::vector<Pose>& poses, double duration_s, int axis);
// `has_temperature`: whether the poses have one, so that what follows it follows the channel.
bool acts_on(const Effect& effect, bool gyro, bool has_temperature);

}  // namespace selfcal::diagnosis
