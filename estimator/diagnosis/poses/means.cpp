#include "estimator/diagnosis/poses/means.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "estimator/diagnosis/poses/pose_data.hpp"
#include "estimator/diagnosis/poses/pose_earth.hpp"
#include "estimator/diagnosis/poses/pose_judgement.hpp"
#include "estimator/diagnosis/poses/pose_motion.hpp"
#include "estimator/diagnosis/poses/pose_student.hpp"
#include "estimator/diagnosis/poses/pose_thermal.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t least_rows = 6;

template <typename... Numbers>
std::string words(const char* format, Numbers... numbers) {
  std::array<char, 300> text{};
  std::snprintf(text.data(), text.size(), format, numbers...);
  return text.data();
}

Vector3 vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

std::vector<Pose> poses_of(const PoseMeans& means) {
  const PoseInput& rows = means.rows;
  const double in_digit = std::sqrt(1.0 / 12.0);
  std::vector<Pose> poses(rows.accel.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    Pose& p = poses[k];
    p.first = k;
    p.last = k + 1;
    p.quiet = {{k, k + 1}};
    p.middle_s = means.timed ? rows.time_s[k] - rows.time_s.front() : 0.0;
    p.length_s = 1.0;
    p.gyro = at(rows.gyro, k);
    p.accel = at(rows.accel, k);
    p.gyro_white = p.accel_white = p.gyro_half = p.accel_half = Vector3::Zero();
    p.accel_hidden = in_digit * vector_of(means.accel_digit);
    p.gyro_hidden = in_digit * vector_of(means.gyro_digit);
  }
  return poses;
}

void calibrate(const PoseInput& input, AccelModel& model, std::vector<Pose>& poses) {
  model = fit_accelerometers(input, poses);
  for (Pose& p : poses) {
    p.u = model.direction(p.accel);
  }
}

// Gyros of a rate table's rows are no means at rest.
std::string turning(const PoseInput& input) {
  constexpr double most =
      3.0 * units::degree;  // rad/s, from the least to the largest: no bias changes so with the pose
  double largest = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(
        input.gyro.begin(), input.gyro.end(), [axis](const auto& a, const auto& b) { return a.at(axis) < b.at(axis); });
    largest = std::max(largest, (high->at(axis) - low->at(axis)) * input.gyro_unit);
  }
  return knows_gyro_unit(input) && largest > most
             ? words("the gyros' means differ by up to %.3g deg/s: rows of rates, not of poses at rest",
                     largest / units::degree)
             : std::string();
}

// Columns that are called gyros and hold gravity: the nominal values of a table, in g or m/s^2.
bool holds_gravity(const PoseInput& input) {
  constexpr double alike = 0.98;  // cosine of 11 deg: a table's positions are no farther from the nominal ones
  for (std::size_t k = 0; k < input.gyro.size(); ++k) {
    const Vector3 rate = vector_of(input.gyro[k]), accel = vector_of(input.accel[k]);
    if (!(rate.norm() > 0.0) || rate.normalized().dot(accel.normalized()) < alike) {
      return false;
    }
  }
  return !input.gyro.empty();
}

// A row that the others contradict by more than chance: its residual against the scatter of the others alone (deleted residual, Student's).
struct OddRow {
  Eigen::Index row = 0;
  double log_p = 0.0, off_g = 0.0, others_g = 0.0;
};
OddRow oddest(const AccelModel& model) {
  OddRow odd;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(model.jacobian);
  const Eigen::MatrixXd basis = Eigen::MatrixXd(qr.householderQ()).leftCols(qr.rank());
  const Eigen::VectorXd left = model.residual - basis * (basis.transpose() * model.residual);
  const double free = static_cast<double>(left.size() - qr.rank()) - 1.0;
  if (free < least_freedom) {
    return odd;
  }
  for (Eigen::Index k = 0; k < left.size(); ++k) {
    const double share = 1.0 - basis.row(k).squaredNorm();  // of its residual that the fit leaves
    constexpr double alone = 1e-6;                          // the row determines a parameter by itself
    if (share < alone) {
      continue;
    }
    const double own = left(k) * left(k) / share;
    const double others = std::max(1e-300, (left.squaredNorm() - own) / free);
    const double log_p = log_corrected(log_f_tail(own / others, 1.0, free), static_cast<double>(left.size()));
    if (log_p < odd.log_p) {
      odd = {k, log_p, left(k) / share, std::sqrt(others)};
    }
  }
  return odd;
}

// What was taken out by the temperature leaves fewer residuals than the fit counts.
void widen(double freedom, AccelModel& model) {
  model.sigma *= student_widening(std::max(least_freedom, freedom)) / student_widening(model.free);
}

