// What the names of all columns together say of their triads. Private to this folder.
#pragma once

#include <string>
#include <vector>

#include "protocol/import/guess_names.hpp"

namespace selfcal::import {

// "userAcceleration", "linear acceleration": of a phone without gravity.
bool says_no_gravity(const std::string& name);

// A phone's "linear acceleration" and "user acceleration" beside its accelerometers are without gravity; alone ROS calls accelerometers so.
void leave_out_linear(const std::vector<std::string>& names, std::vector<NamedColumn>& all);

// "acc_fwd", "acc_left", "acc_up" where no name says x, y, z of that sensor: as a right-handed triad, forward first or, where a side and the
// vertical make that left-handed, the side.
void read_directions(const std::vector<std::string>& names, std::vector<NamedColumn>& all, Role role);

// p, q, r of an aeroplane, with a unit of rates: roll, pitch, yaw.
void read_body_rates(const std::vector<std::string>& names, std::vector<NamedColumn>& all);

}  // namespace selfcal::import
