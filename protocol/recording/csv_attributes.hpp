// The TOML file beside a CSV recording: all that is not one value per sample.
#pragma once

#include <string>
#include <string_view>

#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// Fills everything but the samples. Unknown keys are ignored, as unknown attributes in HDF5 are.
Expected<Recording> parse_attributes(std::string_view toml, const std::string& name);
std::string format_attributes(const Recording& recording);

}  // namespace selfcal
