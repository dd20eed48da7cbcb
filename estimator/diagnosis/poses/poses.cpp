#include "estimator/diagnosis/poses/poses.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "estimator/diagnosis/poses/pose_axes.hpp"
#include "estimator/diagnosis/poses/pose_claims.hpp"
#include "estimator/diagnosis/poses/pose_data.hpp"
#include "estimator/diagnosis/poses/pose_earth.hpp"
#include "estimator/diagnosis/poses/pose_headings.hpp"
#include "estimator/diagnosis/poses/pose_judgement.hpp"
#include "estimator/diagnosis/poses/pose_motion.hpp"
#include "estimator/diagnosis/poses/pose_noise.hpp"
#include "estimator/diagnosis/poses/pose_quantum.hpp"
#include "estimator/diagnosis/poses/pose_spikes.hpp"
#include "estimator/diagnosis/poses/pose_stuck.hpp"
#include "estimator/diagnosis/poses/pose_thermal.hpp"
#include "estimator/diagnosis/poses/pose_turns.hpp"
#include "estimator/diagnosis/poses/read_outs.hpp"
#include "estimator/geometry/angles.hpp"
#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

std::string with_numbers(const char* format, double a, double b) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, a, b);
  return text.data();
}

std::string counted(int count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

void add_noise(const PoseInput& input, const std::vector<Pose>& poses, PoseDiagnosis& d) {
  Vector3 white = Vector3::Zero();
  for (const Pose& p : poses) {
    white += p.gyro_white.cwiseAbs2();
    d.force_at_rest_g += p.accel.norm() * input.accel_unit / 9.80665 / static_cast<double>(poses.size());
    for (const auto& [first, last] : p.quiet) {
      d.static_seconds += input.time_s[last - 1] - input.time_s[first];
    }
  }
  if (input.sensors != Sensors::accelerometers) {
    d.gyro_noise = noise_at_rest(input, input.gyro, poses);
  }
  if (input.sensors != Sensors::gyros) {
    d.accel_noise = noise_at_rest(input, input.accel, poses);
  }
  white = (white / static_cast<double>(poses.size())).cwiseSqrt();
  d.gyro_white_rms = {white.x(), white.y(), white.z()};
  d.poses = static_cast<int>(poses.size());
}

bool has_attitude(const PoseDiagnosis& d) { return d.by_attitude && d.by_attitude->failure.empty(); }

std::string about_attitude(const PoseDiagnosis& d) {
  return d.by_attitude && !d.by_attitude->failure.empty() ? "the attitude: " + d.by_attitude->failure + "; " : "";
}

constexpr double narrow_deg = 20.0;
constexpr std::size_t least_poses = 6;  // biases and scale factors

void add_untested(PoseDiagnosis& d) {
  if (!d.accel_tested) {
    d.invisible.emplace_back(
        "nonlinearity of the accelerometers: it takes 12 poses and more in directions that determine bias, scale and "
        "misalignment first");
  }
}

void add_invisible(PoseDiagnosis& d) {
  if (d.gravity_span_deg < narrow_deg) {
    d.invisible.emplace_back(
        "bias, scale and misalignment of the accelerometers, gyro_g_sensitivity: gravity hardly moves in the sensor");
  } else {
    d.invisible.emplace_back(
        "isotropic part of gyro_g_sensitivity: it turns about gravity, which no direction of gravity shows, and in "
        "the poses it stands together with the Earth's rate about the vertical");
  }
  d.invisible.emplace_back(
      "gyro_magnetic_sensitivity: without heading it cannot be told from the field's vertical part, so it is "
      "not excluded");
  add_untested(d);
}

void add_invisible_of_accelerometers(PoseDiagnosis& d) {
  if (d.gravity_span_deg < narrow_deg) {
    d.invisible.emplace_back("bias, scale and misalignment of the accelerometers: gravity hardly moves in the sensor");
  }
  add_untested(d);
}

AccelModel calibrate(const PoseInput& input, double alpha, std::vector<Pose>& poses, PoseDiagnosis& d) {
  const auto fit = [&] {
    AccelModel model = fit_accelerometers(input, poses);
    for (Pose& p : poses) {
      p.u = model.direction(p.accel);
    }
    return model;
  };
  AccelModel accel = fit();
  const double duration_s = input.time_s.back() - input.time_s.front();
  constexpr double of_temperature = 0.3;
  const double left = d.has_temperature ? (1.0 - of_temperature) * alpha : alpha;
  if (d.has_temperature) {
    d.accel_named = name_thermal(accel, poses, duration_s, of_temperature * alpha);
    take_out(d.accel_named, accel, duration_s, poses);
    accel = fit();
    // What the poses differed by before was noise of the first fit, and a hundredth of g is not small: to convergence.
    constexpr int rounds = 3;
    for (int round = 0; round < rounds && !d.accel_named.empty(); ++round) {
      take_out(refine_thermal(accel, poses, duration_s, d.accel_named), accel, duration_s, poses);
      accel = fit();
    }
  }
  d.settling = find_settling(input, poses, accel, d.accel_named, 0.5 * left);
  if (d.settling) {
    take_out(*d.settling, input, accel, poses);
    accel = fit();
  }
  d.gravity_span_deg = gravity_span_deg(poses);
  judge_accelerometers(accel, poses, duration_s, d.has_temperature, 0.5 * left, d);
  d.accel_parameters = parameters_of(accel);
  return accel;
}

void judge_poses(const PoseInput& as_told, double alpha, std::vector<Pose>& poses, PoseDiagnosis& d) {
  // Accelerometers, their settling and the gyros share the false-alarm rate: a half, of it a half, and a half.
  const AccelModel accel = calibrate(as_told, 0.5 * alpha, poses, d);
  d.failure = not_gravity(as_told, poses, accel);
  if (!d.failure.empty()) {
    return;
  }
  const std::vector<std::size_t> turns = usable_turns(as_told, poses, d);
  const PoseInput input = with_unit_by_turns(as_told, poses, turns, d);
  if (!judge_free_headings(input, poses, turns, d)) {
    judge_gyros(input, without_earth(input, poses, turns, d), input.time_s.back() - input.time_s.front(),
                d.has_temperature, 0.5 * alpha, d);
    mark_earth(input, d);
  }
  const bool linear = std::any_of(d.gyro_named.begin(), d.gyro_named.end(),
                                  [](const PoseEffect& p) { return p.effect->linear_in_force; });
  if (d.gyro_axes == input.gyro_axes) {
    judge_turns(input, poses, turns, accel, linear, d);
  }
  add_invisible(d);
  if (d.turns > 0 && std::none_of(d.gyro_parameters.begin(), d.gyro_parameters.end(),
                                  [](const PoseParameter& p) { return p.determined; })) {
    d.invisible.push_back(std::string("scale factors of the gyros: they carry gravity's direction wrong by ") +
                          with_numbers("%.0f deg", d.direction_after / units::degree, 0.0) +
                          (input.gyros_si ? "" : ", and nobody says their unit (--gyro-unit)"));
  }
  if (d.turns_whole > 0) {
    d.invisible.push_back("scale factors by " + counted(d.turns_whole, "turn") +
                          " of more than one and a half rounds: gravity's direction is not carried so far");
  }
}

void add_read_outs(const PoseInput& input, PoseDiagnosis& d) {
  if (has_attitude(d)) {
    d.supports.emplace_back(d.by_attitude->gravity
                                ? "an attitude: gyros that turn, accelerometers in poses, and its clock"
                                : "an attitude: gyros that turn, and its clock");
  }
  if (d.read_outs && d.read_outs->clipped_turns + d.read_outs->clipped_rates > 0) {
    d.invisible.push_back("what " + counted(d.read_outs->clipped_turns, "turn") + " and " +
                          counted(d.read_outs->clipped_rates, "steady rate") +
                          " of the table tell, in which a gyro stands at the end of its range");
  }
  if (d.read_outs) {
    d.supports.emplace_back("angle read-outs: gyros that turn about the table's axes, and the table's clock");
  } else if (!input.outer.empty()) {
    d.invisible.emplace_back("scale factors by the read-outs: no turn that they and the gyros both show");
  }
}

// What the recording is a reference for.
void add_supports(const PoseInput& input, PoseDiagnosis& d) {
  if (d.by_poses) {
    d.supports.push_back("gravity in " + std::to_string(d.poses) + " poses: accelerometers, and gyros at rest");
    if (d.turns > 0) {
      d.supports.push_back("gravity carried through " + std::to_string(d.turns) + " turns: gyros that turn");
    }
  }
  add_read_outs(input, d);
  if (d.steady_turns > 0 && input.outer.empty() && !has_attitude(d)) {
    d.invisible.push_back("scale factors by " + std::to_string(d.steady_turns) +
                          " stretches that turn steadily: the recording holds no angle of the table");
  }
}

// A rate times a wrong time is a wrong angle.
void add_clock(PoseDiagnosis& d) {
  const bool scale_told = std::any_of(d.gyro_parameters.begin(), d.gyro_parameters.end(), [](const PoseParameter& p) {
    return p.determined && p.name.starts_with("scale_");
  });
  if (scale_told || d.read_outs || has_attitude(d)) {
    d.invisible.emplace_back(
        "the log's clock: its error is one of all gyros' scale factors; where it is 1 % slow, those of gyros that give "
        "rates are 1 % less; increments of angle are free of it");
  }
}

void add_rest(const PoseInput& input, double alpha, const std::vector<Pose>& poses, PoseDiagnosis& d) {
  d.rest = judge_rest(input, poses, alpha, d);
  if (!d.rest) {
    return;
  }
  if (poses.size() > 1 && input.gyros_si && input.latitude) {
    add_bias_by_headings(input, poses, d);
  }
  d.supports.push_back("rest in " + counted(d.poses, "pose") + ": noise, means, and what changes while nothing turns");
  for (const std::string& words : undetermined_at_rest(*d.rest, d)) {
    d.invisible.push_back(words);
  }
  constexpr double most = 0.7;
  const double all = input.time_s.back() - input.time_s.front();
  if (d.steady_turns == 0 && !d.read_outs && !has_attitude(d) && d.static_seconds < most * all) {
    d.invisible.push_back("what happens in " + std::to_string(std::lround(all - d.static_seconds)) + " of " +
                          std::to_string(std::lround(all)) +
                          " s: the sensor shakes or moves more than at rest there, and they are left out");
  }
}

// Gyros alone: nothing says where down is, so that only rest and a table's angles are left to hold them against.
void judge_gyros_alone(const PoseInput& input, double alpha, const std::vector<Pose>& poses, PoseDiagnosis& d) {
  d.read_outs = read_outs_of(input, poses, d.clipped, alpha, d.invisible);
  d.accel_adequate = true;
  if (poses.empty() && !d.read_outs && !has_attitude(d)) {
    d.failure = about_attitude(d) +
                "gyros alone, that neither stand still nor turn with read-outs: nothing to hold them against";
    return;
  }
  const auto n = static_cast<double>(poses.size());
  for (std::size_t axis = 0; axis < 3 && !poses.empty(); ++axis) {
    if (!input.gyro_axes[axis]) {
      continue;
    }
    double mean = 0.0, square = 0.0;
    for (const Pose& p : poses) {
      mean += p.gyro(static_cast<Eigen::Index>(axis)) / n;
    }
    for (const Pose& p : poses) {
      const double off = p.gyro(static_cast<Eigen::Index>(axis)) - mean;
      square += off * off;
    }
    d.gyro_bias[axis] = mean;
    d.gyro_bias_sigma[axis] = poses.size() > 1 ? std::sqrt(square / (n - 1.0) / n) : d.gyro_white_rms[axis];
    d.gyro_bias_sigma[axis] =
        std::hypot(d.gyro_bias_sigma[axis], poses.front().gyro_hidden(static_cast<Eigen::Index>(axis)) / std::sqrt(n));
    d.gyro_held_out_rms[axis] = poses.size() > 1 ? std::sqrt(square / n) * n / (n - 1.0) : 0.0;
  }
  if (poses.size() < least_poses) {
    add_rest(input, alpha, poses, d);
  }
  if (!poses.empty() && !d.rest) {
    d.supports.push_back("rest in " + counted(d.poses, "stop") + ": bias and noise of the gyros");
  }
  add_read_outs(input, d);
  d.invisible.emplace_back("accelerometers: the log holds none");
  d.invisible.emplace_back(
      "the Earth's rate apart from the bias, gyro_g_sensitivity, how the axes lie: no accelerometer says where down "
      "is");
  if (!d.read_outs && !has_attitude(d)) {
    d.invisible.emplace_back(
        "scale factors and misalignment of the gyros: neither angle read-outs nor gravity say how far a turn went");
  }
}

// Accelerometers alone: gravity in poses as ever, but nothing shows a turn.
void judge_accelerometers_alone(const PoseInput& input, double alpha, std::vector<Pose>& poses, PoseDiagnosis& d) {
  d.accel_adequate = true;
  if (poses.empty()) {
    d.failure = "accelerometers alone, that never stand still: gravity is no reference then";
    return;
  }
  if (d.by_poses) {
    const AccelModel accel = calibrate(input, alpha, poses, d);
    d.failure = not_gravity(input, poses, accel);
    if (!d.failure.empty()) {
      return;
    }
    d.supports.push_back("gravity in " + std::to_string(d.poses) + " poses: accelerometers");
    add_invisible_of_accelerometers(d);
  } else {
    add_rest(input, alpha, poses, d);
    if (!d.rest) {
      d.supports.push_back("rest in " + counted(d.poses, "pose") + ": noise of the accelerometers");
    }
    d.invisible.push_back("bias, scale and misalignment of the accelerometers: fewer than 6 static poses: " +
                          std::to_string(d.poses));
  }
  d.invisible.emplace_back("gyros: the log holds none");
  d.invisible.emplace_back(
      "turns: without gyros nothing carries gravity from pose to pose, and a turn about the vertical is not seen at "
      "all");
  if (!input.outer.empty()) {
    d.invisible.emplace_back("delay and scale of the read-outs: they are held against gyros, and the log holds none");
  }
}

// Stretches as quiet as a pose of which gravity is no reference; empty: none.
std::string other_forces_words(const PoseDiagnosis& d) {
  const auto [least, most] = std::minmax_element(d.other_forces.begin(), d.other_forces.end());
  return counted(static_cast<int>(d.other_forces.size()), "quiet part") +
         with_numbers(" at %.2f to %.2f g", *least, *most);
}

// Why nothing is left to hold the log against; empty: something is, or it is judged by what else there is.
std::string why_no_poses(const PoseInput& input, const std::vector<Pose>& poses, const PoseDiagnosis& d) {
  constexpr double weightless = 0.3;  // g
  const bool nothing_else = poses.empty() && input.outer.empty() && !input.attitude;
  if (nothing_else && !d.other_forces.empty()) {
    const bool free =
        std::all_of(d.other_forces.begin(), d.other_forces.end(), [](double force) { return force < weightless; });
    constexpr std::size_t several = 4;
    constexpr double of_each_other = 1.3;
    const auto [low, high] = std::minmax_element(d.other_forces.begin(), d.other_forces.end());
    const bool alike = d.other_forces.size() >= several && *high < of_each_other * *low;
    constexpr double off = 0.1, unit = 1.0 / 9.80665;
    const bool of_g = alike && std::abs(*low / unit - 1.0) < off && std::abs(*high / unit - 1.0) < off;
    return free && !of_g
               ? "the accelerometers read next to nothing at rest: gravity is not in them, as in a phone's linear "
                 "acceleration"
           : alike ? "at rest the accelerometers read" + with_numbers(" %.4g to %.4g g: ", *low, *high) +
                         "gravity in another unit than is said of them"
                   : "steady, but not at 1 g: " + other_forces_words(d) + "; gravity is no reference there";
  }
  if (nothing_else && d.clipped_poses > 0) {
    return "at rest an accelerometer stands at the end of its range: its means are none";
  }
  constexpr double shortest_s = 20.0;  // find_poses
  if (nothing_else && d.duration_s < shortest_s) {
    return "less than 20 s: too short to tell rest from motion";
  }
  if (nothing_else && input.sensors != Sensors::gyros && d.steady_turns == 0) {
    return "the sensor nowhere rests for a second: neither gravity nor rest is a reference";
  }
  return {};
}

void add_other_forces(PoseDiagnosis& d) {
  if (!d.other_forces.empty()) {
    d.invisible.push_back("what " + other_forces_words(d) + " tell: steady acceleration, no pose");
  }
  if (d.clipped_poses > 0) {
    d.invisible.push_back("what " + counted(d.clipped_poses, "pose") +
                          " with an accelerometer at the end of its range tell: a mean of what is clipped is none");
  }
}

// What the attitude leaves open is told with the rest.
void add_open(PoseDiagnosis& d) {
  if (has_attitude(d)) {
    d.invisible.insert(d.invisible.end(), d.by_attitude->invisible.begin(), d.by_attitude->invisible.end());
  }
}

// Whether it is that of an encoder which counts from 0 to 360 deg and begins again.
bool wraps(const std::vector<double>& angle) {
  return std::adjacent_find(angle.begin(), angle.end(), [](double a, double b) { return std::abs(b - a) > M_PI; }) !=
         angle.end();
}

PoseDiagnosis diagnose_continuous(const PoseInput& input, double alpha) {
  PoseDiagnosis d;
  if (input.time_s.size() < 100 || input.gyro.size() != input.time_s.size() ||
      input.accel.size() != input.time_s.size()) {
    d.failure = "too few samples";
    return d;
  }
  d.sensors = input.sensors;
  d.duration_s = input.time_s.back() - input.time_s.front();
  d.gyro_axes = input.gyro_axes;
  d.failure = no_readings(input);
  if (!d.failure.empty()) {
    return d;
  }
  const std::vector<StuckAxis> stuck = find_stuck(input);
  add_dead_axes(stuck, d);
  if (!d.failure.empty()) {
    return d;
  }
  d.clipped = find_clipping(input);
  d.left_out = find_left_out(input, stuck);
  FoundPoses found = find_poses(input, d.left_out);
  if (!found.zero_elsewhere.empty()) {
    PoseInput about = input;
    about.accel_zero_known = false;
    d = diagnose_continuous(about, alpha);
    d.forces_of_another_zero = std::move(found.zero_elsewhere);
    return d;
  }
  std::vector<Pose>& poses = found.poses;
  d.steady_turns = found.steady_turns;
  d.moving = found.moving;
  d.other_forces = found.other_forces;
  d.clipped_poses = input.sensors == Sensors::gyros ? 0 : drop_clipped(input, d.clipped, poses);
  d.failure = why_no_poses(input, poses, d);
  if (!d.failure.empty()) {
    return d;
  }
  add_other_forces(d);
  if (!poses.empty()) {
    add_noise(input, poses, d);
    d.has_temperature = take_temperatures(input, poses);
  }
  d.by_poses = poses.size() >= least_poses && input.sensors != Sensors::gyros;
  if (std::string silent = silent_gyros(input, poses); !silent.empty()) {
    d.invisible.push_back(std::move(silent));
  }
  if (input.attitude && input.sensors != Sensors::accelerometers) {
    d.by_attitude = judge_attitude(input, *input.attitude, poses);
  }
  if (input.sensors == Sensors::gyros) {
    judge_gyros_alone(input, alpha, poses, d);
    add_open(d);
    return d;
  }
  if (input.sensors == Sensors::accelerometers) {
    judge_accelerometers_alone(input, alpha, poses, d);
    return d;
  }
  constexpr double of_read_outs = 0.2;
  d.read_outs = read_outs_of(input, poses, d.clipped, of_read_outs * alpha, d.invisible);
  const double left = (d.read_outs ? 1.0 - of_read_outs : 1.0) * alpha;
  if (!d.by_poses) {
    add_rest(input, left, poses, d);
  }
  if (!d.by_poses && !d.read_outs && !d.rest && !has_attitude(d)) {
    d.failure = about_attitude(d) +
                (poses.empty() && d.steady_turns > 0
                     ? "it turns all the time, steadily in " + counted(d.steady_turns, "part") +
                           ": no rest, and no angle of a table"
                     : "fewer than 6 static poses: " + std::to_string(poses.size()) + ", and too little rest in them");
    return d;
  }
  if (d.by_poses) {
    judge_poses(input, left, poses, d);
  } else {
    d.accel_adequate = true;
    if (!d.rest) {
      d.invisible.push_back("accelerometers, and gyros at rest: fewer than 6 static poses: " +
                            std::to_string(poses.size()));
    }
  }
  add_supports(input, d);
  add_clock(d);
  add_open(d);
  return d;
}

}  // namespace

PoseDiagnosis diagnose_poses(const PoseInput& input, double alpha) {
  PoseInput used = input;
  const std::size_t spikes = take_out_spikes(used);
  if (wraps(used.outer) || wraps(used.inner)) {
    used.outer = unwrapped(std::move(used.outer));
    used.inner = unwrapped(std::move(used.inner));
  }
  PoseDiagnosis d = diagnose_continuous(used, alpha);
  d.spikes = spikes;
  return d;
}

}  // namespace selfcal::diagnosis
