// The daemon's documents as text for people.
#pragma once

#include <string>

namespace selfcal::cli {

// A run: how it ended, its 24 parameters, drift before and after; with `story` its events too.
std::string run_text(const std::string& document, bool colour, bool story);
// All runs of a serial number, then each parameter over the years.
std::string history_text(const std::string& document);
std::string history_csv(const std::string& document);

}  // namespace selfcal::cli
