#include "estimator/navigation/error_dynamics.hpp"

#include <cmath>

namespace selfcal {

SiteModel::SiteModel(const earth::Position& p)
    : omega_ie_n(earth::omega_ie_n(p.latitude)), gravity_n(0.0, -earth::normal_gravity(p.latitude, p.height), 0.0) {
  constexpr int P = StateLayout::position;
  constexpr int V = StateLayout::velocity;
  constexpr int A = StateLayout::attitude;
  const double north_radius = earth::meridian_radius(p.latitude) + p.height;
  const double east_radius = earth::prime_vertical_radius(p.latitude) + p.height;

  Matrix3 transport = Matrix3::Zero();  // omega_en = transport * v
  transport(0, 2) = 1.0 / east_radius;
  transport(1, 2) = std::tan(p.latitude) / east_radius;
  transport(2, 0) = -1.0 / north_radius;

  F_rest.setZero();
  F_rest.block<3, 3>(P, V).setIdentity();              // (D1)
  F_rest.block<3, 3>(V, V) = -2.0 * skew(omega_ie_n);  // (D2)
  F_rest(V + 1, P + 1) = -earth::gravity_gradient(p.latitude, p.height);
  constexpr double step = 1e-4;  // rad; gravity is smooth: central difference good to 1e-9 relative
  F_rest(V + 1, P) =
      -(earth::normal_gravity(p.latitude + step, p.height) - earth::normal_gravity(p.latitude - step, p.height)) /
      (2.0 * step) / north_radius;
  F_rest.block<3, 3>(A, A) = -skew(omega_ie_n);  // (D3)
  F_rest.block<3, 3>(A, V) = transport;
  F_rest(A, P) = -omega_ie_n.y() / north_radius;     // d(Omega cos L)/dL = -Omega sin L
  F_rest(A + 1, P) = omega_ie_n.x() / north_radius;  // d(Omega sin L)/dL =  Omega cos L
}

Matrix9 transition(const SiteModel& site, const Vector3& f_n, double length_s, double sign) {
  Matrix9 F = site.F_rest;
  F.block<3, 3>(StateLayout::velocity, StateLayout::attitude) = skew(f_n);
  F *= sign * length_s;
  // Horner: I + F (I + F/2 (I + F/3)).
  Matrix9 sum = Matrix9::Identity() + F / 3.0;
  sum = (Matrix9::Identity() + 0.5 * F.lazyProduct(sum)).eval();  // a lazy product must not overwrite its factor
  return Matrix9::Identity() + F.lazyProduct(sum);
}

namespace {

// Of the upper triangle. A zero density leaves zero columns.
ProcessNoise factored(Matrix9 Q) {
  Q.triangularView<Eigen::StrictlyLower>() = Q.transpose();
  // L D L^T without pivoting.
  ProcessNoise noise{Matrix9::Identity(), Vector9::Zero()};
  for (int j = 0; j < 9; ++j) {
    noise.q(j) = std::max(Q(j, j), 0.0);
    for (int i = j + 1; i < 9; ++i) {
      noise.L(i, j) = noise.q(j) > 0.0 ? Q(i, j) / noise.q(j) : 0.0;
    }
    for (int i = j + 1; i < 9; ++i) {
      for (int k = j + 1; k <= i; ++k) {
        Q(i, k) -= noise.L(i, j) * noise.q(j) * noise.L(k, j);
        Q(k, i) = Q(i, k);
      }
    }
  }
  return noise;
}

}  // namespace

ProcessNoise process_noise(const SiteModel& site, double gyro_arw, double accel_vrw, double T, double sign) {
  // phi = sign * int(-C n_g), dv = sign * (int C n_a + int f_n x phi), dp = sign * int dv: the sign patterns of the
  // cross terms follow (D5).
  const double qg = gyro_arw * gyro_arw;
  const double qa = accel_vrw * accel_vrw;
  const Matrix3 S = skew(-site.gravity_n);
  const Matrix3 SSt = S * S.transpose();
  const Matrix3 I = Matrix3::Identity();
  Matrix9 Q = Matrix9::Zero();
  Q.block<3, 3>(6, 6) = qg * T * I;
  Q.block<3, 3>(3, 6) = sign * qg * T * T / 2.0 * S;
  Q.block<3, 3>(0, 6) = qg * T * T * T / 6.0 * S;
  Q.block<3, 3>(3, 3) = qa * T * I + qg * T * T * T / 3.0 * SSt;
  Q.block<3, 3>(0, 3) = sign * (qa * T * T / 2.0 * I + qg * std::pow(T, 4) / 8.0 * SSt);
  Q.block<3, 3>(0, 0) = qa * T * T * T / 3.0 * I + qg * std::pow(T, 5) / 20.0 * SSt;
  return factored(Q);
}

ProcessNoise process_noise(const SiteModel& site, const WhiteNoise& noise, double T, double sign) {
  const Matrix3 S = skew(-site.gravity_n);
  const Matrix3 SG = S * noise.rate;
  const Matrix3 SGSt = SG * S.transpose();
  Matrix9 Q = Matrix9::Zero();
  Q.block<3, 3>(6, 6) = T * noise.rate;
  Q.block<3, 3>(3, 6) = sign * T * T / 2.0 * SG;
  Q.block<3, 3>(0, 6) = T * T * T / 6.0 * SG;
  Q.block<3, 3>(3, 3) = T * noise.force + T * T * T / 3.0 * SGSt;
  Q.block<3, 3>(0, 3) = sign * (T * T / 2.0 * noise.force + std::pow(T, 4) / 8.0 * SGSt);
  Q.block<3, 3>(0, 0) = T * noise.velocity + T * T * T / 3.0 * noise.force + std::pow(T, 5) / 20.0 * SGSt;
  return factored(Q);
}

}  // namespace selfcal
