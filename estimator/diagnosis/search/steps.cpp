#include "estimator/diagnosis/search/steps.hpp"

#include <algorithm>
#include <utility>

#include "estimator/diagnosis/noise/velocity_noise.hpp"
#include "estimator/diagnosis/noise/walk_check.hpp"
#include "estimator/diagnosis/search/constants.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr int walk_axes = 6;

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
bool within_form(const Stage& stage, const RandomWalk& walk) {
  const bool of_gyro = walk.axis < 3;
  return walk.delta_chi2 <
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

std::vector<RandomWalk> walks_to_test(const Stage& stage) {
  const std::vector<RandomWalk>& named = stage.hypothesis().walks;
  std::vector<RandomWalk> walks;
  for (int axis = 0; axis < walk_axes; ++axis) {
    if (std::none_of(named.begin(), named.end(), [&](const RandomWalk& w) { return w.axis == axis; })) {
      walks.push_back(
          test_walk(stage.given_forms(), stage.model.map(), stage.model.first_map_column(), axis, stage.columns()));
    }
  }
  std::erase_if(walks, [&](const RandomWalk& w) { return within_form(stage, w); });
  return walks;
}

// Of the recording, corrected as it is, with the amplitudes of what is named fitted under this noise.
double log_likelihood(const SearchGround& ground, const Stage& stage, const NoiseModel& noise) {
  Hypothesis h = stage.hypothesis();
  h.noise = noise;
  return h.empty() ? run_pass(stage.point.pass(noise)).log_likelihood
                   : LinearModel::about(ground.context, stage.point, h, {}, false).log_likelihood();
}

Stage with_noise(const SearchGround& ground, const Stage& stage, const NoiseModel& noise) {
  Selection selection = stage.selection;
  selection.hypothesis.noise = noise;
  return settled(ground.context, stage, std::move(selection));
}

}  // namespace

std::optional<Stage> add_best(const SearchGround& ground, const Stage& stage) {
  std::vector<Candidate> alternatives;
  for (std::size_t k = 0; k < stage.model.alternatives().size(); ++k) {
    if (is_open(stage.selection, stage.selection.alternatives[k])) {
      alternatives.push_back(stage.model.alternatives()[k]);
    }
  }
  const auto goes_on = [&](const RandomWalk& walk) {
    return walks_inside_dwells(ground.context.data(), stage.hypothesis().noise, walk);
  };
  // The p-values of coloured noise rest on a spectrum that was estimated from the same recording: a name must be worth its
  // coefficients by BIC too.
  const bool coloured = !is_white(ground.context.colour());
  const auto says_nothing = [&](const Candidate& c, const GroupTest& test) {
    return immaterial(stage, c, test) || (coloured && test.delta_chi2 < test.rank * std::log(ground.significance.rows));
  };
  const auto found = best_addition(stage.given_forms(), stage.columns(), alternatives, walks_to_test(stage),
                                   ground.significance, goes_on, says_nothing);
  if (!found) {
    return std::nullopt;
  }
  if (found->walk) {
    std::vector<RandomWalk> walks = stage.hypothesis().walks;
    walks.push_back(*found->walk);
    return with_walks(ground.context, stage, std::move(walks));
  }
  Selection selection = stage.selection;
  selection.hypothesis.terms.push_back(term_of(variant_of(stage, *found->term)));
  selection = with_constants_followed(ground.context, stage, std::move(selection), true);
  return settled(ground.context, linearised(ground.context, stage.point, selection), selection);
}

std::optional<Stage> drop_weak(const SearchGround& ground, const Stage& stage) {
  const auto weak = weak_term(stage.given_forms(), stage.model.terms(), ground.significance);
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

std::optional<Stage> drop_weak_walk(const SearchGround& ground, const Stage& stage) {
  const std::vector<RandomWalk>& walks = stage.hypothesis().walks;
  for (std::size_t i = 0; i < walks.size(); ++i) {
    std::vector<RandomWalk> others = walks;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const Stage without = with_walks(ground.context, stage, std::move(others));
    const RandomWalk left = test_walk(without.given_forms(), without.model.map(), without.model.first_map_column(),
                                      walks[i].axis, without.columns());
    if (!ground.significance.holds(ground.significance.corrected(log_chi_squared_tail(left.delta_chi2, 1.0)))) {
      // The constants were found beside the walk.
      const Selection selection = with_constants_followed(ground.context, without, without.selection, false);
      return settled(ground.context, linearised(ground.context, without.point, selection), selection);
    }
  }
  return std::nullopt;
}

std::optional<Stage> sharpen_observation(const SearchGround& ground, const Stage& stage) {
  constexpr double factor = 1.0 / 3.0, least = 0.9e-6;  // m
  NoiseModel noise = stage.hypothesis().noise;
  if (stage.hypothesis().empty() || noise.observation.state_count() > 0) {
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
