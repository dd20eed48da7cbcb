#include "estimator/diagnosis/regression/bias_process.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

using Kind = BiasKernel::Kind;

// Squares of the size that are tried, map units: from what nothing would show to what nothing could miss.
constexpr int steps_per_decade = 8, first_decade = -4, last_decade = 8;
constexpr int sizes = (last_decade - first_decade) * steps_per_decade + 1;
// Correlation times: from what a dwell averages away to half of the recording, beyond which it is a walk.
constexpr double shortest_s = 20.0, time_ratio = 1.5;

double square_of_size(int step) { return std::pow(10.0, first_decade + static_cast<double>(step) / steps_per_decade); }

struct Places {
  std::vector<int> columns, axis;
  std::vector<double> start_s, end_s;

  double span_s() const { return end_s.empty() ? 0.0 : *std::max_element(end_s.begin(), end_s.end()); }
};

Places places_of(const std::vector<LocatedColumn>& map, int first_map_column, const std::vector<int>& axes) {
  Places p;
  for (std::size_t k = 0; k < map.size(); ++k) {
    const bool segment = map[k].kind == LocatedColumn::Kind::dwell || map[k].kind == LocatedColumn::Kind::rotation;
    if (segment && std::find(axes.begin(), axes.end(), map[k].axis) != axes.end()) {
      p.axis.push_back(map[k].axis);
      p.columns.push_back(first_map_column + static_cast<int>(k));
      p.start_s.push_back(map[k].start_s);
      p.end_s.push_back(map[k].end_s);
    }
  }
  return p;
}

// Likelihood of a kernel at every size. With K = L L^T and L^T J L = U D U^T, sizes q of score b gain
// sum of q c^2/(1 + q d) - log(1 + q d), c = U^T L^T b.
class Profile {
 public:
  Profile(const BiasKernel& kernel, const Places& places, const Normal& given) : kernel_(kernel) {
    const auto n = static_cast<Eigen::Index>(places.columns.size());
    Eigen::MatrixXd K(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
        K(i, j) = places.axis[a] != places.axis[b]
                      ? 0.0
                      : kernel.covariance(places.start_s[a], places.end_s[a], places.start_s[b], places.end_s[b]);
      }
    }
    const Eigen::MatrixXd L = K.llt().matrixL();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(L.transpose() * given.information * L);
    d_ = solver.eigenvalues().cwiseMax(0.0);
    c2_ = (solver.eigenvectors().transpose() * (L.transpose() * given.score)).cwiseAbs2();
    gain_.resize(sizes);
    for (int step = 0; step < sizes; ++step) {
      gain_(step) = twice_log_likelihood(square_of_size(step));
    }
  }

  double twice_log_likelihood(double q) const {
    const Eigen::ArrayXd grown = 1.0 + q * d_.array();
    return (q * c2_.array() / grown - grown.log()).sum();
  }

  const BiasKernel& kernel() const { return kernel_; }
  const Eigen::VectorXd& gain() const { return gain_; }
  int best() const {
    Eigen::Index at = 0;
    gain_.maxCoeff(&at);
    return static_cast<int>(at);
  }

 private:
  BiasKernel kernel_;
  Eigen::VectorXd d_, c2_, gain_;
};

std::vector<Profile> profiles_of(const Places& places, const Normal& given) {
  std::vector<Profile> all{Profile({}, places, given)};
  const double most = std::log(0.5 * places.span_s() / shortest_s) / std::log(time_ratio);
  for (int step = 0; step <= most; ++step) {
    all.push_back(Profile({Kind::instability, shortest_s * std::pow(time_ratio, step)}, places, given));
  }
  return all;
}

double in_hours(double seconds) { return seconds / units::hour; }

}  // namespace

double BiasKernel::covariance(double a0, double a1, double b0, double b1) const {
  const bool same = a0 == b0 && a1 == b1;
  if (a0 > b0) {
    std::swap(a0, b0);
    std::swap(a1, b1);
  }
  const double a = a1 - a0, b = b1 - b0;
  if (kind == Kind::random_walk) {
    return in_hours(a0 + a / (same ? 3.0 : 2.0));
  }
  const double T = correlation_s;
  if (same) {
    return 2.0 * T * T / (a * a) * (a / T + std::expm1(-a / T));
  }
  return T * T / (a * b) * std::exp(-(b0 - a1) / T) * std::expm1(-a / T) * std::expm1(-b / T);
}

double BiasProcess::log_p() const { return log_chi_squared_tail(delta_chi2, coefficients()); }

BiasProcess test_bias_process(const Evidence& evidence, const std::vector<LocatedColumn>& map, int first_map_column,
                              const std::vector<int>& axes, const std::vector<int>& others) {
  BiasProcess found;
  found.axes = axes;
  const Places places = places_of(map, first_map_column, axes);
  if (places.columns.empty()) {
    return found;
  }
  const std::vector<Profile> profiles = profiles_of(places, evidence.given(places.columns, others));
  // A walk, with one coefficient, unless an instability is better by 20:1.
  const double least_gain = 2.0 * std::log(20.0);
  const Profile* best = &profiles.front();
  double to_beat = best->gain().maxCoeff() + least_gain;
  for (const Profile& profile : profiles) {
    if (const double gain = profile.gain().maxCoeff(); gain > to_beat) {
      best = &profile;
      to_beat = gain;
    }
  }
  found.kernel = best->kernel();
  if (const double gain = best->gain().maxCoeff(); gain > 0.0) {
    found.delta_chi2 = gain;
    found.size = std::sqrt(square_of_size(best->best()));
  }
  return found;
}

}  // namespace selfcal::diagnosis
