#include "estimator/diagnosis/search/search.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/effects/families.hpp"
#include "estimator/diagnosis/regression/multiplicity.hpp"
#include "estimator/diagnosis/search/averaging.hpp"
#include "estimator/diagnosis/search/bias_noise.hpp"
#include "estimator/diagnosis/search/squares.hpp"
#include "estimator/diagnosis/search/steps.hpp"
#include "estimator/statistics/whiteness.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t most_effects = 6;
constexpr int most_exchanges = 3;
constexpr double processes_tested = 8.0;  // six axes, two triads
const double line_log_p = std::log(1e-4);

bool of_spectrum(const Effect& effect) { return effect.constant.kind == EffectConstant::Kind::spectrum; }

// A base sways within the dwells. What swings more slowly than the gimbal turns is whatever differs from one position to the next: a
// drift with the product of two forces, at positions that alternate, is a line at half the turns' frequency.
double slowest_sway_hz(const RecordingContext& context) {
  constexpr double within = 0.9;  // of the shortest time from turn to turn
  const std::vector<Turn>& turns = context.turns();
  double shortest_s = context.data().time_s.back() - context.data().time_s.front();
  for (std::size_t k = 1; k < turns.size(); ++k) {
    shortest_s = std::min(shortest_s, turns[k].start_s - turns[k - 1].start_s);
  }
  return 1.0 / (within * shortest_s);
}

// Frequencies of the lines from `least_hz` on, each once.
std::vector<double> frequencies_of(const std::vector<InnovationLine>& lines, double least_hz) {
  constexpr double apart_hz = 1e-3;
  std::vector<double> known;
  for (const InnovationLine& line : lines) {
    const bool near =
        std::any_of(known.begin(), known.end(), [&](double f) { return std::abs(f - line.frequency_hz) < apart_hz; });
    if (line.log_p < line_log_p && line.frequency_hz >= least_hz && !near) {
      known.push_back(line.frequency_hz);
    }
  }
  return known;
}

std::vector<Variant> variants_for(const RecordingContext& context, const std::vector<double>& frequencies_hz) {
  std::vector<Variant> all;
  for (const Effect& effect : catalogue()) {
    if (applies(effect, context.has_temperature())) {
      for (const double constant : of_spectrum(effect) ? frequencies_hz : effect.constant.tried()) {
        all.push_back({&effect, constant, constant});
      }
    }
  }
  return all;
}

// Nothing named, every effect an alternative.
Stage first_stage(const RecordingContext& context, const PassInput& input) {
  const OperatingPoint point{input, CorrectedRecording(context.data())};
  Selection selection;
  selection.hypothesis.noise = input.noise;
  selection.alternatives = variants_for(context, {});
  Stage stage = linearised(context, point, selection);
  const std::vector<double> frequencies =
      frequencies_of(innovation_lines(stage.model.rows(), input.interval_s), slowest_sway_hz(context));
  if (!frequencies.empty()) {
    selection.alternatives = variants_for(context, frequencies);
    stage = linearised(context, point, selection);
  }
  return stage;
}

// The catalogue's tests on this recording (multiplicity.hpp) and the bias processes: of each a walk, at the edge of its range, and an instability.
Significance significance_on(const Stage& first, double log_threshold) {
  const double of_effects =
      effective_tests(first.model.evidence(), first.model.alternatives(), std::exp(log_threshold));
  return {log_threshold, of_effects + 1.5 * processes_tested, first.model.evidence().rows};
}

// Replaces the stage where the step was taken.
bool taken(Stage& stage, std::optional<Stage> next) {
  if (next) {
    stage = std::move(*next);
  }
  return next.has_value();
}

Stage course(const SearchGround& ground, Stage s, const SearchOptions& options) {
  const auto goes_on = [&] { return !options.stop.stop_requested(); };
  const auto room = [&] { return goes_on() && s.hypothesis().size() < most_effects; };
  while (room() && taken(s, add_best(ground, s))) {
    if (options.progress) {
      options.progress(std::to_string(s.hypothesis().size()) + " effects fitted");
    }
    taken(s, drop_weak(ground, s));
  }
  for (int round = 0; round < most_exchanges && goes_on() && taken(s, exchange(ground, s)); ++round) {
    while (taken(s, drop_weak(ground, s))) {
    }
  }
  taken(s, refit_processes(ground, s));
  while (goes_on() && taken(s, drop_weak_process(ground, s))) {
  }
  taken(s, sharpen_observation(ground, s));
  // Under noise that no longer holds them the names are tested again; where one falls the noise is fitted without it.
  while (taken(s, refit_noise(ground, s)) && taken(s, drop_weak(ground, s))) {
  }
  while (room() && taken(s, explain_remainder(ground, s))) {
  }
  while (room() && taken(s, add_best(ground, s))) {
  }
  return s;
}