void judge_means(const PoseMeans& means, double alpha, std::vector<Pose>& poses, PoseDiagnosis& d) {
  const PoseInput& input = means.rows;
  const double duration_s = means.timed ? d.duration_s : 1.0;
  AccelModel model;
  calibrate(input, model, poses);
  const bool by_rows = model.free >= least_freedom;
  if (!by_rows && means.accel_deviation.empty()) {
    d.failure = words(
        "%zu rows: they determine bias and scale factors and leave nothing over that says how far: standard "
        "deviations of the readings beside the means, or 12 positions and more",
        poses.size());
    return;
  }
  if (!by_rows) {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      poses[k].accel_half = vector_of(means.accel_deviation[k]);
    }
    calibrate(input, model, poses);
  }
  if (d.has_temperature) {
    d.accel_named = name_thermal(model, poses, duration_s, 0.25 * alpha);
    constexpr int rounds = 3;
    for (int round = 0; round < rounds && !d.accel_named.empty(); ++round) {
      take_out(round == 0 ? d.accel_named : refine_thermal(model, poses, duration_s, d.accel_named), model, duration_s,
               poses);
      calibrate(input, model, poses);
    }
  }
  d.failure = not_gravity(input, poses, model);
  if (!d.failure.empty()) {
    return;
  }
  if (by_rows) {
    double freedom = model.free;
    for (const PoseEffect& e : d.accel_named) {
      freedom -= static_cast<double>(e.value.size());
    }
    widen(freedom, model);
  }
  d.gravity_span_deg = gravity_span_deg(poses);
  judge_accelerometers(model, poses, duration_s, d.has_temperature, 0.25 * alpha, d);
  d.accel_parameters = parameters_of(model);
  // Rows that say themselves how far they are known say nothing against the model where no effect is asked.
  d.accel_adequate |= by_rows && !d.accel_tested;
  const OddRow odd = oddest(model);
  const bool misfit_is_better = !d.accel_tried.empty() && d.accel_tried.front().log_p < odd.log_p;
  constexpr double a_thousandth = -6.908;
  if (odd.log_p < a_thousandth && !misfit_is_better) {
    d.failure = words("row %ld is off by %.3g mg where the others scatter by %.2g: look at it, or leave it out",
                      static_cast<long>(odd.row) + 1, 1e3 * odd.off_g, 1e3 * odd.others_g);
    return;
  }
  if (input.sensors == Sensors::both) {
    const EarthInPoses earth = earth_in_poses(input, poses, false);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      poses[k].gyro -= earth.rate[k];
    }
    d.latitude_seen = earth.latitude;
    d.latitude_seen_sigma = earth.latitude_sigma;
    judge_gyros(input, poses, duration_s, d.has_temperature, 0.5 * alpha, d);
    mark_earth(input, d);
  }
}

}  // namespace

PoseDiagnosis diagnose_means(const PoseMeans& means, double alpha) {
  const PoseInput& input = means.rows;
  PoseDiagnosis d;
  d.means = d.by_poses = true;
  d.sensors = input.sensors;
  d.poses = static_cast<int>(input.accel.size());
  d.duration_s = means.timed && !input.time_s.empty() ? input.time_s.back() - input.time_s.front() : 0.0;
  if (input.accel.size() < least_rows) {
    d.failure = words("%zu rows: six positions and more determine bias and scale factors", input.accel.size());
    return d;
  }
  if (input.sensors == Sensors::both) {
    d.failure = holds_gravity(input) ? "the columns that are called gyros hold gravity, as nominal values do: --only "
                                       "accelerometers leaves them out"
                                     : turning(input);
  }
  std::vector<Pose> poses = poses_of(means);
  d.has_temperature = take_temperatures(input, poses);
  if (d.failure.empty()) {
    judge_means(means, alpha, poses, d);
  }
  for (const Pose& p : poses) {
    d.force_at_rest_g += vector_of(input.accel[p.first]).norm() * input.accel_unit / units::standard_gravity /
                         static_cast<double>(poses.size());
  }
  d.supports.push_back("gravity in " + std::to_string(d.poses) + " poses: accelerometers, a mean each");
  if (!d.accel_tested) {
    d.invisible.emplace_back(
        "nonlinearity of the accelerometers: it takes 12 poses and more in directions that determine bias, scale and "
        "misalignment first");
  }
  d.invisible.emplace_back("noise, settling and drift inside a pose: a mean shows none");
  d.invisible.emplace_back("scale factors and misalignment of the gyros: a table of poses holds no turns");
  return d;
}

}  // namespace selfcal::diagnosis
