#include "estimator/diagnosis/poses/dividing_head.hpp"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "estimator/diagnosis/poses/pose_student.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double same_angle = 0.1 * units::degree;
constexpr double turn = 2.0 * M_PI;

struct Stop {
  double angle = 0.0, reading = 0.0;
};

// Readings that follow one another at one angle are a stop.
std::vector<Stop> stops_of(const HeadReadings& readings) {
  std::vector<Stop> stops;
  stops.reserve(readings.angle_rad.size());
  double count = 0.0, first = 0.0;
  for (std::size_t k = 0; k < readings.angle_rad.size(); ++k) {
    const double angle = readings.angle_rad[k];
    if (stops.empty() || std::abs(angle - first) > same_angle) {
      stops.push_back({angle, readings.reading[k]});
      count = 1.0;
      first = angle;
      continue;
    }
    count += 1.0;
    stops.back().angle += (angle - stops.back().angle) / count;
    stops.back().reading += (readings.reading[k] - stops.back().reading) / count;
  }
  return stops;
}

// Angles of one turn that differ, rising.
std::vector<double> angles_of(const std::vector<Stop>& stops) {
  std::vector<double> all(stops.size());
  std::transform(stops.begin(), stops.end(), all.begin(),
                 [](const Stop& s) { return s.angle - turn * std::floor(s.angle / turn); });
  std::sort(all.begin(), all.end());
  std::vector<double> differ;
  differ.reserve(all.size());
  for (const double angle : all) {
    const bool round = !differ.empty() && turn - angle + differ.front() < same_angle;
    if (!round && (differ.empty() || angle - differ.back() > same_angle)) {
      differ.push_back(angle);
    }
  }
  return differ;
}

double widest_gap(const std::vector<double>& angles) {
  double widest = turn - angles.back() + angles.front();
  for (std::size_t k = 1; k < angles.size(); ++k) {
    widest = std::max(widest, angles[k] - angles[k - 1]);
  }
  return widest;
}

struct Fit {
  Eigen::VectorXd value, left;
  Eigen::MatrixXd covariance;  // per variance of a stop
  Eigen::MatrixXd basis;
  double square = 0.0, free = 0.0;
};

Fit fit(const Eigen::MatrixXd& X, const Eigen::VectorXd& y) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(X);
  Fit f;
  f.value = qr.solve(y);
  f.left = y - X * f.value;
  f.square = f.left.squaredNorm();
  f.free = static_cast<double>(y.size() - qr.rank());
  f.basis = Eigen::MatrixXd(qr.householderQ()).leftCols(qr.rank());
  f.covariance = (X.transpose() * X).inverse();
  return f;
}

Eigen::MatrixXd beside(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd all(a.rows(), a.cols() + b.cols());
  all << a, b;
  return all;
}

double log_p_of(const Fit& without, const Fit& with) {
  const double more = without.free - with.free;
  return more < 1.0 || with.free < 1.0
             ? 0.0
             : log_f_tail((without.square - with.square) / more / std::max(1e-300, with.square / with.free), more,
                          with.free);
}

Eigen::MatrixXd harmonics(const std::vector<Stop>& stops) {
  Eigen::MatrixXd X(static_cast<Eigen::Index>(stops.size()), 5);
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    const double a = stops[static_cast<std::size_t>(k)].angle;
    X.row(k) << 1.0, std::sin(a), std::cos(a), std::sin(2.0 * a), std::cos(2.0 * a);
  }
  return X;
}

Eigen::MatrixXd third_harmonic(const std::vector<Stop>& stops) {
  Eigen::MatrixXd X(static_cast<Eigen::Index>(stops.size()), 2);
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    const double a = stops[static_cast<std::size_t>(k)].angle;
    X.row(k) << std::sin(3.0 * a), std::cos(3.0 * a);
  }
  return X;
}

// A stop that the others contradict, by its deleted residual; empty: none.
std::string odd_stop(const Fit& f, const std::vector<Stop>& stops, double per_g) {
  constexpr double a_thousandth = -6.908;
  std::string words;
  double least = a_thousandth;
  const double free = f.free - 1.0;
  if (free < least_freedom) {
    return words;
  }
  for (Eigen::Index k = 0; k < f.left.size(); ++k) {
    const double share = 1.0 - f.basis.row(k).squaredNorm();
    const double own = f.left(k) * f.left(k) / std::max(1e-9, share);
    const double others = std::max(1e-300, (f.square - own) / free);
    const double log_p = log_corrected(log_f_tail(own / others, 1.0, free), static_cast<double>(f.left.size()));
    if (log_p < least) {
      least = log_p;
      std::array<char, 200> text{};
      std::snprintf(text.data(), text.size(),
                    "the reading at %.6g deg is off by %.3g mg where the others scatter by %.2g: look at it, or leave "
                    "it out",
                    stops[static_cast<std::size_t>(k)].angle / units::degree, 1e3 * f.left(k) / share / per_g,
                    1e3 * std::sqrt(others) / per_g);
      words = text.data();
    }
  }
  return words;
}

