// Where the misfit is: bias of one sensor axis in one dwell, one rotation, after turns, or in one part of the time.
#pragma once

#include <Eigen/Cholesky>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/regression/evidence.hpp"

namespace selfcal::diagnosis {

struct Located {
  // dwell, rotation, after_turn, time, frequency; outer_angle, inner_angle, gravity, earth_rate, temperature
  std::string where;
  int position = -1;                  // number from 1 of the dwell or rotation; -1: none
  std::string axis;                   // gyro_x ... accel_z, or north, up, east
  double start_s = 0.0, end_s = 0.0;  // since the start; after_turn: since the turn
  double significance = 0.0;          // sigma, single test
  double size = 0.0;                  // bias: deg/h or ug; frequency: amplitude, um
  double frequency_hz = 0.0;
  std::string words;
};

constexpr std::array<const char*, 6> axis_ids = {"gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"};

// One column by itself, given that `fitted` ones are fitted. `evidence` must outlive this.
class SingleTest {
 public:
  SingleTest(const Evidence& evidence, const std::vector<int>& fitted);
  struct Result {
    double z = 0.0;     // size over its sigma
    double size = 0.0;  // in the column's units
  };
  std::optional<Result> operator()(int column) const;  // none where it would not be seen

 private:
  const Evidence& evidence_;
  std::vector<int> fitted_;
  Eigen::LDLT<Eigen::MatrixXd> solver_;
  Eigen::VectorXd fitted_score_;
};

struct Map {
  std::vector<Located> places;  // largest first, those above 3 sigma (at most 12)
  double largest_sigma = 0.0;
  double largest_named_sigma = 0.0;  // of places where what is fitted makes at least as much as is left
  int tests = 0;
};

// Tests each place alone, given that `fitted` columns are fitted.
Map locate(const Evidence& evidence, const std::vector<LocatedColumn>& map, int first_map_column,
           const std::vector<int>& fitted);

// Square of the signature that columns `named` of these sizes make, as far as the columns `place` can stand for it.
double square_within(const Evidence& evidence, const std::vector<int>& place, const std::vector<int>& named,
                     const Eigen::VectorXd& size);

// A line in the innovations of one axis of n: sum of both quadratures' squares over the mean.
struct InnovationLine {
  int axis = 0;
  double frequency_hz = 0.0;
  double log_p = 0.0;  // corrected for the frequencies looked at
};
std::vector<InnovationLine> innovation_lines(const SignatureRows& rows, double interval_s);

}  // namespace selfcal::diagnosis
