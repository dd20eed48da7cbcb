#include "estimator/diagnosis/poses/pose_data.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/poses/pose_drift.hpp"
#include "estimator/diagnosis/poses/pose_student.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::array<std::pair<int, int>, 6> free_elements = {{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
using Nine = Eigen::Matrix<double, 9, 1>;

// Where the fit begins, with sigma of it.
AccelModel assumed(const PoseInput& input, const std::vector<Pose>& poses) {
  AccelModel m;
  Vector3 low = poses.front().accel, high = low;
  for (const Pose& p : poses) {
    low = low.cwiseMin(p.accel);
    high = high.cwiseMax(p.accel);
  }
  const bool nominal = input.accel_unit > 0.0;
  m.nominal = nominal;
  m.gravity_sigma = nominal ? input.gravity_sigma / input.gravity : 0.0;
  m.raw_per_g = nominal ? input.gravity / input.accel_unit : 0.5 * (high - low).maxCoeff();
  m.T = Matrix3::Identity() / m.raw_per_g;
  const bool about_zero = nominal && input.accel_zero_known;
  m.bias = about_zero ? Vector3(Vector3::Zero()) : Vector3(0.5 * (low + high));
  constexpr double nominal_bias = 0.2, nominal_scale = 0.1, raw_bias = 0.3, raw_scale = 0.3;
  m.before << Vector3::Constant((about_zero ? nominal_bias : raw_bias) * m.raw_per_g),
      Vector3::Constant((nominal ? nominal_scale : raw_scale) / m.raw_per_g),
      Vector3::Constant(misalignment_before / m.raw_per_g);
  // An axis along which gravity hardly moves shows in |f| by its square alone, and would take on what is anything else's: its
  // bias, scale and misalignments stay what they are assumed to be.
  constexpr double reached = 0.5, held = 1e-6;  // of g, and of sigma before
  m.held.setConstant(false);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (high(axis) - low(axis) < reached * m.raw_per_g) {
      m.held(axis) = m.held(3 + axis) = true;
      for (std::size_t j = 3; j < free_elements.size(); ++j) {
        m.held(3 + static_cast<Eigen::Index>(j)) |= free_elements[j].first == axis || free_elements[j].second == axis;
      }
    }
  }
  m.open = m.before;
  m.before = m.held.select(held * m.before, m.before);
  return m;
}

void linearise(const std::vector<Pose>& poses, AccelModel& m) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  m.residual.resize(n);
  m.jacobian.resize(n, 9);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vector3 u = m.direction(poses[static_cast<std::size_t>(k)].accel);
    const Vector3 e = u.normalized();
    // Of the direction alone: with the reading's own size the columns would hold the residual, and a test could take noise for an effect.
    const Vector3 d = (poses[static_cast<std::size_t>(k)].accel - m.bias) / u.norm();
    m.residual(k) = m.weight(k) * (u.norm() - 1.0);
    m.jacobian.block<1, 3>(k, 0) = -m.weight(k) * (e.transpose() * m.T);
    for (std::size_t j = 0; j < free_elements.size(); ++j) {
      m.jacobian(k, 3 + static_cast<Eigen::Index>(j)) =
          m.weight(k) * e(free_elements[j].first) * d(free_elements[j].second);
    }
  }
}

Nine values_of(const AccelModel& m) {
  Nine x;
  x.head<3>() = m.bias;
  for (std::size_t j = 0; j < free_elements.size(); ++j) {
    x(3 + static_cast<Eigen::Index>(j)) = m.T(free_elements[j].first, free_elements[j].second);
  }
  return x;
}

void move(AccelModel& m, const Nine& step) {
  m.bias += step.head<3>();
  for (std::size_t j = 0; j < free_elements.size(); ++j) {
    m.T(free_elements[j].first, free_elements[j].second) += step(3 + static_cast<Eigen::Index>(j));
  }
}

