#include "estimator/diagnosis/naming.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "estimator/diagnosis/catalogue.hpp"
#include "estimator/diagnosis/locate.hpp"
#include "estimator/diagnosis/multiplicity.hpp"
#include "estimator/diagnosis/velocity_noise.hpp"
#include "estimator/diagnosis/walk_check.hpp"
#include "estimator/statistics/whiteness.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t most_effects = 6;
constexpr int walk_axes = 6;
constexpr int most_relinearisations = 4;
constexpr double converged_sigma = 0.1;
constexpr int steps = 3;  // of a constant to either side
const double line_log_p = std::log(1e-4);

bool of_spectrum(const Effect& effect) { return effect.constant.kind == EffectConstant::Kind::spectrum; }

std::vector<Candidate> candidates_for(const RecordingContext& context, const std::vector<InnovationLine>& lines) {
  std::vector<Candidate> all;
  for (const Effect& effect : catalogue()) {
    if (!applies(effect, context.has_temperature())) {
      continue;
    }
    for (const double constant : effect.constant.tried()) {
      all.push_back({&effect, constant, 0, 0});
    }
    if (of_spectrum(effect)) {
      std::vector<double> known;
      for (const InnovationLine& line : lines) {
        const bool near =
            std::any_of(known.begin(), known.end(), [&](double f) { return std::abs(f - line.frequency_hz) < 1e-3; });
        if (line.log_p < line_log_p && !near) {
          known.push_back(line.frequency_hz);
          all.push_back({&effect, line.frequency_hz, 0, 0});
        }
      }
    }
  }
  return all;
}

}  // namespace

Naming::Naming(const RecordingContext& context, PassInput input, double log_threshold)
    : context_(context),
      log_threshold_(log_threshold),
      point_{std::move(input), CorrectedRecording(context.data())},
      candidates_(candidates_for(context, {})) {
  linearise();
  lines_before_ = innovation_lines(model_.rows(), point_.input.interval_s);
  const bool lines = std::any_of(lines_before_.begin(), lines_before_.end(),
                                 [](const InnovationLine& l) { return l.log_p < line_log_p; });
  if (lines) {
    candidates_ = candidates_for(context, lines_before_);
    linearise();
  }
  effective_tests_ = diagnosis::effective_tests(evidence(), candidates_, std::exp(log_threshold_));
  map_before_ = locate(evidence(), model_.map(), model_.first_map_column(), {});
  square_before_ = evidence().square;
  white_before_ = test_whiteness(model_.rows().residual).log_p;
  for (const Effect& effect : catalogue()) {
    if (!applies(effect, context.has_temperature())) {
      continue;
    }
    Suspect prospect{&effect, 0.0, 0.0};
    for (const Candidate& c : model_.candidates()) {
      if (c.effect == &effect) {
        const GroupTest test = test_group(evidence(), columns_of(c), {});
        prospect.expected_z = std::max(prospect.expected_z, test.expected_z);
      }
    }
    prospects_.push_back(prospect);
  }
}

std::vector<Candidate> Naming::terms() const {
  std::vector<Candidate> all;
  for (const Chosen& c : chosen_) {
    all.push_back(c.candidate);
  }
  return all;
}

std::vector<int> Naming::chosen_columns(std::size_t without) const { return columns_of(terms(), without); }

// The catalogue's on this recording (multiplicity.hpp) and the walks of six axes, each at the edge of its range.
double Naming::independent_tests() const { return effective_tests_ + 0.5 * walk_axes; }

bool Naming::names(const Effect& effect) const {
  return std::any_of(chosen_.begin(), chosen_.end(), [&](const Chosen& x) { return x.candidate.effect == &effect; });
}

Significance Naming::significance() const { return {log_threshold_, independent_tests(), evidence().rows}; }

void Naming::refit() {
  const Fit fit = evidence().fit(chosen_columns());
  Eigen::Index at = 0;
  for (Chosen& c : chosen_) {
    c.size = fit.value.segment(at, c.candidate.count);
    c.covariance = fit.covariance.block(at, at, c.candidate.count, c.candidate.count);
    at += c.candidate.count;
  }
}

// What is chosen and lies in the increments, as fitted.
Correction Naming::correction() const {
  Correction correction;
  for (const Chosen& c : chosen_) {
    correction.add(*c.candidate.effect, c.candidate.constant, c.size);
  }
  return correction;
}

void Naming::linearise() {
  model_ = LinearModel::about(context_, point_, candidates_, walks_, true);
  candidates_ = model_.candidates();
}

