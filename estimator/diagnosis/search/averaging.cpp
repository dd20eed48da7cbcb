// The 24 and the coefficients as means over every explanation that the recording leaves open, weighted by its
// probability: which effect, which constant, one coefficient or all of its group, and how large they may be.
//
// With rows = columns * size + unit noise and size ~ N(0, V) the probability of the rows is, but for a common factor,
//   log p = (b' A^-1 b - log|A| - log|V|) / 2,   A = T'(Z'Z)T + V^-1,   b = T'Z'r,
// and the spread between explanations goes into sigma: a direction that only one of them leaves open does not pass
// for known, nor for unknown (Hoeting and others, Bayesian model averaging, Statistical Science 14, 1999).
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "estimator/diagnosis/search/averaging.hpp"

namespace selfcal::diagnosis {
namespace {

// Typical sizes that coefficients may have: unknown, so each is tried. What is seen at a hundredth of its typical size (a
// lever arm, a time offset) is also found at that.
constexpr std::array<double, 10> scales = {0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0};
constexpr std::size_t first_scale = 7;  // to begin with
constexpr double constant_prior = 2.0;  // sigma of a constant's logarithm: the width of the grids
constexpr double negligible = 25.0;     // log odds below which an explanation is left out

// A share of the design: columns of the rows, combined by T, sizes ~ N(0, sigma^2).
struct Part {
  int only = -1;  // the coefficient, -1: all
  double constant = NAN;
  std::vector<int> columns;
  Eigen::MatrixXd T;
  Eigen::VectorXd sigma;
  double log_prior = 0.0;
};

struct Explanation {
  double log_p = 0.0;
  Eigen::VectorXd mean;  // sizes of the part in question, which comes first
  Eigen::MatrixXd covariance;
  ParameterVector shift;  // of the 24, by all parts
  ParameterMatrix shift_covariance;
};

// Running mean and covariance of a mixture.
template <typename Vector, typename Matrix>
struct Mixture {
  double weight = 0.0;
  Vector sum;
  Matrix square;
  void add(double w, const Vector& mean, const Matrix& covariance) {
    if (weight == 0.0) {
      sum = Vector::Zero(mean.size());
      square = Matrix::Zero(mean.size(), mean.size());
    }
    weight += w;
    sum += w * mean;
    square += w * (covariance + mean * mean.transpose());
  }
  Vector mean() const { return sum / weight; }
  Matrix covariance() const { return square / weight - mean() * mean().transpose(); }
};

class Averaging {
 public:
  Averaging(const Evidence& evidence, const Eigen::MatrixXd& shift, const std::vector<PlacedTerm>& terms)
      : evidence_(evidence), shift_(shift), terms_(terms) {}

  const PlacedTerm& term(std::size_t i) const { return terms_[i]; }
  double rows() const { return evidence_.rows; }
  bool names(const Effect& effect) const {
    return std::any_of(terms_.begin(), terms_.end(),
                       [&](const PlacedTerm& x) { return x.candidate.effect == &effect; });
  }

  // All coefficients of a candidate, or one of them; `derivative`: of its first coefficient by the constant, or -1.
  static Part part(const Candidate& c, int only, double scale, int derivative, const Eigen::VectorXd& size) {
    Part p;
    p.only = only;
    p.constant = c.constant;
    for (int k = 0; k < c.count; ++k) {
      if (only < 0 || only == k) {
        p.columns.push_back(c.first + k);
      }
    }
    const auto sizes = static_cast<Eigen::Index>(p.columns.size());
    const bool constant = derivative >= 0;
    p.T = Eigen::MatrixXd::Identity(sizes * (constant ? 2 : 1), sizes + (constant ? 1 : 0));
    p.sigma = Eigen::VectorXd::Constant(p.T.cols(), scale);
    if (constant) {
      for (int k = 0; k < c.count; ++k) {
        if (only < 0 || only == k) {
          const auto row = static_cast<Eigen::Index>(p.columns.size());
          p.columns.push_back(derivative + k);
          p.T.row(row).setZero();
          p.T(row, sizes) = size(k);
        }
      }
      p.sigma(sizes) = constant_prior;
    }
    return p;
  }

  // Every part that a candidate can play; together they have the prior probability exp(log_prior).
  static std::vector<Part> parts(const Candidate& c, int derivative, const Eigen::VectorXd& size, double log_prior) {
    std::vector<Part> all;
    for (const double scale : scales) {
      for (int only = -1; only < (c.count > 1 ? c.count : 0); ++only) {
        all.push_back(part(c, only, scale, derivative, size));
        const double share = c.count == 1 ? 1.0 : only < 0 ? 0.5 : 0.5 / c.count;
        all.back().log_prior = log_prior + std::log(share / scales.size());
      }
    }
    return all;
  }