// Best variant of every effect that does not count as `left_out`, in the order of the alternatives.
template <typename LeftOut>
std::vector<Suspect> best_of_each(const Stage& stage, const Evidence& evidence, const std::vector<int>& others,
                                  const Significance& significance, LeftOut left_out) {
  std::vector<Suspect> all;
  for (const Candidate& c : stage.model.alternatives()) {
    if (left_out(*c.effect)) {
      continue;
    }
    const GroupTest test = test_group(evidence, columns_of(c), others);
    const double log_p = significance.corrected(test.log_detection, *c.effect);
    const auto same = std::find_if(all.begin(), all.end(), [&](const Suspect& s) { return s.effect == c.effect; });
    if (same == all.end()) {
      all.push_back({c.effect, log_p, test.expected_z});
    } else {
      same->log_p = std::min(same->log_p, log_p);
      same->expected_z = std::max(same->expected_z, test.expected_z);
    }
  }
  return all;
}

// What a typical size of every effect would give; an effect of the spectrum without a line has none.
std::vector<Suspect> prospects_of(const Stage& first, const RecordingContext& context,
                                  const Significance& significance) {
  const std::vector<Suspect> seen =
      best_of_each(first, first.model.evidence(), {}, significance, [](const Effect&) { return false; });
  std::vector<Suspect> all;
  for (const Effect& effect : catalogue()) {
    if (applies(effect, context.has_temperature())) {
      const auto found = std::find_if(seen.begin(), seen.end(), [&](const Suspect& s) { return s.effect == &effect; });
      all.push_back(found == seen.end() ? Suspect{&effect, 0.0, 0.0} : *found);
    }
  }
  return all;
}

std::vector<Suspect> suspects_of(const Stage& stage, const Significance& significance) {
  std::vector<Suspect> all = best_of_each(stage, stage.given_forms(), stage.columns(), significance,
                                          [&](const Effect& effect) { return stage.hypothesis().names(effect); });
  std::stable_sort(all.begin(), all.end(), [](const Suspect& a, const Suspect& b) { return a.log_p < b.log_p; });
  return all;
}

// With the amplitudes of the averages.
Hypothesis averaged(Hypothesis h, const Averages& averages) {
  for (std::size_t i = 0; i < h.terms.size(); ++i) {
    h.terms[i].amplitude = averages.terms[i].amplitude;
    h.terms[i].covariance = averages.terms[i].covariance;
    h.terms[i].constant_sigma = averages.terms[i].constant_sigma;
  }
  return h;
}

std::vector<NamedTerm> named_terms(const RecordingContext& context, const Stage& stage, const Hypothesis& reported,
                                   const Averages& averages, const Significance& significance) {
  std::vector<int> fold;  // by dwells and rotations
  for (const double t : stage.model.rows().time_s) {
    fold.push_back(static_cast<int>(context.segment_at(t)));
  }
  const Eigen::VectorXd residual = stage.model.residual();
  const std::vector<Candidate>& terms = stage.model.terms();
  std::vector<NamedTerm> named;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const std::vector<int> others = columns_of(terms, i);
    const GroupTest marginal = test_group(stage.given_forms(), columns_of(terms[i]), others);
    NamedTerm n;
    static_cast<Term&>(n) = reported.terms[i];
    n.delta_chi2 = marginal.delta_chi2;
    n.rank = marginal.rank;
    n.log_p = significance.corrected(marginal.log_detection, *n.effect);
    n.held_out = held_out_gain(stage.model.rows().columns, residual, fold, stage.columns(), others);
    n.equivalent = equivalents(stage.model.evidence(), terms, i, stage.model.alternatives());
    n.probability = averages.terms[i].probability;
    named.push_back(std::move(n));
  }
  std::stable_sort(named.begin(), named.end(),
                   [](const NamedTerm& a, const NamedTerm& b) { return a.log_p < b.log_p; });
  return named;
}

Map map_of(const Stage& stage, const Evidence& evidence, const std::vector<int>& fitted) {
  return locate(evidence, stage.model.map(), stage.model.first_map_column(), fitted);
}

Shown shown_before(const Stage& first) {
  return {first.model.evidence().square, test_whiteness(first.model.rows().residual).log_p,
          map_of(first, first.model.evidence(), {})};
}

Shown shown_after(const Stage& stage) {
  const Evidence& given = stage.given_forms();
  const std::vector<int> fitted = stage.columns();
  const OpenForms& forms = stage.forms.open;
  return {given.square - given.fit(fitted).delta_chi2,
          test_whiteness(stage.model.residual_after(fitted, forms.columns, forms.mean)).log_p,
          map_of(stage, given, fitted)};
}

// Without what roundings or a prior make negative.
ParameterMatrix positive_part(const ParameterMatrix& matrix) {
  const ParameterVector scale = matrix.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::SelfAdjointEigenSolver<ParameterMatrix> solver(scale.cwiseInverse().asDiagonal() * matrix *
                                                              scale.cwiseInverse().asDiagonal());
  const ParameterMatrix root =
      scale.asDiagonal() * solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  return root * root.transpose();
}

