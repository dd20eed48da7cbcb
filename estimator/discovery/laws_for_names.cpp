#include "estimator/discovery/laws_for_names.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "estimator/discovery/explanation_cost.hpp"
#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery {
namespace {

// Square of the residuals of `less`, the recording with something taken out, in its own noise: squares in two noises cannot be compared.
double square_in_its_noise(const UnitRecording& recording, const ImuData& less, const std::stop_token& stop) {
  const Scene scene(recording);
  PassInput input = scene.input;
  input.data = &less;
  return sum_over_pieces(scene.motion, input, trace_pass(input, stop), stop).sums.square;
}

// Each effect once, as the recording has it that shows it best: one unit has one physics.
std::vector<diagnosis::ModelEffect> names_of(std::span<const DiagnosedRecording> unit) {
  std::vector<diagnosis::ModelEffect> all;
  for (const DiagnosedRecording& r : unit) {
    for (const diagnosis::ModelEffect& name : r.diagnosis.model) {
      const auto same = std::find_if(all.begin(), all.end(), [&](const auto& m) { return m.effect == name.effect; });
      if (same == all.end()) {
        all.push_back(name);
      } else if (square_of(name) > square_of(*same)) {
        *same = name;
      }
    }
  }
  return all;
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

std::optional<LawsForNames> laws_for_names(std::span<const DiagnosedRecording> unit,
                                           std::span<const UnitRecording> as_they_are, double least_log_odds,
                                           const DiscoveryOptions& of_laws, const Progress& progress) {
  const auto stands = [](const DiagnosedRecording& r) { return names_stand_alone(r.diagnosis); };
  const auto explained = [&](const DiagnosedRecording& r) {
    return stands(r) || r.diagnosis.verdict == diagnosis::DiagnosisVerdict::adequate;
  };
  if (!std::any_of(unit.begin(), unit.end(), stands) || !std::all_of(unit.begin(), unit.end(), explained)) {
    return std::nullopt;
  }
  // Twice the logarithm of odds, as costs are. What names take up beside each other is more than what each does alone.
  constexpr double of_all = 0.9;
  double taken_up = 0.0;
  for (const DiagnosedRecording& r : unit) {
    for (const diagnosis::ModelEffect& name : r.diagnosis.model) {
      taken_up += of_all * square_of(name);
    }
  }
  DiscoveryOptions options = of_laws;
  options.least_gain = std::max(1.0, taken_up + 2.0 * least_log_odds);
  LawSearch search(as_they_are, options, progress);
  const Discovery& found = search.fitted();
  if (found.fit.terms.empty() || !found.processes.empty() || of_laws.stop.stop_requested()) {
    return std::nullopt;
  }
  double by_names = cost_of_names(names_of(unit), found.rows);
  for (std::size_t r = 0; r < unit.size(); ++r) {
    const auto less_names = UnexplainedRest::of(unit.subspan(r, 1), of_laws.stop);
    if (!less_names) {
      return std::nullopt;
    }
    by_names += square_in_its_noise(as_they_are[r], less_names->recordings().front().data, of_laws.stop);
  }
  const double by_laws = found.misfit_after + found.rows + cost_of_laws(found.fit.terms.size(), found.rows);
  const double log_odds = 0.5 * (by_names - by_laws);
  return log_odds < least_log_odds ? std::nullopt : std::optional(LawsForNames{std::move(search), log_odds});
}

}  // namespace selfcal::discovery
