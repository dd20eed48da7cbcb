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

LawColumns::LawColumns(const LawMotion& motion, const std::vector<LawTerm>& terms, bool derivatives)
    : motion_(motion),
      terms_(terms),
      derivatives_(derivatives),
      count_(static_cast<int>(terms.size()) + (derivatives ? constants_of(terms) : 0)) {}

void LawColumns::block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
                       Eigen::Ref<Eigen::Matrix3Xd> angle) {
  const StretchNodes stretch = motion_.of(block);
  Eigen::ArrayXd dt(stretch.channels.rows());
  for (Eigen::Index k = 0; k < dt.size(); ++k) {
    dt(k) = stretch.nodes[static_cast<std::size_t>(k)].dt;
  }
  const auto put = [&](int axis, int column, double integral) {
    if (!std::isfinite(integral) && !not_finite_s_) {
      not_finite_s_ = stretch.nodes.front().time_s;
    }
    (axis < 3 ? angle : velocity)(axis % 3, column) = std::isfinite(integral) ? integral * unit_of(axis) : 0.0;
  };
  int next = static_cast<int>(terms_.size());
  for (std::size_t k = 0; k < terms_.size(); ++k) {
    const LawTerm& term = terms_[k];
    const double here = (term.expression.evaluate(stretch.channels, term.constants) * dt).sum();
    put(term.axis, static_cast<int>(k), here);
    for (std::size_t c = 0; derivatives_ && c < term.constants.size(); ++c) {
      std::vector<double> moved = term.constants;
      const double step = derivative_step * std::max(std::abs(moved[c]), 1e-6);
      moved[c] += step;
      const double up = (term.expression.evaluate(stretch.channels, moved) * dt).sum();
      moved[c] -= 2.0 * step;
      const double down = (term.expression.evaluate(stretch.channels, moved) * dt).sum();
      put(term.axis, next++, (up - down) / (2.0 * step));
    }
  }
}

LawFit fit_laws(const LawMotion& motion, const PassInput& input, std::vector<LawTerm> terms, int rounds,
                const std::stop_token& stop) {
  LawFit fit;
  const int constants = constants_of(terms);
  double best = -1.0;
  std::vector<LawTerm> next = terms;
  for (int round = 0; round <= (constants > 0 ? rounds : 0); ++round) {
    LawColumns source(motion, next, true);
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
    fit.held_out_gain.clear();
    std::vector<int> fold;
    for (const double t : sink.time_s) {
      fold.push_back(static_cast<int>(motion.context().segment_at(t)));
    }
    for (const int k : linear) {
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

std::vector<double> exact_gains(const LawMotion& motion, const PassInput& input, const std::vector<LawTerm>& given,
                                const std::vector<LawTerm>& alternatives, const std::stop_token& stop) {
  std::vector<LawTerm> all = given;
  all.insert(all.end(), alternatives.begin(), alternatives.end());
  LawColumns source(motion, all, false);
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

}  // namespace selfcal::discovery
