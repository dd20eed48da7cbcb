// A sample of the IMU in the frames that a profile has for it.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "protocol/can/frame.hpp"
#include "protocol/profile/profile.hpp"
#include "sim_ins/imu_simulator.hpp"

namespace selfcal::sim {

// An empty frame of the kind, with its constants.
can::CanFrame begin_frame(const profile::Profile& profile, const profile::Frame& kind);
// Of a signal that is not there, nothing; a value that it cannot hold stays 0.
void put_value(const profile::Frame& kind, std::string_view name, double value, can::CanFrame& frame);

// In the INS's axes; `counter` as far as the signal holds it.
void append_sample(const profile::Profile& profile, const ImuSample& sample, std::uint64_t counter,
                   std::vector<can::CanFrame>& frames);

}  // namespace selfcal::sim