// Along an axis that gravity hardly reaches |f| is quadratic and a whole step oversteps: halved until it goes down.
void descend(const std::vector<Pose>& poses, const Nine& start, double noise, const Nine& step, AccelModel& m) {
  const auto cost = [&](const AccelModel& model) {
    return (values_of(model) - start).cwiseQuotient(m.before).squaredNorm() +
           model.residual.squaredNorm() / (noise * noise);
  };
  const double now = cost(m);
  constexpr int halvings = 10;
  for (int k = 0; k < halvings; ++k) {
    AccelModel moved = m;
    move(moved, std::ldexp(1.0, -k) * step);
    linearise(poses, moved);
    if (cost(moved) <= now) {
      m = moved;
      return;
    }
  }
}

// What the halves of the poses differ by: noise of a mean, slow noise included. The change of a pose is no noise of the next.
double noise_of_means(const AccelModel& m, const std::vector<Pose>& poses) {
  double square = 0.0;
  for (const Pose& p : poses) {
    const double half = m.direction(p.accel).normalized().dot(m.T * p.accel_half);
    square += half * half;
  }
  return std::sqrt(square / static_cast<double>(poses.size()));
}

// What the halves differ by beyond white noise: bias that wanders, or warms up, and goes on from pose to pose. Means of a table have no halves.
double slow_of_means(const AccelModel& m, const std::vector<Pose>& poses) {
  double square = 0.0;
  for (const Pose& p : poses) {
    const Vector3 along = m.T.transpose() * m.direction(p.accel).normalized();
    const double half = along.dot(p.accel_half), white = along.cwiseProduct(p.accel_white).squaredNorm();
    square += white > 0.0 ? half * half - white : 0.0;
  }
  return std::sqrt(std::max(0.0, square) / static_cast<double>(poses.size()));
}

// Of |u|, by what the quantum hides of the poses' means.
double hidden_of_means(const AccelModel& m, const std::vector<Pose>& poses) {
  double square = 0.0;
  for (const Pose& p : poses) {
    square += (m.T.transpose() * m.direction(p.accel).normalized()).cwiseProduct(p.accel_hidden).squaredNorm();
  }
  return std::sqrt(square / static_cast<double>(poses.size()));
}

// Variance of a pose's |u|: what the poses scatter by, and the white noise of its own mean. Both beside those of a usual pose.
Eigen::VectorXd weights_of(const AccelModel& m, const std::vector<Pose>& poses, double noise) {
  Eigen::VectorXd white(static_cast<Eigen::Index>(poses.size()));  // variances
  for (Eigen::Index k = 0; k < white.size(); ++k) {
    const Pose& p = poses[static_cast<std::size_t>(k)];
    const Vector3 along = m.T.transpose() * m.direction(p.accel).normalized();
    white(k) = along.cwiseProduct(p.accel_white).squaredNorm();
  }
  std::vector<double> sorted(white.begin(), white.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double others = std::max(0.0, noise * noise - *middle);
  return ((others + *middle) / (others + white.array()).max(1e-300)).sqrt().min(1.0);
}

}  // namespace

AccelModel fit_accelerometers(const PoseInput& input, const std::vector<Pose>& poses) {
  AccelModel m = assumed(input, poses);
  const Nine start = values_of(m);
  const auto n = static_cast<double>(poses.size());
  double noise = 1e-3;
  m.weight = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(poses.size()));
  for (int round = 0; round < 30; ++round) {
    linearise(poses, m);
    // In units of what is assumed before, one observation of the noise's size has the weight of the prior's one.
    const Eigen::MatrixXd J = m.jacobian * m.before.asDiagonal() / noise;
    const Eigen::Matrix<double, 9, 9> data = J.transpose() * J;
    const Eigen::Matrix<double, 9, 9> normal = data + Eigen::Matrix<double, 9, 9>::Identity();
    const Nine off = (start - values_of(m)).cwiseQuotient(m.before);
    const Eigen::LLT<Eigen::Matrix<double, 9, 9>> solver(normal);
    const Nine step = solver.solve(-J.transpose() * m.residual / noise + off);
    m.sigma = Nine(solver.solve(Eigen::Matrix<double, 9, 9>::Identity()).diagonal()).cwiseSqrt().cwiseProduct(m.before);
    m.free = n - solver.solve(data).trace();
    descend(poses, start, noise, step.cwiseProduct(m.before), m);
    const double seen = std::sqrt(m.residual.squaredNorm() / std::max(1.0, m.free));
    constexpr double least = 1e-7;  // of g
    m.noise_of_means = std::hypot(noise_of_means(m, poses), hidden_of_means(m, poses));
    noise = std::max(least, std::max(m.noise_of_means, m.free >= least_freedom ? seen : 0.0));
    m.weight = weights_of(m, poses, noise);
  }
  linearise(poses, m);
  // Few residuals are small by chance. Where none shows it, 1/f noise is between poses a few times what it is inside them.
  constexpr double times = 3.0;
  const double told = m.free >= least_freedom
                          ? student_widening(m.free) * std::sqrt(m.residual.squaredNorm() / m.free)
                          : std::hypot(noise, std::sqrt(times * times - 1.0) * slow_of_means(m, poses));
  m.sigma = (m.sigma * std::max(1.0, told / noise)).cwiseMin(m.before);
  if (m.free < least_freedom) {
    hold_drift(poses, m);
  }
  m.open = m.held.select(m.open, m.sigma);
  return m;
}

