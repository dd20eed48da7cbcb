#include "estimator/diagnosis/noise/tilting_base.hpp"

#include <cmath>

namespace selfcal::diagnosis {
namespace {

// Slope of a row over its samples.
double slope_of(const Piece& piece, Eigen::Index row) {
  const auto n = static_cast<double>(piece.cols());
  const Eigen::RowVectorXd time = Eigen::RowVectorXd::LinSpaced(piece.cols(), -0.5 * (n - 1.0), 0.5 * (n - 1.0));
  return piece.row(row).dot(time) / (n * (n * n - 1.0) / 12.0);
}

}  // namespace

Base base_of(const ImuData& data, std::size_t first, std::size_t last) {
  Vector3 f = Vector3::Zero();
  for (std::size_t i = first; i < last; ++i) {
    f += Vector3(data.delta_v[i].data()) * data.sample_rate_hz / static_cast<double>(last - first);
  }
  // x of b made level, and across it. A turn by a small angle about a changes f by -a x f.
  const Vector3 up = f.normalized(), forward = (Vector3::UnitX() - up.x() * up).normalized(), level = up.cross(forward);
  constexpr double sine_of_11_deg = 0.2;
  return {f.norm(), std::abs(up.x()) < sine_of_11_deg, {{{forward, level}, {level, -forward}}}};
}

Piece piece_of(const ImuData& data, const Base& base, std::size_t at, std::size_t n) {
  Piece piece(tilt_channels, static_cast<Eigen::Index>(n));
  for (std::size_t i = 0; i < n; ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    piece.col(column).head<3>() = Vector3(data.delta_theta[at + i].data());
    piece.col(column).segment<3>(3) = Vector3(data.delta_v[at + i].data());
  }
  piece.topRows<first_angle>().colwise() -= piece.topRows<first_angle>().rowwise().mean().eval();
  for (std::size_t k = 0; k < base.axes.size(); ++k) {
    const Eigen::RowVectorXd rate = base.axes[k].about.transpose() * piece.topRows<3>(),
                             force = base.axes[k].across.transpose() * piece.middleRows<3>(3);
    const Eigen::Index row = first_angle + static_cast<Eigen::Index>(k);
    double angle = 0.0;
    for (Eigen::Index i = 0; i < piece.cols(); ++i) {
      piece(row, i) = angle + 0.5 * rate(i);  // in the middle of the sample, where the force is
      angle += rate(i);
    }
    Piece both = Piece::Zero(tilt_channels, piece.cols());
    both.row(0) = force * data.sample_rate_hz / base.g;
    const double less = slope_of(piece, row) - slope_of(both, 0);
    for (Eigen::Index i = 0; i < piece.cols(); ++i) {
      piece(row, i) -= less * static_cast<double>(i);
    }
    piece.row(row).array() -= piece.row(row).mean();
  }
  return piece;
}

}  // namespace selfcal::diagnosis
