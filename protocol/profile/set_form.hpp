// What the 24 numbers of an INS mean. Ours are those of the errors: with f and w true, its sensors say
//   f_s = f + b + K+ max(f, 0) + K- max(-f, 0) + A f,   w_s = w + e + K_G w + G w
// (A below the diagonal, G beside it). An INS may hold instead what it corrects with.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "protocol/error.hpp"
#include "protocol/ins_interface/coefficients.hpp"

namespace selfcal::profile {

enum class SetForm : std::uint8_t {
  errors,            // as above
  correction,        // u = f_s - b, f = u + K+ max(u, 0) + K- max(-u, 0) + A u; gyros likewise
  correction_first,  // f = f_s + K+ max(f_s, 0) + K- max(-f_s, 0) + A f_s - b; gyros likewise
};
inline constexpr std::array<std::string_view, 3> set_forms{"errors", "correction", "correction-first"};

using SetValues = std::array<double, ins::coefficient_count>;  // SI, in the order of sensor_parameters

// From the errors to what the INS holds and back: the conversion is its own inverse. The matrices are inverted exactly for a K of
// one sign; where K+ and K- differ, A and b take the geometric mean of both slopes, and A (K+ + K-) f / 2 is left at most.
// Fails (bad_input) on a scale factor that is not above zero and on a matrix that has no inverse, naming the coefficient.
[[nodiscard]] Expected<SetValues> converted(SetForm form, const SetValues& from);

// From the errors to what is written: converted, and rounded far below what an INS resolves (4e-9 ppm, 6e-9 ug, 2e-10 deg/h), but
// far above the last bits that a conversion there and back may move, so that what is read back and written again is the same.
[[nodiscard]] Expected<SetValues> to_write(SetForm form, const SetValues& errors);

}  // namespace selfcal::profile
