#include "estimator/diagnosis/poses/pose_thermal.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/poses/pose_regression.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

bool follows_channel(const Effect& effect) {
  return effect.temperature == TemperatureUse::measured && acts_on(effect, false, true);
}

// In |f| - g, weighted as its residuals are, per SI.
Eigen::MatrixXd columns_of(const Trial& trial, const AccelModel& model) {
  return model.weight.asDiagonal() * trial.columns / units::standard_gravity;
}

// One more effect beside what is known; its coefficients are the last columns.
PoseEffect attempt(const Effect& effect, const Eigen::MatrixXd& known, const AccelModel& model,
                   const std::vector<Pose>& poses, double duration_s) {
  const Trial trial = trial_of(effect, NAN, poses, duration_s, 3);
  const RowComparison c = compare(known, columns_of(trial, model), model.residual, middles(poses), false);
  return effect_in_force(trial, c, known.cols());
}

Eigen::MatrixXd columns_beside(const PoseEffect* without, const std::vector<PoseEffect>& named, const AccelModel& model,
                               const std::vector<Pose>& poses, double duration_s) {
  Eigen::MatrixXd known = model.jacobian;
  for (const PoseEffect& p : named) {
    if (&p != without) {
      known = joined(known, columns_of(trial_of(*p.effect, NAN, poses, duration_s, 3), model));
    }
  }
  return known;
}

// What changes with time does as much of it where the temperature does nothing but rise with time: the order of the poses does not tell.
void add_rivals_of_time(const AccelModel& model, const std::vector<Pose>& poses, double duration_s, PoseEffect& named) {
  constexpr double all_of_it = 0.95;  // of the square of each column beside the nine
  const Eigen::MatrixXd columns = columns_of(trial_of(*named.effect, NAN, poses, duration_s, 3), model);
  for (const Effect& rival : catalogue()) {
    if (follows_channel(rival) || !acts_on(rival, false, true) || !changes_with_time(rival, duration_s, 3)) {
      continue;
    }
    const std::vector<double> constants = rival.constant.tried();
    const bool does = std::any_of(constants.begin(), constants.end(), [&](double constant) {
      const Trial trial = trial_of(rival, constant, poses, duration_s, 3);
      const Eigen::MatrixXd beside = joined(model.jacobian, columns_of(trial, model));
      for (Eigen::Index k = 0; k < columns.cols(); ++k) {
        const Eigen::VectorXd column = columns.col(k);
        if (regress(beside, column).square > (1.0 - all_of_it) * regress(model.jacobian, column).square) {
          return false;
        }
      }
      return trial.columns.cols() > 0;
    });
    if (does) {
      named.equivalent.push_back(&rival);
    }
  }
}

}  // namespace

bool take_temperatures(const PoseInput& input, std::vector<Pose>& poses) {
  if (input.temperature_c.size() != input.time_s.size() || poses.empty()) {
    return false;
  }
  double mean = 0.0;
  std::vector<double> inside;
  for (Pose& p : poses) {
    double sum = 0.0, square = 0.0, count = 0.0;
    for (const auto& [first, last] : p.quiet) {
      for (std::size_t i = first; i < last; ++i) {
        const double off = input.temperature_c[i] - input.temperature_c[p.first];
        sum += off;
        square += off * off;
        count += 1.0;
      }
    }
    p.temperature = input.temperature_c[p.first] + sum / count;
    inside.push_back(std::sqrt(std::max(0.0, square / count - sum / count * sum / count)));
    mean += p.temperature / static_cast<double>(poses.size());
  }
  double square = 0.0;
  for (Pose& p : poses) {
    p.temperature -= mean;
    square += p.temperature * p.temperature / static_cast<double>(poses.size());
  }
  std::nth_element(inside.begin(), inside.begin() + static_cast<std::ptrdiff_t>(inside.size() / 2), inside.end());
  constexpr double least = 0.2, times = 2.0;
  if (std::isfinite(square) && std::sqrt(square) > std::max(least, times * inside[inside.size() / 2])) {
    return true;
  }
  for (Pose& p : poses) {
    p.temperature = 0.0;
  }
  return false;
}

std::vector<PoseEffect> name_thermal(const AccelModel& model, const std::vector<Pose>& poses, double duration_s,
                                     double alpha) {
  std::vector<const Effect*> candidates;
  for (const Effect& effect : catalogue()) {
    if (follows_channel(effect)) {
      candidates.push_back(&effect);
    }
  }
  std::vector<PoseEffect> named;
  const auto tried = static_cast<double>(candidates.size());
  while (!candidates.empty()) {
    const Eigen::MatrixXd known = columns_beside(nullptr, named, model, poses, duration_s);
    constexpr Eigen::Index coefficients = 3, spare = 2;
    if (known.cols() + coefficients + spare > known.rows()) {
      break;
    }
    std::vector<PoseEffect> all;
    all.reserve(candidates.size());
    for (const Effect* effect : candidates) {
      all.push_back(attempt(*effect, known, model, poses, duration_s));
    }
    PoseEffect best = *std::min_element(all.begin(), all.end(),
                                        [](const PoseEffect& a, const PoseEffect& b) { return a.log_p < b.log_p; });
    best.log_p = log_corrected(best.log_p, tried);
    if (best.log_p > std::log(alpha)) {
      break;
    }
    std::erase(candidates, best.effect);
    named.push_back(best);
  }
  for (PoseEffect& p : named) {  // each once more beside the others
    const double log_p = p.log_p;
    p = attempt(*p.effect, columns_beside(&p, named, model, poses, duration_s), model, poses, duration_s);
    p.log_p = log_p;
  }
  for (PoseEffect& p : named) {
    add_rivals_of_time(model, poses, duration_s, p);
  }
  return named;
}

std::vector<PoseEffect> refine_thermal(const AccelModel& model, const std::vector<Pose>& poses, double duration_s,
                                       std::vector<PoseEffect>& named) {
  std::vector<PoseEffect> added;
  for (PoseEffect& p : named) {
    PoseEffect more = attempt(*p.effect, columns_beside(&p, named, model, poses, duration_s), model, poses, duration_s);
    for (std::size_t k = 0; k < p.value.size(); ++k) {
      p.value[k] += more.value[k];
    }
    p.sigma = more.sigma;
    added.push_back(std::move(more));
  }
  return added;
}

Vector3 thermal_force(const std::vector<PoseEffect>& named, const Pose& pose, double duration_s) {
  Vector3 force = Vector3::Zero();
  for (const PoseEffect& p : named) {
    force += force_at(*p.effect, pose, duration_s) *
             Eigen::Map<const Eigen::VectorXd>(p.value.data(), static_cast<Eigen::Index>(p.value.size())) /
             units::standard_gravity;
  }
  return force;
}

void take_out(const std::vector<PoseEffect>& named, const AccelModel& model, double duration_s,
              std::vector<Pose>& poses) {
  for (Pose& p : poses) {
    p.accel -= model.raw_per_g * thermal_force(named, p, duration_s);  // an error of the reading, in its nominal unit
  }
}

}  // namespace selfcal::diagnosis
