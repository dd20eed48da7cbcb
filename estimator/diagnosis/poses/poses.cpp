#include "estimator/diagnosis/poses/poses.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/poses/pose_data.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

EffectContext context_of(const Pose& pose, double duration_s) {
  EffectContext c;
  c.start_s = pose.middle_s - 0.5;
  c.end_s = pose.middle_s + 0.5;
  c.dt = 1.0;
  c.angle = c.rate = c.rate_change = c.field_b = Vector3::Zero();
  c.u = pose.u;
  c.velocity = c.force = 9.80665 * pose.u;
  c.C_nb = Matrix3::Identity();
  c.duration_s = duration_s;
  return c;
}

// Columns of one axis' readings (or of |f|) for one effect: [poses x coefficients], those that vanish left out.
struct Trial {
  const Effect* effect = nullptr;
  double constant = NAN;
  Eigen::MatrixXd columns;
  std::vector<std::string> names;
};

Trial trial_of(const Effect& effect, double constant, const std::vector<Pose>& poses, double duration_s, int axis) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  const auto count = static_cast<Eigen::Index>(effect.parameters.size());
  Eigen::MatrixXd all(n, count);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Pose& pose = poses[static_cast<std::size_t>(k)];
    Eigen::Matrix3Xd velocity = Eigen::Matrix3Xd::Zero(3, count), angle = velocity;
    effect.sensor(context_of(pose, duration_s), constant, velocity, angle);
    all.row(k) = axis < 3 ? Eigen::RowVectorXd(angle.row(axis)) : Eigen::RowVectorXd(pose.u.transpose() * velocity);
  }
  Trial t{&effect, constant, Eigen::MatrixXd(n, 0), {}};
  for (Eigen::Index j = 0; j < count; ++j) {
    if (all.col(j).cwiseAbs().maxCoeff() > 0.0) {
      t.columns.conservativeResize(Eigen::NoChange, t.columns.cols() + 1);
      t.columns.rightCols<1>() = all.col(j);
      t.names.push_back(effect.parameters[static_cast<std::size_t>(j)].name);
    }
  }
  return t;
}

struct Regression {
  double square = 0.0;
  Eigen::Index rank = 0;
  double held_out_rms = 0.0;  // e / (1 - h)
  Eigen::VectorXd value, sigma;
};

Regression regress(const Eigen::MatrixXd& X, const Eigen::VectorXd& y) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(X);
  Regression r;
  r.rank = qr.rank();
  r.value = qr.solve(y);
  const Eigen::VectorXd e = y - X * r.value;
  const Eigen::MatrixXd Q = Eigen::MatrixXd(qr.householderQ()).leftCols(r.rank);
  r.square = e.squaredNorm();
  const Eigen::ArrayXd leverage = Q.rowwise().squaredNorm();
  r.held_out_rms = std::sqrt((e.array() / (1.0 - leverage).max(1e-9)).square().mean());
  const double variance = r.square / static_cast<double>(std::max<Eigen::Index>(1, y.size() - r.rank));
  const Eigen::MatrixXd G = X.transpose() * X;
  r.sigma = (G.completeOrthogonalDecomposition().pseudoInverse().diagonal() * variance).cwiseMax(0.0).cwiseSqrt();
  return r;
}

Eigen::MatrixXd joined(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd all(a.rows(), a.cols() + b.cols());
  all << a, b;
  return all;
}

// F test of the columns that `with` adds.
double log_p_of(const Regression& without, const Regression& with, Eigen::Index n) {
  const auto more = static_cast<double>(with.rank - without.rank);
  const auto left = static_cast<double>(n - with.rank);
  if (more < 1.0 || left < 1.0) {
    return 0.0;
  }
  return log_f_tail((without.square - with.square) / more / (with.square / left), more, left);
}

bool acts_on(const Effect& effect, bool gyro) {
  return effect.sensor != nullptr && applies(effect, false) && !effect.needs_heading &&
         effect.triad == (gyro ? Triad::gyro : Triad::accelerometer);
}

