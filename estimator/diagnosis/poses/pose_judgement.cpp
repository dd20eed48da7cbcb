#include "estimator/diagnosis/poses/pose_judgement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/poses/pose_accel_jump.hpp"
#include "estimator/diagnosis/poses/pose_regression.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

bool has(const std::vector<PoseEffect>& list, const Effect* effect) {
  return std::any_of(list.begin(), list.end(), [effect](const PoseEffect& p) { return p.effect == effect; });
}

void best_first(std::vector<PoseEffect>& all) {
  std::stable_sort(all.begin(), all.end(), [](const PoseEffect& a, const PoseEffect& b) { return a.log_p < b.log_p; });
}

class Gyros {
 public:
  Gyros(const std::vector<Pose>& poses, double duration_s, bool has_temperature)
      : poses_(poses), time_s_(middles(poses)), duration_s_(duration_s), has_temperature_(has_temperature) {
    const auto n = static_cast<Eigen::Index>(poses.size());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      known_[axis] = Eigen::MatrixXd::Ones(n, 1);
      y_[axis].resize(n);
      for (Eigen::Index k = 0; k < n; ++k) {
        y_[axis](k) = poses[static_cast<std::size_t>(k)].gyro(static_cast<Eigen::Index>(axis));
      }
    }
  }

  // A bias of its own for each part of the log, where the parts differ by more than chance: beside it a drift is asked.
  void take_jumps(const PoseInput& input, double log_limit, PoseDiagnosis& d);
  // A step between two poses instead of `chosen`, which changes with time, where the step is a hundred times as likely; beside it all else is asked.
  bool take_step(const PoseInput& input, const PoseEffect& chosen, double log_limit, PoseDiagnosis& d);
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
  void add_bias(PoseDiagnosis& d) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Regression r = regress(Eigen::MatrixXd::Ones(y_[axis].size(), 1), y_[axis]);
      d.gyro_bias[axis] = r.value(0);
      double hidden = 0.0;  // square, of the mean of all
      for (const Pose& p : poses_) {
        hidden += std::pow(p.gyro_hidden(static_cast<Eigen::Index>(axis)) / static_cast<double>(poses_.size()), 2);
      }
      d.gyro_bias_sigma[axis] = std::sqrt(r.sigma(0) * r.sigma(0) + hidden);
    }
  }
  // Share of `a` that `b` makes too, over the axes.
  double shared(const PoseEffect& a, const PoseEffect& b) const;
  bool of_time(const Effect& effect) const {
    return changes_with_time(effect, duration_s_, 0) || changes_with_time(effect, duration_s_, 1) ||
           changes_with_time(effect, duration_s_, 2);
  }

 private:
  PoseEffect attempt(const Effect& effect, double constant) const;
  // Whether a measured temperature leaves no difference between these parts: in a chamber it is what changes from one to the next.
  bool follow_temperature(const Eigen::MatrixXd& of_parts, double log_limit) const;

  const std::vector<Pose>& poses_;
  std::vector<double> time_s_;
  double duration_s_;
  bool has_temperature_;
  std::array<Eigen::MatrixXd, 3> known_;
  std::array<Eigen::VectorXd, 3> y_;
};

bool Gyros::follow_temperature(const Eigen::MatrixXd& of_parts, double log_limit) const {
  if (!has_temperature_) {
    return false;
  }
  double log_p = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    Eigen::MatrixXd known = known_[i];
    for (const Effect& effect : catalogue()) {
      if (effect.temperature == TemperatureUse::measured && acts_on(effect, true, true)) {
        known = joined(known, trial_of(effect, NAN, poses_, duration_s_, axis).columns);
      }
    }
    log_p = std::min(log_p, compare(known, of_parts, y_[i], time_s_, true).log_p);
  }
  return log_corrected(log_p, 3.0) > log_limit;
}

