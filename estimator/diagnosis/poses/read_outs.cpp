#include "estimator/diagnosis/poses/read_outs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "estimator/diagnosis/poses/pose_regression.hpp"
#include "estimator/diagnosis/poses/pose_student.hpp"
#include "estimator/diagnosis/poses/read_out_oscillation.hpp"
#include "estimator/diagnosis/poses/read_out_rows.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

// Rows that stand more than six usual deviations off are left out, at most a fifth of them, and counted.
std::vector<bool> in_agreement(const Eigen::MatrixXd& X, const Eigen::MatrixXd& y) {
  std::vector<bool> keep(static_cast<std::size_t>(y.rows()), true);
  constexpr double far = 6.0, most = 0.2;
  for (int round = 0; round < 5; ++round) {
    Eigen::VectorXd weight(y.rows());
    for (Eigen::Index k = 0; k < y.rows(); ++k) {
      weight(k) = keep[static_cast<std::size_t>(k)] ? 1.0 : 0.0;
    }
    Eigen::VectorXd off = Eigen::VectorXd::Zero(y.rows());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Regression r = regress(weight.asDiagonal() * X, weight.asDiagonal() * y.col(axis));
      off += (y.col(axis) - X * r.value).cwiseAbs2();
    }
    std::vector<double> sorted(off.data(), off.data() + off.size());
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    const double limit = far * far * std::max(1e-18, sorted[sorted.size() / 2]);
    std::size_t dropped = 0;
    for (Eigen::Index k = 0; k < y.rows(); ++k) {
      keep[static_cast<std::size_t>(k)] = off(k) <= limit;
      dropped += off(k) <= limit ? 0 : 1;
    }
    if (static_cast<double>(dropped) > most * static_cast<double>(y.rows())) {
      return std::vector<bool>(keep.size(), true);
    }
  }
  return keep;
}

std::vector<TurnRow> kept_rows(const std::vector<TurnRow>& rows, int& disagreeing) {
  constexpr std::size_t enough = 6;
  if (rows.size() < enough) {
    return rows;
  }
  Eigen::MatrixXd X(static_cast<Eigen::Index>(rows.size()), 4), y(X.rows(), 3);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double angle = rows[k].inner_angle;
    X.row(static_cast<Eigen::Index>(k)) << rows[k].inner, rows[k].outer, rows[k].outer * std::cos(angle),
        rows[k].outer * std::sin(angle);
    y.row(static_cast<Eigen::Index>(k)) = rows[k].turned.transpose();
  }
  const std::vector<bool> keep = in_agreement(X, y);
  std::vector<TurnRow> kept;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (keep[k]) {
      kept.push_back(rows[k]);
    }
  }
  disagreeing = static_cast<int>(rows.size() - kept.size());
  return kept;
}

// The outer axis stands in the sensor as the inner angle lets it: rows at the inner angle that most of them have.
void keep_one_inner_angle(std::vector<const TurnRow*>& rows) {
  constexpr double alike = 2.0 * units::degree;
  std::size_t most = 0;
  double angle = 0.0;
  for (const TurnRow* row : rows) {
    const auto same = static_cast<std::size_t>(std::count_if(rows.begin(), rows.end(), [&](const TurnRow* other) {
      return std::abs(other->inner_angle - row->inner_angle) < alike;
    }));
    if (same > most) {
      most = same;
      angle = row->inner_angle;
    }
  }
  std::erase_if(rows, [&](const TurnRow* row) { return std::abs(row->inner_angle - angle) >= alike; });
}

// What turns are off by, and whether neighbours are off alike.
struct Residuals {
  double scatter = 0.0, alike = 0.0;
  double widening = 1.0;  // of the sigma of their mean
};

