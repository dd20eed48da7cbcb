// Model selection over the catalogue: which effects and walks explain a recording beside the 24, the noise with them.
#pragma once

#include <functional>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/diagnosis/search/locate.hpp"
#include "estimator/diagnosis/search/remains.hpp"

namespace selfcal::diagnosis {

struct SearchOptions {
  double log_threshold = 0.0;  // of corrected p-values
  std::function<void(const std::string&)> progress = {};
  std::stop_token stop = {};
};

// A term of the answer.
struct NamedTerm : Term {
  double log_p = 0.0;  // given the others, corrected for variants and effects
  double delta_chi2 = 0.0;
  int rank = 0;
  double held_out = 0.0;  // log-likelihood on dwells and rotations left out in turn
  std::vector<const Effect*> equivalent;
  std::map<const Effect*, double> probability;  // of every effect in this one's place, all equally likely before
};

struct Suspect {
  const Effect* effect = nullptr;
  double log_p = 0.0;
  double expected_z = 0.0;  // that a typical size would give
};

// What the recording shows, without what is named or with it.
struct Shown {
  double square = 0.0;  // of the innovations
  double log_p_white = 0.0;
  Map map;
};

// What an open form takes up.
struct OpenForm {
  FormKind kind = FormKind::in_turns;
  const Effect* effect = nullptr;
  double square = 0.0;
};

struct SearchResult {
  std::vector<NamedTerm> named;  // most significant first, amplitudes averaged
  std::vector<BiasProcess> processes;
  NoiseModel noise;  // as filtered, beside what is named
  double rows = 0.0;
  double log_p_limit =
      0.0;  // of one test's p, not corrected: as many independent ones as the catalogue and the walks count for
  Shown before, after;
  Structure structure;
  double log_p_lack_of_fit = 0.0;
  bool collinear = false;
  double misfit = 1.0;  // of the recording, at least 1: what shares are of
  std::vector<OpenForm> open_forms;
  double square_of_forms = 0.0;
  Map map_without_forms;  // with the effects as equations alone
  // Every effect of the catalogue, nothing else fitted; best variant of every effect not named, given what is.
  std::vector<Suspect> prospects, suspects;
  // The 24 as a mean over all explanations, and with the effects as named.
  ParameterVector value = ParameterVector::Zero(), value_as_named = ParameterVector::Zero();
  ParameterMatrix covariance = ParameterMatrix::Zero(), open_beside_named = ParameterMatrix::Zero();
  Stage stage;  // where the search ended

  bool empty() const { return named.empty() && processes.empty(); }
};

// `input`: forward pass about the calibrated recording.
SearchResult search(const RecordingContext& context, const PassInput& input, const SearchOptions& options);

}  // namespace selfcal::diagnosis