void Gyros::take_jumps(const PoseInput& input, double log_limit, PoseDiagnosis& d) {
  const std::ptrdiff_t last = poses_.empty() ? 0 : poses_.back().part;
  constexpr std::ptrdiff_t poses_a_part = 3;
  if (last == poses_.front().part || static_cast<std::ptrdiff_t>(poses_.size()) < poses_a_part * (last + 1)) {
    return;
  }
  std::vector<std::ptrdiff_t> parts;
  for (const Pose& p : poses_) {
    if (p.part != poses_.front().part && (parts.empty() || parts.back() != p.part)) {
      parts.push_back(p.part);
    }
  }
  const auto n = static_cast<Eigen::Index>(poses_.size());
  Eigen::MatrixXd of_parts = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(parts.size()));
  for (Eigen::Index k = 0; k < n; ++k) {
    for (std::size_t j = 0; j < parts.size(); ++j) {
      of_parts(k, static_cast<Eigen::Index>(j)) = poses_[static_cast<std::size_t>(k)].part == parts[j] ? 1.0 : 0.0;
    }
  }
  std::array<RowComparison, 3> answers;
  double log_p = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    answers[axis] = compare(known_[axis], of_parts, y_[axis], time_s_, true);
    log_p = std::min(log_p, answers[axis].log_p);
  }
  if (log_corrected(log_p, 3.0) > log_limit || follow_temperature(of_parts, log_limit)) {
    return;
  }
  for (std::size_t j = 0; j < parts.size(); ++j) {
    BiasJump jump;
    const auto first = std::find_if(poses_.begin(), poses_.end(), [&](const Pose& p) { return p.part == parts[j]; });
    jump.time_s = input.time_s[first->first] - input.time_s.front();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Eigen::Index at = known_[axis].cols() + static_cast<Eigen::Index>(j);
      jump.size(static_cast<Eigen::Index>(axis)) = answers[axis].with.value(at);
      jump.sigma(static_cast<Eigen::Index>(axis)) = answers[axis].with.sigma(at);
    }
    d.gyro_jumps.push_back(jump);
  }
  for (Eigen::MatrixXd& known : known_) {
    known = joined(known, of_parts);
  }
}

bool Gyros::take_step(const PoseInput& input, const PoseEffect& chosen, double log_limit, PoseDiagnosis& d) {
  const auto n = static_cast<Eigen::Index>(poses_.size());
  constexpr Eigen::Index side = 3;  // poses
  const double tries = static_cast<double>(n - 2 * side + 1);
  if (tries < 1.0 || !of_time(*chosen.effect)) {
    return false;
  }
  double of_chosen = 0.0;  // log likelihood but for a constant
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const Trial trial = trial_of(*chosen.effect, chosen.constant, poses_, duration_s_, axis);
    of_chosen -= 0.5 * static_cast<double>(n) * std::log(regress(joined(known_[i], trial.columns), y_[i]).square);
  }
  Eigen::Index best = 0;
  double of_best = -HUGE_VAL;
  const auto step_at = [n](Eigen::Index first) {
    Eigen::MatrixXd column = Eigen::MatrixXd::Zero(n, 1);
    column.bottomRows(n - first).setOnes();
    return column;
  };
  for (Eigen::Index first = side; first + side <= n; ++first) {
    double likelihood = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      likelihood -= 0.5 * static_cast<double>(n) * std::log(regress(joined(known_[i], step_at(first)), y_[i]).square);
    }
    if (likelihood > of_best) {
      of_best = likelihood;
      best = first;
    }
  }
  constexpr double odds = 4.605, two_sigma = 2.0;  // ln 100
  if (of_best - std::log(tries) < of_chosen + odds) {
    return false;
  }
  const Eigen::MatrixXd column = step_at(best);
  BiasJump jump;
  jump.gap = false;
  jump.time_s = input.time_s[poses_[static_cast<std::size_t>(best)].first] - input.time_s.front();
  double log_p = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const RowComparison c = compare(known_[i], column, y_[i], time_s_, true);
    const double beside = log_p_beside_flicker(poses_, time_s_, axis, known_[i], column, y_[i], two_sigma);
    log_p = std::min(log_p, std::max(c.log_p, beside));
    jump.size(axis) = c.with.value(known_[i].cols());
    jump.sigma(axis) = c.with.sigma(known_[i].cols());
  }
  if (log_corrected(log_p, 3.0 * tries) > log_limit) {
    return false;
  }
  d.gyro_jumps.push_back(jump);
  for (Eigen::MatrixXd& known : known_) {
    known = joined(known, column);
  }
  return true;
}

PoseEffect Gyros::attempt(const Effect& effect, double constant) const {
  PoseEffect result;
  result.effect = &effect;
  result.constant = constant;
  // A measured temperature is asked as a drift is: it changes as slowly, and beside a walk it would always lose to one.
  const bool with_time = of_time(effect) || effect.temperature == TemperatureUse::measured;
  constexpr double two_sigma = 2.0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const Trial trial = trial_of(effect, constant, poses_, duration_s_, axis);
    RowComparison c = compare(known_[i], trial.columns, y_[i], time_s_, with_time);
    if (with_time && trial.columns.cols() > 0) {
      hold_flicker(poses_, time_s_, axis, joined(known_[i], trial.columns), known_[i].cols(), c.with);
    }
    const double beside_flicker =
        with_time ? log_p_beside_flicker(poses_, time_s_, axis, known_[i], trial.columns, y_[i], two_sigma) : -HUGE_VAL;
    result.held_out_rms[i] = c.with.held_out_rms;
    result.log_p = std::min(result.log_p, c.log_p);
    result.log_p_beside_flicker = std::min(result.log_p_beside_flicker, std::max(c.log_p, beside_flicker));
    add_coefficients(trial, c, known_[i].cols(), result);
  }
  return result;
}

