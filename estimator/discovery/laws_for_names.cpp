#include "estimator/discovery/laws_for_names.hpp"

#include <algorithm>
#include <utility>

#include "estimator/discovery/explanation_cost.hpp"
#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery {
namespace {

// Square of the residuals of `less`, the recording with something taken out, in its own noise: squares in two noises cannot be compared.
double square_without_names(const UnitRecording& recording, const ImuData& less, const std::stop_token& stop) {
  const Scene scene(recording);
  PassInput input = scene.input;
  input.data = &less;
  return sum_over_pieces(scene.motion, input, trace_pass(input, stop), stop).sums.square;
}

}  // namespace

bool names_stand_alone(const diagnosis::Diagnosis& d) {
  const bool of_sensor = std::any_of(d.model.begin(), d.model.end(),
                                     [](const diagnosis::ModelEffect& m) { return m.effect->sensor != nullptr; });
  const bool process =
      std::any_of(d.findings.begin(), d.findings.end(), [](const diagnosis::Finding& f) { return f.process; });
  return d.verdict == diagnosis::DiagnosisVerdict::named && d.faults.empty() && of_sensor && !process &&
         !d.unexplained && !d.remainder;
}

std::optional<LawsForNames> laws_for_names(const UnitRecording& recording, const diagnosis::Diagnosis& d,
                                           double least_log_odds, const DiscoveryOptions& of_laws,
                                           const Progress& progress) {
  if (!names_stand_alone(d)) {
    return std::nullopt;
  }
  // Twice the logarithm of odds, as costs are. What names take up beside each other is more than what each does alone.
  constexpr double of_all = 0.9;
  double taken_up = 0.0;
  for (const diagnosis::ModelEffect& name : d.model) {
    taken_up += of_all * square_of(name);
  }
  DiscoveryOptions options = of_laws;
  options.least_gain = std::max(1.0, taken_up + 2.0 * least_log_odds);
  LawSearch search({&recording, 1}, options, progress);
  const Discovery& found = search.fitted();
  if (found.fit.terms.empty() || !found.processes.empty() || of_laws.stop.stop_requested()) {
    return std::nullopt;
  }
  const DiagnosedRecording with_names{recording.data, d};
  const auto less_names = UnexplainedRest::of({&with_names, 1}, of_laws.stop);
  if (!less_names) {
    return std::nullopt;
  }
  const double left = square_without_names(recording, less_names->recordings().front().data, of_laws.stop);
  const double by_names = left + cost_of_names(d.model, found.rows);
  const double by_laws = found.misfit_after + found.rows + cost_of_laws(found.fit.terms.size(), found.rows);
  const double log_odds = 0.5 * (by_names - by_laws);
  return log_odds < least_log_odds ? std::nullopt : std::optional(LawsForNames{std::move(search), log_odds});
}

}  // namespace selfcal::discovery