  // About the constant as fitted, and linear in what it is off by.
  std::vector<Part> linear_parts(std::size_t i) const {
    return parts(terms_[i].candidate, terms_[i].derivative, terms_[i].amplitude, 0.0);
  }
  // Each of the constants beside it: what is known of a constant to a factor of 2 only is not linear in it.
  std::vector<Part> own_parts(std::size_t i) const {
    const std::vector<Candidate>& constants = terms_[i].constants;
    if (constants.empty()) {
      return linear_parts(i);
    }
    const double range = std::log(constants.back().constant / constants.front().constant);
    std::vector<Part> all;
    for (std::size_t k = 0; k < constants.size(); ++k) {
      const double below = constants[k > 0 ? k - 1 : k].constant;
      const double above = constants[std::min(k + 1, constants.size() - 1)].constant;
      const double share = 0.5 * std::log(above / below) / range;  // every logarithm is equally likely
      const std::vector<Part> some = parts(constants[k], -1, {}, std::log(share));
      all.insert(all.end(), some.begin(), some.end());
    }
    return all;
  }

  // Effect by effect the most probable part, the others at theirs.
  void settle() {
    for (std::size_t i = 0; i < terms_.size(); ++i) {
      current_.push_back(
          part(terms_[i].candidate, -1, scales[first_scale - 1], terms_[i].derivative, terms_[i].amplitude));
    }
    for (int sweep = 0; sweep < (terms_.size() > 1 ? 2 : 1); ++sweep) {
      for (std::size_t i = 0; i < terms_.size(); ++i) {
        double best = -HUGE_VAL;
        for (const Part& p : linear_parts(i)) {
          const double found = explain(i, p, false).log_p;
          if (found > best) {
            best = found;
            current_[i] = p;
          }
        }
      }
    }
  }

  // `p` in the place of term i, the others as they are.
  Part design(std::size_t i, const Part& p) const {
    std::vector<const Part*> all = {&p};
    for (std::size_t j = 0; j < current_.size(); ++j) {
      if (j != i) {
        all.push_back(&current_[j]);
      }
    }
    Part whole;
    Eigen::Index size = 0;
    for (const Part* q : all) {
      whole.columns.insert(whole.columns.end(), q->columns.begin(), q->columns.end());
      size += q->T.cols();
    }
    whole.T = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(whole.columns.size()), size);
    whole.sigma.resize(size);
    Eigen::Index row = 0, col = 0;
    for (const Part* q : all) {
      whole.T.block(row, col, q->T.rows(), q->T.cols()) = q->T;
      whole.sigma.segment(col, q->T.cols()) = q->sigma;
      row += q->T.rows();
      col += q->T.cols();
    }
    return whole;
  }

  Explanation explain(std::size_t i, const Part& p, bool full) const {
    const Part whole = design(i, p);
    const auto& [columns, T, sigma] = std::tie(whole.columns, whole.T, whole.sigma);
    // In units of the prior's sigma A is I + H. H has no negative eigenvalue but by rounding, which is large beside 1 where
    // some direction is known a billion times better than others.
    const Eigen::MatrixXd H =
        sigma.asDiagonal() * (T.transpose() * evidence_.information(columns, columns) * T) * sigma.asDiagonal();
    const Eigen::VectorXd b = sigma.cwiseProduct(T.transpose() * evidence_.score(columns));
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(H);
    const Eigen::VectorXd precision = 1.0 + solver.eigenvalues().cwiseMax(0.0).array();
    const Eigen::MatrixXd axes = sigma.asDiagonal() * solver.eigenvectors();
    const Eigen::VectorXd along = solver.eigenvectors().transpose() * b;
    const Eigen::VectorXd mean = axes * along.cwiseQuotient(precision);
    Explanation e;
    e.log_p =
        p.log_prior + 0.5 * along.cwiseAbs2().cwiseQuotient(precision).sum() - 0.5 * precision.array().log().sum();
    if (full) {
      const Eigen::MatrixXd covariance = axes * precision.cwiseInverse().asDiagonal() * axes.transpose();
      const Eigen::MatrixXd S = shift_(Eigen::all, columns) * T;
      e.mean = mean.head(p.T.cols());
      e.covariance = covariance.topLeftCorner(p.T.cols(), p.T.cols());
      e.shift = S * mean;
      e.shift_covariance = S * covariance * S.transpose();
    }
    return e;
  }

  Explanation current(std::size_t i) const { return explain(i, current_[i], true); }