AccelModel AccelModel::moved_by(Eigen::Index parameter, double step) const {
  AccelModel moved = *this;
  Nine steps = Nine::Zero();
  steps(parameter) = step;
  move(moved, steps);
  return moved;
}

std::vector<PoseParameter> parameters_of(const AccelModel& m) {
  constexpr std::array<const char*, 9> names = {"bias_x",          "bias_y",          "bias_z",
                                                "scale_x",         "scale_y",         "scale_z",
                                                "misalignment_xy", "misalignment_xz", "misalignment_yz"};
  // Errors of the sensor as it is: u = T (a - b), so a = T^-1 u + b. Each sigma by the element's own alone, to first order.
  const Matrix3 M = (m.T * m.raw_per_g).inverse();
  const Nine x = values_of(m);
  std::vector<PoseParameter> all;
  for (Eigen::Index k = 0; k < 9; ++k) {
    PoseParameter p;
    p.name = names[static_cast<std::size_t>(k)];
    p.determined = !m.held(k) && m.sigma(k) < 0.5 * m.before(k);
    p.value = x(k);
    p.sigma = m.sigma(k);
    p.unit = "raw";
    if (k >= 3) {
      const auto [i, j] = free_elements[static_cast<std::size_t>(k - 3)];
      const bool scale = i == j, per_g = scale && !m.nominal;
      // In counts that nobody gave a scale a misalignment is the angle of its axis, a part of this axis's own scale factor.
      const double unit = per_g ? m.raw_per_g : scale || m.nominal ? 1.0 : 1.0 / M(i, i);
      p.value = unit * M(i, j) - (scale && m.nominal ? 1.0 : 0.0);
      p.sigma = unit * M(i, i) * M(j, j) * m.sigma(k) * m.raw_per_g;
      if (scale && m.nominal) {
        p.sigma = std::hypot(p.sigma, m.gravity_sigma);
      }
      p.unit = per_g ? "raw/g" : "1";
    }
    all.push_back(p);
  }
  return all;
}

double gravity_span_deg(const std::vector<Pose>& poses) {
  double least = 1.0;
  for (const Pose& a : poses) {
    for (const Pose& b : poses) {
      least = std::min(least, a.u.normalized().dot(b.u.normalized()));
    }
  }
  return std::acos(std::clamp(least, -1.0, 1.0)) / units::degree;
}

Vector3 median_of_axes(const std::vector<Vector3>& all) {
  Vector3 medians;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values(all.size());
    std::transform(all.begin(), all.end(), values.begin(), [axis](const Vector3& one) { return one(axis); });
    medians(axis) = median(std::move(values));
  }
  return medians;
}

Vector3 variance_of_turn(const PoseInput& input, const Pose& from, const Pose& to) {
  const double length_s = input.time_s[to.first] - input.time_s[from.last - 1];
  const Vector3 early = from.gyro_white.cwiseAbs2(), late = to.gyro_white.cwiseAbs2();
  return 0.5 * (early * from.length_s + late * to.length_s) * length_s + 0.25 * (early + late) * length_s * length_s;
}

}  // namespace selfcal::diagnosis