class Gyros {
 public:
  Gyros(const std::vector<Pose>& poses, double duration_s) : poses_(poses), duration_s_(duration_s) {
    const auto n = static_cast<Eigen::Index>(poses.size());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      known_[axis] = Eigen::MatrixXd::Ones(n, 1);
      y_[axis].resize(n);
      for (Eigen::Index k = 0; k < n; ++k) {
        y_[axis](k) = poses[static_cast<std::size_t>(k)].gyro(static_cast<Eigen::Index>(axis));
      }
    }
  }

  // Every effect given what is known already, best first.
  std::vector<PoseEffect> try_all(const std::vector<PoseEffect>& named) const;
  void keep(const PoseEffect& chosen);
  std::array<double, 3> held_out_rms() const {
    std::array<double, 3> rms{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      rms[axis] = regress(known_[axis], y_[axis]).held_out_rms;
    }
    return rms;
  }

 private:
  PoseEffect attempt(const Effect& effect, double constant) const;

  const std::vector<Pose>& poses_;
  double duration_s_;
  std::array<Eigen::MatrixXd, 3> known_;
  std::array<Eigen::VectorXd, 3> y_;
};

PoseEffect Gyros::attempt(const Effect& effect, double constant) const {
  PoseEffect result;
  result.effect = &effect;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const Trial trial = trial_of(effect, constant, poses_, duration_s_, axis);
    const Regression without = regress(known_[i], y_[i]);
    const Regression with = regress(joined(known_[i], trial.columns), y_[i]);
    result.held_out_rms[i] = with.held_out_rms;
    result.log_p = std::min(result.log_p, log_p_of(without, with, y_[i].size()));
    for (std::size_t j = 0; j < trial.names.size(); ++j) {
      result.parameters.push_back(trial.names[j]);
      result.value.push_back(with.value(known_[i].cols() + static_cast<Eigen::Index>(j)));
      result.sigma.push_back(with.sigma(known_[i].cols() + static_cast<Eigen::Index>(j)));
    }
  }
  return result;
}

std::vector<PoseEffect> Gyros::try_all(const std::vector<PoseEffect>& named) const {
  std::vector<PoseEffect> all;
  int tried = 0;
  for (const Effect& effect : catalogue()) {
    const bool known =
        std::any_of(named.begin(), named.end(), [&](const PoseEffect& p) { return p.effect == &effect; });
    if (known || !acts_on(effect, true)) {
      continue;
    }
    PoseEffect best;
    for (const double constant : effect.constant.tried()) {
      PoseEffect one = attempt(effect, constant);
      if (best.parameters.empty() || one.log_p < best.log_p) {
        best = std::move(one);
      }
      ++tried;
    }
    if (!best.parameters.empty()) {
      all.push_back(std::move(best));
    }
  }
  for (PoseEffect& p : all) {
    p.log_p = log_corrected(p.log_p, 3.0 * tried);
  }
  std::stable_sort(all.begin(), all.end(), [](const PoseEffect& a, const PoseEffect& b) { return a.log_p < b.log_p; });
  return all;
}

