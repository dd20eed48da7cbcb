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
  Matrix3 matrix() const {  // measured = matrix * truth
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

DataFault wrong_order(const std::string& triad, const AxisOrder& order, const std::string& evidence,
                      std::size_t samples) {
  return {order.ordered() ? "wrong_sign" : "wrong_axes", triad + ": " + order.words() + evidence, 0, samples};
}

// ---- gyros against the gimbal

struct Turns {
  Matrix3 measured;  // M: measured turn = M * the gimbal's, along b
  Matrix3 seen;      // projection on the directions about which it turned
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
  constexpr double plausible = 0.05;  // gimbal good to 1 deg in 90, sensors to 1 deg
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
    faults.push_back(
        {"wrong_scale",
         number("gyros x, y, z make %.3f, %.3f, %.3f of the turns of the gimbal", M(0, 0), M(1, 1), M(2, 2)), 0,
         data.size()});
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
  Vector3 rate, force;  // means, b
  Matrix3 C_ib;         // at the middle, from where the recording starts
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

// rms over g of how gravity, turned back by the gyros, differs from one dwell to the next.
double gravity_scatter(const std::vector<Rest>& dwells, const AxisOrder& order) {
  double differences = 0.0, square = 0.0;
  for (std::size_t k = 1; k < dwells.size(); ++k) {
    const Vector3 before = dwells[k - 1].C_ib * order.truth(dwells[k - 1].force);
    differences += 0.5 * (dwells[k].C_ib * order.truth(dwells[k].force) - before).squaredNorm();
    square += dwells[k].force.squaredNorm();
  }
  return std::sqrt(differences / square);
}

// With the least scatter; gravity and its opposite are as steady: of each pair the one with fewer changes of sign.
AxisOrder steadiest(const std::vector<Rest>& dwells) {
  double least = HUGE_VAL;
  AxisOrder best;
  for (const AxisOrder& order : all_orders()) {
    const auto minus = std::count(order.sign.begin(), order.sign.end(), -1);
    const double found = gravity_scatter(dwells, order) + 1e-9 * static_cast<double>(minus);
    if (found < least) {
      least = found;
      best = order;
    }
  }
  return best;
}

bool upside_down(const ImuData& data, const std::vector<Segment>& segments) {
  double up = 0.0;
  int dwells = 0;
  for (const Segment& s : segments) {
    const std::size_t middle = (s.first + s.last) / 2;
    if (!s.rotation) {
      const Matrix3 C_vb = gimbal_matrix(data.gimbal_outer[middle], data.gimbal_inner[middle]);
      up += (C_vb * Eigen::Map<const Vector3>(data.delta_v[middle].data()))(1) * data.sample_rate_hz;
      ++dwells;
    }
  }
  return dwells > 0 && up / dwells < -0.5 * units::standard_gravity;
}

// Gravity, turned back by the gyros, must point the same way in one dwell and the next, but for the 15 deg/h of the Earth;
// by the gimbal, where there is one, upwards. Whether the accelerometers' axes are right.
bool accelerometers_right(const ImuData& data, const std::vector<Segment>& segments, const std::vector<Rest>& dwells,
                          std::vector<DataFault>& faults) {
  constexpr double inconsistent = 0.15;  // half an hour on the Earth, a gimbal off by degrees
  constexpr double far_better = 0.3, longest_s = 1200.0;
  const double each_s = (data.time_s.back() - data.time_s.front()) / static_cast<double>(dwells.size());
  if (dwells.size() < 2 || each_s > longest_s) {
    return true;
  }
  const double as_given = gravity_scatter(dwells, {});
  if (as_given > inconsistent) {
    const AxisOrder best = steadiest(dwells);
    if (gravity_scatter(dwells, best) < far_better * as_given) {
      faults.push_back(wrong_order("accelerometers", best, ", by where gravity points after the turns", data.size()));
    } else {
      faults.push_back({"wrong_axes",
                        number("accelerometers against gyros: gravity wanders by %.0f deg from dwell to dwell",
                               std::asin(std::min(1.0, as_given)) / units::degree),
                        0, data.size()});
    }
    return false;
  }
  const bool gimbal = !data.gimbal_outer.empty() && !data.gimbal_inner.empty();
  if (gimbal && upside_down(data, segments)) {
    faults.push_back(
        wrong_order("accelerometers", {{0, 1, 2}, {-1, -1, -1}}, ": the base would be upside down", data.size()));
    return false;
  }
  return true;
}

// ---- site

struct SensedEarth {
  Vector3 drift;
  double latitude = 0.0, sigma = 0.0;  // rad; of the scatter from dwell to dwell
};

// Mean rates of dwells are w_k = C_k' w + drift, w the Earth's in space; with gravity's direction in the same dwell the
// latitude is the arc sine of their product. None where dwells are few or alike, or the base sways.
std::optional<SensedEarth> sense_earth(const std::vector<Rest>& dwells) {
  constexpr std::size_t enough = 6;
  constexpr double told_apart = 0.1;  // of the information that dwells all about have
  constexpr double steady = 0.05 * earth::rotation_rate;
  Matrix6 normal = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  for (const Rest& r : dwells) {
    Eigen::Matrix<double, 3, 6> row;
    row << r.C_ib.transpose(), Matrix3::Identity();
    normal += row.transpose() * row;
    right += row.transpose() * r.rate;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(normal);
  const auto n = static_cast<double>(dwells.size());
  if (dwells.size() < enough || solver.eigenvalues()(0) < told_apart * n) {
    return std::nullopt;
  }
  const Vector6 fit = solver.eigenvectors() * solver.eigenvalues().cwiseInverse().asDiagonal() *
                      (solver.eigenvectors().transpose() * right);
  const Vector3 rate = fit.head<3>();
  SensedEarth sensed{fit.tail<3>()};
  double misfit = 0.0, square = 0.0;
  for (const Rest& r : dwells) {
    const Vector3 own = r.C_ib.transpose() * rate;
    misfit += (r.rate - own - sensed.drift).squaredNorm() / n;
    const double angle = std::asin(std::clamp(own.normalized().dot(r.force.normalized()), -1.0, 1.0));
    sensed.latitude += angle / n;
    square += angle * angle / n;
  }
  if (misfit > steady * steady || std::abs(rate.norm() - earth::rotation_rate) > steady) {
    return std::nullopt;
  }
  const double scatter = std::max(0.0, square - sensed.latitude * sensed.latitude);
  sensed.sigma = std::sqrt((scatter + misfit / (earth::rotation_rate * earth::rotation_rate)) / n);
  return sensed;
}

void latitude_by_gyros(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  constexpr double plausible = 0.5 * units::degree, sigmas = 6.0;
  constexpr int rounds = 3;  // a drift of 1 deg/h turns the attitude by as much
  std::optional<SensedEarth> sensed = SensedEarth{Vector3::Zero()};
  for (int round = 0; round < rounds && sensed; ++round) {
    sensed = sense_earth(rests(data, segments, sensed->drift));
  }
  if (sensed && std::abs(sensed->latitude - data.site.latitude) > std::max(plausible, sigmas * sensed->sigma)) {
    faults.push_back(
        {"wrong_site",
         number("gravity and the Earth's rate as sensed stand as at latitude %.2f deg (+- %.2f), the "
                "site's is %.2f deg",
                sensed->latitude / units::degree, sensed->sigma / units::degree, data.site.latitude / units::degree),
         0, data.size()});
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
    faults.push_back(
        {"wrong_scale",
         number("specific force at rest is %.5f m/s^2, gravity there is %.5f m/s^2", sum / dwells, expected), 0,
         data.size()});
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