std::vector<PoseEffect> Gyros::try_all(const std::vector<PoseEffect>& named) const {
  std::vector<PoseEffect> all;
  double tried = 0.0;
  for (const Effect& effect : catalogue()) {
    if (has(named, &effect) || !acts_on(effect, true, has_temperature_)) {
      continue;
    }
    PoseEffect best;
    for (const double constant : effect.constant.tried()) {
      PoseEffect one = attempt(effect, constant);
      if (best.parameters.empty() || one.log_p < best.log_p) {
        best = std::move(one);
      }
    }
    tried += tests_worth(effect, poses_, duration_s_, 0);
    if (!best.parameters.empty()) {
      all.push_back(std::move(best));
    }
  }
  for (PoseEffect& p : all) {
    p.log_p = log_corrected(p.log_p, 3.0 * tried);
    p.log_p_beside_flicker = log_corrected(p.log_p_beside_flicker, 3.0 * tried);
  }
  best_first(all);
  return all;
}

void Gyros::keep(const PoseEffect& chosen) {
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::MatrixXd& known = known_[static_cast<std::size_t>(axis)];
    known = joined(known, trial_of(*chosen.effect, chosen.constant, poses_, duration_s_, axis).columns);
  }
}

double Gyros::shared(const PoseEffect& a, const PoseEffect& b) const {
  double largest = 0.0;
  const auto n = static_cast<Eigen::Index>(poses_.size());
  const Eigen::MatrixXd ones = Eigen::MatrixXd::Ones(n, 1);
  for (int axis = 0; axis < 3; ++axis) {
    const Trial of_a = trial_of(*a.effect, a.constant, poses_, duration_s_, axis);
    const Trial of_b = trial_of(*b.effect, b.constant, poses_, duration_s_, axis);
    const Eigen::MatrixXd rivals = joined(ones, of_b.columns);
    for (Eigen::Index j = 0; j < of_a.columns.cols(); ++j) {
      const Regression alone = regress(ones, of_a.columns.col(j));
      const Regression beside = regress(rivals, of_a.columns.col(j));
      if (alone.square > 0.0) {
        // Columns explain by chance what they are many for: adjusted R^2.
        const double free = static_cast<double>(n - 1) / std::max(1.0, static_cast<double>(n - beside.rank));
        largest = std::max(largest, 1.0 - beside.square / alone.square * free);
      }
    }
  }
  return largest;
}

// What stands in for `chosen`: named alone as well, and nothing more once `chosen` is there.
void add_equivalents(const std::vector<PoseEffect>& before, const std::vector<PoseEffect>& after, double limit,
                     PoseEffect& chosen) {
  constexpr double odds = 4.605;  // ln 100, as for the classes of a recording with a gimbal
  for (const PoseEffect& rival : before) {
    if (rival.effect == chosen.effect || rival.log_p > limit || rival.log_p > chosen.log_p + odds) {
      continue;
    }
    const auto again =
        std::find_if(after.begin(), after.end(), [&](const PoseEffect& p) { return p.effect == rival.effect; });
    if (again != after.end() && again->log_p > limit) {
      chosen.equivalent.push_back(rival.effect);
    }
  }
}

void add_confounded(const Gyros& gyros, const std::vector<PoseEffect>& tried, PoseDiagnosis& d) {
  constexpr double much = 0.5;  // half of an effect that another one makes too costs its sigma a factor of 1.4
  for (const PoseEffect& a : tried) {
    for (const PoseEffect& b : tried) {
      if (gyros.of_time(*a.effect) && !gyros.of_time(*b.effect)) {
        const double shared = gyros.shared(a, b);
        if (shared > much) {
          d.confounded.push_back({a.effect, b.effect, shared});
        }
      }
    }
  }
}

// The nine beside an effect that is tried: by how much they move.
struct Beside {
  double log_p = 0.0;
  Eigen::Matrix<double, 9, 1> moved, sigma;
};

// What the poses may show, named or not, has its part in the nine: each is known no better than the likelier effects let it be.
void widen(const std::vector<Beside>& beside, AccelModel& model) {
  const double may_be = std::log(0.1);  // each by itself: nobody has to name it
  for (const Beside& b : beside) {
    if (b.log_p < may_be) {
      model.sigma = model.sigma.cwiseMax((b.moved.cwiseAbs2() + b.sigma.cwiseAbs2()).cwiseSqrt());
    }
  }
  model.sigma = model.sigma.cwiseMin(model.before);
  model.open = model.held.select(model.open, model.sigma);
}

