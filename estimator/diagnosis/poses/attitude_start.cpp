#include "estimator/diagnosis/poses/attitude_start.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

struct Window {
  double from = 0.0, to = 0.0;      // stamps
  std::size_t first = 0, last = 0;  // samples
};

std::vector<Window> windows_of(const Knots& knots) {
  constexpr double shortest = 0.2, of_intervals = 2.0;
  constexpr std::size_t most = 1500;
  const double length = std::max(shortest, of_intervals * knots.interval_s);
  std::vector<Window> all;
  std::size_t first = 0;
  for (std::size_t k = 1; k < knots.all.size(); ++k) {
    if (knots.all[k].begins || knots.all[k].held) {
      first = k;
    } else if (knots.all[k].time_s - knots.all[first].time_s >= 0.99 * length) {
      all.push_back({knots.all[first].time_s, knots.all[k].time_s, knots.all[first].sample, knots.all[k].sample});
      first = k;
    }
  }
  if (all.size() > most) {
    std::vector<Window> some;
    for (std::size_t k = 0; k < most; ++k) {
      some.push_back(all[k * all.size() / most]);
    }
    return some;
  }
  return all;
}

// Least squares of the gyros on one reading.
struct LinearFit {
  double explained = -1.0, left = 0.0;  // left: square of the residuals over the degrees of freedom
  Eigen::Matrix<double, 4, 3> by = Eigen::Matrix<double, 4, 3>::Zero();  // rotation vector, time
  Matrix3 turns = Matrix3::Zero();                                       // sum of phi phi^T
  double seconds = 0.0;
  double count = 0.0;
};

LinearFit fit_at(const GyroTrack& track, const std::vector<Window>& windows, const std::vector<Vector3>& phi,
                 double delay) {
  Eigen::Matrix4d X = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 3> XY = Eigen::Matrix<double, 4, 3>::Zero();
  LinearFit fit;
  double square = 0.0;
  for (std::size_t k = 0; k < windows.size(); ++k) {
    const double from = windows[k].from - delay, to = windows[k].to - delay;
    if (from < track.time_s.front() || to > track.time_s.back()) {
      continue;
    }
    const Vector3 turned = integral_at(track, to) - integral_at(track, from);
    Eigen::Vector4d x;
    x << phi[k], to - from;
    X += x * x.transpose();
    XY += x * turned.transpose();
    square += turned.squaredNorm();
    fit.turns += phi[k] * phi[k].transpose();
    fit.seconds += to - from;
    fit.count += 1.0;
  }
  constexpr double least_share = 0.5, fewest = 20.0;
  if (fit.count < std::max(fewest, least_share * static_cast<double>(windows.size()))) {
    return fit;
  }
  Eigen::Matrix4d ridged = X;
  ridged.diagonal().array() += 1e-9 * X.trace();
  fit.by = ridged.ldlt().solve(XY);
  const double residual = square - 2.0 * fit.by.cwiseProduct(XY).sum() + fit.by.cwiseProduct(X * fit.by).sum();
  const double constant = XY.row(3).squaredNorm() / X(3, 3);
  fit.explained = 1.0 - residual / std::max(square - constant, 1e-300);
  fit.left = std::max(residual, 0.0) / (3.0 * fit.count);
  return fit;
}

struct Lagged {
  LinearFit fit;
  double delay = 0.0;
};

Lagged best_lag(const GyroTrack& track, const std::vector<Window>& windows, const std::vector<Vector3>& phi,
                double middle, double reach, double step) {
  Lagged best;
  const int steps = static_cast<int>(std::lround(reach / step));
  for (int k = -steps; k <= steps; ++k) {
    const double delay = middle + k * step;
    const LinearFit fit = fit_at(track, windows, phi, delay);
    if (fit.explained > best.fit.explained) {
      best = {fit, delay};
    }
  }
  return best;
}

// Windows about which gyros and attitude agree: where tracking jumps or stands still they do not.
std::vector<std::size_t> agreeing(const GyroTrack& track, const std::vector<Window>& windows,
                                  const std::vector<Vector3>& phi, const Lagged& at) {
  std::vector<double> off;
  for (std::size_t k = 0; k < windows.size(); ++k) {
    const double from = windows[k].from - at.delay, to = windows[k].to - at.delay;
    Eigen::Vector4d x;
    x << phi[k], to - from;
    off.push_back((integral_at(track, to) - integral_at(track, from) - at.fit.by.transpose() * x).norm());
  }
  std::vector<double> sorted = off;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  constexpr double far = 10.0;
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < windows.size(); ++k) {
    if (off[k] <= far * *middle) {
      kept.push_back(k);
    }
  }
  return kept;
}

