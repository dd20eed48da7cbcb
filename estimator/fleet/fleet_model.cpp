#include "estimator/fleet/fleet_model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "estimator/fleet/jumps.hpp"
#include "estimator/statistics/climb.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::fleet {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Variances are found to half of the last factor, 2 %: their own uncertainty with 500 units is several times that.
const Climb climbing{{4.0, 1.5, 1.1, 1.04}, 12, 20, 1e-3, 1e6};
const Climb polishing{{1.04}, 12, 20, 1e-3, 1e6};
// More change the variances by less than their own uncertainty; fewer measurements tell a walk from what comes back badly.
constexpr std::size_t units_for_variances = 150, measurements_for_variances = 15'000;
constexpr double mad_to_sd = 1.4826;  // of a normal distribution
constexpr int figures_of_return = 4;  // v0, its spread, wander_sd, T

// Whitened innovations of any number of columns (values, and what fixed effects and sets contribute to them), which share the
// filter's gains, are handed to `take`.
template <int Columns, typename Fill, typename Take>
void whiten(const UnitHistory& unit, const Ageing& ageing, Eigen::Index columns, Fill fill, Take take) {
  using Row = Eigen::Matrix<double, 1, Columns>;
  Row level = Row::Zero(columns), ramp = level, returning = level, row = level;
  UnitCovariance covariance(ageing);
  double year = unit.empty() ? 0.0 : unit.front().year;
  const double first = year;
  for (const Measurement& m : unit) {
    level += (m.year - year) * ramp;
    returning *= covariance.advance(m.year - year);
    year = m.year;
    const double noise = ageing.setup_sd * ageing.setup_sd + m.sigma * m.sigma;
    const double variance = covariance.variance() + noise;
    row.setZero();
    fill(m, m.year - first, row);
    row -= level + returning;
    const auto gain = covariance.take(noise);
    level += gain[0] * row;
    ramp += gain[1] * row;
    returning += gain[2] * row;
    take(row, variance);
  }
}

// How v0 shows after so many years.
double settled(const Ageing& ageing, double years) { return std::exp(-years / ageing.return_years); }

struct Likelihood {
  double profile = -HUGE_VAL;     // of the variances, at the best fixed effects; but for a constant
  double restricted = -HUGE_VAL;  // REML
};

// Fixed effects: 1, t, and with three of them what v0 leaves.
template <int Fixed>
Likelihood log_likelihood(std::span<const UnitHistory* const> units, const std::vector<double>& offsets,
                          const Ageing& ageing) {
  using Normal = Eigen::Matrix<double, Fixed + 1, Fixed + 1>;
  Normal normal = Normal::Zero();
  double log_variance = 0.0;
  for (const UnitHistory* unit : units) {
    whiten<Fixed + 1>(
        *unit, ageing, Fixed + 1,
        [&](const Measurement& m, double t, auto& row) {
          row(0) = m.value - offsets[static_cast<std::size_t>(m.set)];
          row(1) = 1.0;
          row(2) = t;
          if constexpr (Fixed == 3) {
            row(3) = settled(ageing, t);
          }
        },
        [&](const auto& row, double variance) {
          normal += row.transpose() * row / variance;
          log_variance += std::log(variance);
        });
  }
  const Eigen::LLT<Eigen::Matrix<double, Fixed, Fixed>> fixed(normal.template bottomRightCorner<Fixed, Fixed>());
  if (fixed.info() != Eigen::Success) {
    return {};
  }
  const Eigen::Matrix<double, Fixed, 1> right = normal.template bottomLeftCorner<Fixed, 1>();
  const double misfit = normal(0, 0) - right.dot(fixed.solve(right));
  const double log_determinant = 2.0 * fixed.matrixL().toDenseMatrix().diagonal().array().log().sum();
  return {-0.5 * (log_variance + misfit), -0.5 * (log_variance + misfit + log_determinant)};
}

int fixed_effects(const Ageing& ageing) { return ageing.return_years > 0.0 ? 3 : 2; }

