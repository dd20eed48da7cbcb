// What a diagnosis found, as files that the simulation loads: physics, configuration, schedule.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/noise/noise_spectra.hpp"
#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::cli {

// Physics file (sim_ins/physics.hpp) with what was named, in the simulation's names and units. What such a file cannot
// hold becomes a comment. With `spectra`, which stand in the file then, without the noise that they hold.
std::string physics_text(const diagnosis::Diagnosis& diagnosis, const diagnosis::AssumedNoise& assumed, double latitude,
                         const std::optional<diagnosis::NoiseSpectra>& spectra = std::nullopt);

// sim.toml: site, attitude, rate, noise, and the 24 as fitted together with the physics. `spectra`: the physics file has the noise, all
// of it; the configuration has what the recording counts in.
std::string sim_config_text(const diagnosis::Diagnosis& diagnosis, const diagnosis::AssumedNoise& assumed,
                            const Recording& recording, bool spectra = false);

// physics.toml with `laws` behind what was named, sim.toml and schedule.toml in `folder`, which is made where it is not there.
Expected<void> write_amendment(const std::filesystem::path& folder, const diagnosis::Diagnosis& diagnosis,
                               const diagnosis::AssumedNoise& assumed, const Recording& recording, const ImuData& data,
                               const std::string& laws = {});

}  // namespace selfcal::cli
