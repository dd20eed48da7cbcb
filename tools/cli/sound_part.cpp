#include "tools/cli/sound_part.hpp"

#include <fmt/format.h>

#include "daemon/estimate/calibrate_recording.hpp"
#include "protocol/recording/check.hpp"

namespace selfcal::cli {

#ifdef SELFCAL_WITHOUT_ANALYSIS
std::unique_ptr<SoundPart> sound_part_or_all(const Recording& /*recording*/) { return nullptr; }
#else
SoundPart::SoundPart(const Recording& recording) : aside(imu_view(recording, first_temperature)) {}

std::unique_ptr<SoundPart> sound_part_or_all(const Recording& recording) {
  auto sound = std::make_unique<SoundPart>(recording);
  if (!sound->aside.refused().empty()) {
    fmt::print(stderr, "warning: nothing is left out: {}\n", sound->aside.refused());
    return nullptr;
  }
  return sound->aside.left_out().empty() ? nullptr : std::move(sound);
}
#endif

Expected<std::unique_ptr<SoundPart>> sound_part(const Recording& recording, bool strict) {
  if (strict) {
    return nullptr;
  }
  std::unique_ptr<SoundPart> sound = sound_part_or_all(recording);
  if (!sound) {
    if (const auto checked = check_recording(recording); !checked) {
      return tl::unexpected(checked.error());
    }
  }
  return sound;
}

void add_strict_option(Options& options, bool& strict) {
  options.flag("--strict", strict, "a fault in a part of the recording refuses all of it");
}

}  // namespace selfcal::cli
