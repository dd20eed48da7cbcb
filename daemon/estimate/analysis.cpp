#include "daemon/estimate/analysis.hpp"

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/discovery/kept_names.hpp"
#include "estimator/discovery/named_effects.hpp"

namespace selfcal {

Cause cause_of(const ImuData& data, const diagnosis::DiagnosisOptions& options,
               const std::function<void(const std::string& step)>& step) {
  diagnosis::DiagnosisOutcome outcome = diagnosis::diagnose(data, options, step);
  Cause cause{std::move(outcome.diagnosis), std::move(outcome.failure), std::nullopt};
  if (!cause.diagnosis || !cause.diagnosis->unexplained) {
    return cause;
  }
  const discovery::DiagnosedRecording recording{data, *cause.diagnosis};
  if (const auto rest = discovery::UnexplainedRest::of({&recording, 1}, options.stop)) {
    discovery::DiscoveryOptions of_laws;
    of_laws.stop = options.stop;
    of_laws.coloured = cause.diagnosis->before.coloured;
    cause.beyond = discovery::discover(rest->recordings(), of_laws, step);
    if (discovery::say_what_was_rejected(rest->recordings().front(), *cause.diagnosis, *cause.beyond, options.stop)) {
      discovery::keep_rejected_names(*cause.diagnosis, *cause.beyond);
      cause.beyond.reset();
    }
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
