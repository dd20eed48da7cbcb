// Addresses and times of an INS as communication parameters, and the files that say what those are. ODX refers to ISO's own files of
// parameters; what of them is used here is written beside, so that every reference leads somewhere.
#pragma once

#include <string>

#include "protocol/odx/node.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::odx {

inline constexpr std::string_view protocol_name = "UDS_on_CAN";
inline constexpr std::string_view parameters_name = "UDSOnCAN_CPS";

// COMPARAM-REFS of a layer.
void write_parameters(Node refs, const profile::Profile& profile);

std::string parameters_text();  // the COMPARAM-SPEC
std::string transport_text();   // the COMPARAM-SUBSET of ISO 15765-2
std::string timing_text();      // the COMPARAM-SUBSET of ISO 15765-3

}  // namespace selfcal::odx