// Long-run variance over the variance (Newey and West 1987, Bartlett weights), where neighbours correlate beyond two sigma of chance.
// Turns that are off to and fro are the table's, which the sums hold.
Residuals residuals_of(const Eigen::VectorXd& off) {
  const auto n = off.size();
  const Eigen::VectorXd e = off.array() - off.mean();
  const double square = e.squaredNorm();
  Residuals r;
  constexpr Eigen::Index enough = 12;
  if (n < 2 || !(square > 0.0)) {
    return r;
  }
  r.scatter = std::sqrt(square / static_cast<double>(n - 1));
  const auto correlation = [&](Eigen::Index lag) { return e.head(n - lag).dot(e.tail(n - lag)) / square; };
  if (n < enough || correlation(1) < 2.0 / std::sqrt(static_cast<double>(n))) {
    return r;
  }
  const auto lags = static_cast<Eigen::Index>(std::ceil(std::cbrt(static_cast<double>(n))));
  double variance = 1.0;
  for (Eigen::Index lag = 1; lag <= lags; ++lag) {
    variance += 2.0 * (1.0 - static_cast<double>(lag) / static_cast<double>(lags + 1)) * correlation(lag);
  }
  r.alike = correlation(1);
  r.widening = std::sqrt(std::max(1.0, variance));
  return r;
}

// By which sigma of `rows` rows is wider that are known by no more than what they leave beside two columns.
double widened_by_few(Eigen::Index rows) {
  return student_widening(static_cast<double>(std::max<Eigen::Index>(1, rows - 2)));
}

// (R1) Sums over the turns, for a table that stops short once goes further the next time: what a stop's angle is off by is
// white in the sums, what the gyros add turn by turn is a walk in them. Of few turns what is left may be small by chance: sigma is no less
// than the gyros' own noise makes it.
void fit_sums(const PoseInput& input, const std::vector<const TurnRow*>& rows, bool outer, ReadOutAxis& axis) {
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd X(n + 1, 2), y(n + 1, 3);
  X.row(0) << 1.0, 0.0;
  y.row(0).setZero();
  std::vector<double> number = {0.0};
  Vector3 information = Vector3::Zero();
  for (Eigen::Index k = 0; k < n; ++k) {
    const TurnRow& row = *rows[static_cast<std::size_t>(k)];
    const double turn = outer ? row.outer : row.inner;
    X.row(k + 1) << 1.0, X(k, 1) + turn;
    y.row(k + 1) = y.row(k) + row.turned.transpose();
    number.push_back(static_cast<double>(k + 1));
    axis.turned_deg += std::abs(turn) / units::degree;
    information += (turn * turn * row.noise.cwiseAbs2().cwiseMax(1e-300).cwiseInverse());
  }
  const double few = widened_by_few(n + 1);
  std::array<Residuals, 3> off;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Whitener white(X, y.col(i), number);
    const Regression r = regress(white(X), white(y.col(i)));
    const Eigen::VectorXd left = y.col(i) - r.value(1) * X.col(1);
    off[static_cast<std::size_t>(i)] = residuals_of(left.tail(n) - left.head(n));
    axis.response(i) = r.value(1) * input.gyro_unit;
    const double by_residuals = r.sigma(1) * few * off[static_cast<std::size_t>(i)].widening;
    axis.sigma(i) = input.gyro_unit * std::max(by_residuals, 1.0 / std::sqrt(information(i)));
  }
  Eigen::Index along = 0;
  axis.response.cwiseAbs().maxCoeff(&along);
  const double mean_turn = axis.turned_deg * units::degree / static_cast<double>(n);
  axis.turn_scatter = off[static_cast<std::size_t>(along)].scatter * input.gyro_unit / mean_turn;
  axis.turns_alike = off[static_cast<std::size_t>(along)].alike;
}

// (R1), axes that turn by themselves.
void axes_from_turns(const PoseInput& input, const std::vector<TurnRow>& rows, ReadOuts& answer) {
  for (const bool outer : {true, false}) {
    std::vector<const TurnRow*> of_axis;
    for (const TurnRow& row : rows) {
      if (outer ? row.about_outer() : row.about_inner()) {
        of_axis.push_back(&row);
      }
    }
    if (outer) {
      keep_one_inner_angle(of_axis);
    }
    constexpr std::size_t enough = 3;
    if (of_axis.size() < enough) {
      continue;
    }
    ReadOutAxis axis;
    axis.name = outer ? "outer" : "inner";
    axis.rows = static_cast<int>(of_axis.size());
    fit_sums(input, of_axis, outer, axis);
    answer.axes.push_back(axis);
  }
}

