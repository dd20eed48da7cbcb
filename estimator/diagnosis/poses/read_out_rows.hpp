// What of a recording read-outs and gyros can be compared in. Private to this folder; equations (R1) to (R4): read_outs.hpp.
#pragma once

#include <cmath>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// A part of a pose in which the read-outs rest too.
struct Stop {
  std::size_t pose = 0;  // number
  std::size_t middle = 0;
  double outer = 0.0, inner = 0.0;  // rad
};
std::vector<Stop> find_stops(const PoseInput& input, const std::vector<Pose>& poses);

// From the middle of a stop to that of the next one.
struct TurnRow {
  std::size_t first = 0, last = 0;   // samples
  Vector3 bias;                      // raw, of the poses at its ends
  std::size_t begins = 0, ends = 0;  // samples between the poses, in which the gyros turn
  Vector3 turned;                    // integral of the gyros less bias, raw times s
  Vector3 noise;                     // sigma of it by their white noise, that of the bias in it
  double outer = 0.0, inner = 0.0;   // turned, rad
  double inner_angle = 0.0;          // before, rad

  // Whether the other axis rests.
  bool about_outer() const { return outer != 0.0 && std::abs(inner) < alone * std::abs(outer); }
  bool about_inner() const { return inner != 0.0 && std::abs(outer) < alone * std::abs(inner); }
  static constexpr double alone = 0.02;
};
// Those in which a gyro stands at the end of its range are counted alone.
std::vector<TurnRow> turns_between(const PoseInput& input, const std::vector<Pose>& poses,
                                   const std::vector<Stop>& stops, const std::vector<Clipping>& clipped,
                                   int& at_the_end);

// A stretch in which one read-out turns steadily and the other one rests, without its ends.
struct SteadyRate {
  std::size_t first = 0, last = 0;  // samples
  bool outer = true;
  double rate = 0.0, length_s = 0.0;  // rad/s
  Vector3 gyro;                       // mean, raw
  double uneven = 0.0;                // half of what the means of both halves differ by, raw
};
// Those in which a gyro stands at the end of its range are counted alone.
std::vector<SteadyRate> find_steady_rates(const PoseInput& input, const std::vector<Clipping>& clipped,
                                          int& at_the_end);

// Those about one axis of the table, apart by how the sensor was mounted on it: rates that turn the sensor about another of its axes than
// the ones before. What the gyros read at rest is that of the poses; without poses all are one.
std::vector<std::vector<SteadyRate>> mounts_of(const PoseInput& input, const std::vector<SteadyRate>& rates,
                                               const std::vector<Pose>& poses, bool outer);

struct Delay {
  double time_s = 0.0;  // by the read-out, since the start
  double delay_s = 0.0;
};
std::vector<Delay> delays_of_turns(const PoseInput& input, const std::vector<TurnRow>& rows, const ReadOuts& found);
std::vector<Delay> delays_of_steps(const PoseInput& input, const std::vector<SteadyRate>& rates, const ReadOuts& found);

}  // namespace selfcal::diagnosis