void Gyros::keep(const PoseEffect& chosen) {
  const Effect& effect = *chosen.effect;
  const std::vector<double> constants = effect.constant.tried();
  double best = 0.0, constant = constants.front();
  for (const double trial : constants) {
    const double log_p = attempt(effect, trial).log_p;
    if (log_p < best) {
      best = log_p;
      constant = trial;
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::MatrixXd& known = known_[static_cast<std::size_t>(axis)];
    known = joined(known, trial_of(effect, constant, poses_, duration_s_, axis).columns);
  }
}

void judge_accelerometers(const AccelModel& model, const std::vector<Pose>& poses, double duration_s, double alpha,
                          PoseDiagnosis& d) {
  const auto n = model.residual.size();
  const Regression plain = regress(model.jacobian, model.residual);
  d.accel_rms_g = std::sqrt(plain.square / static_cast<double>(n));
  d.accel_held_out_rms_g = plain.held_out_rms;
  int tried = 0;
  for (const Effect& effect : catalogue()) {
    if (!acts_on(effect, false)) {
      continue;
    }
    for (const double constant : effect.constant.tried()) {
      const Trial trial = trial_of(effect, constant, poses, duration_s, 3);
      if (trial.columns.cols() == 0) {
        continue;
      }
      const Regression with = regress(joined(model.jacobian, trial.columns), model.residual);
      PoseEffect p;
      p.effect = &effect;
      p.log_p = log_p_of(plain, with, n);
      p.held_out_rms.fill(with.held_out_rms);
      d.accel_tried.push_back(p);
      ++tried;
    }
  }
  for (PoseEffect& p : d.accel_tried) {
    p.log_p = log_corrected(p.log_p, tried);
  }
  std::stable_sort(d.accel_tried.begin(), d.accel_tried.end(),
                   [](const PoseEffect& a, const PoseEffect& b) { return a.log_p < b.log_p; });
  d.accel_adequate = d.accel_tried.empty() || d.accel_tried.front().log_p > std::log(alpha);
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

void judge_turns(const PoseInput& input, const std::vector<Pose>& poses, bool linear, double& fitted,
                 double& held_out) {
  GyroModel all = static_model(poses, none, linear);
  fit_turns(input, poses, none, all);
  double square = 0.0, held_out_square = 0.0;
  for (std::size_t k = 0; k + 1 < poses.size(); ++k) {
    square += direction_error(input, poses[k], poses[k + 1], all).squaredNorm();
    GyroModel rest = static_model(poses, k, linear);
    rest.S = all.S;
    fit_turns(input, poses, k, rest);
    held_out_square += direction_error(input, poses[k], poses[k + 1], rest).squaredNorm();
  }
  const auto turns = static_cast<double>(poses.size() - 1);
  fitted = std::sqrt(square / turns);
  held_out = std::sqrt(held_out_square / turns);
}

}  // namespace

namespace {

// Names of the gyros' effects, one after the other; half of the false-alarm rate is theirs.
void name_gyro_effects(Gyros& gyros, double alpha, PoseDiagnosis& d) {
  d.gyro_held_out_rms = gyros.held_out_rms();
  d.gyro_tried = gyros.try_all({});
  for (std::vector<PoseEffect> left = d.gyro_tried; !left.empty() && left.front().log_p < std::log(0.5 * alpha);) {
    gyros.keep(left.front());
    d.gyro_named.push_back(left.front());
    left = gyros.try_all(d.gyro_named);
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
  std::vector<Pose> poses = find_poses(input);
  constexpr std::size_t least = 16;  // nine unknowns of the accelerometers, and as many again to judge them by
  if (poses.size() < least) {
    d.failure = "fewer than 16 static poses: " + std::to_string(poses.size());
    return d;
  }
  const AccelModel accel = fit_accelerometers(poses);
  Vector3 white = Vector3::Zero();
  for (Pose& p : poses) {
    p.u = accel.direction(p.accel);
    white += p.gyro_white.cwiseAbs2();
    d.static_seconds += input.time_s[p.last - 1] - input.time_s[p.first];
  }
  white = (white / static_cast<double>(poses.size())).cwiseSqrt();
  d.gyro_white_rms = {white.x(), white.y(), white.z()};
  d.poses = static_cast<int>(poses.size());
  const double duration = input.time_s.back() - input.time_s.front();
  judge_accelerometers(accel, poses, duration, 0.5 * alpha, d);

  Gyros gyros(poses, duration);
  name_gyro_effects(gyros, alpha, d);
  judge_turns(input, poses, false, d.direction_before, d.direction_before_held_out);
  const bool linear = std::any_of(d.gyro_named.begin(), d.gyro_named.end(),
                                  [](const PoseEffect& p) { return p.effect->linear_in_force; });
  judge_turns(input, poses, linear, d.direction_after, d.direction_after_held_out);
  d.invisible = {
      "isotropic part of gyro_g_sensitivity: it turns about gravity, which no direction of gravity shows, and in "
      "the poses it stands together with the Earth's rate about the vertical",
      "gyro_magnetic_sensitivity: without heading it cannot be told from the field's vertical part, so it is "
      "not excluded"};
  return d;
}

}  // namespace selfcal::diagnosis
