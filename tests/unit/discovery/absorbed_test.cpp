// A law that is described moves the 24 of its axis: against least squares of signs drawn at random.
#include "estimator/discovery/absorbed.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <vector>

#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {
namespace {

constexpr Eigen::Index count = 60;

NodeTable table() {
  NodeTable t;
  t.channels = laws::Channels::Zero(count, static_cast<Eigen::Index>(laws::variable_count));
  for (Eigen::Index k = 0; k < count; ++k) {
    const double turn = 0.7 * static_cast<double>(k), tilt = 0.23 * static_cast<double>(k);
    t.nodes.push_back({10.0 * static_cast<double>(k), k % 3 == 0 ? 2.0 : 10.0});
    t.channels(k, static_cast<int>(laws::Variable::fx)) = std::cos(turn) * std::cos(tilt);
    t.channels(k, static_cast<int>(laws::Variable::fy)) = std::sin(turn) * std::cos(tilt);
    t.channels(k, static_cast<int>(laws::Variable::fz)) = std::sin(tilt);
    t.channels(k, static_cast<int>(laws::Variable::wz)) = k % 3 == 0 ? 18.0 : 0.0;
  }
  return t;
}

DiscoveredLaw law_of(int axis, const char* text, double coefficient) {
  DiscoveredLaw law;
  law.term = {axis, *laws::Expression::parse(text), {}};
  law.coefficient = coefficient;
  return law;
}

// Bias, two scale factors and two misalignments of accelerometer z (tools/handbook/frames-and-signs.md), written out.
TEST(Absorbed, HoldsALawOfAnySign) {
  const NodeTable t = table();
  const double size = 30.0 * units::micro_g;
  const std::vector<DiscoveredLaw> law = {law_of(5, "sin(7*fx)", 30.0)};
  const ParameterVector sigma = absorbed(t, law);
  Eigen::MatrixXd X(count, 5);
  Eigen::VectorXd weight(count), values(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const double fx = t.channels(k, 0), fy = t.channels(k, 1), fz = t.channels(k, 2), g = units::standard_gravity;
    X.row(k) << 1.0, g * std::max(fz, 0.0), g * std::max(-fz, 0.0), g * fx, g * fy;
    weight(k) = std::sqrt(t.nodes[static_cast<std::size_t>(k)].dt);
    values(k) = size * std::sin(7.0 * fx);
  }
  const Eigen::MatrixXd A = weight.asDiagonal() * X;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(A);
  const Eigen::VectorXd weighted = weight.cwiseProduct(values);
  const Eigen::VectorXd shown = values - X * solver.solve(weighted);
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(5);
  unsigned seed = 1;
  for (int draw = 0; draw < 2000; ++draw) {
    Eigen::VectorXd signs(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      seed = seed * 1664525U + 1013904223U;
      signs(k) = (seed >> 31U) != 0U ? 1.0 : -1.0;
    }
    const Eigen::VectorXd error = weight.cwiseProduct(shown.cwiseProduct(signs));
    const Eigen::VectorXd moved = solver.solve(error);
    largest = largest.cwiseMax(moved.cwiseAbs());
  }
  const auto at = [&](const char* name) { return sigma(*find_sensor_parameter(name)); };
  const std::vector<double> told = {at("accel_bias_z"), at("accel_scale_pos_z"), at("accel_scale_neg_z"),
                                    at("accel_misalignment_zx"), at("accel_misalignment_zy")};
  for (std::size_t k = 0; k < told.size(); ++k) {
    const double seen = largest(static_cast<Eigen::Index>(k));
    EXPECT_GT(told[k], seen) << k;  // no sign moves a parameter farther
    EXPECT_LT(told[k], 4.0 * seen)
        << k;  // sixty signs: the farthest is some sqrt(60) of one sigma, 2000 draws reach 3.5
  }
  int others = 0;
  for (Eigen::Index k = 0; k < sensor_parameter_count; ++k) {
    others += sigma(k) > 0.0 ? 1 : 0;
  }
  EXPECT_EQ(others, 5);  // of its own axis alone
}

// What is one of the 24 shows nothing, and moves nothing that shows.
TEST(Absorbed, IsNothingWhereNothingShows) {
  const std::vector<DiscoveredLaw> scale = {law_of(2, "wz", 0.5)};
  EXPECT_LT(absorbed(table(), scale).maxCoeff(), 1e-12);
  EXPECT_TRUE(absorbed(table(), {}).isZero(0.0));
}

}  // namespace
}  // namespace selfcal::discovery
