// A recording in which an effect of the catalogue stands beside a law that no catalogue holds. The catalogue by itself rejects the
// name, for it leaves the law; the search by itself writes the effect as equations. Together they are asked here: what is left
// without the laws is diagnosed anew, and what is left without the names that stand then is searched anew.
#pragma once

#include <optional>

#include "estimator/discovery/named_effects.hpp"

namespace selfcal::discovery {

struct NamesBesideLaws {
  diagnosis::Diagnosis diagnosis;  // with the names; unexplained, for the laws are what they leave
  UnexplainedRest rest;            // the recording less what is named
  Discovery laws;                  // of that
};

// `alone`: what the search fitted on `searched`, the recording as it was calibrated, with nothing taken out. None where one law or
// process was enough, where no name stands, or where name and laws together say more than the laws alone. A diagnosis and a search each
// are made up to five times.
std::optional<NamesBesideLaws> names_beside_laws(const ImuData& data, const diagnosis::Diagnosis& diagnosis,
                                                 const UnitRecording& searched, const Discovery& alone,
                                                 const diagnosis::DiagnosisOptions& of_catalogue,
                                                 const DiscoveryOptions& of_laws, const Progress& progress = {});

}  // namespace selfcal::discovery
