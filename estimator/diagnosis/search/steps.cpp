#include "estimator/diagnosis/search/steps.hpp"

#include <algorithm>
#include <utility>

#include "estimator/diagnosis/noise/process_check.hpp"
#include "estimator/diagnosis/noise/velocity_noise.hpp"
#include "estimator/diagnosis/search/bias_noise.hpp"
#include "estimator/diagnosis/search/constants.hpp"

namespace selfcal::diagnosis {
namespace {

// Square of what an equation leaves that is right to 3 % of its amplitude, over its own.
constexpr double form_square = 1e-3;

bool of_spectrum(const Effect& effect) { return effect.constant.kind == EffectConstant::Kind::spectrum; }

// Largest square among the terms that `counts`.
template <typename Counts>
double largest_square(const Stage& stage, Counts counts) {
  double largest = 0.0;
  for (const Candidate& c : stage.model.terms()) {
    if (counts(*c.effect)) {
      largest = std::max(largest, test_group(stage.model.evidence(), columns_of(c), {}).delta_chi2);
    }
  }
  return largest;
}

// A bias that wanders by less than what the named effect's form may be off by.
bool within_form(const Stage& stage, const BiasProcess& process) {
  const bool of_gyro = process.of_gyro();
  return process.delta_chi2 <
         form_square * largest_square(
                           stage, [&](const Effect& effect) { return (effect.triad == Triad::gyro) == of_gyro; });
}

// A further effect that says nothing: within what the named ones' forms may be off by, smaller than a tenth of what such sensors
// typically show (nobody would look for it), and moving none of the 24 by half a sigma (nobody would miss it).
bool immaterial(const Stage& stage, const Candidate& candidate, const GroupTest& test) {
  constexpr double typical_share = 0.1, noticed_sigma = 0.5;
  if (stage.hypothesis().terms.empty() ||
      test.delta_chi2 > form_square * largest_square(stage, [](const Effect&) { return true; })) {
    return false;
  }
  std::vector<int> all = stage.columns();
  const std::vector<int> own = columns_of(candidate);
  all.insert(all.end(), own.begin(), own.end());
  const Eigen::VectorXd size = stage.given_forms().fit(all).value.tail(candidate.count);
  if (size.cwiseAbs().maxCoeff() > typical_share) {
    return false;
  }
  const ParameterVector sigma = stage.model.covariance().diagonal().cwiseSqrt();
  const ParameterVector shift = stage.model.rows().shift.middleCols(candidate.first, candidate.count) * size;
  return shift.cwiseAbs().cwiseQuotient(sigma).maxCoeff() < noticed_sigma;
}

// The p-values of coloured noise rest on a spectrum that was estimated from the same recording: a name must be worth its
// coefficients by BIC too, when it is taken and beside all that came after it.
bool dear(const SearchGround& ground, const GroupTest& test) {
  return !is_white(ground.context.colour()) && test.delta_chi2 < test.rank * std::log(ground.significance.rows);
}

std::optional<std::size_t> dear_term(const SearchGround& ground, const Stage& stage) {
  const std::vector<Candidate>& terms = stage.model.terms();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (dear(ground, test_group(stage.given_forms(), columns_of(terms[i]), columns_of(terms, i)))) {
      return i;
    }
  }
  return std::nullopt;
}

// Whether it may be taken: of the lines of a spectrum each once, of other effects one; and nothing that fell.
bool is_open(const Selection& s, const Variant& v) {
  const auto takes_its_place = [&](const Variant& x) {
    return x.effect == v.effect && (!of_spectrum(*v.effect) || same(x, v));
  };
  return std::none_of(s.hypothesis.terms.begin(), s.hypothesis.terms.end(), takes_its_place) &&
         std::none_of(s.fallen.begin(), s.fallen.end(), takes_its_place);
}

// The variant that a candidate of the stage's model is.
const Variant& variant_of(const Stage& stage, const Candidate& candidate) {
  const std::vector<Candidate>& all = stage.model.alternatives();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Candidate& c) { return c.first == candidate.first; });
  return stage.selection.alternatives[static_cast<std::size_t>(found - all.begin())];
}

Term term_of(const Variant& variant) {
  Term term;
  static_cast<Variant&>(term) = variant;
  return term;
}

std::vector<BiasProcess> processes_to_test(const Stage& stage) {
  std::vector<BiasProcess> processes;
  for (const std::vector<int>& axes : open_axes(stage.hypothesis())) {
    processes.push_back(test_bias_process(stage.given_forms(), stage.model.map(), stage.model.first_map_column(), axes,
                                          stage.columns()));
  }
  std::erase_if(processes, [&](const BiasProcess& w) { return within_form(stage, w); });
  return processes;
}

// A strong one of the accelerometers bends the attitude, and the columns of the gyros' biases take it up: the best of either
// triad, for the filter to decide.
std::vector<BiasProcess> best_of_triads(const SearchGround& ground, const BiasProcess& best,
                                        const std::vector<BiasProcess>& all) {
  std::vector<BiasProcess> chosen = {best};
  const BiasProcess* other = nullptr;
  for (const BiasProcess& p : all) {
    if (p.of_gyro() != best.of_gyro() && ground.significance.holds(ground.significance.corrected(p.log_p())) &&
        (other == nullptr || p.log_p() < other->log_p())) {
      other = &p;
    }
  }
  if (other != nullptr) {
    chosen.push_back(*other);
  }
  return chosen;
}

