// Names of columns that a table with read-outs of its own wrote.
#pragma once

#include <string>

#include "protocol/import/guess_names.hpp"

namespace selfcal::import {

enum class TableReadOut { none, angle, rate };

// What a name that calls a table, an encoder, an axis or a command says of it: where it stands ("cmd_pitch_deg"), or how fast it turns
// ("table_rate_dps", "cmd_rate"). A unit counts more than words; without either it is none ("axis", "encoder_counts").
TableReadOut table_read_out(const NamedColumn& column, const std::string& name);

}  // namespace selfcal::import