 private:
  const Evidence& evidence_;
  const Eigen::MatrixXd& shift_;
  const std::vector<PlacedTerm>& terms_;
  std::vector<Part> current_;
};

// A candidate's part in the place of a term.
struct Tried {
  const Candidate* candidate;
  Part part;
  double log_p;
};

std::vector<Tried> try_all(const Averaging& averaging, std::size_t i, const std::vector<Candidate>& candidates) {
  std::vector<Tried> tried;
  const auto with = [&](const Candidate& candidate, const std::vector<Part>& parts) {
    for (const Part& p : parts) {
      tried.push_back({&candidate, p, averaging.explain(i, p, false).log_p});
    }
  };
  with(averaging.term(i).candidate, averaging.own_parts(i));
  for (const Candidate& rival : candidates) {
    if (!averaging.names(*rival.effect)) {
      with(rival, Averaging::parts(rival, -1, {}, -std::log(variants(*rival.effect, averaging.rows()))));
    }
  }
  return tried;
}

// What the explanations in the place of one term say together.
struct PlaceAverage {
  Mixture<ParameterVector, ParameterMatrix> shift;  // of the 24, by all effects
  std::vector<Share> constants;
  std::map<const Effect*, double> probability;
};

double top_of(const std::vector<Tried>& tried) {
  double top = -HUGE_VAL;
  for (const Tried& t : tried) {
    top = std::max(top, t.log_p);
  }
  return top;
}

PlaceAverage average_place(const Averaging& averaging, std::size_t i, const std::vector<Tried>& tried) {
  const double top = top_of(tried);
  const PlacedTerm& own = averaging.term(i);
  PlaceAverage place;
  for (const Tried& t : tried) {
    if (t.log_p < top - negligible) {
      continue;
    }
    const double weight = std::exp(t.log_p - top);
    const Explanation e = averaging.explain(i, t.part, true);
    place.shift.add(weight, e.shift, e.shift_covariance);
    place.probability[t.candidate->effect] += weight;
    if (t.candidate != &own.candidate || std::isnan(t.part.constant)) {
      continue;
    }
    if (own.constants.empty()) {  // the last size is the logarithm's
      const Eigen::Index last = e.mean.size() - 1;
      place.constants.push_back(
          {weight, t.part.constant * (1.0 + e.mean(last)), t.part.constant * std::sqrt(e.covariance(last, last))});
    } else {
      place.constants.push_back({weight, t.part.constant, 0.0});
    }
  }
  for (auto& [effect, p] : place.probability) {
    p /= place.shift.weight;
  }
  return place;
}

// Size and sigma of the coefficients, all of them unknown: that only one is concerned may well be the better guess, but
// an interval must not rest on it. Size and constant as reported belong together; sigma says what else they may be.
void report_sizes(const Averaging& averaging, std::size_t i, std::vector<Tried> tried, AveragedTerm& reported) {
  std::erase_if(tried, [&](const Tried& t) { return t.candidate != &averaging.term(i).candidate || t.part.only >= 0; });
  const double top = top_of(tried);
  const Eigen::Index count = averaging.term(i).candidate.count;
  Mixture<Eigen::VectorXd, Eigen::MatrixXd> any, fitted;  // with any constant, with the one reported
  std::vector<std::vector<Share>> each(static_cast<std::size_t>(count));
  for (const Tried& t : tried) {
    if (t.log_p < top - negligible) {
      continue;
    }
    const double weight = std::exp(t.log_p - top);
    const Explanation e = averaging.explain(i, t.part, true);
    const Eigen::VectorXd mean = e.mean.head(count);
    const Eigen::MatrixXd covariance = e.covariance.topLeftCorner(count, count);
    any.add(weight, mean, covariance);
    if (std::isnan(t.part.constant) || t.part.constant == averaging.term(i).candidate.constant) {
      fitted.add(weight, mean, covariance);
    }
    for (Eigen::Index k = 0; k < count; ++k) {
      each[static_cast<std::size_t>(k)].push_back({weight, mean(k), std::sqrt(covariance(k, k))});
    }
  }
  reported.amplitude = (fitted.weight > 0.0 ? fitted : any).mean();
  reported.covariance = any.covariance();
  Eigen::VectorXd stretch(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    stretch(k) =
        sigma_about(reported.amplitude(k), each[static_cast<std::size_t>(k)]) / std::sqrt(reported.covariance(k, k));
  }
  reported.covariance = stretch.asDiagonal() * reported.covariance * stretch.asDiagonal();
}

}  // namespace

Averages average_explanations(const Evidence& evidence, const Eigen::MatrixXd& shift,
                              const std::vector<PlacedTerm>& terms, const std::vector<Candidate>& alternatives) {
  Averages result;
  if (terms.empty()) {
    return result;
  }
  Averaging averaging(evidence, shift, terms);
  averaging.settle();
  const Explanation best = averaging.current(0);
  result.shift = best.shift;
  result.shift_covariance = best.shift_covariance;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const std::vector<Tried> tried = try_all(averaging, i, alternatives);
    const PlaceAverage place = average_place(averaging, i, tried);
    AveragedTerm reported;
    reported.probability = place.probability;
    report_sizes(averaging, i, tried, reported);
    reported.constant_sigma =
        place.constants.empty() ? terms[i].constant_sigma : sigma_about(terms[i].candidate.constant, place.constants);
    result.terms.push_back(std::move(reported));
    result.shift += place.shift.mean() - best.shift;
    result.shift_covariance += place.shift.covariance() - best.shift_covariance;
    for (int k = 0; k < sensor_parameter_count; ++k) {  // averaging one effect never adds certainty about the others
      result.shift_covariance(k, k) = std::max(result.shift_covariance(k, k), best.shift_covariance(k, k));
    }
  }
  return result;
}

}  // namespace selfcal::diagnosis
