#include "estimator/diagnosis/poses/pose_turns.hpp"

#include "estimator/diagnosis/poses/pose_axes.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/geometry/units.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
constexpr double scale_before = 0.1;  // sigma of S before the data

Vector3 left_in(const Pose& p, const GyroModel& model) { return p.gyro - model.bias - model.G * p.u; }

// u at the beginning of pose k+1, carried there from pose k, less the accelerometers' u.
Vector3 direction_error(const PoseInput& input, const Pose& from, const Pose& to, const GyroModel& model) {
  Vector3 u = from.u.normalized();
  Vector3 besides = Vector3::Zero(), more = Vector3::Zero();  // at the end of `from`; a second
  if (model.drifts) {
    besides = left_in(from, model);
    more = (left_in(to, model) - besides) / (to.middle_s - from.middle_s);
    besides += more * (input.time_s[from.last - 1] - input.time_s.front() - from.middle_s);
  }
  for (std::size_t i = from.last; i < to.first; ++i) {
    const double dt = input.time_s[i] - input.time_s[i - 1];
    besides += more * dt;
    const Vector3 raw = at(input.gyro, i) - model.bias - besides - model.G * u;
    u = matrix_from_rotation_vector(-(model.S * raw) * input.gyro_unit * dt) * u;
  }
  return u - to.u.normalized();
}

struct TurnFit {
  double noise = 0.0;        // rad, of a component
  bool by_residuals = true;  // whether turns leave a residual that shows it
  Eigen::MatrixXd response;  // of S to the directions' errors, [9 x 3 turns]
  Eigen::Matrix<double, 9, 1> sigma = Eigen::Matrix<double, 9, 1>::Zero();
};

// Of noise that is known by the scatter of so many degrees of freedom: Student's two-sided 95 % in those of a normal distribution. t^2 is
// distributed as F with one degree of freedom above.
double wider_by_few(double free) {
  constexpr double normal = 1.959964;
  const double tail = std::log(0.05);
  double low = normal, high = 13.0;  // 12.7 with one
  while (high - low > 1e-3) {
    const double t = 0.5 * (low + high);
    (log_f_tail(t * t, 1.0, free) > tail ? low : high) = t;
  }
  return low / normal;
}

// Fits S to `turns` (numbers of the poses that they begin at) but `without`.
TurnFit fit_turns(const PoseInput& input, const std::vector<Pose>& poses, const std::vector<std::size_t>& turns,
                  std::size_t without, GyroModel& model) {
  TurnFit fit;
  fit.noise = 0.01;
  for (int round = 0; round < 4; ++round) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(turns.size()), 9);
    Eigen::VectorXd r = Eigen::VectorXd::Zero(J.rows());
    for (std::size_t t = 0; t < turns.size(); ++t) {
      const std::size_t k = turns[t];
      if (k == without) {
        continue;
      }
      const auto row = 3 * static_cast<Eigen::Index>(t);
      const Vector3 now = direction_error(input, poses[k], poses[k + 1], model);
      r.segment<3>(row) = now;
      constexpr double h = 1e-4;
      for (Eigen::Index j = 0; j < 9; ++j) {
        GyroModel moved = model;
        moved.S(j / 3, j % 3) += h;
        J.block<3, 1>(row, j) = (direction_error(input, poses[k], poses[k + 1], moved) - now) / h;
      }
    }
    Eigen::Matrix<double, 9, 1> off;
    for (Eigen::Index j = 0; j < 9; ++j) {
      off(j) = (j % 4 == 0 ? 1.0 : 0.0) - model.S(j / 3, j % 3);
    }
    const double weight = fit.noise * fit.noise / (scale_before * scale_before);
    const Eigen::Matrix<double, 9, 9> normal = J.transpose() * J + weight * Eigen::Matrix<double, 9, 9>::Identity();
    const Eigen::LLT<Eigen::Matrix<double, 9, 9>> solver(normal);
    const Eigen::Matrix<double, 9, 1> step = solver.solve(-J.transpose() * r + weight * off);
    for (Eigen::Index j = 0; j < 9; ++j) {
      model.S(j / 3, j % 3) += step(j);
    }
    fit.response = -solver.solve(J.transpose());
    // A turn gives two components of a direction, and the nine take what the turns determine of them.
    const double taken = solver.solve(J.transpose() * J).trace();
    const double left = 2.0 * static_cast<double>(turns.size()) - taken;
    constexpr double a_residual = 0.5;
    fit.by_residuals = left > a_residual;
    const double free = std::max(1.0, left);
    fit.noise = std::max(1e-6, std::sqrt((r + J * step).squaredNorm() / free));
    fit.sigma =
        Eigen::Matrix<double, 9, 1>(solver.solve(Eigen::Matrix<double, 9, 9>::Identity()).diagonal()).cwiseSqrt() *
        fit.noise * wider_by_few(free);
    if (step.cwiseAbs().maxCoeff() < 1e-5) {
      break;
    }
  }
  return fit;
}

