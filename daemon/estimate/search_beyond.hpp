// The search for equations in what the catalogue leaves of recordings, and what it does to the catalogue's word: one course for the
// service, the programs and the amendment.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/named_effects.hpp"

namespace selfcal {

struct BeyondSearch {
  discovery::UnexplainedRest rest;
  discovery::Discovery found;  // of it
  // The catalogue's name stands, although it was rejected: the search found nothing better. `found` is its equation once more.
  bool said_by_catalogue = false;
};

// Where it is due: where the catalogue leaves something, where it names a walk or an instability, and of several recordings.
enum class Search { where_due, always };

// `unit`: recordings of one unit with their diagnoses; what they refer to must outlive the result. `first` is the diagnosis of the first of
// them, and may change: a walk or an instability is rejected where equations explain what it was named for; of one
// recording a name that was rejected stands where the search finds nothing better, or beside laws where both together say less than
// laws alone, and a name is rejected where laws alone say less than both. Names that leave nothing are held against laws in their place
// first: they are rejected for far likelier ones, and `first.instead` holds others. Nothing where no search is due. The failure is that of
// a calibration, or "stopped".
tl::expected<std::optional<BeyondSearch>, std::string> search_beyond(
    std::span<const discovery::DiagnosedRecording> unit, const diagnosis::DiagnosisOptions& of_catalogue,
    const discovery::DiscoveryOptions& of_laws, diagnosis::Diagnosis& first, Search when,
    const discovery::Progress& progress = {});

}  // namespace selfcal
