// How a profile may name the 24 in the INS's record: all at once ("values"), by group ("accel_bias", x y z), or one by one
// ("accel_bias_x"). "accel_scale" is one factor in place of accel_scale_pos and accel_scale_neg.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/profile/layout.hpp"
#include "protocol/profile/roles.hpp"

namespace selfcal::profile {

// The role of a set: version, date, author and each way to name the 24, in SI units.
const RecordRole& set_role();

// The 24 that are named twice or not at all.
std::vector<std::string> coefficient_complaints(const Layout& layout);

// Where a field's elements stand among the 24: the first of them and how many; and whether they are one factor for K+ and K-,
// of which the first of K+ is told.
struct Span {
  std::size_t first = 0, count = 0;
  bool one_factor = false;
};
// Scale factors: such a field may tell its nominal value times 1 + it, and of K- times 1 - it, the slope.
enum class Factor : std::uint8_t { none, slope, negative_slope };
Factor factor_of(std::string_view field);

std::optional<Span> span_of(std::string_view field);

}  // namespace selfcal::profile
