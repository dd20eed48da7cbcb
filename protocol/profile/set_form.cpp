#include "protocol/profile/set_form.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::profile {
namespace {

// A number below one millionth keeps its last bit beside 1.
using Real = long double;
using Matrix = Eigen::Matrix<Real, 3, 3>;
using Vector = Eigen::Matrix<Real, 3, 1>;

constexpr std::size_t accel_bias = parameter::accel_bias, gyro_drift = parameter::gyro_drift;
constexpr std::size_t plus = parameter::accel_scale_pos, minus = parameter::accel_scale_neg;
constexpr std::size_t accel_angles = parameter::accel_misalignment, gyro_scale = parameter::gyro_scale;
constexpr std::size_t gyro_angles = parameter::gyro_misalignment;

// Powers of two below 1 (m/s^2, rad/s, 1) to which the written numbers are rounded.
constexpr int accel_bias_grid = 44, gyro_drift_grid = 50, matrix_grid = 48;

// Row and column of xy, xz, yx, yz, zx, zy.
constexpr std::array<std::array<int, 2>, 6> beside{{{0, 1}, {0, 2}, {1, 0}, {1, 2}, {2, 0}, {2, 1}}};

// One matrix of three input axes, and the bias that goes with it.
struct Triad {
  Matrix deviation = Matrix::Zero();  // the matrix less the identity
  Vector bias = Vector::Zero();
};

// (1 + k)^-1 - 1, to the last bit of k.
Real inverse_factor(Real k) { return -k / (1 + k); }

// The slope for both signs of f.
Real slope(const SetValues& v, std::size_t axis) {
  return std::sqrt((1 + Real{v[plus + axis]}) * (1 - Real{v[minus + axis]}));
}

Triad accelerometers(const SetValues& v) {
  Triad triad;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<int>(axis);
    triad.deviation(k, k) = slope(v, axis) - 1;
    triad.bias[k] = v[accel_bias + axis];
  }
  triad.deviation(1, 0) = v[accel_angles];
  triad.deviation(2, 0) = v[accel_angles + 1];
  triad.deviation(2, 1) = v[accel_angles + 2];
  return triad;
}

Triad gyros(const SetValues& v) {
  Triad triad;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<int>(axis);
    triad.deviation(k, k) = v[gyro_scale + axis];
    triad.bias[k] = v[gyro_drift + axis];
  }
  for (std::size_t i = 0; i < beside.size(); ++i) {
    triad.deviation(beside[i][0], beside[i][1]) = v[gyro_angles + i];
  }
  return triad;
}

Matrix inverse_deviation(const Matrix& deviation) { return -((Matrix::Identity() + deviation).inverse() * deviation); }

// Of a lower triangle with these slopes: without the rounding of 1 + k.
Vector inverse_angles(const SetValues& v) {
  const Real x = slope(v, 0), y = slope(v, 1), z = slope(v, 2);
  const Real yx = v[accel_angles], zx = v[accel_angles + 1], zy = v[accel_angles + 2];
  return {-yx / (x * y), (yx * zy / y - zx) / (x * z), -zy / (y * z)};
}

std::string fault(const SetValues& v) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const auto& [index, factor] :
         {std::pair(plus + axis, 1 + v[plus + axis]), std::pair(minus + axis, 1 - v[minus + axis]),
          std::pair(gyro_scale + axis, 1 + v[gyro_scale + axis])}) {
      if (!(factor > 0.0) || !std::isfinite(factor)) {
        return fmt::format("{} is {:g}: a scale factor of {:g} has no inverse", ins::coefficient_names[index], v[index],
                           factor);
      }
    }
  }
  const Real determinant = (Matrix::Identity() + gyros(v).deviation).determinant();
  return determinant > 0 ? std::string() : "the matrix of gyro_scale and gyro_misalignment has no inverse";
}

}  // namespace

Expected<SetValues> converted(SetForm form, const SetValues& from) {
  if (form == SetForm::errors) {
    return from;
  }
  if (const std::string why = fault(from); !why.empty()) {
    return fail(ErrorKind::bad_input, why);
  }
  SetValues to = from;
  const Vector angles = inverse_angles(from);
  const Matrix gyro = inverse_deviation(gyros(from).deviation);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<int>(axis);
    to[plus + axis] = static_cast<double>(inverse_factor(from[plus + axis]));
    to[minus + axis] = static_cast<double>(-inverse_factor(-Real{from[minus + axis]}));
    to[accel_angles + axis] = static_cast<double>(angles[k]);
    to[gyro_scale + axis] = static_cast<double>(gyro(k, k));
  }
  for (std::size_t i = 0; i < beside.size(); ++i) {
    to[gyro_angles + i] = static_cast<double>(gyro(beside[i][0], beside[i][1]));
  }
  if (form == SetForm::correction_first) {
    // b' = M^-1 b, and b = M b': the matrix of `to` in either way.
    const Vector b = accelerometers(from).bias, e = gyros(from).bias;
    const Vector accel_bias_to = b + accelerometers(to).deviation * b;
    const Vector gyro_drift_to = e + gyros(to).deviation * e;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      to[accel_bias + axis] = static_cast<double>(accel_bias_to[static_cast<int>(axis)]);
      to[gyro_drift + axis] = static_cast<double>(gyro_drift_to[static_cast<int>(axis)]);
    }
  }
  return to;
}

Expected<SetValues> to_write(SetForm form, const SetValues& errors) {
  auto told = converted(form, errors);
  if (!told || form == SetForm::errors) {
    return told;
  }
  for (std::size_t k = 0; k < told->size(); ++k) {
    const int grid = k < gyro_drift ? accel_bias_grid : k < plus ? gyro_drift_grid : matrix_grid;
    (*told)[k] = std::ldexp(std::round(std::ldexp((*told)[k], grid)), -grid);
  }
  return told;
}

}  // namespace selfcal::profile