struct RateRow {
  double rate = 0.0, uneven = 0.0;
  Vector3 gyro;
};

// A rate that was less steady counts less: by what its halves differ by, beside what they usually differ by.
std::pair<Eigen::MatrixXd, Eigen::MatrixXd> weighted(const std::vector<RateRow>& rows) {
  std::vector<double> uneven;
  uneven.reserve(rows.size());
  for (const RateRow& row : rows) {
    uneven.push_back(row.uneven);
  }
  std::nth_element(uneven.begin(), uneven.begin() + static_cast<std::ptrdiff_t>(uneven.size() / 2), uneven.end());
  const double usual = std::max(1e-12, uneven[uneven.size() / 2]);
  Eigen::MatrixXd X(static_cast<Eigen::Index>(rows.size()), 2), y(X.rows(), 3);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double weight = 1.0 / std::hypot(1.0, rows[k].uneven / usual);
    X.row(static_cast<Eigen::Index>(k)) << weight, weight * rows[k].rate;
    y.row(static_cast<Eigen::Index>(k)) = weight * rows[k].gyro.transpose();
  }
  return {X, y};
}

// (R2), poses as rates of zero.
std::optional<ReadOutAxis> axis_from_rates(const PoseInput& input, const std::vector<SteadyRate>& rates,
                                           const std::vector<Pose>& poses, bool outer, double alpha, ReadOuts& answer) {
  ReadOutAxis axis;
  axis.name = outer ? "outer" : "inner";
  axis.steady = true;
  axis.slowest_deg_per_s = HUGE_VAL;
  std::vector<RateRow> rows;
  for (const SteadyRate& s : rates) {
    rows.push_back({s.rate, s.uneven, s.gyro});
    const double rate = std::abs(s.rate) / units::degree;
    axis.slowest_deg_per_s = std::min(axis.slowest_deg_per_s, rate);
    axis.fastest_deg_per_s = std::max(axis.fastest_deg_per_s, rate);
    axis.turned_deg += rate * s.length_s;
  }
  axis.rows = static_cast<int>(rows.size());
  for (const Pose& p : poses) {
    rows.push_back({0.0, p.gyro_half.norm(), p.gyro});
  }
  constexpr std::size_t enough = 4;
  if (axis.rows < 2 || rows.size() < enough) {
    return std::nullopt;
  }
  const auto [X, y] = weighted(rows);
  const double few = widened_by_few(X.rows());
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Regression r = regress(X, y.col(i));
    answer.gyro_bias(i) = r.value(0);
    answer.gyro_bias_sigma(i) = r.sigma(0) * few;
    axis.response(i) = r.value(1) * input.gyro_unit;
    axis.sigma(i) = r.sigma(1) * few * input.gyro_unit;
  }
  // Along the response: the part that grows with the rate, in both directions alike.
  const Eigen::VectorXd along = y * axis.response.normalized();
  const Eigen::VectorXd square = X.col(1).cwiseProduct(X.col(1).cwiseAbs()).cwiseQuotient(X.col(0));
  const Regression plain = regress(X, along), with = regress(joined(X, square), along);
  if (with.rank == 3 && y.rows() > 4) {
    axis.log_p_nonlinear = log_p_of(plain, with, y.rows());
    axis.nonlinearity = PoseParameter{"nonlinearity", "s/rad", with.value(2) * input.gyro_unit / axis.response.norm(),
                                      with.sigma(2) * few * input.gyro_unit / axis.response.norm(),
                                      axis.log_p_nonlinear < std::log(alpha)};
  }
  return axis;
}

// (R2) for each way in which the sensor was mounted. Of turns from stop to stop and steady rates the better one; turns of a sensor that
// was mounted anew tell nothing together.
void axes_from_rates(const PoseInput& input, const std::vector<SteadyRate>& rates, const std::vector<Pose>& poses,
                     bool outer, double alpha, ReadOuts& answer) {
  std::vector<ReadOutAxis> found;
  for (const std::vector<SteadyRate>& of_mount : mounts_of(input, rates, poses, outer)) {
    if (auto axis = axis_from_rates(input, of_mount, poses, outer, alpha, answer)) {
      found.push_back(std::move(*axis));
    }
  }
  const auto known = std::find_if(answer.axes.begin(), answer.axes.end(),
                                  [&](const ReadOutAxis& a) { return a.name == (outer ? "outer" : "inner"); });
  const bool better = known == answer.axes.end() || found.size() > 1 ||
                      (!found.empty() && found.front().sigma.norm() < known->sigma.norm());
  if (found.empty() || !better) {
    return;
  }
  if (known != answer.axes.end()) {
    answer.axes.erase(known);
  }
  answer.axes.insert(answer.axes.end(), found.begin(), found.end());
}