// Normal equations of the fixed effects and a column for each set; the last column and row are the value's.
MatrixXd normal_equations(std::span<const UnitHistory> units, int sets, const Ageing& ageing) {
  const Eigen::Index fixed = fixed_effects(ageing), columns = fixed + sets + 1;
  MatrixXd normal = MatrixXd::Zero(columns, columns);
  for (const UnitHistory& unit : units) {
    whiten<Eigen::Dynamic>(
        unit, ageing, columns,
        [&](const Measurement& m, double t, Eigen::RowVectorXd& row) {
          row(0) = 1.0;
          row(1) = t;
          if (fixed == 3) {
            row(2) = settled(ageing, t);
          }
          row(fixed + m.set) = 1.0;
          row(columns - 1) = m.value;
        },
        [&](const Eigen::RowVectorXd& row, double variance) {
          normal.selfadjointView<Eigen::Lower>().rankUpdate(row.transpose(), 1.0 / variance);
        });
  }
  return normal.selfadjointView<Eigen::Lower>();
}

double median_or_zero(std::vector<double> values) { return values.empty() ? 0.0 : median(std::move(values)); }

struct Effects {
  VectorXd value;
  MatrixXd covariance;
  Eigen::Index fixed;  // before those of the sets
};

// `set_sd`: prior of the offsets.
Effects solve(const MatrixXd& normal, Eigen::Index fixed, double set_sd) {
  const Eigen::Index size = normal.rows() - 1;
  MatrixXd information = normal.topLeftCorner(size, size);
  information.diagonal().tail(size - fixed).array() += 1.0 / (set_sd * set_sd);
  const Eigen::LDLT<MatrixXd> factor(information);
  return {factor.solve(normal.col(size).head(size)), factor.solve(MatrixXd::Identity(size, size)), fixed};
}

