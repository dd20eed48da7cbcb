#include "estimator/diagnosis/poses/rest.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "estimator/diagnosis/poses/pose_quantum.hpp"
#include "estimator/diagnosis/poses/rest_drift.hpp"
#include "estimator/diagnosis/poses/rest_swing.hpp"
#include "estimator/diagnosis/poses/rest_tilt.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// Quantum of an axis, and what it hides of the mean. A pose in which nothing steps has the quantum of the log.
void add_quantum(const PoseInput& input, const std::vector<Pose>& poses, RestAxis& a) {
  const auto& series = a.gyro ? input.gyro : input.accel;
  const auto axis = static_cast<std::size_t>(a.axis);
  if (const double band = silent_band(series, axis, poses); band > 0.0) {
    a.quantum = quantum_of(series, axis, 0, series.size());
    a.mean_sigma = std::hypot(a.mean_sigma, hidden_by_band(band, a.quantum));
    return;
  }
  double least = HUGE_VAL, square = 0.0, count = 0.0;
  for (const Pose& p : poses) {
    for (const auto& [first, last] : p.quiet) {
      const double quantum = quantum_of(series, axis, first, last);
      least = quantum > 0.0 ? std::min(least, quantum) : least;
      for (std::size_t i = first + 1; i < last; ++i) {
        square += 0.5 * std::pow(series[i][axis] - series[i - 1][axis], 2);
        count += 1.0;
      }
    }
  }
  least = std::isfinite(least) ? least : quantum_of(series, axis, 0, series.size());
  if (least <= 0.0 || count <= 0.0) {
    return;
  }
  constexpr double visible = 0.01;
  const double off = hidden_by_quantum(square / count / (least * least));
  a.mean_sigma = std::hypot(a.mean_sigma, off * least);
  a.quantum = off > visible ? least : 0.0;
}

// White noise shows where sigma sqrt(tau) is least: quanta and vibration lie above it at short times, slow noise at long ones.
void add_allan(const std::vector<RestNoise>& noise, RestAxis& a) {
  const auto axis = static_cast<std::size_t>(a.axis);
  constexpr double enough = 8.0, many = 200.0;  // means that do not overlap: 25 % and 5 % of the deviation
  double white = HUGE_VAL, least = HUGE_VAL;
  double longest = 0.0;
  for (const RestNoise& n : noise) {
    if (n.freedom < enough && longest > 0.0) {
      break;
    }
    if (n.freedom >= many || !std::isfinite(white)) {
      white = std::min(white, n.deviation[axis] * std::sqrt(n.tau_s));
    }
    if (n.deviation[axis] < least) {
      least = n.deviation[axis];
      a.instability_tau_s = n.tau_s;
    }
  }
  a.white_asd = std::isfinite(white) ? white : 0.0;
  a.instability = std::isfinite(least) ? least : 0.0;
  a.instability_is_bound = a.instability_tau_s == longest;
}

// What swings stands in the Allan deviation at all times, and would be told as white noise.
void add_swing(const PoseInput& input, const std::vector<Pose>& poses, RestAxis& a) {
  constexpr double counts = 1.3;
  const auto swing =
      find_swing(a.gyro ? input.gyro : input.accel, static_cast<std::size_t>(a.axis), sample_rate(input), poses);
  if (swing) {
    a.swing = swing->amplitude;
    a.swing_hz = swing->frequency_hz;
    a.white_asd = a.white_asd > counts * swing->white_asd ? swing->white_asd : a.white_asd;
  }
}

