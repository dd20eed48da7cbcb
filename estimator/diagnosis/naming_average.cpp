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

#include "estimator/diagnosis/naming.hpp"

namespace selfcal::diagnosis {
namespace {

// Typical sizes that coefficients may have: unknown, so each is tried. What is seen at a hundredth of its typical size (a
// lever arm, a time offset) is also found at that.
constexpr std::array<double, 10> scales = {0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0};
constexpr std::size_t first_scale = 7;  // to begin with
constexpr double constant_prior = 2.0;  // sigma of a constant's logarithm: the width of the grids
constexpr double negligible = 25.0;     // log odds below which an explanation is left out
// Constants beside a chosen effect's own: so many sigmas of the logarithm apart, further out by a share of the distance.
constexpr double constants_apart = 0.5, constants_spread = 0.25;
constexpr double furthest_apart = 0.5;  // of the logarithm

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
  Averaging(const Evidence& evidence, const SignatureRows& rows, const std::vector<Chosen>& chosen)
      : evidence_(evidence), rows_(rows), chosen_(chosen) {}

  const Chosen& chosen(std::size_t i) const { return chosen_[i]; }
  double rows() const { return evidence_.rows; }
  bool names(const Effect& effect) const {
    return std::any_of(chosen_.begin(), chosen_.end(),
                       [&](const Chosen& x) { return x.candidate.effect->id == effect.id; });
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
    return parts(chosen_[i].candidate, chosen_[i].derivative, chosen_[i].size, 0.0);
  }
  // Each of the constants beside it: what is known of a constant to a factor of 2 only is not linear in it.
  std::vector<Part> own_parts(std::size_t i) const {
    const std::vector<Candidate>& constants = chosen_[i].constants;
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
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      current_.push_back(
          part(chosen_[i].candidate, -1, scales[first_scale - 1], chosen_[i].derivative, chosen_[i].size));
    }
    for (int sweep = 0; sweep < (chosen_.size() > 1 ? 2 : 1); ++sweep) {
      for (std::size_t i = 0; i < chosen_.size(); ++i) {
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

  // `p` in the place of chosen effect i, the others as they are.
  Explanation explain(std::size_t i, const Part& p, bool full) const {
    std::vector<const Part*> all = {&p};
    for (std::size_t j = 0; j < current_.size(); ++j) {
      if (j != i) {
        all.push_back(&current_[j]);
      }
    }
    std::vector<int> columns;
    Eigen::Index size = 0;
    for (const Part* q : all) {
      columns.insert(columns.end(), q->columns.begin(), q->columns.end());
      size += q->T.cols();
    }
    Eigen::MatrixXd T = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(columns.size()), size);
    Eigen::VectorXd sigma(size);
    Eigen::Index row = 0, col = 0;
    for (const Part* q : all) {
      T.block(row, col, q->T.rows(), q->T.cols()) = q->T;
      sigma.segment(col, q->T.cols()) = q->sigma;
      row += q->T.rows();
      col += q->T.cols();
    }
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
      const Eigen::MatrixXd S = rows_.shift(Eigen::all, columns) * T;
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
  const SignatureRows& rows_;
  const std::vector<Chosen>& chosen_;
  std::vector<Part> current_;
};

// A candidate's part in the place of a chosen effect.
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
  with(averaging.chosen(i).candidate, averaging.own_parts(i));
  for (const Candidate& rival : candidates) {
    if (!averaging.names(*rival.effect)) {
      with(rival, Averaging::parts(rival, -1, {}, -std::log(variants(*rival.effect, averaging.rows()))));
    }
  }
  return tried;
}

// What the explanations in the place of one chosen effect say together.
struct PlaceAverage {
  Mixture<ParameterVector, ParameterMatrix> shift;  // of the 24, by all effects
  std::vector<Share> constants;
  std::map<std::string, double> probability;
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
  const Chosen& own = averaging.chosen(i);
  PlaceAverage place;
  for (const Tried& t : tried) {
    if (t.log_p < top - negligible) {
      continue;
    }
    const double weight = std::exp(t.log_p - top);
    const Explanation e = averaging.explain(i, t.part, true);
    place.shift.add(weight, e.shift, e.shift_covariance);
    place.probability[t.candidate->effect->id] += weight;
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
  for (auto& [name, p] : place.probability) {
    p /= place.shift.weight;
  }
  return place;
}

// Size and sigma of the coefficients, all of them unknown: that only one is concerned may well be the better guess, but
// an interval must not rest on it. Size and constant as told belong together; sigma says what else they may be.
void tell_sizes(const Averaging& averaging, std::size_t i, std::vector<Tried> tried, Chosen& chosen) {
  std::erase_if(tried,
                [&](const Tried& t) { return t.candidate != &averaging.chosen(i).candidate || t.part.only >= 0; });
  const double top = top_of(tried);
  const Eigen::Index count = chosen.candidate.count;
  Mixture<Eigen::VectorXd, Eigen::MatrixXd> any, fitted;  // with any constant, with the one told
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
    if (std::isnan(t.part.constant) || t.part.constant == chosen.candidate.constant) {
      fitted.add(weight, mean, covariance);
    }
    for (Eigen::Index k = 0; k < count; ++k) {
      each[static_cast<std::size_t>(k)].push_back({weight, mean(k), std::sqrt(covariance(k, k))});
    }
  }
  chosen.size = (fitted.weight > 0.0 ? fitted : any).mean();
  chosen.covariance = any.covariance();
  Eigen::VectorXd stretch(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    stretch(k) = sigma_about(chosen.size(k), each[static_cast<std::size_t>(k)]) / std::sqrt(chosen.covariance(k, k));
  }
  chosen.covariance = stretch.asDiagonal() * chosen.covariance * stretch.asDiagonal();
}

}  // namespace

// Further columns beside those of the rows: those of `more` combined by `combine` (one row each of what is appended).
// Returns where they begin.
int Naming::append_columns(const std::vector<Candidate>& more, const Eigen::MatrixXd& combine) {
  SignaturePass pass(context_, more, false);
  const SignatureRows beside = pass.run(input_);
  const Eigen::Index at = rows_.columns.cols();
  rows_.columns.conservativeResize(Eigen::NoChange, at + combine.rows());
  rows_.shift.conservativeResize(Eigen::NoChange, at + combine.rows());
  rows_.columns.rightCols(combine.rows()) = beside.columns * combine.transpose();
  rows_.shift.rightCols(combine.rows()) = beside.shift * combine.transpose();
  evidence_ = Evidence(rows_);
  evidence_.restore(applied_columns_, applied_);
  for (const WalkTest& walk : walks_) {
    evidence_.absorb(walk.columns, walk.covariance);
  }
  size_forms();
  return static_cast<int>(at);
}

// Constants that a chosen effect may have beside its own, in order: close where the likelihood's curvature says, for it may
// be anything but a parabola out to the ends of the catalogue's grid and a factor of 2 beyond. A frequency is sharp: its
// derivative will do.
static std::vector<double> constants_about(const Chosen& chosen) {
  const std::vector<double>& grid = chosen.candidate.effect->constants;
  if (grid.empty()) {
    return {};
  }
  const auto [smallest, largest] = std::minmax_element(grid.begin(), grid.end());
  const double own = chosen.candidate.constant;
  const double down = std::log(own / (0.5 * *smallest)), up = std::log(2.0 * *largest / own);
  const double apart = chosen.constant_sigma > 0.0 ? constants_apart * chosen.constant_sigma / own : furthest_apart;
  std::vector<double> all = {own};
  for (double offset = 0.0; offset < std::max(down, up);) {
    offset += std::min(std::max(apart, constants_spread * offset), furthest_apart);
    if (offset < down) {
      all.insert(all.begin(), own * std::exp(-offset));
    }
    if (offset < up) {
      all.push_back(own * std::exp(offset));
    }
  }
  return all;
}

// Further columns for the chosen effects' constants: derivatives by the logarithm, and others in the constant's place.
void Naming::append_constants() {
  struct Appended {
    Chosen* chosen;
    double width;  // of the difference that makes the derivative
    std::vector<double> constants;
  };
  std::vector<Candidate> more;
  std::vector<Appended> all;
  Eigen::Index rows = 0, columns = 0;
  for (Chosen& chosen : chosen_) {
    const Candidate& c = chosen.candidate;
    if (std::isnan(c.constant)) {
      continue;
    }
    // A frequency may shift the phase by an eighth of a radian over the recording.
    const double h = c.effect->id == "base_sway" ? 0.02 / (c.constant * rows_.time_s.back()) : 0.05;
    more.push_back({c.effect, c.constant * std::exp(h), 0, 0});
    more.push_back({c.effect, c.constant * std::exp(-h), 0, 0});
    all.push_back({&chosen, 2.0 * h, constants_about(chosen)});
    for (const double constant : all.back().constants) {
      more.push_back({c.effect, constant, 0, 0});
    }
    const auto beside = static_cast<Eigen::Index>(all.back().constants.size());
    rows += c.count * (1 + beside);
    columns += c.count * (2 + beside);
  }
  if (all.empty()) {
    return;
  }
  Eigen::MatrixXd combine = Eigen::MatrixXd::Zero(rows, columns);
  const Eigen::Index at = rows_.columns.cols();
  Eigen::Index row = 0, column = 0;
  for (const Appended& a : all) {
    const Candidate& c = a.chosen->candidate;
    const Eigen::Index count = c.count, beside = count * std::ssize(a.constants);
    const Eigen::MatrixXd difference = Eigen::MatrixXd::Identity(count, count) / a.width;
    combine.block(row, column, count, count) = difference;
    combine.block(row, column + count, count, count) = -difference;
    combine.block(row + count, column + 2 * count, beside, beside).setIdentity();
    a.chosen->derivative = static_cast<int>(at + row);
    int first = static_cast<int>(at + row + count);
    a.chosen->constants.clear();
    for (const double constant : a.constants) {
      a.chosen->constants.push_back({c.effect, constant, first, c.count});
      first += c.count;
    }
    row += count + beside;
    column += 2 * count + beside;
  }
  append_columns(more, combine);
}

void Naming::average() {
  averaged_.setZero();
  spread_.setZero();
  if (chosen_.empty()) {
    return;
  }
  append_constants();
  const std::vector<Chosen> found = chosen_;
  Averaging averaging(evidence_, rows_, found);
  averaging.settle();
  const Explanation best = averaging.current(0);
  averaged_ = best.shift;
  spread_ = best.shift_covariance;
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const std::vector<Tried> tried = try_all(averaging, i, pass_.candidates());
    const PlaceAverage place = average_place(averaging, i, tried);
    Chosen& c = chosen_[i];
    c.probability = place.probability;
    tell_sizes(averaging, i, tried, c);
    if (!place.constants.empty()) {
      c.constant_sigma = sigma_about(c.candidate.constant, place.constants);
    }
    averaged_ += place.shift.mean() - best.shift;
    spread_ += place.shift.covariance() - best.shift_covariance;
    for (int k = 0; k < sensor_parameter_count; ++k) {  // averaging one effect never adds certainty about the others
      spread_(k, k) = std::max(spread_(k, k), best.shift_covariance(k, k));
    }
  }
}

}  // namespace selfcal::diagnosis
