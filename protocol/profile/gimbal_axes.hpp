// Gimbal angles, outer and inner, and what is counted like them: in our axes, and in the INS's words (`gimbal` of [axes]).
#pragma once

#include <array>
#include <cstddef>

#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

template <typename T>
std::array<T, 2> in_their_axes(const Profile& profile, const std::array<T, 2>& ours) {
  std::array<T, 2> theirs{};
  for (std::size_t k = 0; k < 2; ++k) {
    theirs[profile.raw.gimbal[k]] = static_cast<T>(profile.raw.gimbal_sign[k] * ours[k]);
  }
  return theirs;
}

template <typename T>
std::array<T, 2> in_our_axes(const Profile& profile, const std::array<T, 2>& theirs) {
  return {static_cast<T>(profile.raw.gimbal_sign[0] * theirs[profile.raw.gimbal[0]]),
          static_cast<T>(profile.raw.gimbal_sign[1] * theirs[profile.raw.gimbal[1]])};
}

}  // namespace selfcal::profile
