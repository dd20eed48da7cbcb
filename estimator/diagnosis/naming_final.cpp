// What is settled once the names stand: the noise of the base, whether they are an explanation, and what they leave.
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/locate.hpp"
#include "estimator/diagnosis/naming.hpp"
#include "estimator/diagnosis/quantities.hpp"
#include "estimator/statistics/whiteness.hpp"

namespace selfcal::diagnosis {
// The calibration took part of what was left out for motion of the base. With the effects fitted its white noise is
// the one of the greatest likelihood, down to a micrometre, by factors of 3.
void Naming::sharpen_observation() {
  constexpr double factor = 1.0 / 3.0, least = 0.9e-6;  // m
  if ((chosen_.empty() && walks_.empty()) || point_.input.noise.observation.state_count() > 0) {
    return;
  }
  double best = log_likelihood_as_named(point_.input);
  bool better = false;
  double sigma = point_.input.noise.observation.sigma;
  while ((sigma *= factor) > least) {
    PassInput trial = point_.input;
    trial.noise.observation.sigma = sigma;
    const double found = log_likelihood_as_named(trial);
    if (found < best) {
      break;
    }
    best = found;
    better = true;
    point_.input.noise.observation.sigma = sigma;
  }
  if (better) {
    relinearise();
  }
}

// Of the recording, corrected as it is, with the sizes of what is named fitted under the noise of `input`.
double Naming::log_likelihood_as_named(const PassInput& input) const {
  const OperatingPoint point{input, point_.recording};
  if (chosen_.empty() && walks_.empty()) {
    return run_pass(point.pass()).log_likelihood;
  }
  std::vector<Candidate> named;
  for (const Chosen& c : chosen_) {
    named.push_back(c.candidate);
  }
  const LinearModel model = LinearModel::about(context_, point, named, walks_, false);
  std::vector<int> columns;
  for (const Candidate& c : model.candidates()) {
    const std::vector<int> own = columns_of(c);
    columns.insert(columns.end(), own.begin(), own.end());
  }
  return model.log_likelihood(columns);
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
    for (std::size_t k = 0; k < model_.map().size(); ++k) {
      const LocatedColumn& m = model_.map()[k];
      const bool segment = m.kind == LocatedColumn::Kind::dwell || m.kind == LocatedColumn::Kind::rotation;
      if (segment && m.axis / 3 == w.axis / 3) {
        groups.back().push_back(model_.first_map_column() + static_cast<int>(k));
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
      const Eigen::MatrixXd other = model_.rows().columns(Eigen::all, groups[j]);
      const Eigen::MatrixXd G = other.transpose() * other;
      for (Eigen::Index k = 0; k < z.size(); ++k) {
        const Eigen::VectorXd own = model_.rows().columns.col(groups[i][static_cast<std::size_t>(k)]);
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
  const double own = test_group(evidence(), columns_of(chosen.candidate), {}).gain;
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
  const int first = model_.append(context_, point_, beside, Eigen::MatrixXd::Identity(all, all));
  size_forms();
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
    const Effect* left = c.candidate.effect->lack_of_fit.get();
    if (left == nullptr || (left->needs_gimbal && !gimbal)) {
      continue;
    }
    std::vector<Candidate> beside;
    for (const double constant : left->constant.tried()) {
      beside.push_back({left, constant, 0, 0});
    }
    log_p_likeness_ = std::min(log_p_likeness_, test_leftover(c, beside));
  }
}

Naming::Structure Naming::structure() const {
  using Kind = LocatedColumn::Kind;
  const std::vector<int> others = chosen_columns();
  const Evidence& given = given_forms();
  const Eigen::VectorXd size = given.fit(others).value;
  Structure found;
  int tests = 0;
  for (const Kind kind : {Kind::dwell, Kind::rotation, Kind::after_turn, Kind::time}) {
    for (int axis = 0; axis < 6; ++axis) {
      std::vector<int> group;
      for (std::size_t k = 0; k < model_.map().size(); ++k) {
        if (model_.map()[k].kind == kind && model_.map()[k].axis == axis) {
          group.push_back(model_.first_map_column() + static_cast<int>(k));
        }
      }
      const GroupTest left = test_group(given, group, others);
      const bool walks =
          std::any_of(walks_.begin(), walks_.end(), [&](const WalkTest& w) { return w.axis / 3 == axis / 3; });
      const bool named = walks || (!others.empty() && square_within(given, group, others, size) >= left.gain);
      double& smallest = named ? found.log_p_named : found.log_p_elsewhere;
      smallest = std::min(smallest, left.log_p);
      ++tests;
    }
  }
  found.log_p_named = log_corrected(found.log_p_named, tests);
  found.log_p_elsewhere = log_corrected(found.log_p_elsewhere, tests);
  return found;
}

Map Naming::map_after() const {
  return locate(given_forms(), model_.map(), model_.first_map_column(), chosen_columns());
}

Naming::ByQuantity Naming::locate_by_quantities() const {
  std::vector<Candidate> all = quantity_bins(context_);
  const auto bins = static_cast<std::ptrdiff_t>(all.size());
  for (const Chosen& c : chosen_) {
    all.push_back(c.candidate);
  }
  const LinearModel model = LinearModel::about(context_, point_, all, walks_, false);
  const std::vector<Candidate> quantities(model.candidates().begin(), model.candidates().begin() + bins);
  std::vector<int> fitted;
  for (auto c = model.candidates().begin() + bins; c != model.candidates().end(); ++c) {
    const std::vector<int> columns = columns_of(*c);
    fitted.insert(fitted.end(), columns.begin(), columns.end());
  }
  const double mean_c = context_.mean_temperature();
  return {locate_by_quantity(model.evidence_without_walks(), quantities, {}, mean_c),
          locate_by_quantity(model.evidence(), quantities, fitted, mean_c)};
}

double Naming::square_after() const { return given_forms().square - given_forms().fit(chosen_columns()).gain; }

double Naming::log_p_white_after() const {
  return test_whiteness(model_.residual_after(chosen_columns(), forms_.columns, forms_.mean)).log_p;
}

ParameterVector Naming::value_as_named() const {
  const std::vector<int> columns = chosen_columns();
  Eigen::VectorXd size(static_cast<Eigen::Index>(columns.size()));
  Eigen::Index at = 0;
  for (const Chosen& c : chosen_) {
    size.segment(at, c.size.size()) = c.size;
    at += c.size.size();
  }
  return model_.parameters(columns, size);
}

ParameterVector Naming::value() const {
  const Eigen::MatrixXd& shift = model_.rows().shift;
  ParameterVector value = value_as_named() + averaged_;
  for (const Chosen& c : chosen_) {
    value -= shift.middleCols(c.candidate.first, c.candidate.count) * c.size;
  }
  if (!forms_.empty()) {
    value += shift(Eigen::all, forms_.columns) * forms_.mean;
  }
  return value;
}

ParameterMatrix Naming::covariance() const {
  const PassOutput& pass = model_.rows().pass;
  const int at = pass.layout.parameters();
  ParameterMatrix covariance = pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at) + spread_;
  if (!forms_.empty()) {
    const Eigen::MatrixXd S = model_.rows().shift(Eigen::all, forms_.columns);
    covariance += S * forms_.covariance * S.transpose();
  }
  return covariance + covariance_of_closed_forms();
}

}  // namespace selfcal::diagnosis