// (R3). A gyro's sample is the mean over its interval or a reading at its end, which nothing in a log shows: half an interval lies
// between the two, and the delay is known to no less.
std::optional<ReadOutClock> clock_of(const std::vector<Delay>& delays, double duration_s, double interval_s) {
  constexpr std::size_t enough = 3;
  if (delays.size() < enough) {
    return std::nullopt;
  }
  ReadOutClock clock;
  clock.turns = static_cast<int>(delays.size());
  const auto n = static_cast<Eigen::Index>(delays.size());
  Eigen::MatrixXd X(n, 2);
  Eigen::VectorXd y(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Delay& d = delays[static_cast<std::size_t>(k)];
    X.row(k) << 1.0, d.time_s / duration_s - 0.5;
    y(k) = d.delay_s;
  }
  const Regression r = regress(X, y);
  const double few = widened_by_few(n);
  clock.delay_s = r.value(0);
  clock.delay_sigma_s = std::hypot(r.sigma(0) * few, 0.5 * interval_s);
  clock.growth_s = r.value(1);
  clock.growth_sigma_s = r.sigma(1) * few;
  clock.faster = -clock.growth_s / duration_s;  // what the read-outs show at a second happens 1 + this by the log
  clock.faster_sigma = clock.growth_sigma_s / duration_s;
  clock.least_s = y.minCoeff();
  clock.most_s = y.maxCoeff();
  clock.scatter_s = std::sqrt(r.square / static_cast<double>(std::max<Eigen::Index>(1, n - 2)));
  return clock;
}

// (R4)
std::optional<TableTilt> tilt_of(const std::vector<Stop>& stops, const std::vector<Pose>& poses, double raw_per_g) {
  constexpr std::size_t enough = 8;
  if (stops.size() < enough) {
    return std::nullopt;
  }
  const auto range = [&](auto angle) {
    const auto [low, high] = std::minmax_element(stops.begin(), stops.end(),
                                                 [&](const Stop& a, const Stop& b) { return angle(a) < angle(b); });
    return angle(*high) - angle(*low);
  };
  const double outer = range([](const Stop&s) { return s.outer; }), inner = range([](const Stop&s) { return s.inner; });
  constexpr double span = 120.0 * units::degree, still = 0.5 * units::degree;
  if (std::max(outer, inner) < span || std::min(outer, inner) > still) {
    return std::nullopt;
  }
  const auto n = static_cast<Eigen::Index>(stops.size());
  Eigen::MatrixXd X(n, 3), twice(n, 2), f(n, 3);
  std::vector<double> time_s;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Stop& s = stops[static_cast<std::size_t>(k)];
    const double angle = outer > inner ? s.outer : s.inner;
    X.row(k) << 1.0, std::cos(angle), std::sin(angle);
    twice.row(k) << std::cos(2.0 * angle), std::sin(2.0 * angle);
    f.row(k) = poses[s.pose].accel.transpose();
    time_s.push_back(poses[s.pose].middle_s);
  }
  TableTilt tilt;
  tilt.axis = outer > inner ? "outer" : "inner";
  double square = 0.0, noise = 0.0, log_p = 0.0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Whitener white(X, f.col(axis), time_s);
    const Eigen::VectorXd y = white(f.col(axis));
    const Regression plain = regress(white(X), y);
    square += plain.value.tail<2>().squaredNorm();
    noise += plain.sigma.tail<2>().squaredNorm();
    log_p = std::min(log_p, log_p_of(plain, regress(white(joined(X, twice)), y), n));
  }
  // p and q are each g sin(tilt) long; noise adds its own square to theirs.
  const double sine = std::sqrt(0.5 * std::max(0.0, square - noise)) / raw_per_g;
  constexpr double nearer = 0.7;
  tilt.near_vertical = sine < nearer;
  tilt.tilt_deg = std::asin(std::min(1.0, sine)) / units::degree;
  tilt.sigma_deg = std::sqrt(0.5 * noise) / raw_per_g / units::degree;
  tilt.log_p_shape = log_corrected(log_p, 3.0);
  return tilt;
}

