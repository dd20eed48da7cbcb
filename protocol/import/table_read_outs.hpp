// Columns that a table with read-outs of its own wrote: where its axes stand, or how fast they turn.
#pragma once

#include <string>
#include <vector>

#include "protocol/import/guess_names.hpp"

namespace selfcal::import {

enum class TableReadOut { none, angle, rate };

// What a name that calls a table, an encoder, an axis or a command says of it: where it stands ("cmd_pitch_deg"), or how fast it turns
// ("table_rate_dps", "cmd_rate"). A unit counts more than words; without either it is none ("axis", "encoder_counts").
TableReadOut table_read_out(const NamedColumn& column, const std::string& name);

// The angle that a table with this rate has turned by since the first row, in the rate's unit times s: by the trapezoid.
std::vector<double> angle_of_rate(const std::vector<double>& rate, const std::vector<double>& time_s);

}  // namespace selfcal::import
