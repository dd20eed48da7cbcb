// Prints the DBC: `selfcal_write_dbc > config/selfcal.dbc`. A test checks that the file is current.
#include <cstdio>

#include "protocol/ins_interface/dbc.hpp"

int main() { return std::fputs(selfcal::ins::dbc_text().c_str(), stdout) < 0 ? 1 : 0; }
