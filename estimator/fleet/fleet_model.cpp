#include "estimator/fleet/fleet_model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "estimator/statistics/climb.hpp"

namespace selfcal::fleet {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Variances are found to half of the last factor, 2 %: their own uncertainty with 500 units is several times that.
const Climb climbing{{4.0, 1.5, 1.1, 1.04}, 12, 20, 1e-3, 1e6};
constexpr std::size_t units_for_variances = 150;  // more change them by less than their own uncertainty
constexpr double mad_to_sd = 1.4826;              // of a normal distribution

// Standard deviations of (F1) in the order unit, ramp, walk, set-up.
using Deviations = std::array<double, 4>;

// The filter of (F1) as a sequence of gains: it depends on times and sigmas alone, so that any number of columns (values, and
// what fixed effects and sets contribute to them) share it. Whitened innovations of all columns are handed to `take`.
template <typename Fill, typename Take>
void whiten(const UnitHistory& unit, const Deviations& sd, Eigen::Index columns, Fill fill, Take take) {
  double p00 = sd[0] * sd[0], p01 = 0.0, p11 = sd[1] * sd[1];
  Eigen::RowVectorXd level = Eigen::RowVectorXd::Zero(columns), ramp = level, row = level;
  double year = unit.empty() ? 0.0 : unit.front().year;
  const double first = year;
  for (const Measurement& m : unit) {
    const double dt = m.year - year;
    year = m.year;
    level += dt * ramp;
    p00 += dt * (2.0 * p01 + dt * p11) + sd[2] * sd[2] * dt;
    p01 += dt * p11;
    const double variance = p00 + sd[3] * sd[3] + m.sigma * m.sigma;
    row.setZero();
    fill(m, m.year - first, row);
    row -= level;
    const double k0 = p00 / variance, k1 = p01 / variance;
    level += k0 * row;
    ramp += k1 * row;
    p11 -= k1 * p01;
    p01 -= k1 * p00;
    p00 -= k0 * p00;
    take(row, variance);
  }
}

// Columns value, 1, t; but for a constant.
double log_restricted_likelihood(std::span<const UnitHistory* const> units, const std::vector<double>& offsets,
                                 const Deviations& sd) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  double log_variance = 0.0;
  for (const UnitHistory* unit : units) {
    whiten(
        *unit, sd, 3,
        [&](const Measurement& m, double t, Eigen::RowVectorXd& row) {
          row << m.value - offsets[static_cast<std::size_t>(m.set)], 1.0, t;
        },
        [&](const Eigen::RowVectorXd& row, double variance) {
          normal += row.transpose() * row / variance;
          log_variance += std::log(variance);
        });
  }
  const Eigen::LLT<Eigen::Matrix2d> fixed(normal.bottomRightCorner<2, 2>());
  if (fixed.info() != Eigen::Success) {
    return -HUGE_VAL;
  }
  const Eigen::Vector2d right = normal.bottomLeftCorner<2, 1>();
  const double misfit = normal(0, 0) - right.dot(fixed.solve(right));
  const double log_determinant = 2.0 * fixed.matrixL().toDenseMatrix().diagonal().array().log().sum();
  return -0.5 * (log_variance + misfit + log_determinant);
}

// Normal equations of 1, t and a column for each set; the last column and row are the value's.
MatrixXd normal_equations(std::span<const UnitHistory> units, int sets, const Deviations& sd) {
  const Eigen::Index columns = 3 + sets;
  MatrixXd normal = MatrixXd::Zero(columns, columns);
  for (const UnitHistory& unit : units) {
    whiten(
        unit, sd, columns,
        [&](const Measurement& m, double t, Eigen::RowVectorXd& row) {
          row(0) = 1.0;
          row(1) = t;
          row(2 + m.set) = 1.0;
          row(columns - 1) = m.value;
        },
        [&](const Eigen::RowVectorXd& row, double variance) {
          normal.selfadjointView<Eigen::Lower>().rankUpdate(row.transpose(), 1.0 / variance);
        });
  }
  return normal.selfadjointView<Eigen::Lower>();
}

