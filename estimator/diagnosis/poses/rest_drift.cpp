#include "estimator/diagnosis/poses/rest_drift.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "estimator/diagnosis/poses/rest_equations.hpp"
#include "estimator/diagnosis/poses/rest_noise.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

using Indices = std::vector<Eigen::Index>;
using Candidate = RestCandidate;

// One axis.
class Course {
 public:
  Course(const SlowNoise& noise, const std::vector<Candidate>& equations, Indices constants, Eigen::Index reading)
      : noise_(noise), equations_(equations), constants_(std::move(constants)), reading_(reading) {}

  struct Asked {
    const Candidate* candidate = nullptr;
    std::size_t best = 0;  // column
    double log_p = 0.0;
  };
  struct Kept {
    Asked asked;
    std::vector<Asked> as_well;
  };

  void select(double axes, double log_limit);
  void fill(const Eigen::MatrixXd& y, RestAxis& axis) const;

 private:
  std::vector<Asked> ask_all(double axes, const Indices& known) const;
  Asked ask(const Candidate& c, const Indices& known) const;
  RestAmplitude amplitude(const Candidate& c, const Indices& known) const;
  Indices known_without(const Kept* left_out) const;

  const SlowNoise& noise_;
  const std::vector<Candidate>& equations_;
  Indices constants_;
  Eigen::Index reading_;
  std::vector<Kept> kept_;
};

bool holds(const Indices& known, Eigen::Index one) { return std::find(known.begin(), known.end(), one) != known.end(); }

Indices with(Indices known, Eigen::Index one) {
  known.push_back(one);
  return known;
}

Course::Asked Course::ask(const Candidate& c, const Indices& known) const {
  Asked best{&c, 0, 0.0};
  double most = -HUGE_VAL;
  for (std::size_t k = 0; k < c.at.size(); ++k) {
    if (holds(known, c.at[k])) {
      continue;  // it has jumped there
    }
    const SlowNoise::Answer a = noise_.ask(with(known, c.at[k]), reading_);
    if (a.log_likelihood > most) {
      most = a.log_likelihood;
      best.best = k;
      best.log_p = a.log_p;
    }
  }
  return best;
}

std::vector<Course::Asked> Course::ask_all(double axes, const Indices& known) const {
  const bool linear =
      std::any_of(kept_.begin(), kept_.end(), [](const Kept& k) { return k.asked.candidate->is_linear; });
  std::vector<Asked> all;
  // Of the false alarms that are allowed a jump, which may be anywhere, has a tenth: the others know their course.
  constexpr double of_jumps = 0.1;
  double tests = 0.0, jumps = 0.0;
  for (const Candidate& c : equations_) {
    const bool there = !c.equation.jumps &&
                       std::any_of(kept_.begin(), kept_.end(), [&c](const Kept& k) { return k.asked.candidate == &c; });
    if (!there && (!c.after_linear || linear)) {
      all.push_back(ask(c, known));
      (c.equation.jumps ? jumps : tests) += c.tests;
    }
  }
  for (Asked& a : all) {
    const bool jump = a.candidate->equation.jumps;
    a.log_p = log_corrected(a.log_p, axes * (jump ? jumps / of_jumps : tests / (jumps > 0.0 ? 1.0 - of_jumps : 1.0)));
  }
  std::stable_sort(all.begin(), all.end(), [](const Asked& a, const Asked& b) { return a.log_p < b.log_p; });
  return all;
}

Indices Course::known_without(const Kept* left_out) const {
  Indices known = constants_;
  for (const Kept& k : kept_) {
    if (&k != left_out) {
      known.push_back(k.asked.candidate->at[k.asked.best]);
    }
  }
  return known;
}

