// The daemon's documents as text for people.
#pragma once

#include <string>

namespace selfcal::cli {

// A run in six lines at most, for the end of the command that followed it.
std::string run_ending_text(const std::string& document, bool colour, int columns);
// A run: its summary, who and when, what was named, its 24 parameters, drift before and after, its events; the summary
// again at the end where the text goes to a terminal (`columns` > 0), for there the beginning has scrolled away.
std::string run_text(const std::string& document, bool colour, int columns);
// All runs of a serial number, then each parameter over the years.
// One INS of `selfcal status --json`: what it is doing, its bus, the set in force, the last calibration.
std::string status_text(const std::string& instrument, int columns);
std::string history_text(const std::string& document);
std::string history_csv(const std::string& document);

}  // namespace selfcal::cli
