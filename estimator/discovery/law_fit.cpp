#include "estimator/discovery/law_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/diagnosis/evidence.hpp"
#include "estimator/discovery/pieces.hpp"

namespace selfcal::discovery {
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
  }
}

}  // namespace

LawColumns::LawColumns(const LawMotion& motion, const NodeTable& table, const std::vector<LawTerm>& terms,
                       bool derivatives)
    : motion_(motion), table_(table), count_(static_cast<int>(terms.size()) + (derivatives ? constants_of(terms) : 0)) {
  const auto n = static_cast<Eigen::Index>(table.nodes.size());
  Eigen::ArrayXd dt(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    dt(k) = table.nodes[static_cast<std::size_t>(k)].dt;
  }
  integrals_.resize(n, count_);
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
      std::vector<double> up = term.constants, down = term.constants;
      const double step = derivative_step * std::max(std::abs(up[c]), 1e-6);
      up[c] += step;
      down[c] -= step;
      put(term.axis, (term.expression.evaluate(table.channels, up) - term.expression.evaluate(table.channels, down)) /
                         (2.0 * step));
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

LawFit fit_laws(const LawMotion& motion, const NodeTable& table, const PassInput& input, std::vector<LawTerm> terms,
                int rounds, const std::stop_token& stop) {
  LawFit fit;
  const int constants = constants_of(terms);
  double best = -1.0;
  std::vector<LawTerm> next = terms;
  for (int round = 0; round <= (constants > 0 ? rounds : 0); ++round) {
    LawColumns source(motion, table, next, true);
    RowSink sink;
    const ColumnSums sums = run_columns(input, source, stop, &sink);
    std::vector<int> linear(next.size());
    std::iota(linear.begin(), linear.end(), 0);
    const Solution alone = solve(sums.information(linear, linear), sums.score(linear));
    if (alone.gain <= best * (1.0 + 1e-9)) {
      break;  // no better: the round before stands
    }
    best = alone.gain;
    fit.terms = next;
    fit.coefficient = alone.value;
    fit.square_before = sums.square;
    fit.square_after = sums.square - alone.gain;
    fit.rows = sums.rows;
    // Coefficients with the constants unknown: the column of a constant is the coefficient times the derivative.
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(source.count());
    auto at = static_cast<Eigen::Index>(next.size());
    for (std::size_t k = 0; k < next.size(); ++k) {
      for (std::size_t c = 0; c < next[k].constants.size(); ++c) {
        scale(at++) = alone.value(static_cast<Eigen::Index>(k));
      }
    }
    const Eigen::MatrixXd G = scale.asDiagonal() * sums.information * scale.asDiagonal();
    const Eigen::VectorXd b = scale.asDiagonal() * sums.score;
    fit.covariance = solve(G, b).covariance;
    const Eigen::MatrixXd shift = sums.shift * scale.asDiagonal();
    fit.parameters = input.parameters + sums.pass.mean.segment<sensor_parameter_count>(sums.pass.layout.parameters()) +
                     sums.shift.leftCols(static_cast<Eigen::Index>(next.size())) * alone.value;
    fit.parameter_covariance = sums.pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(
                                   sums.pass.layout.parameters(), sums.pass.layout.parameters()) +
                               shift * fit.covariance * shift.transpose();
    fit.gain.clear();
    fit.collinear.clear();
    fit.held_out_gain.clear();
    std::vector<int> fold;
    for (const double t : sink.time_s) {
      fold.push_back(static_cast<int>(motion.context().segment_at(t)));
    }
    for (const int k : linear) {
      fit.collinear.push_back(1.0 - 1.0 / (fit.covariance(k, k) * G(k, k)));
      fit.gain.push_back(gain_of(sums.information, sums.score, linear, k));
      std::vector<int> without = linear;
      without.erase(without.begin() + k);
      fit.held_out_gain.push_back(diagnosis::held_out_gain(sink.columns, sink.residual, fold, linear, without));
    }
    if (constants > 0) {
      const Solution full = solve(sums.information, sums.score);
      refine_constants(next, full.value);
    }
  }
  return fit;
}

std::vector<double> exact_gains(const LawMotion& motion, const NodeTable& table, const PassInput& input,
                                const std::vector<LawTerm>& given, const std::vector<LawTerm>& alternatives,
                                const std::stop_token& stop) {
  std::vector<LawTerm> all = given;
  all.insert(all.end(), alternatives.begin(), alternatives.end());
  LawColumns source(motion, table, all, false);
  const ColumnSums sums = run_columns(input, source, stop);
  std::vector<int> base(given.size());
  std::iota(base.begin(), base.end(), 0);
  const double before = base.empty() ? 0.0 : solve(sums.information(base, base), sums.score(base)).gain;
  std::vector<double> gains;
  for (std::size_t k = 0; k < alternatives.size(); ++k) {
    std::vector<int> with = base;
    with.push_back(static_cast<int>(given.size() + k));
    gains.push_back(solve(sums.information(with, with), sums.score(with)).gain - before);
  }
  return gains;
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