// Values of the model from the harmonics, by what each changes with them.
void add_parameters(const HeadReadings& readings, const Fit& f, double sigma, DividingHead& head) {
  const double a = std::hypot(f.value(1), f.value(2)), phase = std::atan2(f.value(2), f.value(1));
  constexpr double quarter = M_PI / 2.0;
  const double whole = quarter * std::round(phase / quarter);
  head.level_rad = -whole - turn * std::floor(-whole / turn);
  const double c2 = std::cos(2.0 * phase), s2 = std::sin(2.0 * phase);
  const auto size = f.value.size();
  const auto with = [&](std::initializer_list<std::pair<Eigen::Index, double>> parts) {
    Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
    for (const auto& [index, part] : parts) {
      g(index) = part;
    }
    return g;
  };
  const auto add = [&](const char* name, const char* unit, double value, const Eigen::VectorXd& by, double more) {
    const double own = sigma * std::sqrt(by.dot(f.covariance * by));
    head.parameters.push_back({name, unit, value, std::hypot(own, more), true});
  };
  const Eigen::VectorXd twice_sine = with({{3, c2 / a}, {4, s2 / a}}), twice_cosine = with({{3, -s2 / a}, {4, c2 / a}});
  const Eigen::VectorXd amplitude = with({{1, std::cos(phase)}, {2, std::sin(phase)}});
  const double k2 = -2.0 * twice_cosine.dot(f.value);
  head.parameters.reserve(5);
  add("bias", "g", f.value(0) / a - 0.5 * k2, with({{0, 1.0 / a}}) + twice_cosine, 0.0);
  const bool nominal = readings.per_g > 0.0;
  const double unit = nominal ? readings.per_g : 1.0;
  add("scale", nominal ? "1" : "raw/g", a / unit - (nominal ? 1.0 : 0.0), amplitude / unit,
      nominal ? readings.gravity_sigma : 0.0);
  add("k2", "g/g^2", k2, 2.0 * twice_cosine, 0.0);
  add("kip", "g/g^2", 2.0 * twice_sine.dot(f.value), 2.0 * twice_sine, 0.0);
  add("misalignment", "rad", phase - whole, with({{1, -std::sin(phase) / a}, {2, std::cos(phase) / a}}), 0.0);
}

std::string why_not(const std::vector<Stop>& stops, const std::vector<double>& angles) {
  constexpr std::size_t least = 8;
  std::array<char, 240> text{};
  if (angles.size() < least) {
    std::snprintf(text.data(), text.size(),
                  "%zu angles of a dividing head: they leave nothing over that says how far the five coefficients are "
                  "known: 8 and more",
                  angles.size());
  } else if (widest_gap(angles) > turn / 3.0 + same_angle) {
    std::snprintf(text.data(), text.size(), "the angles leave %.0f deg of a turn out: stops all round are wanted",
                  widest_gap(angles) / units::degree);
  } else if (stops.size() > 4 * angles.size() || angles.size() > 720) {
    std::snprintf(text.data(), text.size(), "the angle does not stand: %zu angles that differ in %zu stops",
                  angles.size(), stops.size());
  }
  return text.data();
}

}  // namespace

DividingHead judge_dividing_head(const HeadReadings& readings, double alpha) {
  DividingHead head;
  const std::vector<Stop> stops = stops_of(readings);
  const std::vector<double> angles = angles_of(stops);
  head.stops = static_cast<int>(stops.size());
  head.angles = static_cast<int>(angles.size());
  head.failure = angles.empty() ? "no angle of a dividing head" : why_not(stops, angles);
  if (!head.failure.empty()) {
    return head;
  }
  head.step_rad = widest_gap(angles);
  Eigen::VectorXd y(static_cast<Eigen::Index>(stops.size()));
  std::transform(stops.begin(), stops.end(), y.begin(), [](const Stop& s) { return s.reading; });
  Eigen::MatrixXd X = harmonics(stops);
  Fit f = fit(X, y);
  constexpr std::size_t for_third = 12;
  if (angles.size() >= for_third) {
    const Eigen::MatrixXd with_third = beside(X, third_harmonic(stops));
    const Fit third = fit(with_third, y);
    head.log_p_third = log_corrected(log_p_of(f, third), 2.0);
    const Eigen::MatrixXd with_order = beside(X, Eigen::VectorXd::LinSpaced(y.size(), -1.0, 1.0));
    const Fit drift = fit(with_order, y);
    head.log_p_drift = log_corrected(log_p_of(f, drift), 2.0);
    head.drift = head.log_p_drift < std::log(alpha);
    // The one that shows more is in the fit before the other is asked.
    if (head.drift && head.log_p_drift <= head.log_p_third) {
      const Fit both = fit(beside(with_order, third_harmonic(stops)), y);
      head.log_p_third = log_corrected(log_p_of(drift, both), 2.0);
      head.third = head.log_p_third < std::log(alpha);
      f = head.third ? both : drift;
    } else if (head.log_p_third < std::log(alpha)) {
      const Fit both = fit(beside(with_third, Eigen::VectorXd::LinSpaced(y.size(), -1.0, 1.0)), y);
      head.third = true;
      head.log_p_drift = log_corrected(log_p_of(third, both), 2.0);
      head.drift = head.log_p_drift < std::log(alpha);
      f = head.drift ? both : third;
    }
  }
  const double a = std::hypot(f.value(1), f.value(2));
  head.failure = a > 0.0 ? odd_stop(f, stops, a) : "the reading does not follow the angle";
  constexpr double followed = 0.03;  // of g: what a single turn of gravity leaves, rms
  head.rms = a > 0.0 ? std::sqrt(f.square / static_cast<double>(y.size())) / a : 0.0;
  if (head.failure.empty() && head.rms > followed) {
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(),
                  "the reading does not follow the sine of the angle: %.0f %% rms are left: other unit or other axis",
                  100.0 * head.rms);
    head.failure = text.data();
  }
  if (!head.failure.empty()) {
    return head;
  }
  // Angles of the head that are wrong are wrong again in the next turn.
  const double again = static_cast<double>(stops.size()) / static_cast<double>(angles.size());
  const double sigma =
      std::sqrt(f.square / f.free * std::max(1.0, again)) *
      student_widening(std::max(least_freedom, std::min(f.free, static_cast<double>(angles.size()) - 5.0)));
  add_parameters(readings, f, sigma, head);
  return head;
}

}  // namespace selfcal::diagnosis
