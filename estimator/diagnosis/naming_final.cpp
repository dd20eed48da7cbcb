// What is settled once the names stand: the noise of the base, whether they are an explanation, and what they leave.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/diagnosis/catalogue.hpp"
#include "estimator/diagnosis/locate.hpp"
#include "estimator/diagnosis/naming.hpp"
#include "estimator/diagnosis/quantities.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// Warm-ups on the axes of an effect that is a drift in time or follows temperature; null for others.
const Effect* slow_curves_of(const Effect& effect) {
  const std::string id = effect.id == "gyro_drift_ramp"   ? "gyro_temperature"
                         : effect.id == "accel_bias_ramp" ? "accel_temperature"
                                                          : effect.id;
  const std::vector<Effect>& all = catalogue();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Effect& e) {
    return e.id == id && id.ends_with("_temperature") && !e.needs_temperature;
  });
  return found == all.end() ? nullptr : &*found;
}

// Gyro drift with sine and cosine of either gimbal angle: no member of the catalogue, for it is no physics.
void gimbal_columns(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  const std::array<double, 4> functions = {std::sin(c.outer), std::cos(c.outer), std::sin(c.inner), std::cos(c.inner)};
  for (std::size_t k = 0; k < functions.size(); ++k) {
    add_axes(angle.middleCols<3>(static_cast<Eigen::Index>(3 * k)), Vector3::Constant(functions[k] * c.dt));
  }
}

const Effect& gimbal_functions() {
  static const Effect effect = [] {
    Effect e;
    for (int k = 0; k < 4; ++k) {
      const std::vector<EffectParameter> axes = axis_parameters("deg/h", units::degree_per_hour, 0.01);
      e.parameters.insert(e.parameters.end(), axes.begin(), axes.end());
    }
    e.sensor = gimbal_columns;
    return e;
  }();
  return effect;
}

}  // namespace

// The calibration took part of what was left out for motion of the base. With the effects fitted its white noise is
// the one of the greatest likelihood, down to a micrometre, by factors of 3.
void Naming::sharpen_observation() {
  constexpr double factor = 1.0 / 3.0, least = 0.9e-6;  // m
  if ((chosen_.empty() && walks_.empty()) || input_.noise.observation.state_count() > 0) {
    return;
  }
  double best = log_likelihood_as_named(input_);
  bool better = false;
  double sigma = input_.noise.observation.sigma;
  while ((sigma *= factor) > least) {
    PassInput trial = input_;
    trial.noise.observation.sigma = sigma;
    const double found = log_likelihood_as_named(trial);
    if (found < best) {
      break;
    }
    best = found;
    better = true;
    input_.noise.observation.sigma = sigma;
  }
  if (better) {
    relinearise();
  }
}

// Of the recording, corrected as it is, with the sizes of what is named fitted under the noise of `input`.
double Naming::log_likelihood_as_named(const PassInput& input) const {
  if (chosen_.empty() && walks_.empty()) {
    return run_pass(input).log_likelihood;
  }
  std::vector<Candidate> named = correction_.effects;
  for (const Chosen& c : chosen_) {
    named.push_back(c.candidate);
  }
  SignaturePass pass(context_, named, !walks_.empty());
  const SignatureRows rows = pass.run(input);
  Evidence evidence(rows);
  const double raw = evidence.square;
  const auto corrected = static_cast<int>(correction_.size.size());
  std::vector<int> columns(static_cast<std::size_t>(pass.first_map_column()));
  std::iota(columns.begin(), columns.end(), 0);
  const std::vector<int> applied(columns.begin(), columns.begin() + corrected);
  evidence.restore(applied, correction_.size);
  for (const WalkTest& walk : walks_) {
    std::vector<int> own = walk.columns;
    for (int& column : own) {
      column += pass.first_map_column() - pass_.first_map_column();
    }
    evidence.absorb(own, walk.covariance);
  }
  columns.erase(columns.begin(), columns.begin() + corrected);
  return rows.pass.log_likelihood + 0.5 * (raw - evidence.square + evidence.fit(columns).gain);
}