std::string with_number(const char* format, double value) {
  char text[200];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

bool names(const Rest& rest, bool gyro, bool of_temperature) {
  return std::any_of(rest.axes.begin(), rest.axes.end(), [&](const RestAxis& a) {
    return a.gyro == gyro && std::any_of(a.terms.begin(), a.terms.end(), [&](const RestTerm& t) {
             return t.found.equation.of_temperature == of_temperature;
           });
  });
}

// The Earth turns by 15.04 deg/h, which the gyros' mean holds.
std::string of_gyros(const Rest& rest) {
  double square = 0.0, most_sigma = 0.0;
  for (const RestAxis& a : rest.axes) {
    if (a.gyro) {
      square += a.mean * a.mean;
      most_sigma = std::max(most_sigma, a.mean_sigma);
    }
  }
  const double sigma = most_sigma / units::degree_per_hour;
  constexpr double visible = 3.0;  // deg/h: a fifth of the Earth's rate
  if (!rest.si) {
    return "bias of the gyros apart from the Earth's rate: no unit and no north";
  }
  if (!std::isfinite(sigma)) {
    return "the Earth's rate: gyros that read one value do not show it";
  }
  if (sigma > visible) {
    return with_number("the Earth's 15.04 deg/h apart from a bias of the gyros known to %.2g", sigma);
  }
  return with_number("bias of the gyros apart from the Earth's rate (%.2f deg/h in all)",
                     std::sqrt(square) / units::degree_per_hour);
}

// Whether a jump of the gyros is no larger than a sensor that was turned sees of the Earth's rate.
bool may_be_headings(const Rest& rest) {
  constexpr double both_ways = 2.0 * 15.041 * units::degree_per_hour, sure = 3.0;
  return rest.si && std::any_of(rest.axes.begin(), rest.axes.end(), [](const RestAxis& a) {
           return a.gyro && std::any_of(a.terms.begin(), a.terms.end(), [](const RestTerm& t) {
                    return t.found.equation.jumps && std::abs(t.found.value) - sure * t.found.sigma < both_ways;
                  });
         });
}

}  // namespace

std::optional<Rest> judge_rest(const PoseInput& input, const std::vector<Pose>& poses, double alpha,
                               const PoseDiagnosis& d) {
  if (poses.empty()) {
    return std::nullopt;
  }
  const RestBlocks blocks = rest_blocks(input, poses);
  constexpr Eigen::Index least = 5;
  if (blocks.rows() < least + static_cast<Eigen::Index>(poses.size())) {
    return std::nullopt;
  }
  Rest rest;
  rest.si = (input.sensors == Sensors::gyros || input.accel_unit > 0.0) &&
            (input.sensors == Sensors::accelerometers || input.gyros_si);
  rest.blocks = static_cast<int>(blocks.rows());
  rest.block_s = blocks.times.block_s;
  rest.has_channel = !input.temperature_c.empty();
  rest.drift_tested = drift_is_asked(blocks);
  if (blocks.temperature.size() > 0) {
    rest.coldest = blocks.temperature.minCoeff();
    rest.warmest = blocks.temperature.maxCoeff();
  }
  for (const bool gyro : {true, false}) {
    for (int axis = 0; axis < 3 && input.sensors != (gyro ? Sensors::accelerometers : Sensors::gyros); ++axis) {
      if (gyro && !input.gyro_axes[static_cast<std::size_t>(axis)]) {
        continue;
      }
      RestAxis a;
      a.gyro = gyro;
      a.axis = axis;
      add_allan(gyro ? d.gyro_noise : d.accel_noise, a);
      rest.axes.push_back(a);
    }
  }
  for (RestAxis& a : rest.axes) {
    add_swing(input, poses, a);
  }
  constexpr double of_promised =
      0.5;  // the noise is of no grid: half of what is promised, as in the diagnosis elsewhere
  judge_drift(blocks, of_promised * alpha, rest.axes);
  judge_tilt(input, poses, blocks, rest);
  for (RestAxis& a : rest.axes) {
    add_quantum(input, poses, a);
    if (a.gyro || std::abs(a.mean) < 0.1 * blocks.accel.row(0).norm()) {  // a scale factor shows where gravity acts
      for (RestTerm& t : a.terms) {
        t.twins.clear();
      }
    }
  }
  return rest;
}

std::vector<std::string> undetermined_at_rest(const Rest& rest, const PoseDiagnosis& d) {
  std::vector<std::string> all;
  if (d.sensors == Sensors::both) {
    all.emplace_back("scale factors, misalignment: six poses and turns between them");
    all.emplace_back("bias of the accelerometers: where gravity points in them is not known");
    if (!d.earth_taken_out) {
      all.push_back(of_gyros(rest));
    }
  }
  if (may_be_headings(rest)) {
    all.emplace_back("a jump of the gyros apart from another heading: the Earth's rate makes as much");
  }
  if (names(rest, false, true) || names(rest, false, false)) {
    all.emplace_back("drift of accelerometers or tilt of the base: 1 mg is 0.057 deg");
  }
  if (!rest.has_channel) {
    all.emplace_back("the temperature's part: the log has no such channel");
  } else if (!rest.coldest) {
    all.emplace_back("the temperature's part: its channel moves by no more than its noise");
  } else if (!rest.drift_tested) {
    all.emplace_back("drift: too short a rest");
  }
  return all;
}

}  // namespace selfcal::diagnosis
