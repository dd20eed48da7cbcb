#include "estimator/diagnosis/data_axes.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/rotation.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

std::string number(const char* format, double a, double b = 0.0, double c = 0.0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

// ---- axes that are signed permutations of the right ones

// Measured axis i is sign[i] times true axis of[i].
struct AxisOrder {
  std::array<int, 3> of{0, 1, 2};
  std::array<int, 3> sign{1, 1, 1};

  Vector3 truth(const Vector3& measured) const {
    Vector3 v;
    for (std::size_t i = 0; i < 3; ++i) {
      v(of[i]) = sign[i] * measured(static_cast<Eigen::Index>(i));
    }
    return v;
  }
  Matrix3 matrix() const {   // measured = matrix * truth
    Matrix3 m = Matrix3::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
      m(static_cast<Eigen::Index>(i), of[i]) = sign[i];
    }
    return m;
  }
  bool right() const { return of == AxisOrder{}.of && sign == AxisOrder{}.sign; }
  bool ordered() const { return of == AxisOrder{}.of; }

  std::string words() const {
    std::string text;
    for (std::size_t i = 0; i < 3; ++i) {
      if (of[i] != static_cast<int>(i) || sign[i] < 0) {
        text += std::string(text.empty() ? "" : ", ") + "xyz"[i] + " gives " + (sign[i] < 0 ? "-" : "") + "xyz"[of[i]];
      }
    }
    return text;
  }
};

std::vector<AxisOrder> all_orders() {
  std::vector<AxisOrder> all;
  AxisOrder order;
  do {
    for (int signs = 0; signs < 8; ++signs) {
      for (std::size_t i = 0; i < 3; ++i) {
        order.sign[i] = (signs >> i) & 1 ? -1 : 1;
      }
      all.push_back(order);
    }
  } while (std::next_permutation(order.of.begin(), order.of.end()));
  return all;
}

DataFault wrong_order(const std::string& triad, const AxisOrder& order, const std::string& evidence, std::size_t samples) {
  return {order.ordered() ? "wrong_sign" : "wrong_axes", triad + ": " + order.words() + evidence, 0, samples};
}

// ---- gyros against the gimbal

struct Turns {
  Matrix3 measured;            // M: measured turn = M * the gimbal's, along b
  Matrix3 seen;                // projection on the directions about which it turned
};

std::optional<Turns> turns_against_gimbal(const ImuData& data, const std::vector<Segment>& segments) {
  Matrix3 cross = Matrix3::Zero(), normal = Matrix3::Zero();
  for (const Segment& s : segments) {
    if (!s.rotation || s.first == 0 || s.last >= data.size()) {
      continue;
    }
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    for (std::size_t i = s.first; i < s.last; ++i) {
      q = q * quaternion_from_rotation_vector(Eigen::Map<const Vector3>(data.delta_theta[i].data()));
    }
    const Matrix3 from = gimbal_matrix(data.gimbal_outer[s.first - 1], data.gimbal_inner[s.first - 1]);
    const Matrix3 to = gimbal_matrix(data.gimbal_outer[s.last], data.gimbal_inner[s.last]);
    const Vector3 expected = rotation_vector_from_matrix(from.transpose() * to);
    const Vector3 measured = rotation_vector_from_matrix(q.toRotationMatrix());
    cross += measured * expected.transpose();
    normal += expected * expected.transpose();
  }
  const Eigen::JacobiSVD<Matrix3> svd(normal, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.singularValues()(0) == 0.0) {
    return std::nullopt;
  }
  Vector3 inverse = Vector3::Zero();
  Matrix3 seen = Matrix3::Zero();
  for (int k = 0; k < 3; ++k) {
    if (svd.singularValues()(k) > 0.05 * svd.singularValues()(0)) {
      inverse(k) = 1.0 / svd.singularValues()(k);
      seen += svd.matrixV().col(k) * svd.matrixV().col(k).transpose();
    }
  }
  return Turns{cross * svd.matrixV() * inverse.asDiagonal() * svd.matrixU().transpose(), seen};
}

// Whether the gyros turn as the gimbal does.
bool gyros_right(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  const std::optional<Turns> turns = turns_against_gimbal(data, segments);
  constexpr double plausible = 0.05;   // gimbal good to 1 deg in 90, sensors to 1 deg
  if (!turns || (turns->measured - turns->seen).cwiseAbs().maxCoeff() <= plausible) {
    return true;
  }
  const Matrix3& M = turns->measured;
  for (const AxisOrder& order : all_orders()) {
    if (!order.right() && (M - order.matrix() * turns->seen).cwiseAbs().maxCoeff() <= plausible) {
      faults.push_back(wrong_order("gyros", order, ", by the turns of the gimbal", data.size()));
      return false;
    }
  }
  Matrix3 beside = M;
  beside.diagonal().setZero();
  if (beside.cwiseAbs().maxCoeff() <= plausible && M.diagonal().minCoeff() > 0.0) {
    faults.push_back({"wrong_scale", number("gyros x, y, z make %.3f, %.3f, %.3f of the turns of the gimbal", M(0, 0), M(1, 1),
                                            M(2, 2)), 0, data.size()});
    return false;
  }
  char text[200];
  std::snprintf(text, sizeof text,
                "gyros against gimbal: turns along b come out as [%.3f %.3f %.3f; %.3f %.3f %.3f; %.3f %.3f %.3f]",
                M(0, 0), M(0, 1), M(0, 2), M(1, 0), M(1, 1), M(1, 2), M(2, 0), M(2, 1), M(2, 2));
  faults.push_back({"wrong_axes", text, 0, data.size()});
  return false;
}