// The finer search, once more without what disagrees.
Lagged refined(const GyroTrack& track, const std::vector<Window>& windows, const std::vector<Vector3>& phi,
               const Lagged& coarse, double half) {
  constexpr double fine = 20.0;
  Lagged first = best_lag(track, windows, phi, coarse.delay, half, half / fine);
  std::vector<Window> some;
  std::vector<Vector3> some_phi;
  double kept = 0.0, all = 0.0;
  for (const std::size_t k : agreeing(track, windows, phi, first)) {
    some.push_back(windows[k]);
    some_phi.push_back(phi[k]);
    kept += phi[k].squaredNorm();
  }
  for (const Vector3& turn : phi) {
    all += turn.squaredNorm();
  }
  constexpr double most_turns = 0.7;  // rests always agree
  if (kept < most_turns * all) {
    return first;
  }
  const Lagged second = best_lag(track, some, some_phi, first.delay, half, half / fine);
  return second.fit.explained > 0.0 ? second : first;
}

// W and the directions of g that turns reach. What they do not reach is a rotation's, and stays so.
void set_response(const LinearFit& fit, AttitudeModel& model, Vector3& turned) {
  const Matrix3 A = fit.by.topRows<3>().transpose();
  model.bias = fit.by.row(3).transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(fit.turns);
  const double gain2 = std::max(1e-300, (A * eigen.eigenvectors().col(2)).squaredNorm());
  constexpr double enough = 0.02;  // relative sigma of the response to turns about an axis
  Eigen::Index axes = 0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double square = std::max(0.0, eigen.eigenvalues()(2 - k));
    turned(k) = std::sqrt(square * fit.count) * fit.seconds / std::max(fit.seconds, 1e-300);
    axes += fit.left / gain2 < enough * enough * square ? 1 : 0;
  }
  axes = std::max<Eigen::Index>(axes, 1);
  const Eigen::MatrixXd E = eigen.eigenvectors().rowwise().reverse().leftCols(axes);
  const Eigen::MatrixXd response = A * E;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(response, Eigen::ComputeFullU | Eigen::ComputeFullV);
  model.seen = svd.matrixU().leftCols(axes);
  if (axes == 3) {
    model.W = A.inverse();
    return;
  }
  Matrix3 from = Matrix3::Identity(), to = Matrix3::Identity();
  from.leftCols(axes) = E;
  to.leftCols(axes) = svd.matrixU().leftCols(axes) * svd.matrixV().transpose();
  const Eigen::JacobiSVD<Eigen::MatrixXd> whole(E, Eigen::ComputeFullU);
  from.rightCols(3 - axes) = whole.matrixU().rightCols(3 - axes);
  to.rightCols(3 - axes) = svd.matrixU().rightCols(3 - axes);
  if (from.determinant() < 0.0) {
    from.col(2) = -from.col(2);
  }
  if (to.determinant() < 0.0) {
    to.col(2) = -to.col(2);
  }
  const double gain = svd.singularValues().mean();
  Matrix3 image = gain * to;
  image.leftCols(axes) = response;
  model.W = (image * from.transpose()).inverse();
}

}  // namespace

AttitudeStart find_start(const GyroTrack& track, const ReferenceAttitude& attitude, const Knots& knots) {
  AttitudeStart start;
  const std::vector<Window> windows = windows_of(knots);
  constexpr std::size_t fewest = 20;
  if (windows.size() < fewest) {
    start.failure =
        std::to_string(knots.all.size()) + " values of the attitude that follow each other closely: too few";
    return start;
  }
  constexpr double longest_lag = 60.0, of_duration = 0.25, half = 0.1;
  const double reach = std::min(longest_lag, of_duration * (track.time_s.back() - track.time_s.front()));
  std::vector<Lagged> all;
  for (const AttitudeReading& reading : attitude.readings) {
    std::vector<Vector3> phi;
    phi.reserve(windows.size());
    for (const Window& w : windows) {
      phi.push_back(rotation_vector(reading.q_rm[w.first].conjugate() * reading.q_rm[w.last]));
    }
    const Lagged coarse = best_lag(track, windows, phi, 0.0, reach, half);
    all.push_back(coarse.fit.explained < 0.0 ? coarse : refined(track, windows, phi, coarse, half));
  }
  const auto best = std::max_element(
      all.begin(), all.end(), [](const Lagged& a, const Lagged& b) { return a.fit.explained < b.fit.explained; });
  start.explained = best->fit.explained;
  constexpr double least = 0.5, as_good = 1.1;
  if (start.explained < least) {
    start.failure = best->fit.count == 0.0 ? "too little of it lies within the log's time"
                    : start.explained < 0.0
                        ? "too few of its turns lie within the log's time"
                        : "the gyros follow " + std::to_string(std::lround(100.0 * start.explained)) +
                              " % of its turns at best, in whatever order and direction its columns are read";
    return start;
  }
  // The likeliest reading of those that fit no worse.
  for (std::size_t k = all.size(); k-- > 0;) {
    if (all[k].fit.explained > 0.0 && all[k].fit.left <= as_good * best->fit.left) {
      start.as_well.push_back(k);
      start.reading = k;
    }
  }
  std::erase(start.as_well, start.reading);
  const Lagged& chosen = all[start.reading];
  start.model.delay_s = chosen.delay;
  set_response(chosen.fit, start.model, start.turned);
  return start;
}

}  // namespace selfcal::diagnosis
