#include "daemon/estimate/analysis.hpp"

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/search_beyond.hpp"
#include "daemon/estimate/unit_answer.hpp"
#include "estimator/diagnosis/effects/catalogue.hpp"

namespace selfcal {

Cause cause_of(const ImuData& data, const diagnosis::DiagnosisOptions& options,
               const std::function<void(const std::string& step)>& step) {
  diagnosis::DiagnosisOutcome outcome = diagnosis::diagnose(data, options, step);
  Cause cause{std::move(outcome.diagnosis), std::move(outcome.failure), std::nullopt};
  if (!cause.diagnosis) {
    return cause;
  }
  diagnosis::Diagnosis& diagnosis = *cause.diagnosis;
  const discovery::DiagnosedRecording recording{data, diagnosis};
  discovery::DiscoveryOptions of_laws;
  of_laws.stop = options.stop;
  of_laws.coloured = diagnosis.before.coloured;
  auto search = search_beyond({&recording, 1}, options, of_laws, diagnosis, Search::where_due, step);
  if (search && *search && diagnosis.unexplained &&
      fit_together((*search)->rest, (*search)->found, diagnosis, options.stop)) {
    cause.beyond = std::move((*search)->found);
  }
  return cause;
}

std::string words_in_catalogue(std::string_view id) {
  for (const diagnosis::Effect& effect : diagnosis::catalogue()) {
    if (effect.id == id) {
      return effect.words;
    }
  }
  return {};
}

}  // namespace selfcal