// Bias, and with `linear` G, from the poses but two.
GyroModel static_model(const std::vector<Pose>& poses, std::size_t without, bool linear) {
  std::vector<const Pose*> kept;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (without == none || (k != without && k != without + 1)) {
      kept.push_back(&poses[k]);
    }
  }
  Eigen::MatrixXd X(static_cast<Eigen::Index>(kept.size()), linear ? 4 : 1);
  Eigen::MatrixXd y(X.rows(), 3);
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    const Pose& p = *kept[static_cast<std::size_t>(k)];
    X(k, 0) = 1.0;
    if (linear) {
      X.block<1, 3>(k, 1) = p.u.transpose();
    }
    y.row(k) = p.gyro.transpose();
  }
  const Eigen::MatrixXd solution = X.colPivHouseholderQr().solve(y);
  GyroModel m;
  m.bias = solution.row(0).transpose();
  if (linear) {
    m.G = solution.bottomRows(3).transpose();
  }
  return m;
}

// Whether the poses read more besides than their white noise makes: beside so much, a mean bias is wrong in the turns, and what the readings on
// both sides of a turn are known by is little.
bool drifts(const std::vector<Pose>& poses, const GyroModel& model) {
  constexpr double times = 2.0;
  double square = 0.0, white = 0.0;
  for (const Pose& p : poses) {
    square += left_in(p, model).squaredNorm();
    white += p.gyro_white.squaredNorm();
  }
  return white > 0.0 && square > times * times * white;
}

// Sigma of S by what the poses leave open of the accelerometers: directions of gravity are wrong by as much, and gyros that carry them from
// pose to pose seem misaligned, or of another scale.
Eigen::Matrix<double, 9, 1> sigma_by_accelerometers(const PoseInput& input, const std::vector<Pose>& poses,
                                                    const std::vector<std::size_t>& turns, const AccelModel& accel,
                                                    const TurnFit& fit, const GyroModel& model) {
  Eigen::Matrix<double, 9, 1> square = Eigen::Matrix<double, 9, 1>::Zero();
  constexpr double h = 1e-3;  // of sigma; the directions are linear in so little
  for (Eigen::Index j = 0; j < 9; ++j) {
    const AccelModel moved = accel.moved_by(j, h * accel.open(j));
    std::vector<Pose> others = poses;
    for (Pose& p : others) {
      p.u = moved.direction(p.accel);
    }
    Eigen::VectorXd change(3 * static_cast<Eigen::Index>(turns.size()));
    for (std::size_t t = 0; t < turns.size(); ++t) {
      const std::size_t k = turns[t];
      change.segment<3>(3 * static_cast<Eigen::Index>(t)) = direction_error(input, others[k], others[k + 1], model) -
                                                            direction_error(input, poses[k], poses[k + 1], model);
    }
    square += (fit.response * change / h).cwiseAbs2();
  }
  return square.cwiseSqrt();
}

void add_parameters(const GyroModel& model, const Eigen::Matrix<double, 9, 1>& sigma, PoseDiagnosis& d) {
  // True rate = S times reading: the sensor's own errors are those of the inverse. Products of misalignments of 2 % are 4e-4 of a scale factor.
  const Matrix3 M = model.S.inverse();
  for (Eigen::Index j = 0; j < 9; ++j) {
    const bool diagonal = j % 4 == 0;
    const std::string axes = diagonal ? std::string(1, "xyz"[j / 3]) : std::string{"xyz"[j / 3], "xyz"[j % 3]};
    const double value = M(j / 3, j % 3) - (diagonal ? 1.0 : 0.0);
    d.gyro_parameters.push_back({(diagonal ? "scale_" : "misalignment_") + axes, "1", value,
                                 M(j / 3, j / 3) * M(j % 3, j % 3) * sigma(j), sigma(j) < 0.5 * scale_before});
  }
}

// Without those that go round: where a gyro's scale factor of a per cent makes a phase of half a radian, directions are not linear in it, and
// a wrong one fits as well.
std::vector<std::size_t> without_rounds(const PoseInput& input, const std::vector<Pose>& poses,
                                        std::vector<std::size_t> turns) {
  constexpr double most = 3.0 * M_PI;
  std::erase_if(turns, [&](std::size_t k) {
    const Vector3 bias = 0.5 * (poses[k].gyro + poses[k + 1].gyro);
    double angle = 0.0;
    for (std::size_t i = poses[k].last; i < poses[k + 1].first; ++i) {
      angle += (at(input.gyro, i) - bias).norm() * input.gyro_unit * (input.time_s[i] - input.time_s[i - 1]);
    }
    return angle > most;
  });
  return turns;
}

void close_parameters(PoseDiagnosis& d) {
  for (PoseParameter& p : d.gyro_parameters) {
    p.determined = false;
  }
}

// Of the direction behind a turn, rms over the turns, rad: the noise of the turn and that of the bias by the poses at its ends.
double by_noise(const PoseInput& input, const std::vector<Pose>& poses, const std::vector<std::size_t>& turns) {
  double square = 0.0;
  constexpr double across = 2.0 / 3.0;  // of three components
  for (const std::size_t k : turns) {
    square += across * variance_of_turn(input, poses[k], poses[k + 1]).sum();
  }
  return input.gyro_unit * std::sqrt(square / static_cast<double>(turns.size()));
}

