// The word that somebody meant, among those that there are.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace selfcal {

// Letters to insert, drop, replace or swap with their neighbour until `a` is `b` (optimal string alignment).
std::size_t edit_distance(std::string_view a, std::string_view b);

// "; did you mean NEAREST?" for the known word that is fewest letters away from `word`, the first of several; "" where
// none is near: no more than a third of the longer word's letters may differ, though one may in a word of two.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> known);
std::string did_you_mean(std::string_view word, std::span<const std::string> known);

}  // namespace selfcal
