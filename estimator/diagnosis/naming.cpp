#include "estimator/diagnosis/naming.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/catalogue.hpp"
#include "estimator/diagnosis/locate.hpp"
#include "estimator/diagnosis/multiplicity.hpp"
#include "estimator/diagnosis/velocity_noise.hpp"
#include "estimator/diagnosis/walk_check.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t most_effects = 6;
constexpr int walk_axes = 6;
constexpr int most_relinearisations = 4;
constexpr double converged_sigma = 0.1;
constexpr int steps = 3;  // of a constant to either side
// Effects whose odds against the best are better than 1:100 stay in its class.
const double class_log_odds = std::log(100.0);
const double line_log_p = std::log(1e-4);

std::vector<Candidate> candidates_for(const RecordingContext& context, const std::vector<InnovationLine>& lines) {
  std::vector<Candidate> all;
  for (const Effect& effect : catalogue()) {
    // With a channel, temperature is what it says; without, a warm-up.
    const bool thermal = effect.id.ends_with("_temperature");
    if (context.has_temperature() ? thermal && !effect.needs_temperature : effect.needs_temperature) {
      continue;
    }
    for (const double constant : effect.constants) {
      all.push_back({&effect, constant, 0, 0});
    }
    if (effect.id == "base_sway") {
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
      input_(std::move(input)),
      log_threshold_(log_threshold),
      pass_(context, candidates_for(context, {}), true),
      rows_(pass_.run(input_)),
      evidence_(rows_),
      given_forms_(evidence_) {
  lines_before_ = innovation_lines(rows_, input_.interval_s);
  const bool lines = std::any_of(lines_before_.begin(), lines_before_.end(),
                                 [](const InnovationLine& l) { return l.log_p < line_log_p; });
  if (lines) {
    pass_ = SignaturePass(context, candidates_for(context, lines_before_), true);
    rows_ = pass_.run(input_);
    evidence_ = Evidence(rows_);
  }
  effective_tests_ = diagnosis::effective_tests(evidence_, pass_.candidates(), std::exp(log_threshold_));
  map_before_ = locate(evidence_, pass_.map(), pass_.first_map_column(), {});
  square_before_ = evidence_.square;
  white_before_ = diagnosis::log_p_white(rows_.residual);
  for (const Effect& effect : catalogue()) {
    Suspect prospect{effect.id, 0.0, 0.0};
    for (const Candidate& c : pass_.candidates()) {
      if (c.effect == &effect) {
        const GroupTest test = test_group(evidence_, columns_of(c), {});
        prospect.expected_z = std::max(prospect.expected_z, test.expected_z);
      }
    }
    const auto same =
        std::find_if(prospects_.begin(), prospects_.end(), [&](const Suspect& s) { return s.effect == effect.id; });
    if (same == prospects_.end()) {
      prospects_.push_back(prospect);
    } else {
      same->expected_z = std::max(same->expected_z, prospect.expected_z);
    }
  }
}

std::vector<int> Naming::chosen_columns(std::size_t without) const {
  std::vector<int> columns;
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    if (i != without) {
      const std::vector<int> own = columns_of(chosen_[i].candidate);
      columns.insert(columns.end(), own.begin(), own.end());
    }
  }
  return columns;
}

// The catalogue's on this recording (multiplicity.hpp) and the walks of six axes, each at the edge of its range.
double Naming::independent_tests() const { return effective_tests_ + 0.5 * walk_axes; }

// The frequency of a sway was looked for in a spectrum.
double Naming::corrected(double log_p, const std::string& effect) const {
  const double spectrum = effect == "base_sway" ? searched_frequencies(evidence_.rows) : 1.0;
  return log_corrected(log_p, independent_tests() * spectrum);
}

void Naming::refit() {
  const Fit fit = evidence_.fit(chosen_columns());
  Eigen::Index at = 0;
  for (Chosen& c : chosen_) {
    c.size = fit.value.segment(at, c.candidate.count);
    c.covariance = fit.covariance.block(at, at, c.candidate.count, c.candidate.count);
    at += c.candidate.count;
  }
}

// Takes the fitted effects out of the increments, lets the 24 settle again, and carries the signatures about the
// new trajectory; until the sizes stand still.
void Naming::relinearise() {
  refit();
  for (int round = 0; round < most_relinearisations; ++round) {
    Correction correction;
    std::vector<double> sizes;
    applied_columns_.clear();
    int first = 0;
    for (const Chosen& c : chosen_) {
      if (c.candidate.effect->sensor != nullptr) {
        Candidate own = c.candidate;
        own.first = first;
        first += own.count;
        correction.effects.push_back(own);
        sizes.insert(sizes.end(), c.size.begin(), c.size.end());
        const std::vector<int> columns = columns_of(c.candidate);
        applied_columns_.insert(applied_columns_.end(), columns.begin(), columns.end());
      }
    }
    correction.size = Eigen::Map<const Eigen::VectorXd>(sizes.data(), static_cast<Eigen::Index>(sizes.size()));
    applied_ = correction.size;
    correction_ = correction;
    const ImuData& original = context_.data();
    if (!sizes.empty()) {
      theta_.assign(original.delta_theta.begin(), original.delta_theta.end());
      velocity_.assign(original.delta_v.begin(), original.delta_v.end());
      PassInput geometry = input_;
      geometry.data = &original;
      subtract_effects(context_, geometry, correction, theta_, velocity_);
      corrected_view_ = original;
      corrected_view_.delta_theta = theta_;
      corrected_view_.delta_v = velocity_;
      input_.data = &corrected_view_;
    } else {
      input_.data = &original;
    }
    for (const double sign : {+1.0, -1.0, +1.0, -1.0}) {
      input_.sign = sign;
      if (input_.held) {
        break;
      }
      const PassOutput out = run_pass(input_);
      input_.parameters += out.mean.segment<sensor_parameter_count>(out.layout.parameters());
      input_.C_nb = out.C_nb;
    }
    input_.sign = 1.0;
    rows_ = pass_.run(input_);
    evidence_ = Evidence(rows_);
    evidence_.restore(applied_columns_, applied_);
    for (const WalkTest& walk : walks_) {
      evidence_.absorb(walk.columns, walk.covariance);
    }
    const std::vector<Chosen> before = chosen_;
    refit();
    double move = 0.0;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      const Eigen::VectorXd sigma = chosen_[i].covariance.diagonal().cwiseSqrt();
      move = std::max(move, (chosen_[i].size - before[i].size).cwiseAbs().cwiseQuotient(sigma).maxCoeff());
    }
    if (sizes.empty() || move < converged_sigma) {
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
  const std::size_t applied = grid.size();  // what the recording's correction took out comes back first
  grid.insert(grid.end(), correction_.effects.begin(), correction_.effects.end());
  SignaturePass pass(context_, grid, false);
  const SignatureRows rows = pass.run(input_);
  Evidence evidence(rows);
  const auto columns_between = [&](std::size_t from, std::size_t to) {
    std::vector<int> all;
    for (std::size_t i = from; i < to; ++i) {
      const std::vector<int> columns = columns_of(pass.candidates()[i]);
      all.insert(all.end(), columns.begin(), columns.end());
    }
    return all;
  };
  const std::vector<int> others = columns_between(own, applied);
  if (applied < grid.size()) {
    evidence.restore(columns_between(applied, grid.size()), correction_.size);
  }
  std::vector<double> gain;
  for (std::size_t i = 0; i < own; ++i) {
    gain.push_back(test_group(evidence, columns_of(pass.candidates()[i]), others).gain);
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
  const std::vector<double>& all = chosen.candidate.effect->constants;
  const double least = all.empty() ? HUGE_VAL : 0.5 * *std::min_element(all.begin(), all.end());
  const double most = all.empty() ? 0.0 : 2.0 * *std::max_element(all.begin(), all.end());
  // A frequency comes from a spectrum: it lies within half a bin.
  const double bin = 1.0 / (chosen.candidate.constant * rows_.time_s.back());
  const double coarse = chosen.candidate.effect->id == "base_sway" ? 0.25 * bin : 0.2;
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
  pass_.set_constant(chosen.candidate.first, chosen.candidate.constant);
}

bool Naming::add_best() {
  const std::vector<int> others = chosen_columns();
  double best = 0.0, detected = 0.0;  // name by the one, presence by the other
  const Candidate* winner = nullptr;
  for (const Candidate& c : pass_.candidates()) {
    const bool taken = std::any_of(chosen_.begin(), chosen_.end(), [&](const Chosen& x) {
      return x.candidate.effect->id == c.effect->id && c.effect->id != "base_sway";
    });
    const bool same =
        std::any_of(chosen_.begin(), chosen_.end(), [&](const Chosen& x) { return x.candidate.first == c.first; });
    if (taken || same || fell(c)) {
      continue;
    }
    const GroupTest test = test_group(given_forms(), columns_of(c), others);
    const double log_p = corrected(test.log_detection, c.effect->id);
    if (log_p < log_threshold_ && immaterial(c, test)) {
      continue;
    }
    detected = std::min(detected, log_p);
    if (test.log_p < best) {
      best = test.log_p;
      winner = &c;
    }
  }
  const double best_equation = best;
  // A walk has one coefficient, at the edge of its range (half a chi-squared), on one of six axes.
  const WalkTest* walker = nullptr;
  std::vector<WalkTest> tests;
  tests.reserve(walk_axes);
  for (int axis = 0; axis < walk_axes; ++axis) {
    tests.push_back(test_walk(given_forms(), pass_.map(), pass_.first_map_column(), axis, others));
  }
  for (const WalkTest& test : tests) {
    const double log_p = log_chi_squared_tail(test.gain, 1.0);
    const bool taken = within_form(test) || std::any_of(walks_.begin(), walks_.end(),
                                                        [&](const WalkTest& w) { return w.axis == test.axis; });
    if (!taken) {
      detected = std::min(detected, corrected(log_p, test.axis < 3 ? "gyro_random_walk" : "accel_random_walk"));
    }
    if (!taken && log_p < best) {
      best = log_p;
      walker = &test;
    }
  }
  if (detected > log_threshold_) {
    return false;
  }
  // A walk can follow any slow curve. It is taken where it beats every equation by far; an equation whose constant is
  // still on its grid gets the benefit.
  constexpr double equation_share = 0.85;
  constexpr double jump_share = 0.6;  // what jumps is no walk: an equation that comes near it is tried first
  if (walker != nullptr && winner != nullptr) {
    const bool real = walks_inside_dwells(context_.data(), input_.noise, *walker);
    walker = best_equation < (real ? equation_share : jump_share) * best ? nullptr : walker;
  }
  if (walker != nullptr) {
    walks_.push_back(*walker);
    evidence_.absorb(walker->columns, walker->covariance);
    refit();
    size_forms();
  } else {
    chosen_.emplace_back();
    chosen_.back().candidate = *winner;
    refine_constant(chosen_.back());
    for (std::size_t i = 0; i + 1 < chosen_.size(); ++i) {  // they were found while this one was left out
      refine_constant(chosen_[i]);
    }
    rows_ = pass_.run(input_);
    evidence_ = Evidence(rows_);
    if (!applied_columns_.empty()) {
      evidence_.restore(applied_columns_, applied_);
    }
    relinearise();
  }
  return true;
}

// What fell once is not taken again: what was seen may be another's, and it would fall and be taken for ever.
bool Naming::fell(const Candidate& candidate) const {
  return std::any_of(fallen_.begin(), fallen_.end(), [&](const Candidate& f) {
    const bool line = f.effect->constants.empty();  // of a sway, one of several
    return f.effect == candidate.effect && (!line || f.first == candidate.first);
  });
}

bool Naming::drop_weak() {
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const GroupTest test = test_group(given_forms(), columns_of(chosen_[i].candidate), chosen_columns(i));
    if (corrected(test.log_detection, chosen_[i].candidate.effect->id) > log_threshold_) {
      fallen_.push_back(chosen_[i].candidate);
      chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(i));
      relinearise();
      return true;
    }
  }
  return false;
}

// An early choice may have been the least bad name: each is held against every other candidate in its place.
bool Naming::exchange() {
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const std::vector<int> others = chosen_columns(i);
    const Candidate own = chosen_[i].candidate;
    double best = test_group(evidence_, columns_of(own), others).log_p - 1.0;
    const Candidate* winner = nullptr;
    for (const Candidate& c : pass_.candidates()) {
      const bool taken = std::any_of(chosen_.begin(), chosen_.end(), [&](const Chosen& x) {
        return x.candidate.effect->id == c.effect->id;  // its own constant is refined already
      });
      if (taken || c.first == own.first) {
        continue;
      }
      const double log_p = test_group(evidence_, columns_of(c), others).log_p;
      if (log_p < best) {
        best = log_p;
        winner = &c;
      }
    }
    if (winner != nullptr) {
      chosen_[i].candidate = *winner;
      refine_constant(chosen_[i]);
      relinearise();
      return true;
    }
  }
  return false;
}

void Naming::judge() {
  std::vector<int> fold;
  for (const double t : rows_.time_s) {
    fold.push_back(static_cast<int>(context_.segment_at(t)));
  }
  Eigen::VectorXd residual = rows_.residual;
  if (!applied_columns_.empty()) {
    residual += rows_.columns(Eigen::all, applied_columns_) * applied_;
  }
  const std::vector<int> all = chosen_columns();
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    Chosen& c = chosen_[i];
    const std::vector<int> others = chosen_columns(i);
    const GroupTest own = test_group(evidence_, columns_of(c.candidate), others);
    const GroupTest marginal = test_group(given_forms(), columns_of(c.candidate), others);
    c.gain = marginal.gain;
    c.rank = marginal.rank;
    c.log_p = corrected(marginal.log_detection, c.candidate.effect->id);
    c.held_out = held_out_gain(rows_.columns, residual, fold, all, others);
    c.equivalent.clear();
    for (const Candidate& rival : pass_.candidates()) {
      const std::string& id = rival.effect->id;
      const bool listed =
          id == c.candidate.effect->id || std::find(c.equivalent.begin(), c.equivalent.end(), id) != c.equivalent.end();
      const bool chosen =
          std::any_of(chosen_.begin(), chosen_.end(), [&](const Chosen& x) { return x.candidate.effect->id == id; });
      if (listed || chosen) {
        continue;
      }
      const GroupTest test = test_group(evidence_, columns_of(rival), others);
      // As good a likelihood, or one that only its further coefficients cost: an effect that contains the other.
      if (test.log_p < own.log_p + class_log_odds || (test.gain > own.gain - 2.0 && test.log_p < 0.8 * own.log_p)) {
        c.equivalent.push_back(id);
      }
    }
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
  while (fallen && refit_velocity_noise(input_, log_likelihood)) {
    relinearise();
    fallen = drop_weak();
  }
}

std::vector<Suspect> Naming::suspects() const {
  std::vector<Suspect> all;
  const std::vector<int> others = chosen_columns();
  for (const Candidate& c : pass_.candidates()) {
    const bool chosen = std::any_of(chosen_.begin(), chosen_.end(),
                                    [&](const Chosen& x) { return x.candidate.effect->id == c.effect->id; });
    if (chosen) {
      continue;
    }
    const GroupTest test = test_group(given_forms(), columns_of(c), others);
    const double log_p = corrected(test.log_detection, c.effect->id);
    const auto same = std::find_if(all.begin(), all.end(), [&](const Suspect& s) { return s.effect == c.effect->id; });
    if (same == all.end()) {
      all.push_back({c.effect->id, log_p, test.expected_z});
    } else {
      same->log_p = std::min(same->log_p, log_p);
      same->expected_z = std::max(same->expected_z, test.expected_z);
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Suspect& a, const Suspect& b) { return a.log_p < b.log_p; });
  return all;
}

}  // namespace selfcal::diagnosis