// Of a class the measured temperature speaks, for it is what moves; else the likeliest.
void Course::select(double axes, double log_limit) {
  constexpr std::size_t most = 3;  // more are a series for a curve
  std::vector<Asked> before = ask_all(axes, known_without(nullptr));
  constexpr double odds = 4.605;  // ln 100, as for the classes of a recording with a gimbal
  while (!before.empty() && before.front().log_p < log_limit && kept_.size() < most) {
    const double likely = before.front().log_p + odds;
    const auto leader = std::find_if(before.begin(), before.end(),
                                     [likely](const Asked& a) { return a.candidate->is_linear && a.log_p < likely; });
    kept_.push_back({leader == before.end() ? before.front() : *leader, {}});
    const std::vector<Asked> after = ask_all(axes, known_without(nullptr));
    for (const Asked& rival : before) {
      const auto again =
          std::find_if(after.begin(), after.end(), [&rival](const Asked& a) { return a.candidate == rival.candidate; });
      const bool another = rival.candidate != kept_.back().asked.candidate;
      if (another && again != after.end() && rival.log_p < log_limit && rival.log_p < likely &&
          again->log_p > log_limit) {
        kept_.back().as_well.push_back(rival);
      }
    }
    before = after;
  }
}

// Over the time constants by their likelihood, so that sigma holds theirs.
RestAmplitude Course::amplitude(const Candidate& c, const Indices& known) const {
  std::vector<SlowNoise::Answer> answers;
  std::vector<std::size_t> of;  // columns
  double most = -HUGE_VAL;
  for (std::size_t k = 0; k < c.at.size(); ++k) {
    if (!holds(known, c.at[k])) {
      answers.push_back(noise_.ask(with(known, c.at[k]), reading_));
      of.push_back(k);
      most = std::max(most, answers.back().log_likelihood);
    }
  }
  RestAmplitude r;
  r.equation = c.equation;
  double sum = 0.0, square = 0.0, constant = 0.0, constant_square = 0.0;
  for (std::size_t k = 0; k < answers.size(); ++k) {
    const double w = std::exp(answers[k].log_likelihood - most);
    const double value = answers[k].value(answers[k].value.size() - 1) / c.length[of[k]];
    const double sigma = answers[k].sigma(answers[k].sigma.size() - 1) / c.length[of[k]];
    sum += w;
    r.value += w * value;
    square += w * (value * value + sigma * sigma);
    constant += w * c.constant[of[k]];
    constant_square += w * c.constant[of[k]] * c.constant[of[k]];
  }
  r.value /= sum;
  r.sigma = std::sqrt(std::max(0.0, square / sum - r.value * r.value));
  if (answers.size() > 1) {
    r.constant = constant / sum;
    constexpr double of_the_grid = 0.067;  // 26 % apart, even: / sqrt(12)
    const double grid = c.apart_s > 0.0 ? c.apart_s / std::sqrt(12.0) : of_the_grid * r.constant;
    r.constant_sigma = std::sqrt(std::max(0.0, constant_square / sum - r.constant * r.constant) + grid * grid);
  }
  return r;
}

void Course::fill(const Eigen::MatrixXd& table, RestAxis& axis) const {
  const SlowNoise::Answer all = noise_.ask(known_without(nullptr), reading_);
  axis.mean += all.value(0);
  axis.mean_sigma = all.sigma(0);
  constexpr double sure = 3.0;  // ln 20
  if (all.walk_odds > sure) {
    axis.walk = all.walk;
    axis.walk_sigma = all.walk_sigma;
  }
  const double n = static_cast<double>(table.rows());
  Eigen::VectorXd left = table.col(reading_);
  axis.rms = std::sqrt(left.squaredNorm() / n);
  for (const Kept& k : kept_) {
    RestTerm term;
    term.log_p = k.asked.log_p;
    term.found = amplitude(*k.asked.candidate, known_without(&k));
    for (const Asked& rival : k.as_well) {
      term.as_well.push_back(amplitude(*rival.candidate, known_without(&k)));
    }
    term.twins = k.asked.candidate->twins;
    const std::size_t best = k.asked.best;
    const Eigen::VectorXd made =
        term.found.value * k.asked.candidate->length[best] * table.col(k.asked.candidate->at[best]);
    term.share = std::min(1.0, made.squaredNorm() / std::max(1e-300, table.col(reading_).squaredNorm()));
    left -= made;
    axis.terms.push_back(std::move(term));
  }
  axis.rms_left = std::sqrt(left.squaredNorm() / n);
}

