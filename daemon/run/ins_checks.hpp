// Checks of an INS's answers against the schedule and against each other. Each complaint names the value and what it
// contradicts; none begins with the interface. The range of a single value is checked where its bytes are decoded
// (protocol/ins_interface).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/host/config.hpp"
#include "daemon/run/rotation_clock.hpp"
#include "estimator/geometry/schedule.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/ins_interface/records.hpp"

namespace selfcal {

using Complaint = std::optional<std::string>;  // nothing: it fits

// Pages of the whole schedule at this format.
double pages_of(const Schedule& schedule, const ins::SampleFormatRecord& format);

// Everything of the rotation lies in the FLASH.
bool holds_whole_rotation(const ins::DirectoryRecord& directory);

// Samples against pages, pages against the schedule, which may take `longer_s` longer: where the moves are commanded one by one, each
// may take its time.
Complaint check_directory(const ins::DirectoryRecord& directory, const ins::SampleFormatRecord& format,
                          const Schedule& schedule, double longer_s = 0.0);

// The data of a rotation that is over, samples over rate, against the time that the rotation took on the operator's clock.
// Neither clock is wrong by more than a quartz is, and an answer is as old as a request may wait. The clock of a virtual INS
// (time_scale above 1) may stand, so that only too many data contradict it.
Complaint check_rotation_time(const ins::DirectoryRecord& directory, const ins::SampleFormatRecord& format,
                              const RotationTime& took, const InsConfig& config);

// The first value (SI, order of sensor_parameters) outside what is physically possible.
Complaint check_coefficients(const std::array<double, sensor_parameter_count>& value, std::string_view whose);

// What becomes of a set in an INS whose record has fewer bits than ours, or one scale factor in place of K+ and K-. `wanted` and
// `held` are SI, `tolerance` in the parameters' units. Refused where a value is lost beyond its tolerance.
Complaint check_held(const std::array<double, sensor_parameter_count>& wanted,
                     const std::array<double, sensor_parameter_count>& held,
                     const std::array<double, sensor_parameter_count>& tolerance);
// The largest loss, in tolerances, in a sentence: "accel_scale_pos_x: 162 ppm were found, the INS holds 156.5: 5.5 ug are lost at
// 1 g". Empty where all are lost by less than a thousandth of their tolerance.
std::string words_of_loss(const std::array<double, sensor_parameter_count>& wanted,
                          const std::array<double, sensor_parameter_count>& held,
                          const std::array<double, sensor_parameter_count>& tolerance);

// The answer about a navigation check of `asked_s` seconds, done or under way.
Complaint check_navigation(const ins::NavigationCheckRecord& answer, double asked_s);

}  // namespace selfcal
