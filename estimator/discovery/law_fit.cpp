#include "estimator/discovery/law_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/diagnosis/regression/evidence.hpp"
#include "estimator/discovery/pieces.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {

bool same_law(const LawTerm& a, const LawTerm& b) {
  return a.axis == b.axis && a.expression.text() == b.expression.text();
}

namespace {

// Relative step of the derivative with respect to a constant: its square is the error, 1e-8 its rounding.
constexpr double derivative_step = 1e-4;
// A constant moves by a third in one round at most: beyond that its signature is no longer nearly linear in it.
constexpr double largest_step = 0.33;
// Terms nearer than this to the span of the others are collinear with them.
constexpr double least_left = 1e-9;

int constants_of(const std::vector<LawTerm>& terms) {
  return std::accumulate(terms.begin(), terms.end(), 0,
                         [](int sum, const LawTerm& t) { return sum + static_cast<int>(t.constants.size()); });
}

struct Solution {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;
  double gain = 0.0;
};

Solution solve(const Eigen::MatrixXd& G, const Eigen::VectorXd& b) {
  const Eigen::VectorXd scale = G.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd A = scale.asDiagonal() * G * scale.asDiagonal();
  A.diagonal().array() += least_left;
  const Eigen::LDLT<Eigen::MatrixXd> solver(A);
  Solution s;
  const Eigen::VectorXd y = scale.asDiagonal() * b;
  s.value = scale.asDiagonal() * solver.solve(y);
  s.covariance = scale.asDiagonal() * solver.solve(Eigen::MatrixXd::Identity(b.size(), b.size())) * scale.asDiagonal();
  s.gain = std::max(0.0, y.dot(solver.solve(y)));
  return s;
}

// Fall of the square by column k, given all the others.
double gain_of(const Eigen::MatrixXd& G, const Eigen::VectorXd& b, const std::vector<int>& all, int k) {
  std::vector<int> without = all;
  without.erase(std::remove(without.begin(), without.end(), k), without.end());
  const double with = solve(G(all, all), b(all)).gain;
  return with - (without.empty() ? 0.0 : solve(G(without, without), b(without)).gain);
}

void refine_constants(std::vector<LawTerm>& terms, const Eigen::VectorXd& value) {
  auto at = static_cast<Eigen::Index>(terms.size());
  for (std::size_t k = 0; k < terms.size(); ++k) {
    for (double& constant : terms[k].constants) {
      const double step = value(at++) / value(static_cast<Eigen::Index>(k));
      const double most = largest_step * std::max(std::abs(constant), 1e-6);
      constant += std::isfinite(step) ? std::clamp(step, -most, most) : 0.0;
    }
    if (!terms[k].constants.empty()) {
      terms[k].constants.front() = std::clamp(terms[k].constants.front(), terms[k].least, terms[k].most);
    }
  }
}

// Of a law by one of its constants. A step changes where it stands and nowhere else: its derivative is as wide as a node at least.
Eigen::ArrayXd derivative(const LawTerm& term, std::size_t constant, const laws::Channels& channels) {
  constexpr double widest = 0.05;
  const double size = std::max(std::abs(term.constants[constant]), 1e-6);
  Eigen::ArrayXd slope;
  for (double step = derivative_step; step < widest && (slope.size() == 0 || (slope == 0.0).all()); step *= 4.0) {
    std::vector<double> up = term.constants, down = term.constants;
    up[constant] += step * size;
    down[constant] -= step * size;
    slope = (term.expression.evaluate(channels, up) - term.expression.evaluate(channels, down)) / (2.0 * step * size);
  }
  return slope;
}

}  // namespace

Eigen::VectorXd column_scale(const std::vector<LawTerm>& terms, const Eigen::VectorXd& coefficient) {
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(terms.size()) + constants_of(terms));
  auto at = static_cast<Eigen::Index>(terms.size());
  for (std::size_t k = 0; k < terms.size(); ++k) {
    for (std::size_t c = 0; c < terms[k].constants.size(); ++c) {
      scale(at++) = coefficient(static_cast<Eigen::Index>(k));
    }
  }
  return scale;
}

