#include <algorithm>
#include <array>
#include <cstdlib>

#include "protocol/profile/frames.hpp"

namespace selfcal::profile {
namespace {

using F = RoleField;
constexpr std::array<std::string_view, 4> states{"starting", "idle", "moving", "failed"};

constexpr std::array identity{F{"serial", "", true, "serial number"}, F{"software", "", false, "its version"}};
constexpr std::array state{F{"state", "", true, "idle: the gimbal rests; moving: it turns", states},
                           F{"power_cycles", "", true, "counts every power-on"},
                           F{"version", "", false, "of the coefficients in force"},
                           F{"outer", "rad", false, "gimbal read-out"}, F{"inner", "rad", false, "gimbal read-out"}};
constexpr std::array told{F{"index", "", true, "of the coefficient"}, F{"value", "", true, "its bits, as it is held"}};
constexpr std::array move{F{"outer", "rad", true, "where the outer axis is to turn to"},
                          F{"inner", "rad", true, "where the inner axis is to turn to"}};
constexpr std::array read{F{"index", "", true, "of the coefficient that is to be told"}};
constexpr std::array sample{F{"counter", "", true, "counts the samples; the same in all frames of one"},
                            F{"delta_theta_x", "", false, "angle increment, counts"},
                            F{"delta_theta_y", "", false, "angle increment, counts"},
                            F{"delta_theta_z", "", false, "angle increment, counts"},
                            F{"delta_v_x", "", false, "velocity increment, counts"},
                            F{"delta_v_y", "", false, "velocity increment, counts"},
                            F{"delta_v_z", "", false, "velocity increment, counts"},
                            F{"outer", "rad", false, "gimbal read-out"},
                            F{"inner", "rad", false, "gimbal read-out"},
                            F{"temperature", "degC", false, "of the IMU"}};

constexpr std::array<std::string_view, 7> run_states{"starting", "idle",   "rotating", "complete",
                                                     "aborted",  "failed", "checking"};
constexpr std::array<std::string_view, 4> sessions{"unknown", "default", "programming", "extended"};
constexpr std::array status_state{F{"state", "", true, "what the INS is doing", run_states},
                                  F{"gimbal_moving", "", false, "1: the gimbal turns"},
                                  F{"unlocked", "", false, "1: the lock is open"},
                                  F{"session", "", false, "that it is in", sessions},
                                  F{"faults", "", false, "bits: 1 gimbal, 2 sensor, 4 FLASH, 8 coefficients"},
                                  F{"position", "", false, "1 is the first; 0: not in a schedule"},
                                  F{"pages_written", "", false, "of this run"},
                                  F{"state_alive", "", false, "counts the frames"}};
constexpr std::array status_gimbal{F{"outer_angle", "deg", false, "gimbal read-out"},
                                   F{"inner_angle", "deg", false, "gimbal read-out"},
                                   F{"time_left", "s", false, "of the rotation, on the INS's clock"},
                                   F{"gimbal_alive", "", false, "counts the frames"}};

const std::array roles{
    FrameRole{"identity", true, true, "who it is; again and again", identity},
    FrameRole{"state", true, true, "what it is doing; again and again", state},
    FrameRole{"told", true, true, "a coefficient, answer to read and to write", told},
    FrameRole{"move", false, true, "turn there, and rest", move},
    FrameRole{"start", false, false, "begin the stream of samples", {}},
    FrameRole{"stop", false, false, "end it, and all motion", {}},
    FrameRole{"read", false, true, "tell a coefficient", read},
    FrameRole{"write", false, true, "hold a coefficient; used from the next power-on on", told},
    FrameRole{"reset", false, true, "restart, as by power", {}},
    FrameRole{"status.state", true, false, "what it is doing; periodic", status_state},
    FrameRole{"status.gimbal", true, false, "where the gimbal is; periodic", status_gimbal},
    FrameRole{"sample", true, true, "a sample of the IMU, or a part of it", sample},
};

}  // namespace

std::span<const FrameRole> frame_roles() { return roles; }

const FrameRole& frame_role(std::string_view name) {
  const auto found = std::ranges::find(roles, name, &FrameRole::name);
  return found == roles.end() ? (std::abort(), roles[0]) : *found;
}

const Signal* Frame::find(std::string_view wanted) const {
  const auto found = std::ranges::find(signals, wanted, &Signal::name);
  return found == signals.end() ? nullptr : &*found;
}

}  // namespace selfcal::profile