// ---- dwells by the gyros' own attitude

struct Rest {
  Vector3 rate, force;         // means, b
  Matrix3 C_ib;                // at the middle, from where the recording starts
};

// Dwells without their first and last second; `drift` is taken from the gyros.
std::vector<Rest> rests(const ImuData& data, const std::vector<Segment>& segments, const Vector3& drift) {
  const auto margin = static_cast<std::size_t>(data.sample_rate_hz);
  const double dt = 1.0 / data.sample_rate_hz;
  std::vector<Rest> all;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (const Segment& s : segments) {
    const bool rest = !s.rotation && s.last > s.first + 4 * margin;
    Vector3 angle = Vector3::Zero(), velocity = Vector3::Zero();
    const std::size_t from = s.first + margin, to = s.last - std::min(s.last, margin), middle = (s.first + s.last) / 2;
    Matrix3 C_ib = Matrix3::Identity();
    for (std::size_t i = s.first; i < s.last; ++i) {
      const Vector3 theta = Eigen::Map<const Vector3>(data.delta_theta[i].data());
      if (i == middle) {
        C_ib = q.toRotationMatrix();
      }
      if (i >= from && i < to) {
        angle += theta;
        velocity += Eigen::Map<const Vector3>(data.delta_v[i].data());
      }
      q = (q * quaternion_from_rotation_vector(theta - drift * dt)).normalized();
    }
    if (rest) {
      const double length_s = static_cast<double>(to - from) * dt;
      all.push_back({angle / length_s, velocity / length_s, C_ib});
    }
  }
  return all;
}

// Gravity, turned back by the gyros, must point the same way in one dwell and the next, but for the 15 deg/h of the Earth;
// by the gimbal, where there is one, upwards. Whether the accelerometers' axes are right.
bool accelerometers_right(const ImuData& data, const std::vector<Segment>& segments, const std::vector<Rest>& dwells,
                          std::vector<DataFault>& faults) {
  constexpr double inconsistent = 0.15;   // rms over g: half an hour on the Earth, a gimbal off by degrees
  constexpr double far_better = 0.3, longest_s = 1200.0;
  const double each_s = (data.time_s.back() - data.time_s.front()) / static_cast<double>(dwells.size());
  if (dwells.size() < 2 || each_s > longest_s) {
    return true;
  }
  const auto scatter = [&](const AxisOrder& order) {
    double differences = 0.0, square = 0.0;
    for (std::size_t k = 1; k < dwells.size(); ++k) {
      differences += 0.5 * (dwells[k].C_ib * order.truth(dwells[k].force) -
                            dwells[k - 1].C_ib * order.truth(dwells[k - 1].force)).squaredNorm();
      square += dwells[k].force.squaredNorm();
    }
    return std::sqrt(differences / square);
  };
  const double as_given = scatter({});
  if (as_given > inconsistent) {
    double least = as_given;
    AxisOrder best;
    for (const AxisOrder& order : all_orders()) {
      // Gravity and its opposite are as steady: of each pair the one with fewer changes of sign.
      const int minus = (order.sign[0] < 0) + (order.sign[1] < 0) + (order.sign[2] < 0);
      const double found = scatter(order) + 1e-9 * minus;
      if (found < least) {
        least = found;
        best = order;
      }
    }
    if (least < far_better * as_given) {
      faults.push_back(wrong_order("accelerometers", best, ", by where gravity points after the turns", data.size()));
    } else {
      faults.push_back({"wrong_axes", number("accelerometers against gyros: gravity wanders by %.0f deg from dwell to dwell",
                                             std::asin(std::min(1.0, as_given)) / units::degree), 0, data.size()});
    }
    return false;
  }
  if (data.gimbal_outer.empty() || data.gimbal_inner.empty()) {
    return true;
  }
  double up = 0.0;
  for (const Segment& s : segments) {
    const std::size_t middle = (s.first + s.last) / 2;
    if (!s.rotation) {
      const Matrix3 C_vb = gimbal_matrix(data.gimbal_outer[middle], data.gimbal_inner[middle]);
      up += (C_vb * Eigen::Map<const Vector3>(data.delta_v[middle].data()))(1) * data.sample_rate_hz;
    }
  }
  if (up / static_cast<double>(dwells.size()) < -0.5 * units::standard_gravity) {
    faults.push_back(wrong_order("accelerometers", {{0, 1, 2}, {-1, -1, -1}}, ": the base would be upside down", data.size()));
    return false;
  }
  return true;
}

