#include "estimator/diagnosis/poses/poses.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/poses/pose_data.hpp"
#include "estimator/diagnosis/poses/pose_judgement.hpp"
#include "estimator/diagnosis/poses/pose_noise.hpp"
#include "estimator/diagnosis/poses/pose_turns.hpp"
#include "estimator/diagnosis/poses/read_outs.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

double span_of(const std::vector<Pose>& poses) {
  double least = 1.0;
  for (const Pose& a : poses) {
    for (const Pose& b : poses) {
      least = std::min(least, a.u.normalized().dot(b.u.normalized()));
    }
  }
  return std::acos(std::clamp(least, -1.0, 1.0)) / units::degree;
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

void calibrate(const PoseInput& input, double alpha, std::vector<Pose>& poses, PoseDiagnosis& d) {
  const auto fit = [&] {
    AccelModel model = fit_accelerometers(input, poses);
    for (Pose& p : poses) {
      p.u = model.direction(p.accel);
    }
    return model;
  };
  AccelModel accel = fit();
  d.settling = find_settling(input, poses, accel, 0.5 * alpha);
  if (d.settling) {
    take_out(*d.settling, input, accel, poses);
    accel = fit();
  }
  d.accel_parameters = parameters_of(accel);
  d.gravity_span_deg = span_of(poses);
  judge_accelerometers(accel, poses, input.time_s.back() - input.time_s.front(), 0.5 * alpha, d);
}

}  // namespace

namespace {

void judge_poses(const PoseInput& input, double alpha, std::vector<Pose>& poses, PoseDiagnosis& d) {
  // Accelerometers, their settling and the gyros share the false-alarm rate: a half, of it a half, and a half.
  calibrate(input, 0.5 * alpha, poses, d);
  judge_gyros(poses, input.time_s.back() - input.time_s.front(), 0.5 * alpha, d);
  const bool linear = std::any_of(d.gyro_named.begin(), d.gyro_named.end(),
                                  [](const PoseEffect& p) { return p.effect->linear_in_force; });
  judge_turns(input, poses, linear, d);
  add_invisible(d);
}

void add_read_outs(const PoseInput& input, PoseDiagnosis& d) {
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
}

std::string counted(int count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

void add_rest(const PoseInput& input, double alpha, const std::vector<Pose>& poses, PoseDiagnosis& d) {
  d.rest = judge_rest(input, poses, alpha, d);
  if (!d.rest) {
    return;
  }
  d.supports.push_back("rest in " + counted(d.poses, "pose") + ": noise, means, and what changes while nothing turns");
  for (const std::string& words : undetermined_at_rest(*d.rest, d)) {
    d.invisible.push_back(words);
  }
}

// Gyros alone: nothing says where down is, so that only rest and a table's angles are left to hold them against.
void judge_gyros_alone(const PoseInput& input, double alpha, const std::vector<Pose>& poses, PoseDiagnosis& d) {
  d.read_outs = judge_read_outs(input, poses, alpha);
  d.accel_adequate = true;
  if (poses.empty() && !d.read_outs) {
    d.failure = "gyros alone, that neither stand still nor turn with read-outs: nothing to hold them against";
    return;
  }
  const auto n = static_cast<double>(poses.size());
  for (std::size_t axis = 0; axis < 3 && !poses.empty(); ++axis) {
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
  if (!d.read_outs) {
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
    calibrate(input, alpha, poses, d);
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

}  // namespace

PoseDiagnosis diagnose_poses(const PoseInput& input, double alpha) {
  PoseDiagnosis d;
  if (input.time_s.size() < 100 || input.gyro.size() != input.time_s.size() ||
      input.accel.size() != input.time_s.size()) {
    d.failure = "too few samples";
    return d;
  }
  d.sensors = input.sensors;
  d.clipped = find_clipping(input);
  d.left_out = find_left_out(input);
  std::vector<Pose> poses = find_poses(input);
  if (!poses.empty()) {
    add_noise(input, poses, d);
  }
  d.by_poses = poses.size() >= least_poses && input.sensors != Sensors::gyros;
  if (input.sensors == Sensors::gyros) {
    judge_gyros_alone(input, alpha, poses, d);
    return d;
  }
  if (input.sensors == Sensors::accelerometers) {
    judge_accelerometers_alone(input, alpha, poses, d);
    return d;
  }
  constexpr double of_read_outs = 0.2;
  d.read_outs = judge_read_outs(input, poses, of_read_outs * alpha);
  const double left = (d.read_outs ? 1.0 - of_read_outs : 1.0) * alpha;
  if (!d.by_poses) {
    add_rest(input, left, poses, d);
  }
  if (!d.by_poses && !d.read_outs && !d.rest) {
    d.failure = "fewer than 6 static poses: " + std::to_string(poses.size()) + ", and too little rest in them";
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
  return d;
}

}  // namespace selfcal::diagnosis