// Between sets, from offsets that a wide prior leaves as they are.
double spread_of_sets(const Effects& wide) {
  const Eigen::Index sets = wide.value.size() - wide.fixed;
  std::vector<double> offsets, departures, variances;
  for (Eigen::Index s = 0; s < sets; ++s) {
    offsets.push_back(wide.value(wide.fixed + s));
  }
  const double middle = median_or_zero(offsets);
  for (Eigen::Index s = 0; s < sets; ++s) {
    departures.push_back(std::abs(offsets[static_cast<std::size_t>(s)] - middle));
    // The mean of all sets cannot be told from the type's: what counts is how well one is known against the others.
    variances.push_back(wide.covariance(wide.fixed + s, wide.fixed + s) -
                        wide.covariance.bottomRightCorner(sets, sets).mean());
  }
  const double seen = mad_to_sd * median_or_zero(departures);
  return std::sqrt(std::max(0.0, seen * seen - median_or_zero(variances)));
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
  found.sigma = median_or_zero(sigmas);
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
  std::size_t measurements = 0;
  for (const UnitHistory* unit : all) {
    measurements += unit->size();
  }
  const std::size_t step =
      std::max<std::size_t>(1, std::min(all.size() / units_for_variances, measurements / measurements_for_variances));
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

using Sample = std::span<const UnitHistory* const>;

// Without v.
Ageing climb_plain(Sample sample, const std::vector<double>& offsets, const Ageing& from, const Climb& how) {
  const auto ageing = [](const std::array<double, 4>& at) {
    return Ageing{.unit_sd = at[0], .ramp_sd = at[1], .walk_sd = at[2], .setup_sd = at[3]};
  };
  return ageing(climb<4>({from.unit_sd, from.ramp_sd, from.walk_sd, from.setup_sd}, how, [&](const auto& trial) {
                  return log_likelihood<2>(sample, offsets, ageing(trial)).restricted;
                }).at);
}

using Span = std::pair<double, double>;

// With v, whose T stays within `years`.
Ageing climb_with_return(Sample sample, const std::vector<double>& offsets, const Ageing& from, const Span& years,
                         const Climb& how) {
  const auto ageing = [](const std::array<double, 7>& at) {
    return Ageing{at[0], at[1], at[2], at[3], at[4], at[5], at[6]};
  };
  const auto likelihood = [&](const std::array<double, 7>& trial) {
    const bool within = trial[6] >= years.first && trial[6] <= years.second;
    return within ? log_likelihood<3>(sample, offsets, ageing(trial)).restricted : -HUGE_VAL;
  };
  return ageing(climb<7>({from.unit_sd, from.ramp_sd, from.walk_sd, from.setup_sd, from.settling_sd, from.wander_sd,
                          from.return_years},
                         how, likelihood)
                    .at);
}

// The span of time that a T can be told in: from the usual distance of two measurements to the longest past.
Span tellable_years(Sample sample) {
  std::vector<double> steps;
  double longest = 0.0;
  for (const UnitHistory* unit : sample) {
    longest = std::max(longest, unit->back().year - unit->front().year);
    for (std::size_t k = 1; k < unit->size(); ++k) {
      steps.push_back((*unit)[k].year - (*unit)[k - 1].year);
    }
  }
  return {median_or_zero(std::move(steps)), longest};
}

// v where it raises the likelihood by more than its figures; the walk has to give to it what it had to stand for.
Ageing climb_to_top(Sample sample, const std::vector<double>& offsets, const Ageing& from) {
  const Ageing plain = climb_plain(sample, offsets, from, climbing);
  const Span years = tellable_years(sample);
  if (!(years.second > 2.0 * years.first) || !(years.first > 0.0)) {
    return plain;
  }
  double best = log_likelihood<2>(sample, offsets, plain).profile + figures_of_return;
  Ageing chosen = plain;
  for (const double share : {0.1, 0.4}) {
    Ageing start = plain;
    start.return_years = std::clamp(share * years.second, years.first, years.second);
    start.wander_sd = start.settling_sd = plain.walk_sd * std::sqrt(0.5 * start.return_years);
    start.walk_sd *= 0.3;
    const Ageing found = climb_with_return(sample, offsets, start, years, climbing);
    const double reached = log_likelihood<3>(sample, offsets, found).profile;
    if (reached > best) {
      best = reached;
      chosen = found;
    }
  }
  return chosen;
}

// Again, from where it was with other offsets of the sets.
Ageing polished(Sample sample, const std::vector<double>& offsets, const Ageing& from) {
  return from.return_years > 0.0 ? climb_with_return(sample, offsets, from, tellable_years(sample), polishing)
                                 : climb_plain(sample, offsets, from, polishing);
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
  const Ageing start{.unit_sd = seen.sd, .ramp_sd = small, .walk_sd = small, .setup_sd = small};
  std::vector<double> offsets(model.sets.size(), 0.0);
  for (int round = 0; round < 2; ++round) {
    Ageing& ageing = model;
    ageing = round == 0 ? climb_to_top(sample, offsets, start) : polished(sample, offsets, ageing);
    const MatrixXd normal = normal_equations(units, sets, ageing);
    const Eigen::Index fixed = fixed_effects(ageing);
    model.set_sd = std::max(spread_of_sets(solve(normal, fixed, 100.0 * seen.sd)), 1e-3 * seen.sd);
    const Effects effects = solve(normal, fixed, model.set_sd);
    model.mean = effects.value(0);
    model.ramp_per_year = effects.value(1);
    model.settling = fixed == 3 ? effects.value(2) : 0.0;
    for (std::size_t s = 0; s < offsets.size(); ++s) {
      const auto column = fixed + static_cast<Eigen::Index>(s);
      offsets[s] = effects.value(column);
      model.sets[s].value = offsets[s];
      model.sets[s].sigma = std::sqrt(std::max(0.0, effects.covariance(column, column)));
    }
  }
  const Jumps jumps = jumps_of(units, model);
  model.jumps_per_year = jumps.per_year;
  model.jump_sd = jumps.sd;
  return model;
}

}  // namespace selfcal::fleet
