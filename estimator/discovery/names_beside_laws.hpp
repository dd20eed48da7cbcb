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

// The names in `diagnosis`, taken out of `rest`, fitted anew beside the laws that were fitted to it. Nothing where there are no laws, or
// processes beside them. What names and laws say is counted with these sizes: a name has none on an axis where a law stood in its place.
void fit_names(const UnexplainedRest& rest, const Discovery& fitted, diagnosis::Diagnosis& diagnosis,
               const std::stop_token& stop = {});

// `alone`: what the search fitted on `searched`, the recording as it was calibrated, with nothing taken out. None where one law was
// enough without a process, where no name stands, or where name and laws together say more than the laws alone. Names that the catalogue
// rejects for what they leave are asked after those that it gives; then the two effects that with one of the laws explain the recording best,
// whatever else the catalogue would say of what is left; last, where a process is told, what was rejected without any law taken out. Names
// beside other laws than were taken out are asked for once more. A diagnosis and a search each are made up to ten times, up to fourteen where
// four laws and more stand alone. Where `diagnosis` has names, `alone` is of the recording less these: then further names are looked for, in the
// place of laws that effects make and of those two effects. A process that `diagnosis` names is rejected: whoever asks sees to it that names and
// laws explain the recording without one.
std::optional<NamesBesideLaws> names_beside_laws(const ImuData& data, const diagnosis::Diagnosis& diagnosis,
                                                 const UnitRecording& searched, const Discovery& alone,
                                                 const diagnosis::DiagnosisOptions& of_catalogue,
                                                 const DiscoveryOptions& of_laws, const Progress& progress = {});

// Names of sensors that were given before laws were found beside them, asked once more of the recording less these: a field may be taken
// for a g-sensitivity while a law is in the way. None where the catalogue has no others, or where names and laws say more
// then.
std::optional<NamesBesideLaws> named_anew(const ImuData& data, const diagnosis::Diagnosis& diagnosis,
                                          const Discovery& beside, const diagnosis::DiagnosisOptions& of_catalogue,
                                          const DiscoveryOptions& of_laws, const Progress& progress = {});

// A name that takes up a part of a law is no physics of its own: g-sensitivity follows the mean of a creep that has the sign of a force,
// and what the search finds beside it mends what it took too much. Where an effect that was named could make a part of the laws found
// beside it, the recording is searched with nothing taken out. `beside`: what the search fitted on `searched`, the recording less the
// names, which leave something or stand beside a walk. None where names and laws together say less. In `diagnosis` the names of sensors are rejected.
std::optional<NamesBesideLaws> laws_in_place_of_names(const ImuData& data, const diagnosis::Diagnosis& diagnosis,
                                                      const UnitRecording& searched, const Discovery& beside,
                                                      const DiscoveryOptions& of_laws, const Progress& progress = {});

}  // namespace selfcal::discovery
