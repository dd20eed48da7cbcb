// The DBC of the status frames and the diagnostic identifiers, from the table.
#pragma once

#include <string>

namespace selfcal::ins {

std::string dbc_text();

}  // namespace selfcal::ins