double median(std::vector<double> values) {
  if (values.empty()) {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Effects {
  VectorXd value;
  MatrixXd covariance;
};

// `set_sd`: prior of the offsets.
Effects solve(const MatrixXd& normal, double set_sd) {
  const Eigen::Index size = normal.rows() - 1;
  MatrixXd information = normal.topLeftCorner(size, size);
  information.diagonal().tail(size - 2).array() += 1.0 / (set_sd * set_sd);
  const Eigen::LDLT<MatrixXd> factor(information);
  return {factor.solve(normal.col(size).head(size)), factor.solve(MatrixXd::Identity(size, size))};
}

// Between sets, from offsets that a wide prior leaves as they are.
double spread_of_sets(const Effects& wide) {
  const Eigen::Index sets = wide.value.size() - 2;
  std::vector<double> offsets, departures, variances;
  for (Eigen::Index s = 0; s < sets; ++s) {
    offsets.push_back(wide.value(2 + s));
  }
  const double middle = median(offsets);
  for (Eigen::Index s = 0; s < sets; ++s) {
    departures.push_back(std::abs(offsets[static_cast<std::size_t>(s)] - middle));
    // The mean of all sets cannot be told from the type's: what counts is how well one is known against the others.
    variances.push_back(wide.covariance(2 + s, 2 + s) - wide.covariance.bottomRightCorner(sets, sets).mean());
  }
  const double seen = mad_to_sd * median(departures);
  return std::sqrt(std::max(0.0, seen * seen - median(variances)));
}

struct Extent {
  double mean = 0.0, sd = 0.0, sigma = 0.0;
  std::size_t count = 0;
};

Extent extent(std::span<const UnitHistory> units) {
  Extent found;
  double sum = 0.0, squares = 0.0;
  std::vector<double> sigmas;
  for (const UnitHistory& unit : units) {
    for (const Measurement& m : unit) {
      ++found.count;
      sum += m.value;
      sigmas.push_back(m.sigma);
    }
  }
  if (found.count == 0) {
    return found;
  }
  found.mean = sum / static_cast<double>(found.count);
  for (const UnitHistory& unit : units) {
    for (const Measurement& m : unit) {
      squares += (m.value - found.mean) * (m.value - found.mean);
    }
  }
  found.sd = std::sqrt(squares / static_cast<double>(found.count));
  found.sigma = median(sigmas);
  return found;
}

// Every k-th unit with a past, so that all ages are among them.
std::vector<const UnitHistory*> sample_of(std::span<const UnitHistory> units) {
  std::vector<const UnitHistory*> all;
  for (const UnitHistory& unit : units) {
    if (unit.size() > 1) {
      all.push_back(&unit);
    }
  }
  const std::size_t step = std::max<std::size_t>(1, all.size() / units_for_variances);
  std::vector<const UnitHistory*> sample;
  for (std::size_t i = 0; i < all.size(); i += step) {
    sample.push_back(all[i]);
  }
  return sample;
}

void count_measurements(std::span<const UnitHistory> units, TypeModel& model) {
  for (const UnitHistory& unit : units) {
    for (const Measurement& m : unit) {
      ++model.sets[static_cast<std::size_t>(m.set)].measurements;
    }
  }
}

}  // namespace

TypeModel fit_type(std::span<const UnitHistory> units, int sets) {
  TypeModel model;
  model.sets.resize(static_cast<std::size_t>(sets));
  count_measurements(units, model);
  const Extent seen = extent(units);
  const auto sample = sample_of(units);
  model.mean = seen.mean;
  if (sample.size() < 3 || seen.count < 10 || !(seen.sd > 0.0)) {
    model.unit_sd = seen.sd;
    return model;
  }
  const double small = std::max(0.1 * seen.sigma, 1e-3 * seen.sd);
  Deviations sd{seen.sd, small, small, small};
  std::vector<double> offsets(model.sets.size(), 0.0);
  double set_sd = seen.sd;
  for (int round = 0; round < 2; ++round) {
    sd = climb<4>(sd, climbing, [&](const Deviations& trial) {
           return log_restricted_likelihood(sample, offsets, trial);
         }).at;
    const MatrixXd normal = normal_equations(units, sets, sd);
    set_sd = std::max(spread_of_sets(solve(normal, 100.0 * seen.sd)), 1e-3 * seen.sd);
    const Effects effects = solve(normal, set_sd);
    model.mean = effects.value(0);
    model.ramp_per_year = effects.value(1);
    for (std::size_t s = 0; s < offsets.size(); ++s) {
      const auto column = static_cast<Eigen::Index>(2 + s);
      offsets[s] = effects.value(column);
      model.sets[s].value = offsets[s];
      model.sets[s].sigma = std::sqrt(std::max(0.0, effects.covariance(column, column)));
    }
  }
  model.unit_sd = sd[0];
  model.ramp_sd = sd[1];
  model.walk_sd = sd[2];
  model.setup_sd = sd[3];
  model.set_sd = set_sd;
  return model;
}

UnitFilter::UnitFilter(const TypeModel& model, double first_year)
    : model_(&model),
      state_{first_year,
             model.mean,
             model.ramp_per_year,
             {model.unit_sd * model.unit_sd, 0.0, model.ramp_sd * model.ramp_sd}} {}

UnitState UnitFilter::at(double year) const {
  UnitState later = state_;
  const double dt = std::max(0.0, year - state_.year);
  auto& [p00, p01, p11] = later.covariance;
  later.year = year;
  later.level += dt * later.ramp;
  p00 += dt * (2.0 * p01 + dt * p11) + model_->walk_sd * model_->walk_sd * dt;
  p01 += dt * p11;
  return later;
}

Innovation UnitFilter::add(const Measurement& measurement) {
  state_ = at(measurement.year);
  const SetOffset& set = model_->sets.at(static_cast<std::size_t>(measurement.set));
  auto& [p00, p01, p11] = state_.covariance;
  const Innovation innovation{
      measurement.value - set.value - state_.level,
      p00 + model_->setup_sd * model_->setup_sd + measurement.sigma * measurement.sigma + set.sigma * set.sigma};
  const double k0 = p00 / innovation.variance, k1 = p01 / innovation.variance;
  state_.level += k0 * innovation.value;
  state_.ramp += k1 * innovation.value;
  p11 -= k1 * p01;
  p01 -= k1 * p00;
  p00 -= k0 * p00;
  return innovation;
}

double UnitFilter::variance_of_measurement(double year, double sigma) const {
  return at(year).covariance[0] + model_->setup_sd * model_->setup_sd + model_->set_sd * model_->set_sd + sigma * sigma;
}

double interval_years(std::span<const Watched> parameters, double last_year, double risk, double least, double most) {
  constexpr double step = 7.0 / 365.2425;
  for (double years = least + step; years < most; years += step) {
    double probability = 0.0;
    for (const Watched& one : parameters) {
      if (!(one.limit > 0.0)) {
        continue;
      }
      const UnitState state = one.filter->at(last_year + years);
      const double sd = std::sqrt(state.covariance[0]);
      const double departure = state.level - one.measured;
      // Both tails are half of erfc, and count twice: what wanders and was beyond in between is beyond at the end in half of
      // the cases (reflection principle).
      probability += (std::erfc((one.limit - departure) / (sd * std::sqrt(2.0))) +
                      std::erfc((one.limit + departure) / (sd * std::sqrt(2.0))));
    }
    if (probability > risk) {
      return years - step;
    }
  }
  return most;
}

}  // namespace selfcal::fleet