bool Naming::entangled() const {
  constexpr double half_of_it = 0.5, counts = 3.0;  // share of a signature; sigmas from which a coefficient counts
  std::vector<std::vector<int>> groups;
  for (const Chosen& c : chosen_) {
    groups.push_back(columns_of(c.candidate));
  }
  // What one axis's walk does not take up another's does.
  for (const WalkTest& w : walks_) {
    groups.emplace_back();
    for (std::size_t k = 0; k < pass_.map().size(); ++k) {
      const LocatedColumn& m = pass_.map()[k];
      const bool segment = m.kind == LocatedColumn::Kind::dwell || m.kind == LocatedColumn::Kind::rotation;
      if (segment && m.axis / 3 == w.axis / 3) {
        groups.back().push_back(pass_.first_map_column() + static_cast<int>(k));
      }
    }
  }
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const Eigen::VectorXd z = chosen_[i].size.cwiseQuotient(chosen_[i].covariance.diagonal().cwiseSqrt()).cwiseAbs();
    const double least = std::min(counts, z.maxCoeff());
    for (std::size_t j = 0; j < groups.size(); ++j) {
      if (j == i || (j < chosen_.size() && chosen_[j].candidate.effect == chosen_[i].candidate.effect)) {
        continue;  // lines of a sway are several of one kind
      }
      const Eigen::MatrixXd other = rows_.columns(Eigen::all, groups[j]);
      const Eigen::MatrixXd G = other.transpose() * other;
      for (Eigen::Index k = 0; k < z.size(); ++k) {
        const Eigen::VectorXd own = rows_.columns.col(groups[i][static_cast<std::size_t>(k)]);
        const double share = fit_columns(G, other.transpose() * own).gain / own.squaredNorm();
        if (z(k) >= least && share > half_of_it) {
          return true;
        }
      }
    }
  }
  return false;
}

// Of columns on the axes of a chosen effect, one by one, given all that is chosen and its constants: the smallest p,
// corrected for `tests_per_axis` independent ones.
double Naming::test_leftover(const Chosen& chosen, const std::vector<Candidate>& beside) {
  constexpr double counts = 3.0;          // sigmas from which a coefficient counts
  constexpr double tests_per_axis = 3.0;  // four functions of the gimbal angles; warm-ups are alike: two
  // An equation that is right to 3 % of its amplitude leaves as much: its own form, not another effect's.
  constexpr double form_square = 1e-3;
  const double own = test_group(evidence_, columns_of(chosen.candidate), {}).gain;
  std::vector<int> others = chosen_columns();
  for (const Chosen& c : chosen_) {
    for (int k = 0; c.derivative >= 0 && k < c.candidate.count; ++k) {
      others.push_back(c.derivative + k);
    }
  }
  std::array<bool, 3> concerned{};
  const Eigen::VectorXd z = chosen.size.cwiseQuotient(chosen.covariance.diagonal().cwiseSqrt()).cwiseAbs();
  for (Eigen::Index k = 0; k < z.size(); ++k) {
    const Eigen::Index axis = z.size() > 3 ? k / 3 : k;  // a matrix row by row
    concerned[static_cast<std::size_t>(axis)] |= z(k) >= std::min(counts, z.maxCoeff());
  }
  Eigen::Index all = 0;
  for (const Candidate& c : beside) {
    all += static_cast<Eigen::Index>(c.effect->parameters.size());
  }
  const int first = append_columns(beside, Eigen::MatrixXd::Identity(all, all));
  double smallest = 0.0;
  for (int column = 0; column < static_cast<int>(all); ++column) {  // axis by axis in threes
    if (concerned[static_cast<std::size_t>(column % 3)]) {
      const GroupTest left = test_group(given_forms(), {first + column}, others);
      smallest = left.gain > form_square * own ? std::min(smallest, left.log_p) : smallest;
    }
  }
  const auto axes = std::count(concerned.begin(), concerned.end(), true);
  return log_corrected(smallest, tests_per_axis * static_cast<double>(axes));
}

// A drift that is named after one curve in time must not need a second, one named after gravity, field or rate no
// function of the gimbal angles beside it: over tens of minutes and eighteen positions much looks alike, and a test of
// everything that may be left has little power against what is likely.
void Naming::test_likenesses() {
  log_p_likeness_ = 0.0;
  const bool gimbal = !context_.data().gimbal_outer.empty() && !context_.data().gimbal_inner.empty();
  const std::vector<Chosen> named = chosen_;
  for (const Chosen& c : named) {
    const std::string& id = c.candidate.effect->id;
    std::vector<Candidate> beside;
    if (const Effect* warm_up = slow_curves_of(*c.candidate.effect)) {
      for (const double constant : warm_up->constants) {
        beside.push_back({warm_up, constant, 0, 0});
      }
    } else if (gimbal && (id == "gyro_g_sensitivity" || id == "gyro_magnetic_sensitivity" || id == "gyro_dead_zone")) {
      beside.push_back({&gimbal_functions(), NAN, 0, 0});
    }
    if (!beside.empty()) {
      log_p_likeness_ = std::min(log_p_likeness_, test_leftover(c, beside));
    }
  }
}