void fit_and_hold_out(const PoseInput& input, const std::vector<Pose>& poses, const std::vector<std::size_t>& turns,
                      const AccelModel& accel, bool linear, PoseDiagnosis& d) {
  // Before what is named: with a bias alone.
  const bool drift = drifts(poses, static_model(poses, none, linear)), more = linear || drift;
  for (const bool with : {false, true}) {
    const auto model_without = [&](std::size_t pose) {
      GyroModel model = static_model(poses, pose, with && linear);
      model.drifts = with && drift;
      return model;
    };
    GyroModel all = model_without(none);
    const TurnFit fit = fit_turns(input, poses, turns, none, all);
    double square = 0.0, held_out_square = 0.0;
    for (const std::size_t k : turns) {
      square += direction_error(input, poses[k], poses[k + 1], all).squaredNorm();
      GyroModel rest = model_without(k);
      rest.S = all.S;
      fit_turns(input, poses, turns, k, rest);
      held_out_square += direction_error(input, poses[k], poses[k + 1], rest).squaredNorm();
    }
    const auto n = static_cast<double>(turns.size());
    (with ? d.direction_after : d.direction_before) = std::sqrt(square / n);
    (with ? d.direction_after_held_out : d.direction_before_held_out) = std::sqrt(held_out_square / n);
    if (with || !more) {
      const auto open = sigma_by_accelerometers(input, poses, turns, accel, fit, all);
      add_parameters(all, (fit.sigma.cwiseAbs2() + open.cwiseAbs2()).cwiseSqrt(), d);
      if (!fit.by_residuals) {
        close_parameters(d);
        d.invisible.push_back("scale factors and misalignment of the gyros by " + std::to_string(turns.size()) +
                              (turns.size() == 1 ? " turn" : " turns") +
                              ": they leave nothing over that says how far they are known");
      }
    }
    if (!with && !more) {
      d.direction_after = d.direction_before;
      d.direction_after_held_out = d.direction_before_held_out;
      break;
    }
  }
}

// Scale factors of counts are told in counts.
void tell_in_raw(PoseDiagnosis& d) {
  for (PoseParameter& p : d.gyro_parameters) {
    if (p.name.starts_with("scale_")) {
      p.value = (1.0 + p.value) / d.gyro_raw_unit;
      p.sigma /= d.gyro_raw_unit;
      p.unit = "raw/(rad/s)";
    }
  }
}

}  // namespace

std::vector<std::size_t> usable_turns(const PoseInput& input, const std::vector<Pose>& poses, const PoseDiagnosis& d) {
  std::vector<std::size_t> turns;
  for (std::size_t k = 0; k + 1 < poses.size(); ++k) {
    bool clipped = gyros_clip(input, d.clipped, poses[k].last, poses[k + 1].first);
    const double from = input.time_s[poses[k].last - 1] - input.time_s.front();
    const double to = input.time_s[poses[k + 1].first] - input.time_s.front();
    for (const LeftOut& out : d.left_out) {
      clipped |= out.last_s >= from && out.first_s <= to;
    }
    if (!clipped) {
      turns.push_back(k);
    }
  }
  return turns;
}

void judge_turns(const PoseInput& input, const std::vector<Pose>& poses, const std::vector<std::size_t>& turns,
                 const AccelModel& accel, bool linear, PoseDiagnosis& d) {
  const std::vector<std::size_t> kept = knows_gyro_unit(input) ? without_rounds(input, poses, turns) : turns;
  d.turns = static_cast<int>(kept.size());
  d.turns_clipped = static_cast<int>(poses.size() - 1 - turns.size());
  d.turns_whole = static_cast<int>(turns.size() - kept.size());
  if (kept.empty()) {
    // That all of them do is more likely another unit, or time.
    if (const auto reading = read_gyros_by_turns(input, poses, turns); reading && d.gyros_contradict.empty()) {
      d.gyros_contradict = contradiction(input, *reading);
    }
    return;
  }
  fit_and_hold_out(input, poses, kept, accel, linear, d);
  d.direction_by_noise = by_noise(input, poses, kept);
  // Turns that end this far from where gravity is are carried in another unit, or not by these gyros; or by a part of what they read, where
  // noise makes little of it.
  constexpr double most = 10.0 * units::degree, much = 3.0 * units::degree, times = 20.0;
  if (d.direction_after > most || d.direction_after > std::max(much, times * d.direction_by_noise)) {
    close_parameters(d);
    if (const auto reading = read_gyros_by_turns(input, poses, turns); reading && d.gyros_contradict.empty()) {
      d.gyros_contradict = contradiction(input, *reading);
    }
    if (d.gyros_contradict.empty() && knows_gyro_unit(input)) {
      d.gyros_contradict = turns_elsewhere(input, poses, turns, d.direction_after);
    }
  } else if (d.gyro_raw_unit > 0.0) {
    tell_in_raw(d);
  }
}

}  // namespace selfcal::diagnosis
