// Where the gimbal stands and how it turns: true angles, rates and accelerations of both axes at any time.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "estimator/geometry/schedule.hpp"
#include "protocol/error.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/random.hpp"

namespace selfcal::sim {

// Outer axis first. rad, rad/s, rad/s^2.
struct GimbalState {
  std::array<double, 2> angle{};
  std::array<double, 2> rate{};
  std::array<double, 2> acceleration{};
};

// One move of both axes: half-cosine ramp up, constant rate, ramp down.
struct GimbalMove {
  double start_s = 0.0;
  double duration_s = 0.0;
  double ramp_s = 0.0;
  std::array<double, 2> from{};  // rad
  std::array<double, 2> to{};    // rad

  double end_s() const { return start_s + duration_s; }
};

class GimbalMotion {
 public:
  GimbalMotion() = default;
  // Moves in order of time, not overlapping; each begins where the one before ended. Without any: stands at `initial`.
  GimbalMotion(std::array<double, 2> initial, std::vector<GimbalMove> moves);

  GimbalState at(double t) const;
  bool turning(double begin, double end) const;  // anywhere within [begin, end]
  const std::vector<GimbalMove>& moves() const { return moves_; }
  // Times at which the profile has no second derivative of rate: starts and ends of ramps, in order.
  const std::vector<double>& breakpoints() const { return breakpoints_; }
  // Seconds since the last move that ended at or before t; negative where none has.
  double since_move_end(double t) const;
  // Index of the last move begun at or before t, -1 before the first.
  int last_move(double t) const;

 private:
  std::array<double, 2> initial_{};
  std::vector<GimbalMove> moves_;
  std::vector<double> breakpoints_;
};

// Checks that the drive can make every move of the schedule in rotation_s: bad_input naming the move otherwise.
[[nodiscard]] Expected<void> check_schedule(const GimbalConfig& config, const Schedule& schedule);

// The moves of the whole schedule from t = 0, each position missed by a draw of the positioning error.
GimbalMotion plan_gimbal(const GimbalConfig& config, const Schedule& schedule, Random& random);

// The ramp a move of the given duration uses.
double ramp_time(const GimbalConfig& config, double duration_s);

}  // namespace selfcal::sim