// Of the nine, were the readings' own noise all there is: what the model leaves widens the model's own sigma, a jump above all, and
// is to be tested.
Eigen::Matrix<double, 9, 1> sigma_by_noise(const AccelModel& model) {
  if (!(model.noise_of_means > 0.0)) {
    return model.sigma;  // means of a table: their noise is what is left
  }
  const Eigen::MatrixXd J = model.jacobian * model.before.asDiagonal() / model.noise_of_means;
  const Eigen::Matrix<double, 9, 9> normal = J.transpose() * J + Eigen::Matrix<double, 9, 9>::Identity();
  const Eigen::Matrix<double, 9, 1> variance = normal.llt().solve(Eigen::Matrix<double, 9, 9>::Identity()).diagonal();
  return variance.cwiseSqrt().cwiseProduct(model.before).cwiseMin(model.sigma);
}

}  // namespace

void judge_accelerometers(AccelModel& model, const std::vector<Pose>& poses, double duration_s, bool has_temperature,
                          double alpha, PoseDiagnosis& d) {
  const auto n = model.residual.size();
  const Regression plain = regress(model.jacobian, model.residual);
  d.accel_rms_g = std::sqrt(model.residual.squaredNorm() / static_cast<double>(n));
  d.accel_held_out_rms_g = plain.held_out_rms;
  // Three degrees of freedom beside the nine; and where the poses leave one of the nine open, its column is made of the noise of
  // the readings themselves and explains it.
  constexpr Eigen::Index least = 12;
  constexpr double well = 0.1;  // of sigma before
  d.accel_tested =
      n >= least && !model.held.any() && (sigma_by_noise(model).array() < well * model.before.array()).all();
  if (!d.accel_tested) {
    // Slow noise between poses is a few times that inside them; ten times as much is something else.
    constexpr double times = 10.0;
    const double left = std::sqrt(model.residual.squaredNorm() / std::max(1.0, model.free));
    d.accel_adequate = model.held.any() || model.free < 1.0 || left < times * model.noise_of_means;
    return;
  }
  double tried = 0.0;
  std::vector<Beside> beside;
  const std::vector<double> time_s = middles(poses);
  for (const Effect& effect : catalogue()) {
    if (!acts_on(effect, false, has_temperature) ||
        (has_temperature && effect.temperature == TemperatureUse::measured)) {
      continue;  // what follows the channel was taken out before
    }
    for (const double constant : effect.constant.tried()) {
      const Trial trial = trial_of(effect, constant, poses, duration_s, 3);
      if (trial.columns.cols() == 0) {
        continue;
      }
      const RowComparison c = compare(model.jacobian, model.weight.asDiagonal() * trial.columns, model.residual, time_s,
                                      changes_with_time(effect, duration_s, 3));
      d.accel_tried.push_back(effect_in_force(trial, c, model.jacobian.cols()));
      beside.push_back({c.log_p, c.with.value.head<9>(), c.with.sigma.head<9>()});
    }
    tried += tests_worth(effect, poses, duration_s, 3);
  }
  for (PoseEffect& p : d.accel_tried) {
    p.log_p = log_corrected(p.log_p, tried);
  }
  widen(beside, model);
  best_first(d.accel_tried);
  const double of_effect = d.accel_tried.empty() ? 0.0 : d.accel_tried.front().log_p;
  constexpr double share = 0.1;  // of the alarms, beside them: Bonferroni's count of the steps is cautious
  d.accel_jump = find_accel_jump(poses, std::log(share * alpha), of_effect, model);
  d.accel_adequate = !d.accel_jump && of_effect > std::log(alpha);
}

void judge_gyros(const PoseInput& input, const std::vector<Pose>& poses, double duration_s, bool has_temperature,
                 double alpha, PoseDiagnosis& d) {
  Gyros gyros(poses, duration_s, has_temperature);
  gyros.add_bias(d);
  d.gyro_held_out_rms = gyros.held_out_rms();
  const double limit = std::log(alpha);
  gyros.take_jumps(input, limit, d);
  d.gyro_tried = gyros.try_all({});
  std::vector<PoseEffect> left = d.gyro_tried;
  while (!left.empty() && left.front().log_p < limit) {
    PoseEffect chosen = left.front();
    if (gyros.take_step(input, chosen, limit, d)) {
      left = gyros.try_all(d.gyro_named);
      continue;
    }
    chosen.may_be_flicker = chosen.log_p_beside_flicker > limit;
    gyros.keep(chosen);
    std::vector<PoseEffect> named = d.gyro_named;
    named.push_back(chosen);
    const std::vector<PoseEffect> after = gyros.try_all(named);
    add_equivalents(left, after, limit, chosen);
    d.gyro_named.push_back(chosen);
    left = after;
  }
  d.gyro_open = left;
  add_confounded(gyros, d.gyro_tried, d);
}

}  // namespace selfcal::diagnosis