LawColumns::LawColumns(const LawMotion& motion, const NodeTable& table, const std::vector<LawTerm>& terms,
                       bool derivatives)
    : motion_(motion), table_(table), count_(static_cast<int>(terms.size()) + (derivatives ? constants_of(terms) : 0)) {
  const Eigen::ArrayXd dt = dt_of(table);
  integrals_.resize(dt.size(), count_);
  const auto put = [&](int axis, const Eigen::ArrayXd& values) {
    integrals_.col(static_cast<Eigen::Index>(axes_.size())) =
        values.isFinite().select(values, 0.0) * dt * unit_of(axis);
    axes_.push_back(axis);
  };
  for (const LawTerm& term : terms) {
    put(term.axis, term.expression.evaluate(table.channels, term.constants));
  }
  for (const LawTerm& term : terms) {
    for (std::size_t c = 0; derivatives && c < term.constants.size(); ++c) {
      put(term.axis, derivative(term, c, table.channels));
    }
  }
}

void LawColumns::block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
                       Eigen::Ref<Eigen::Matrix3Xd> angle) {
  const double end_s = block.end_s - motion_.start_s();
  for (; next_ < table_.nodes.size() && table_.nodes[next_].time_s < end_s; ++next_) {
    for (int column = 0; column < count_; ++column) {
      const int axis = axes_[static_cast<std::size_t>(column)];
      (axis < 3 ? angle : velocity)(axis % 3, column) += integrals_(static_cast<Eigen::Index>(next_), column);
    }
  }
}