// Takes the fitted effects out of the increments, lets the 24 settle again, and carries the signatures about the
// new trajectory; until the sizes stand still.
void Naming::relinearise() {
  refit();
  for (int round = 0; round < most_relinearisations; ++round) {
    point_ = settle(context_, point_, correction());
    linearise();
    const std::vector<Chosen> before = chosen_;
    refit();
    double move = 0.0;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      const Eigen::VectorXd sigma = chosen_[i].covariance.diagonal().cwiseSqrt();
      move = std::max(move, (chosen_[i].size - before[i].size).cwiseAbs().cwiseQuotient(sigma).maxCoeff());
    }
    if (point_.recording.taken_out().effects.empty() || move < converged_sigma) {
      break;
    }
  }
  append_forms();
}

// Gain of a chosen effect with its constant `steps` steps of the logarithm to either side.
std::vector<double> Naming::gains_around(const Chosen& chosen, double step) {
  std::vector<Candidate> grid;
  for (int k = -steps; k <= steps; ++k) {
    grid.push_back({chosen.candidate.effect, chosen.candidate.constant * std::exp(k * step), 0, 0});
  }
  const std::size_t own = grid.size();
  for (const Chosen& c : chosen_) {
    if (&c != &chosen) {
      grid.push_back(c.candidate);
    }
  }
  const LinearModel model = LinearModel::about(context_, point_, grid, walks_, false);
  std::vector<int> others;
  for (std::size_t i = own; i < grid.size(); ++i) {
    const std::vector<int> columns = columns_of(model.candidates()[i]);
    others.insert(others.end(), columns.begin(), columns.end());
  }
  std::vector<double> gain;
  for (std::size_t i = 0; i < own; ++i) {
    gain.push_back(test_group(model.evidence(), columns_of(model.candidates()[i]), others).gain);
  }
  return gain;
}

// Takes the constant to the top of the likelihood: a parabola through the gain over its logarithm, on a grid that
// closes in.
void Naming::refine_constant(Chosen& chosen) {
  if (std::isnan(chosen.candidate.constant)) {
    return;
  }
  // The catalogue's grid may be wide: the top is followed along it, and by a factor of 2 beyond. A frequency has none.
  const std::span<const double> all = chosen.candidate.effect->constant.grid;
  const double least = all.empty() ? HUGE_VAL : 0.5 * *std::min_element(all.begin(), all.end());
  const double most = all.empty() ? 0.0 : 2.0 * *std::max_element(all.begin(), all.end());
  // A frequency comes from a spectrum: it lies within half a bin.
  const double bin = 1.0 / (chosen.candidate.constant * model_.rows().time_s.back());
  const double coarse = of_spectrum(*chosen.candidate.effect) ? 0.25 * bin : 0.2;
  constexpr int most_moves = 8;
  for (const double step : {coarse, 0.2 * coarse}) {
    for (int move = 0; move < most_moves; ++move) {
      const std::vector<double> gain = gains_around(chosen, step);
      const auto top = std::max_element(gain.begin(), gain.end()) - gain.begin();
      const auto middle = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(top, 1, 2 * steps - 1));
      const double curvature = gain[middle - 1] - 2.0 * gain[middle] + gain[middle + 1];
      const double slope = 0.5 * (gain[middle + 1] - gain[middle - 1]);
      const double offset = curvature < 0.0 ? std::clamp(-slope / curvature, -1.0, 1.0) : 0.0;
      chosen.candidate.constant *= std::exp((static_cast<double>(middle) - steps + offset) * step);
      // gain = -2 log likelihood: sigma^2 = -2 / (second derivative).
      chosen.constant_sigma = curvature < 0.0 ? chosen.candidate.constant * step * std::sqrt(-2.0 / curvature) : 0.0;
      const bool at_edge = top == 0 || top + 1 == std::ssize(gain);
      if (!at_edge || chosen.candidate.constant < least || chosen.candidate.constant > most) {
        break;
      }
    }
  }
  for (Candidate& c : candidates_) {
    c.constant = c.first == chosen.candidate.first ? chosen.candidate.constant : c.constant;
  }
}

bool Naming::add_best() {
  const std::vector<int> fitted = chosen_columns();
  std::vector<Candidate> alternatives;
  std::copy_if(model_.candidates().begin(), model_.candidates().end(), std::back_inserter(alternatives),
               [&](const Candidate& c) { return open(c); });
  std::vector<WalkTest> walks;
  for (int axis = 0; axis < walk_axes; ++axis) {
    if (std::none_of(walks_.begin(), walks_.end(), [&](const WalkTest& w) { return w.axis == axis; })) {
      walks.push_back(test_walk(given_forms(), model_.map(), model_.first_map_column(), axis, fitted));
    }
  }
  std::erase_if(walks, [&](const WalkTest& w) { return within_form(w); });
  const auto goes_on = [&](const WalkTest& walk) {
    return walks_inside_dwells(context_.data(), point_.input.noise, walk);
  };
  const auto found = best_addition(given_forms(), fitted, alternatives, walks, significance(), goes_on,
                                   [&](const Candidate& c, const GroupTest& test) { return immaterial(c, test); });
  if (!found) {
    return false;
  }
  if (found->walk) {
    walks_.push_back(*found->walk);
    model_.marginalise(*found->walk);
    refit();
    size_forms();
    return true;
  }
  chosen_.emplace_back();
  chosen_.back().candidate = *found->term;
  refine_constant(chosen_.back());
  for (std::size_t i = 0; i + 1 < chosen_.size(); ++i) {  // they were found while this one was left out
    refine_constant(chosen_[i]);
  }
  linearise();
  relinearise();
  return true;
}