Naming::Structure Naming::structure() const {
  using Kind = LocatedColumn::Kind;
  const std::vector<int> others = chosen_columns();
  const Evidence& evidence = given_forms();
  const Eigen::VectorXd size = evidence.fit(others).value;
  Structure found;
  int tests = 0;
  for (const Kind kind : {Kind::dwell, Kind::rotation, Kind::after_turn, Kind::time}) {
    for (int axis = 0; axis < 6; ++axis) {
      std::vector<int> group;
      for (std::size_t k = 0; k < pass_.map().size(); ++k) {
        if (pass_.map()[k].kind == kind && pass_.map()[k].axis == axis) {
          group.push_back(pass_.first_map_column() + static_cast<int>(k));
        }
      }
      const GroupTest left = test_group(evidence, group, others);
      const bool walks =
          std::any_of(walks_.begin(), walks_.end(), [&](const WalkTest& w) { return w.axis / 3 == axis / 3; });
      const bool named = walks || (!others.empty() && square_within(evidence, group, others, size) >= left.gain);
      double& smallest = named ? found.log_p_named : found.log_p_elsewhere;
      smallest = std::min(smallest, left.log_p);
      ++tests;
    }
  }
  found.log_p_named = log_corrected(found.log_p_named, tests);
  found.log_p_elsewhere = log_corrected(found.log_p_elsewhere, tests);
  return found;
}

Map Naming::map_after() const { return locate(given_forms(), pass_.map(), pass_.first_map_column(), chosen_columns()); }

Naming::ByQuantity Naming::locate_by_quantities() const {
  std::vector<Candidate> all = quantity_bins(context_);
  const std::size_t bins = all.size(), applied = bins + chosen_.size();
  for (const Chosen& c : chosen_) {
    all.push_back(c.candidate);
  }
  all.insert(all.end(), correction_.effects.begin(), correction_.effects.end());
  SignaturePass pass(context_, all, !walks_.empty());
  Evidence evidence(pass.run(input_));
  all = pass.candidates();
  std::vector<int> fitted, restored;
  for (std::size_t i = bins; i < all.size(); ++i) {
    const std::vector<int> columns = columns_of(all[i]);
    std::vector<int>& to = i < applied ? fitted : restored;
    to.insert(to.end(), columns.begin(), columns.end());
  }
  if (!restored.empty()) {
    evidence.restore(restored, correction_.size);
  }
  all.resize(bins);
  ByQuantity located;
  located.before = locate_by_quantity(evidence, all, {}, context_.mean_temperature());
  for (const WalkTest& walk : walks_) {
    std::vector<int> columns = walk.columns;
    for (int& column : columns) {
      column += pass.first_map_column() - pass_.first_map_column();
    }
    evidence.absorb(columns, walk.covariance);
  }
  located.after = locate_by_quantity(evidence, all, fitted, context_.mean_temperature());
  return located;
}

double Naming::square_after() const { return given_forms().square - given_forms().fit(chosen_columns()).gain; }

Eigen::VectorXd Naming::final_residual() const {
  Eigen::VectorXd residual = rows_.residual;
  if (!applied_columns_.empty()) {
    residual += rows_.columns(Eigen::all, applied_columns_) * applied_;
  }
  const std::vector<int> columns = chosen_columns();
  if (!columns.empty()) {
    residual -= rows_.columns(Eigen::all, columns) * evidence_.fit(columns).value;
  }
  if (!forms_.empty()) {
    residual -= rows_.columns(Eigen::all, forms_.columns) * forms_.mean;
  }
  for (const WalkTest& walk : walks_) {  // the walk's own estimate
    const Eigen::MatrixXd Z = rows_.columns(Eigen::all, walk.columns);
    const Eigen::MatrixXd J = Z.transpose() * Z;
    const auto n = J.rows();
    residual -= Z * (walk.covariance * (Eigen::MatrixXd::Identity(n, n) + J * walk.covariance).inverse() *
                     (Z.transpose() * residual));
  }
  return residual;
}

double Naming::log_p_white_after() const { return diagnosis::log_p_white(final_residual()); }

// Truth = estimate + shift * (size - what the correction already took out).
ParameterVector Naming::value_as_named() const {
  const PassOutput& pass = rows_.pass;
  ParameterVector value = input_.parameters + pass.mean.segment<sensor_parameter_count>(pass.layout.parameters());
  for (const Chosen& c : chosen_) {
    value += rows_.shift.middleCols(c.candidate.first, c.candidate.count) * c.size;
  }
  if (!applied_columns_.empty()) {
    value -= rows_.shift(Eigen::all, applied_columns_) * applied_;
  }
  return value;
}

ParameterVector Naming::value() const {
  ParameterVector value = value_as_named() + averaged_;
  for (const Chosen& c : chosen_) {
    value -= rows_.shift.middleCols(c.candidate.first, c.candidate.count) * c.size;
  }
  if (!forms_.empty()) {
    value += rows_.shift(Eigen::all, forms_.columns) * forms_.mean;
  }
  return value;
}

ParameterMatrix Naming::covariance() const {
  const int at = rows_.pass.layout.parameters();
  ParameterMatrix covariance =
      rows_.pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at) + spread_;
  if (!forms_.empty()) {
    const Eigen::MatrixXd S = rows_.shift(Eigen::all, forms_.columns);
    covariance += S * forms_.covariance * S.transpose();
  }
  return covariance + covariance_of_closed_forms();
}

}  // namespace selfcal::diagnosis