Stage with_noise(const SearchGround& ground, const Stage& stage, const NoiseModel& noise) {
  Selection selection = stage.selection;
  selection.hypothesis.noise = noise;
  return settled(ground.context, stage, std::move(selection));
}

}  // namespace

double log_likelihood(const SearchGround& ground, const Stage& stage, const NoiseModel& noise) {
  Hypothesis h = stage.hypothesis();
  h.noise = noise;
  if (h.terms.empty() && is_white(ground.context.colour()) && !ground.context.reference()) {
    return run_pass(stage.point.pass(noise)).log_likelihood;
  }
  return LinearModel::about(ground.context, stage.point, h, {}, false).log_likelihood();
}

std::optional<Stage> add_best(const SearchGround& ground, const Stage& stage) {
  std::vector<Candidate> alternatives;
  for (std::size_t k = 0; k < stage.model.alternatives().size(); ++k) {
    if (is_open(stage.selection, stage.selection.alternatives[k])) {
      alternatives.push_back(stage.model.alternatives()[k]);
    }
  }
  const auto goes_on = [&](const BiasProcess& process) {
    return goes_on_inside_dwells(ground.context.data(), stage.hypothesis().noise, process);
  };
  const auto says_nothing = [&](const Candidate& c, const GroupTest& test) {
    return immaterial(stage, c, test) || dear(ground, test);
  };
  const std::vector<BiasProcess> processes = processes_to_test(stage);
  const auto found = best_addition(stage.given_forms(), stage.columns(), alternatives, processes, ground.significance,
                                   goes_on, says_nothing);
  if (!found) {
    return std::nullopt;
  }
  if (found->process) {
    const bool in_filter = stage.hypothesis().noise.axes && !ground.context.reference();
    return with_process(ground, stage,
                        in_filter ? best_in_filter(ground, stage) : best_of_triads(ground, *found->process, processes),
                        ground.significance);
  }
  Selection selection = stage.selection;
  selection.hypothesis.terms.push_back(term_of(variant_of(stage, *found->term)));
  selection = with_constants_followed(ground.context, stage, std::move(selection), true);
  return settled(ground.context, linearised(ground.context, stage.point, selection), selection);
}

std::optional<Stage> drop_weak(const SearchGround& ground, const Stage& stage) {
  auto weak = weak_term(stage.given_forms(), stage.model.terms(), ground.significance);
  weak = weak ? weak : dear_term(ground, stage);
  if (!weak) {
    return std::nullopt;
  }
  Selection selection = stage.selection;
  selection.fallen.push_back(selection.hypothesis.terms[*weak]);
  selection.hypothesis = without_term(std::move(selection.hypothesis), *weak);
  return settled(ground.context, stage, std::move(selection));
}

std::optional<Stage> exchange(const SearchGround& ground, const Stage& stage) {
  const auto found = better_exchange(stage.model.evidence(), stage.model.terms(), stage.model.alternatives());
  if (!found) {
    return std::nullopt;
  }
  Selection selection = stage.selection;
  selection.hypothesis.terms[found->term] = term_of(variant_of(stage, found->by));
  selection = with_constant_followed(ground.context, stage, std::move(selection), found->term);
  return settled(ground.context, stage, std::move(selection));
}

std::optional<Stage> drop_weak_process(const SearchGround& ground, const Stage& stage) {
  const std::vector<BiasProcess>& all = stage.hypothesis().processes;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double left = log_chi_squared_tail(std::max(0.0, gain_of_process(ground, stage, i)), all[i].coefficients());
    if (!ground.significance.holds(ground.significance.corrected(left))) {
      const Stage without = without_process(ground, stage, i);
      // The constants were found beside it.
      const Selection selection = with_constants_followed(ground.context, without, without.selection, false);
      return settled(ground.context, linearised(ground.context, without.point, selection), selection);
    }
  }
  return std::nullopt;
}

std::optional<Stage> sharpen_observation(const SearchGround& ground, const Stage& stage) {
  constexpr double factor = 1.0 / 3.0, least = 0.9e-6;  // m
  NoiseModel noise = stage.hypothesis().noise;
  if (stage.hypothesis().empty() || noise.observation.state_count() > 0 || noise.axes) {
    return std::nullopt;
  }
  const double before = noise.observation.sigma;
  double best = log_likelihood(ground, stage, noise);
  for (NoiseModel trial = noise; (trial.observation.sigma *= factor) > least;) {
    const double found = log_likelihood(ground, stage, trial);
    if (found < best) {
      break;
    }
    best = found;
    noise = trial;
  }
  if (noise.observation.sigma == before) {
    return std::nullopt;
  }
  return with_noise(ground, stage, noise);
}

std::optional<Stage> refit_noise(const SearchGround& ground, const Stage& stage) {
  // A colour is in units of the densities that it was found beside.
  if (stage.hypothesis().empty() || !is_white(ground.context.colour())) {
    return std::nullopt;
  }
  const auto noise = refit_velocity_noise(
      stage.hypothesis().noise, [&](const NoiseModel& trial) { return log_likelihood(ground, stage, trial); });
  if (!noise) {
    return std::nullopt;
  }
  return with_noise(ground, stage, *noise);
}

}  // namespace selfcal::diagnosis