// What may stand in a term's place; where squares of other axes are named, but for the square of the own one: add_squares weighs that.
std::vector<Candidate> rivals_of(const Stage& stage) {
  std::vector<Candidate> rivals = stage.model.alternatives();
  const std::vector<Term>& terms = stage.hypothesis().terms;
  if (std::any_of(terms.begin(), terms.end(), [](const Term& t) { return has_squares_of_others(*t.effect); })) {
    std::erase_if(rivals, [](const Candidate& c) { return has_square_of_own(*c.effect); });
  }
  return rivals;
}

// Where squares of other axes are named: that they may be the square of the own one.
void add_squares(const Stage& stage, const Hypothesis& reported, SearchResult& result) {
  constexpr double of_the_class = 0.01;
  for (std::size_t i = 0; i < reported.terms.size(); ++i) {
    const Term& term = reported.terms[i];
    if (!has_squares_of_others(*term.effect)) {
      continue;
    }
    const SquaresAverage average = average_squares(
        term, stage.model.rows().shift(Eigen::all, columns_of(stage.model.terms()[i])), stage.model.evidence().rows);
    result.value += average.shift;
    result.covariance += average.covariance;
    const auto named = std::find_if(result.named.begin(), result.named.end(),
                                    [&](const NamedTerm& n) { return n.effect == term.effect; });
    if (average.own_square > of_the_class && named != result.named.end()) {
      const Effect* own = &*std::find_if(catalogue().begin(), catalogue().end(), has_square_of_own);
      for (auto& [effect, probability] : named->probability) {
        probability *= 1.0 - average.own_square;
      }
      named->probability[own] = average.own_square;
      if (std::find(named->equivalent.begin(), named->equivalent.end(), own) == named->equivalent.end()) {
        named->equivalent.push_back(own);
      }
    }
  }
}

// The 24 with the terms as reported, and as a mean over all explanations with its covariance.
void report_parameters(const Stage& stage, const Hypothesis& reported, const Averages& averages, SearchResult& result) {
  const Eigen::MatrixXd& shift = stage.model.rows().shift;
  const OpenForms& forms = stage.forms.open;
  const std::vector<int> columns = stage.columns();
  Eigen::VectorXd amplitudes(static_cast<Eigen::Index>(columns.size()));
  Eigen::Index at = 0;
  for (const Term& t : reported.terms) {
    amplitudes.segment(at, t.amplitude.size()) = t.amplitude;
    at += t.amplitude.size();
  }
  result.value_as_named = stage.model.parameters(columns, amplitudes);
  result.value = stage.model.parameters() + averages.shift;
  result.covariance = stage.model.covariance() + averages.shift_covariance + covariance_of_closed_forms(stage);
  const KindAverage kinds = average_kinds(stage);
  result.value += kinds.shift;
  result.covariance += kinds.covariance;
  if (!forms.empty()) {
    const Eigen::MatrixXd S = shift(Eigen::all, forms.columns);
    result.value += S * forms.mean;
    result.covariance += S * forms.covariance * S.transpose();
  }
  add_squares(stage, reported, result);
  const Eigen::MatrixXd S = shift(Eigen::all, columns);
  const ParameterMatrix as_named =
      stage.model.covariance() + S * stage.model.evidence().fit(columns).covariance * S.transpose();
  const ParameterVector apart = result.value - result.value_as_named;
  result.open_beside_named = positive_part(result.covariance - as_named + apart * apart.transpose());
}

void report_forms(const Stage& stage, SearchResult& result) {
  const OpenForms& forms = stage.forms.open;
  for (const FormFamily& f : forms.families) {
    result.open_forms.push_back({f.kind, stage.hypothesis().terms[f.term].effect, f.square});
  }
  result.square_of_forms = forms.square;
  if (!forms.empty()) {
    result.map_without_forms = map_of(stage, stage.model.evidence(), stage.columns());
  }
}

}  // namespace

SearchResult search(const RecordingContext& context, const PassInput& input, const SearchOptions& options) {
  SearchResult result;
  Stage first = first_stage(context, input);
  const SearchGround ground{context, significance_on(first, options.log_threshold)};
  result.before = shown_before(first);
  result.prospects = prospects_of(first, context, ground.significance);
  Stage stage = course(ground, std::move(first), options);
  const WithConstants with = with_constants(context, stage);
  const Averages averages =
      average_explanations(with.model.evidence(), with.model.rows().shift, with.terms, rivals_of(stage));
  const Hypothesis reported = averaged(stage.hypothesis(), averages);
  result.log_p_lack_of_fit = log_p_of_lack_of_fit(context, stage, with, reported);
  result.named = named_terms(context, stage, reported, averages, ground.significance);
  result.processes = reported.processes;
  result.noise = reported.noise;
  result.rows = stage.model.evidence().rows;
  result.log_p_limit = options.log_threshold - std::log(ground.significance.independent_tests);
  result.after = shown_after(stage);
  result.structure = structure_left(stage);
  result.collinear = any_collinear(stage.model, reported);
  result.misfit = std::max(1.0, stage.model.evidence().square - result.rows);
  report_forms(stage, result);
  result.suspects = suspects_of(stage, ground.significance);
  report_parameters(stage, reported, averages, result);
  result.stage = std::move(stage);
  return result;
}

}  // namespace selfcal::diagnosis