// (R5), where there is neither a stop nor a steady rate.
void add_oscillation(const PoseInput& input, double interval_s, ReadOuts& answer) {
  for (const bool outer : {true, false}) {
    const std::optional<Oscillation> o = judge_oscillation(input, outer);
    if (!o) {
      continue;
    }
    answer.axes.push_back(o->axis);
    answer.gyro_bias = o->bias;
    answer.gyro_bias_sigma = o->bias_sigma;
    ReadOutClock clock;
    clock.turns = o->axis.rows;
    clock.delay_s = clock.least_s = clock.most_s = o->delay_s;
    clock.delay_sigma_s = std::hypot(o->delay_sigma_s, 0.5 * interval_s);
    answer.clock = clock;
  }
}

}  // namespace

std::optional<ReadOuts> judge_read_outs(const PoseInput& input, const std::vector<Pose>& poses,
                                        const std::vector<Clipping>& clipped, double alpha) {
  if (input.outer.size() != input.time_s.size() || input.inner.size() != input.time_s.size()) {
    return std::nullopt;
  }
  ReadOuts answer;
  const std::vector<Stop> stops = find_stops(input, poses);
  const std::vector<TurnRow> rows =
      kept_rows(turns_between(input, poses, stops, clipped, answer.clipped_turns), answer.disagreeing);
  const std::vector<SteadyRate> rates = find_steady_rates(input, clipped, answer.clipped_rates);
  axes_from_turns(input, rows, answer);
  for (const bool outer : {true, false}) {
    axes_from_rates(input, rates, poses, outer, alpha, answer);
  }
  const double duration_s = input.time_s.back() - input.time_s.front();
  const double interval_s = duration_s / static_cast<double>(input.time_s.size() - 1);
  if (answer.axes.empty()) {
    add_oscillation(input, interval_s, answer);
    return answer.axes.empty() ? std::nullopt : std::optional(answer);
  }
  const bool by_rates =
      std::any_of(answer.axes.begin(), answer.axes.end(), [](const ReadOutAxis& a) { return a.steady; });
  answer.clock = clock_of(by_rates ? delays_of_steps(input, rates, answer) : delays_of_turns(input, rows, answer),
                          duration_s, interval_s);
  if (!poses.empty() && input.sensors == Sensors::both) {
    double raw_per_g = 0.0;
    for (const Pose& p : poses) {
      raw_per_g += p.accel.norm() / static_cast<double>(poses.size());
    }
    answer.tilt = tilt_of(stops, poses, input.accel_unit > 0.0 ? 9.80665 / input.accel_unit : raw_per_g);
  }
  return answer;
}

std::optional<ReadOuts> read_outs_of(const PoseInput& input, const std::vector<Pose>& poses,
                                     const std::vector<Clipping>& clipped, double alpha,
                                     std::vector<std::string>& invisible) {
  constexpr double another = 1.5, deviations = 5.0;
  std::optional<ReadOuts> answer = judge_read_outs(input, poses, clipped, alpha);
  for (const ReadOutAxis& axis : answer&& input.gyros_si ? answer->axes : std::vector<ReadOutAxis>{}) {
    const double gain = axis.response.norm();
    if ((gain > another || gain < 1.0 / another) && std::abs(gain - 1.0) > deviations * axis.sigma.norm()) {
      std::array<char, 200> text{};
      std::snprintf(
          text.data(), text.size(),
          "what angle read-outs tell that turn %.3g times as far as the gyros (another unit than degrees, or a "
          "table that does not carry the sensor)",
          1.0 / gain);
      invisible.emplace_back(text.data());
      return std::nullopt;
    }
  }
  return answer;
}

}  // namespace selfcal::diagnosis
