// The part of a recording that commands answer from: faults of a stretch cost that stretch.
#pragma once

#include <memory>

#include "estimator/diagnosis/data/set_aside.hpp"
#include "protocol/command_line/command_line.hpp"
#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::cli {

struct SoundPart {
  std::vector<double> first_temperature;
  diagnosis::SetAside aside;
  std::vector<Coast> coasts;  // those of `aside`, with the turns as a calibration found them
  explicit SoundPart(const Recording& recording);
};

// Null where nothing is left out: with `strict`, or where nothing is faulty. Where the fault is one of the whole recording it is
// the answer as if strict, and an error where the recording then is none to be estimated. `recording` must outlive it.
Expected<std::unique_ptr<SoundPart>> sound_part(const Recording& recording, bool strict);

// The same for a diagnosis, which names the fault of a whole recording itself.
std::unique_ptr<SoundPart> sound_part_or_all(const Recording& recording);

void add_strict_option(Options& options, bool& strict);

}  // namespace selfcal::cli