// ---- site

// Mean rates of dwells are w_k = C_k' w + drift, w the Earth's in space; with gravity's direction in the same dwell the
// latitude is the arc sine of their product.
void latitude_by_gyros(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  constexpr double earth_rate = earth::rotation_rate;
  constexpr double steady = 0.05;                       // of it: a base that sways is no place to tell
  constexpr double plausible = 0.5 * units::degree, sigmas = 6.0;
  constexpr std::size_t enough = 6;
  Vector3 drift = Vector3::Zero();
  double latitude = 0.0, sigma = HUGE_VAL;
  for (int round = 0; round < 3; ++round) {
    const std::vector<Rest> dwells = rests(data, segments, drift);
    if (dwells.size() < enough) {
      return;
    }
    Matrix6 normal = Matrix6::Zero();
    Vector6 right = Vector6::Zero();
    for (const Rest& r : dwells) {
      Eigen::Matrix<double, 3, 6> row;
      row << r.C_ib.transpose(), Matrix3::Identity();
      normal += row.transpose() * row;
      right += row.transpose() * r.rate;
    }
    constexpr double told_apart = 0.1;
    const Eigen::SelfAdjointEigenSolver<Matrix6> solver(normal);
    if (solver.eigenvalues()(0) < told_apart * static_cast<double>(dwells.size())) {
      return;
    }
    const Vector6 fit = solver.eigenvectors() * solver.eigenvalues().cwiseInverse().asDiagonal() *
                        (solver.eigenvectors().transpose() * right);
    drift = fit.tail<3>();
    const Vector3 axis = fit.head<3>().normalized();
    double misfit = 0.0, sum = 0.0, square = 0.0;
    for (const Rest& r : dwells) {
      misfit += (r.rate - r.C_ib.transpose() * fit.head<3>() - drift).squaredNorm();
      const double angle = std::asin(std::clamp((r.C_ib.transpose() * axis).dot(r.force.normalized()), -1.0, 1.0));
      sum += angle;
      square += angle * angle;
    }
    const auto n = static_cast<double>(dwells.size());
    const double rms = std::sqrt(misfit / n);
    if (rms > steady * earth_rate || std::abs(fit.head<3>().norm() / earth_rate - 1.0) > steady) {
      return;
    }
    latitude = sum / n;
    // Of the product's scatter, and of the Earth's rate in the mean of the dwells.
    sigma = std::sqrt(std::max(0.0, square / n - latitude * latitude) / n + rms * rms / (earth_rate * earth_rate * n));
  }
  if (std::abs(latitude - data.site.latitude) > std::max(plausible, sigmas * sigma)) {
    faults.push_back({"wrong_site", number("gravity and the Earth's rate as sensed stand as at latitude %.2f deg (+- %.2f), the "
                                           "site's is %.2f deg", latitude / units::degree, sigma / units::degree,
                                           data.site.latitude / units::degree), 0, data.size()});
  }
}

// ---- scale

// Mean size of the specific force in dwells against normal gravity; sensors are within 5000 ppm.
void gravity_size(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  const double expected = earth::normal_gravity(data.site.latitude, data.site.height);
  double sum = 0.0;
  int dwells = 0;
  for (const Segment& s : segments) {
    if (s.rotation || s.last <= s.first) {
      continue;
    }
    Vector3 velocity = Vector3::Zero();
    for (std::size_t i = s.first; i < s.last; ++i) {
      velocity += Eigen::Map<const Vector3>(data.delta_v[i].data());
    }
    sum += velocity.norm() * data.sample_rate_hz / static_cast<double>(s.last - s.first);
    ++dwells;
  }
  constexpr double plausible = 0.015;
  if (dwells > 0 && std::abs(sum / dwells / expected - 1.0) > plausible) {
    faults.push_back({"wrong_scale", number("specific force at rest is %.5f m/s^2, gravity there is %.5f m/s^2",
                                            sum / dwells, expected), 0, data.size()});
  }
}

}  // namespace

void find_wrong_axes(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  const bool gimbal = !data.gimbal_outer.empty() && !data.gimbal_inner.empty();
  const bool gyros = !gimbal || gyros_right(data, segments, faults);
  if (gyros) {
    const std::vector<Rest> dwells = rests(data, segments, Vector3::Zero());
    if (!dwells.empty() && accelerometers_right(data, segments, dwells, faults)) {
      latitude_by_gyros(data, segments, faults);
    }
  }
  gravity_size(data, segments, faults);
}

}  // namespace selfcal::diagnosis