namespace {

// Normal equations and rows of the terms over all recordings, constants' derivatives behind the terms.
struct JointSums {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
  double square = 0.0, rows = 0.0;
  RowSink sink;
  std::vector<int> fold;  // [rows] dwell or rotation, of one recording after the other
  std::vector<ColumnSums> each;
};

void append(const RowSink& more, RowSink& all) {
  const Eigen::Index before = all.residual.size(), n = more.residual.size();
  all.columns.conservativeResize(before + n, more.columns.cols());
  all.residual.conservativeResize(before + n);
  all.columns.bottomRows(n) = more.columns;
  all.residual.tail(n) = more.residual;
}

JointSums sum_jointly(std::span<const LawRecording> recordings, const std::vector<LawTerm>& terms,
                      const std::stop_token& stop) {
  JointSums all;
  int first_fold = 0;
  for (const LawRecording& r : recordings) {
    LawColumns source(r.motion, r.table, terms, true);
    RowSink sink;
    ColumnSums sums = run_beside(r.beside, r.motion.context(), r.input, r.trace, source, stop, &sink);
    if (all.each.empty()) {
      all.information = Eigen::MatrixXd::Zero(source.count(), source.count());
      all.score = Eigen::VectorXd::Zero(source.count());
    }
    all.information += sums.information;
    all.score += sums.score;
    all.square += sums.square;
    all.rows += sums.rows;
    append(sink, all.sink);
    int last_fold = first_fold;
    for (const double t : sink.time_s) {
      all.fold.push_back(first_fold + static_cast<int>(r.motion.context().segment_at(t)));
      last_fold = std::max(last_fold, all.fold.back());
    }
    first_fold = last_fold + 1;
    all.each.push_back(std::move(sums));
  }
  return all;
}

FittedRecording fitted(const PassInput& input, const ColumnSums& sums, const LawFit& fit,
                       const Eigen::VectorXd& scale) {
  const int first = sums.pass.layout.parameters();
  FittedRecording r;
  r.shift = sums.shift * scale.asDiagonal();
  r.parameters = input.parameters + sums.pass.mean.segment<sensor_parameter_count>(first) +
                 r.shift.leftCols(fit.coefficient.size()) * fit.coefficient;
  r.covariance_alone = sums.pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(first, first);
  r.covariance = r.covariance_alone + r.shift * fit.covariance * r.shift.transpose();
  return r;
}

std::vector<int> first_numbers(std::size_t count) {
  std::vector<int> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

// A change at a time that is fitted, alone or times something.
bool is_step(const LawTerm& law) {
  return law.constants.size() == 1 && law.expression.text().find("sign(t-?)") != std::string::npos;
}

// A step is placed to a second, so much of the recording as one value of a law holds.
void add_second_of_steps(LawFit& fit) {
  constexpr double square_of_second = 1.0 / 12.0 / (units::hour * units::hour);
  auto at = static_cast<Eigen::Index>(fit.terms.size());
  for (const LawTerm& term : fit.terms) {
    if (is_step(term)) {
      fit.covariance(at, at) += square_of_second;
    }
    at += static_cast<Eigen::Index>(term.constants.size());
  }
}

// Coefficients with the constants unknown, what each term gains, and what it gains on what was left out.
void describe(const JointSums& sums, const Eigen::VectorXd& scale, LawFit& fit) {
  const Eigen::MatrixXd G = scale.asDiagonal() * sums.information * scale.asDiagonal();
  fit.covariance = solve(G, scale.asDiagonal() * sums.score).covariance;
  add_second_of_steps(fit);
  fit.gain.clear();
  fit.collinear.clear();
  fit.held_out_gain.clear();
  const std::vector<int> linear = first_numbers(fit.terms.size());
  for (const int k : linear) {
    fit.collinear.push_back(1.0 - 1.0 / (fit.covariance(k, k) * G(k, k)));
    fit.gain.push_back(gain_of(sums.information, sums.score, linear, k));
    std::vector<int> without = linear;
    without.erase(without.begin() + k);
    fit.held_out_gain.push_back(
        diagnosis::held_out_gain(sums.sink.columns, sums.sink.residual, sums.fold, linear, without));
  }
}

// The time of a step, to a second: what it gains falls by the distance from the true time and not by its square, so that Gauss-Newton
// comes nearer by seconds only.
void place_step(std::span<const LawRecording> recordings, std::vector<LawTerm>& terms, std::size_t k,
                const std::stop_token& stop) {
  constexpr int rounds = 6;
  constexpr int farthest_s = 128;
  std::vector<LawTerm> others = terms;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
  for (int round = 0; round < rounds && !stop.stop_requested(); ++round) {
    std::vector<LawTerm> places = {terms[k]};
    for (int away = 1; away <= farthest_s; away *= 2) {
      for (const int to : {-away, away}) {
        LawTerm moved = terms[k];
        moved.constants.front() += to / units::hour;
        if (moved.constants.front() > moved.least && moved.constants.front() < moved.most) {
          places.push_back(std::move(moved));
        }
      }
    }
    const std::vector<SingleFit> fits = fit_each(recordings, others, places, stop);
    const auto best = std::max_element(fits.begin(), fits.end(),
                                       [](const SingleFit& a, const SingleFit& b) { return a.gain < b.gain; });
    if (best == fits.begin()) {
      return;
    }
    terms[k] = places[static_cast<std::size_t>(best - fits.begin())];
  }
}

}  // namespace

LawFit fit_laws(std::span<const LawRecording> recordings, std::vector<LawTerm> terms, int rounds,
                const std::stop_token& stop) {
  LawFit fit;
  const int constants = constants_of(terms);
  const std::vector<int> linear = first_numbers(terms.size());
  for (std::size_t k = 0; k < terms.size() && rounds > 0; ++k) {
    if (is_step(terms[k])) {
      place_step(recordings, terms, k, stop);
    }
  }
  double best = -1.0;
  for (int round = 0; round <= (constants > 0 ? rounds : 0); ++round) {
    const JointSums sums = sum_jointly(recordings, terms, stop);
    const Solution alone = solve(sums.information(linear, linear), sums.score(linear));
    if (alone.gain <= best * (1.0 + 1e-9)) {
      break;  // no better: the round before stands
    }
    best = alone.gain;
    fit.terms = terms;
    fit.coefficient = alone.value;
    fit.square_before = sums.square;
    fit.square_after = sums.square - alone.gain;
    fit.rows = sums.rows;
    const Eigen::VectorXd scale = column_scale(terms, alone.value);
    describe(sums, scale, fit);
    fit.recordings.clear();
    for (std::size_t r = 0; r < recordings.size(); ++r) {
      fit.recordings.push_back(fitted(recordings[r].input, sums.each[r], fit, scale));
    }
    if (constants > 0) {
      refine_constants(terms, solve(sums.information, sums.score).value);
    }
  }
  return fit;
}

std::vector<SingleFit> fit_each(std::span<const LawRecording> recordings, const std::vector<LawTerm>& given,
                                const std::vector<LawTerm>& alternatives, const std::stop_token& stop,
                                GivenConstants given_constants) {
  const bool free = given_constants == GivenConstants::free;
  std::vector<LawTerm> all = given;
  all.insert(all.end(), alternatives.begin(), alternatives.end());
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
  for (const LawRecording& r : recordings) {
    LawColumns source(r.motion, r.table, all, free);
    const ColumnSums sums = run_beside(r.beside, r.motion.context(), r.input, r.trace, source, stop);
    information = information.size() == 0 ? sums.information : Eigen::MatrixXd(information + sums.information);
    score = score.size() == 0 ? sums.score : Eigen::VectorXd(score + sums.score);
  }
  std::vector<int> base = first_numbers(given.size());
  for (int k = 0; free && k < constants_of(given); ++k) {
    base.push_back(static_cast<int>(all.size()) + k);  // derivatives stand behind all terms
  }
  const double before = base.empty() ? 0.0 : solve(information(base, base), score(base)).gain;
  std::vector<SingleFit> fits;
  for (std::size_t k = 0; k < alternatives.size(); ++k) {
    std::vector<int> with = base;
    with.push_back(static_cast<int>(given.size() + k));
    const Solution solution = solve(information(with, with), score(with));
    const Eigen::Index last = solution.value.size() - 1;
    const double own = information(with.back(), with.back()), variance = solution.covariance(last, last);
    fits.push_back({solution.gain - before, solution.value(last), variance, own > 0.0 ? 1.0 / (own * variance) : 0.0});
  }
  return fits;
}

namespace {

class Subtraction : public ExtraSignatures {
 public:
  Subtraction(LawColumns& columns, const Eigen::VectorXd& coefficient, diagnosis::AngleVelocity& delta_theta,
              diagnosis::AngleVelocity& delta_v)
      : columns_(columns), coefficient_(coefficient), delta_theta_(delta_theta), delta_v_(delta_v) {}
  int count() const override { return columns_.count(); }
  bool block_ends_before(std::size_t sample) const override { return columns_.block_ends_before(sample); }
  void block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
             Eigen::Ref<Eigen::Matrix3Xd> angle) override {
    columns_.block(block, velocity, angle);
    const double samples = static_cast<double>(block.last - block.first);
    const Vector3 dv = velocity * coefficient_ / samples, dtheta = angle * coefficient_ / samples;
    for (std::size_t i = block.first; i < block.last; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        delta_v_[i][axis] -= dv(static_cast<Eigen::Index>(axis));
        delta_theta_[i][axis] -= dtheta(static_cast<Eigen::Index>(axis));
      }
    }
  }

 private:
  LawColumns& columns_;
  const Eigen::VectorXd& coefficient_;
  diagnosis::AngleVelocity &delta_theta_, &delta_v_;
};

}  // namespace

diagnosis::CorrectedRecording without_laws(const LawMotion& motion, const NodeTable& table, const PassInput& input,
                                           const std::vector<LawTerm>& terms, const Eigen::VectorXd& coefficient) {
  diagnosis::AngleVelocity delta_theta(input.data->delta_theta.begin(), input.data->delta_theta.end());
  diagnosis::AngleVelocity delta_v(input.data->delta_v.begin(), input.data->delta_v.end());
  LawColumns columns(motion, table, terms, false);
  Subtraction subtraction(columns, coefficient, delta_theta, delta_v);
  IntervalNavigator navigator(*input.data, input.parameters, input.C_nb, input.sign, input.interval_s, &subtraction);
  Interval interval;
  while (navigator.next(interval)) {
  }
  return {*input.data, std::move(delta_theta), std::move(delta_v)};
}

}  // namespace selfcal::discovery
