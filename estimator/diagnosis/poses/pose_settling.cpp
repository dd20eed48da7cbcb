// What the accelerometers do after each turn, seen in |f|: no tilt of the sensor makes it.
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/poses/pose_judgement.hpp"
#include "estimator/diagnosis/poses/pose_regression.hpp"
#include "estimator/diagnosis/poses/pose_thermal.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::array<double, 9> time_constants_s = {1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0};

// |f| in g over a pose in blocks; seconds since its beginning.
struct Course {
  std::size_t pose = 0;
  Eigen::VectorXd since_s, force;
  double length_s = 0.0;
};

Course course_of(const PoseInput& input, const std::vector<Pose>& poses, std::size_t k, const AccelModel& model,
                 const std::vector<PoseEffect>& thermal) {
  const Pose& p = poses[k];
  const double duration_s = input.time_s.back() - input.time_s.front();
  Pose warmer = p;  // by a degree
  warmer.temperature += 1.0;
  const double per_degree =
      thermal.empty()
          ? 0.0
          : p.u.normalized().dot(thermal_force(thermal, warmer, duration_s) - thermal_force(thermal, p, duration_s));
  Course c;
  c.pose = k;
  c.length_s = p.length_s;
  const double block_s = std::max(0.5, c.length_s / 60.0);
  std::vector<double> since, force;
  Vector3 sum = Vector3::Zero();
  double when = 0.0, count = 0.0, warm = 0.0;
  std::size_t number = 0;
  const auto close = [&] {
    if (count > 0.0) {
      since.push_back(when / count);
      force.push_back(model.direction(sum / count).norm() - warm / count * per_degree);
    }
    sum.setZero();
    when = count = warm = 0.0;
  };
  for (const auto& [first, last] : p.quiet) {
    for (std::size_t i = first; i < last; ++i) {
      const double s = input.time_s[i] - input.time_s[p.first];
      if (const auto now = static_cast<std::size_t>(s / block_s); now != number) {
        close();
        number = now;
      }
      sum += at(input.accel, i);
      when += s;
      warm += thermal.empty() ? 0.0 : input.temperature_c[i] - input.temperature_c[p.first];
      count += 1.0;
    }
  }
  close();
  c.since_s = Eigen::Map<const Eigen::VectorXd>(since.data(), static_cast<Eigen::Index>(since.size()));
  c.force = Eigen::Map<const Eigen::VectorXd>(force.data(), static_cast<Eigen::Index>(force.size()));
  return c;
}

// Size of exp(-s/tau) beside a constant.
double amplitude(const Course& c, double tau) {
  Eigen::VectorXd decay = (-c.since_s / tau).array().exp();
  decay.array() -= decay.mean();
  return decay.dot(c.force) / decay.squaredNorm();
}

// What |f| shows of a creep of unit size of each axis.
Eigen::MatrixXd design(const std::vector<Course>& courses, const std::vector<Pose>& poses, bool with_change) {
  Eigen::MatrixXd X(static_cast<Eigen::Index>(courses.size()), 3);
  for (std::size_t row = 0; row < courses.size(); ++row) {
    const std::size_t k = courses[row].pose;
    const Vector3 change = with_change ? Vector3(poses[k].u - poses[k - 1].u) : Vector3(Vector3::Ones());
    X.row(static_cast<Eigen::Index>(row)) = poses[k].u.cwiseProduct(change).transpose();
  }
  return X;
}

}  // namespace

std::optional<Settling> find_settling(const PoseInput& input, const std::vector<Pose>& poses, const AccelModel& model,
                                      const std::vector<PoseEffect>& thermal, double alpha) {
  std::vector<Course> courses;
  for (std::size_t k = 1; k < poses.size(); ++k) {  // before the first there was no turn
    courses.push_back(course_of(input, poses, k, model, thermal));
  }
  std::optional<Settling> best;
  int tried = 0;
  for (const double tau : time_constants_s) {
    std::vector<Course> usable;
    std::copy_if(courses.begin(), courses.end(), std::back_inserter(usable), [tau](const Course& c) {
      constexpr double least = 1.5, blocks = 6.0;  // time constants that a pose lasts, and blocks that it is seen in
      return c.length_s > least * tau && static_cast<double>(c.since_s.size()) >= blocks;
    });
    constexpr std::size_t enough = 5;  // two more than there are axes
    if (usable.size() < enough) {
      continue;
    }
    Eigen::VectorXd r(static_cast<Eigen::Index>(usable.size()));
    for (std::size_t row = 0; row < usable.size(); ++row) {
      r(static_cast<Eigen::Index>(row)) = amplitude(usable[row], tau);
    }
    for (const bool with_change : {false, true}) {
      const Eigen::MatrixXd X = design(usable, poses, with_change);
      // An axis that gravity hardly reaches would be given any size.
      constexpr double reached = 0.15;
      std::vector<Eigen::Index> axes;
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        if (X.col(axis).norm() > reached * std::sqrt(static_cast<double>(X.rows()))) {
          axes.push_back(axis);
        }
      }
      if (axes.empty()) {
        continue;
      }
      Regression nothing;
      nothing.square = r.squaredNorm();
      // Sensors of one kind are alike: one size for all, which few poses tell better than three.
      for (const bool alike : {false, true}) {
        const Eigen::MatrixXd columns =
            alike ? Eigen::MatrixXd(X(Eigen::all, axes).rowwise().sum()) : X(Eigen::all, axes);
        const Regression fit = regress(columns, r);
        const double log_p = log_p_of(nothing, fit, r.size());
        ++tried;
        if (!best || log_p < best->log_p) {
          best = Settling{tau, with_change, Vector3::Zero(), Vector3::Zero(), log_p};
          for (std::size_t k = 0; k < axes.size(); ++k) {
            best->size_g(axes[k]) = fit.value(alike ? 0 : static_cast<Eigen::Index>(k));
            best->sigma_g(axes[k]) = fit.sigma(alike ? 0 : static_cast<Eigen::Index>(k));
          }
        }
      }
    }
  }
  if (!best) {
    return best;
  }
  best->log_p = log_corrected(best->log_p, tried);
  return best->log_p < std::log(alpha) ? best : std::nullopt;
}

void take_out(const Settling& settling, const PoseInput& input, const AccelModel& model, std::vector<Pose>& poses) {
  std::vector<Vector3> u;
  u.reserve(poses.size());
  for (const Pose& p : poses) {
    u.push_back(p.u);
  }
  for (std::size_t k = 1; k < poses.size(); ++k) {
    Pose& p = poses[k];
    double sum = 0.0, count = 0.0;
    for (const auto& [first, last] : p.quiet) {
      for (std::size_t i = first; i < last; ++i) {
        sum += std::exp(-(input.time_s[i] - input.time_s[p.first]) / settling.tau_s);
        count += 1.0;
      }
    }
    const Vector3 change = settling.with_change ? Vector3(u[k] - u[k - 1]) : Vector3(Vector3::Ones());
    p.accel -= model.T.inverse() * settling.size_g.cwiseProduct(change) * (sum / count);
  }
}

}  // namespace selfcal::diagnosis
