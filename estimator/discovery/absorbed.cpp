#include "estimator/discovery/absorbed.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "estimator/discovery/pieces.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {
namespace {

// Of an axis: its parameters and what one unit of each does to it, [nodes x parameters], rad/s and m/s^2.
struct AxisParameters {
  std::vector<int> index;  // of the 24
  Eigen::MatrixXd columns;
};

Vector3 three(const laws::Channels& channels, Eigen::Index node, laws::Variable first) {
  return channels.row(node).segment<3>(static_cast<Eigen::Index>(first)).matrix().transpose();
}

AxisParameters parameters_of(int axis, const laws::Channels& channels) {
  constexpr int count = 12;  // of a triad
  static_assert(count == accel_parameter_count && count == gyro_parameter_count);
  const bool gyro = axis < 3;
  Eigen::MatrixXd all(channels.rows(), count);
  for (Eigen::Index node = 0; node < channels.rows(); ++node) {
    const Vector3 f = units::standard_gravity * three(channels, node, laws::Variable::fx);
    const SensorIntegrals second{.dt = 1.0,
                                 .angle = units::degree * three(channels, node, laws::Variable::wx),
                                 .velocity_pos = f.cwiseMax(0.0),
                                 .velocity_neg = (-f).cwiseMax(0.0)};
    if (gyro) {
      GyroSensitivity row = GyroSensitivity::Zero();
      add_gyro_sensitivity(Matrix3::Identity(), second, 1.0, row);
      all.row(node) = row.row(axis);
    } else {
      AccelSensitivity row = AccelSensitivity::Zero();
      add_accel_sensitivity(Matrix3::Identity(), second, 1.0, row);
      all.row(node) = row.row(axis - 3);
    }
  }
  AxisParameters of_axis;
  std::vector<Eigen::Index> seen;
  for (Eigen::Index k = 0; k < count; ++k) {
    if (all.col(k).cwiseAbs().maxCoeff() > 0.0) {
      seen.push_back(k);
      const auto at = static_cast<std::size_t>(k);
      of_axis.index.push_back(gyro ? gyro_parameter_index[at] : accel_parameter_index[at]);
    }
  }
  of_axis.columns = all(Eigen::all, seen);
  return of_axis;
}

}  // namespace

ParameterVector absorbed(const NodeTable& table, std::span<const DiscoveredLaw> described) {
  ParameterVector sigma = ParameterVector::Zero();
  const Eigen::VectorXd dt = dt_of(table);
  for (int axis = 0; axis < axis_count; ++axis) {
    Eigen::VectorXd law = Eigen::VectorXd::Zero(dt.size());
    for (const DiscoveredLaw& d : described) {
      if (d.term.axis == axis) {
        law += d.coefficient * unit_of(axis) * d.term.expression.evaluate(table.channels, d.term.constants).matrix();
      }
    }
    if (!law.allFinite() || law.isZero(0.0)) {
      continue;
    }
    const AxisParameters own = parameters_of(axis, table.channels);
    const Eigen::VectorXd size = own.columns.colwise().norm().transpose();
    const Eigen::MatrixXd X = own.columns * size.cwiseInverse().asDiagonal();
    const Eigen::LDLT<Eigen::MatrixXd> normal(X.transpose() * dt.asDiagonal() * X);
    const Eigen::VectorXd shown = law - X * normal.solve(X.transpose() * dt.cwiseProduct(law));
    const Eigen::MatrixXd gain = normal.solve(X.transpose()).cwiseAbs();  // of an error at a node, a second long
    const Eigen::VectorXd farthest = gain * dt.cwiseProduct(shown.cwiseAbs());
    for (std::size_t k = 0; k < own.index.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const double moved = farthest(at) / size(at);
      sigma(own.index[k]) = std::isfinite(moved) ? moved : 0.0;
    }
  }
  return sigma;
}

}  // namespace selfcal::discovery