// What fell once is not taken again: what was seen may be another's, and it would fall and be taken for ever.
bool Naming::fell(const Candidate& candidate) const {
  return std::any_of(fallen_.begin(), fallen_.end(), [&](const Candidate& f) {
    return f.effect == candidate.effect && (!of_spectrum(*f.effect) || f.first == candidate.first);
  });
}

// Whether it may be taken: of the lines of a spectrum each once, of other effects one.
bool Naming::open(const Candidate& candidate) const {
  const bool same = std::any_of(chosen_.begin(), chosen_.end(),
                                [&](const Chosen& x) { return x.candidate.first == candidate.first; });
  return !same && !fell(candidate) && (of_spectrum(*candidate.effect) || !names(*candidate.effect));
}

bool Naming::drop_weak() {
  const auto weak = weak_term(given_forms(), terms(), significance());
  if (weak) {
    fallen_.push_back(chosen_[*weak].candidate);
    chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(*weak));
    relinearise();
  }
  return weak.has_value();
}

bool Naming::exchange() {
  const auto found = better_exchange(evidence(), terms(), model_.candidates());
  if (found) {
    chosen_[found->term].candidate = found->by;
    refine_constant(chosen_[found->term]);
    relinearise();
  }
  return found.has_value();
}

void Naming::judge() {
  std::vector<int> fold;
  for (const double t : model_.rows().time_s) {
    fold.push_back(static_cast<int>(context_.segment_at(t)));
  }
  const Eigen::VectorXd residual = model_.residual();
  const std::vector<int> all = chosen_columns();
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    Chosen& c = chosen_[i];
    const std::vector<int> others = chosen_columns(i);
    const GroupTest marginal = test_group(given_forms(), columns_of(c.candidate), others);
    c.gain = marginal.gain;
    c.rank = marginal.rank;
    c.log_p = significance().corrected(marginal.log_detection, *c.candidate.effect);
    c.held_out = held_out_gain(model_.rows().columns, residual, fold, all, others);
    c.equivalent = equivalents(evidence(), terms(), i, model_.candidates());
  }
  std::stable_sort(chosen_.begin(), chosen_.end(), [](const Chosen& a, const Chosen& b) { return a.log_p < b.log_p; });
}

void Naming::run(const std::function<void(const std::string&)>& progress, const std::stop_token& stop) {
  while (!stop.stop_requested() && chosen_.size() + walks_.size() < most_effects && add_best()) {
    if (progress) {
      progress(std::to_string(chosen_.size() + walks_.size()) + " effects fitted");
    }
    drop_weak();
  }
  for (int round = 0; round < 3 && !stop.stop_requested() && exchange(); ++round) {
    while (drop_weak()) {
    }
  }
  while (!stop.stop_requested() && drop_weak_walk()) {
  }
  sharpen_observation();
  refit_noise();
  while (!stop.stop_requested() && chosen_.size() + walks_.size() < most_effects && add_best()) {
  }
  average();
  test_likenesses();
  judge();
}

// Under noise that no longer holds them the names are tested again; where one falls the noise is fitted without it.
void Naming::refit_noise() {
  const auto log_likelihood = [&](const PassInput& trial) { return log_likelihood_as_named(trial); };
  bool fallen = !chosen_.empty() || !walks_.empty();
  while (fallen && refit_velocity_noise(point_.input, log_likelihood)) {
    relinearise();
    fallen = drop_weak();
  }
}

std::vector<Suspect> Naming::suspects() const {
  std::vector<Suspect> all;
  const std::vector<int> others = chosen_columns();
  for (const Candidate& c : model_.candidates()) {
    if (names(*c.effect)) {
      continue;
    }
    const GroupTest test = test_group(given_forms(), columns_of(c), others);
    const double log_p = significance().corrected(test.log_detection, *c.effect);
    const auto same = std::find_if(all.begin(), all.end(), [&](const Suspect& s) { return s.effect == c.effect; });
    if (same == all.end()) {
      all.push_back({c.effect, log_p, test.expected_z});
    } else {
      same->log_p = std::min(same->log_p, log_p);
      same->expected_z = std::max(same->expected_z, test.expected_z);
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Suspect& a, const Suspect& b) { return a.log_p < b.log_p; });
  return all;
}

}  // namespace selfcal::diagnosis
