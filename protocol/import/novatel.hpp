// ASCII logs of NovAtel's receivers: RAWIMU, RAWIMUS, RAWIMUX and RAWIMUSX, each line with its checksum, among lines of any other log.
// Source: OEM7 Commands and Logs Reference Manual, SPAN logs and "32-bit CRC".
#pragma once

#include <filesystem>
#include <memory>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

// Columns: time in s since the GNSS epoch, by week and seconds; status; increments of the accelerometers and of the gyros in counts, x, y, z of
// the IMU. Nothing: the first lines hold no log of NovAtel. Errors (bad_input): such logs without one of raw IMU data, or none whose
// checksum is right.
Expected<std::unique_ptr<ColumnSource>> open_novatel(const std::filesystem::path& file);

}  // namespace selfcal::import