// Columns that are asked about: the longest pose's constant, the others', equations, readings less the poses' means.
struct Table {
  Eigen::MatrixXd columns;
  std::vector<std::size_t> stands;  // poses with a block, the longest first
  void append(const Eigen::MatrixXd& more) {
    columns.conservativeResize(Eigen::NoChange, columns.cols() + more.cols());
    columns.rightCols(more.cols()) = more;
  }
};

Table table_of_constants(const RestBlocks& blocks) {
  Table t;
  t.stands = blocks.pose;
  t.stands.erase(std::unique(t.stands.begin(), t.stands.end()), t.stands.end());
  std::stable_partition(t.stands.begin(), t.stands.end(), [&](std::size_t p) { return p == blocks.stand; });
  t.columns = Eigen::MatrixXd::Zero(blocks.rows(), static_cast<Eigen::Index>(t.stands.size()));
  for (std::size_t p = 0; p < t.stands.size(); ++p) {
    for (Eigen::Index i = 0; i < blocks.rows(); ++i) {
      t.columns(i, static_cast<Eigen::Index>(p)) = blocks.pose[static_cast<std::size_t>(i)] == t.stands[p] ? 1.0 : 0.0;
    }
  }
  return t;
}

}  // namespace

void judge_drift(const RestBlocks& blocks, double alpha, std::vector<RestAxis>& axes) {
  std::array<std::vector<Candidate>, 2> equations = {equations_at_rest(blocks, true), equations_at_rest(blocks, false)};
  Table table = table_of_constants(blocks);
  const Eigen::MatrixXd constants = table.columns;
  Indices stands(static_cast<std::size_t>(constants.cols()));
  std::iota(stands.begin(), stands.end(), 0);
  for (std::vector<Candidate>& of_triad : equations) {
    for (Candidate& c : of_triad) {
      for (Eigen::Index k = 0; k < c.columns.cols(); ++k) {
        c.at.push_back(table.columns.cols() + k);
      }
      table.append(c.columns);
    }
  }
  Indices readings;
  for (RestAxis& axis : axes) {
    const Eigen::VectorXd y = (axis.gyro ? blocks.gyro : blocks.accel).col(axis.axis);
    const Eigen::VectorXd means = (constants.transpose() * y).cwiseQuotient(constants.colwise().sum().transpose());
    axis.mean = means(0);
    readings.push_back(table.columns.cols());
    constexpr double rounding = 1e-12;  // what a mean of equal numbers is off by is no noise
    const Eigen::VectorXd left = y - constants * means;
    table.append(left.norm() > rounding * y.norm() ? left : Eigen::VectorXd::Zero(y.size()));
  }
  const SlowNoise noise(blocks.times, table.columns);
  for (std::size_t k = 0; k < axes.size(); ++k) {
    Course course(noise, equations[axes[k].gyro ? 0 : 1], stands, readings[k]);
    if (drift_is_asked(blocks) && table.columns.col(readings[k]).squaredNorm() > 0.0) {
      course.select(static_cast<double>(axes.size()), std::log(alpha));
    }
    course.fill(table.columns, axes[k]);
  }
}

bool drift_is_asked(const RestBlocks& blocks) {
  constexpr Eigen::Index least = 16;  // a constant, three terms, and noise of three parameters, twice over
  std::vector<std::size_t> stands = blocks.pose;
  stands.erase(std::unique(stands.begin(), stands.end()), stands.end());
  return blocks.rows() >= least + static_cast<Eigen::Index>(stands.size());
}

}  // namespace selfcal::diagnosis
