// What the squares of the components of gravity leave open: closed forms on paper.
#include "estimator/diagnosis/search/squares.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rows = 10'000.0, sigma = 3.0;  // ug/g^2
constexpr int bias_x = 0, bias_y = 1;

const Effect& squares() {
  return *std::find_if(catalogue().begin(), catalogue().end(),
                       [](const Effect& e) { return e.id == "accel_cross_squares"; });
}

// Squares of the other two axes in each accelerometer, ug/g^2, known to 3 ug/g^2 each; the 24 move with none of them.
SquaresAverage of(const std::array<double, 6>& coefficients) {
  Term term;
  term.effect = &squares();
  const double typical = squares().parameters.front().typical;
  term.amplitude = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(coefficients.data()) / typical;
  term.covariance = Eigen::MatrixXd::Identity(6, 6) * (sigma / typical) * (sigma / typical);
  return average_squares(term, Eigen::MatrixXd::Zero(sensor_parameter_count, 6), rows);
}

// x -60 yy -60 zz is 60 xx less 60 g^2. One coefficient of one effect against two of one, or of two effects: sqrt(rows) to 1 and to 1/e twice.
TEST(Squares, OfBothOtherAxesAlikeAreTheOwnOne) {
  const SquaresAverage average = of({-60.0, -60.0, 0.0, 0.0, 0.0, 0.0});
  const double two_of_one = 1.0 / std::sqrt(rows), two_of_two = two_of_one / std::exp(1.0);
  const double total = 1.0 + two_of_one + 2.0 * two_of_two;
  EXPECT_NEAR(average.own_square, (1.0 + 2.0 * two_of_two) / total, 1e-3);
  EXPECT_NEAR(average.shift(bias_x) / units::micro_g, -60.0 * (1.0 + 2.0 * two_of_two) / total, 0.1);
  EXPECT_NEAR(average.shift(bias_y) / units::micro_g, 0.0, 0.01);
}

// 100 yy + 50 zz is 50 yy - 50 xx and 50 g^2, or -50 zz - 100 xx and 100 g^2: a name more, which costs e.
TEST(Squares, OfDifferentSizesLeaveTheBiasOpen) {
  const SquaresAverage average = of({100.0, 50.0, 0.0, 0.0, 0.0, 0.0});
  const double other = 1.0 / std::exp(1.0), total = 1.0 + 2.0 * other;
  const double mean = 150.0 * other / total, square = (50.0 * 50.0 + 100.0 * 100.0) * other / total;
  EXPECT_NEAR(average.own_square, 2.0 * other / total, 1e-3);
  EXPECT_NEAR(average.shift(bias_x) / units::micro_g, mean, 0.3);
  EXPECT_NEAR(std::sqrt(average.covariance(bias_x, bias_x)) / units::micro_g, std::sqrt(square - mean * mean), 0.3);
}

// One square alone says it in fewer words than two do.
TEST(Squares, OfOneAxisLeaveLittleOpen) {
  const SquaresAverage average = of({0.0, 0.0, 0.0, 100.0, 0.0, 0.0});
  EXPECT_LT(average.own_square, 0.02);
  EXPECT_LT(std::abs(average.shift(bias_y)) / units::micro_g, 2.0);
  EXPECT_LT(average.covariance.diagonal().cwiseSqrt().maxCoeff() / units::micro_g, 15.0);
}

}  // namespace
}  // namespace selfcal::diagnosis
