// Whether a column may be a time, and where it is none.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/import/guess_names.hpp"

namespace selfcal::import {

// It increases throughout, nearly all intervals about as long: a time, and no slowly rising quantity.
bool rises_evenly(const std::vector<long double>& stamps);

// "100.0" of lines before the numbers, one of which says "Sample rate: 100.0Hz"; empty: none does, or they say several.
std::string rate_in_head(std::string_view head);
// What to do about a rate that no column tells.
std::string rate_words(std::string_view head);
std::string counter_words(std::string_view head);  // behind the title of a column that may be a counter

// How far from the sensor a clock stands by its name: 0 its own, 1 nobody says, 2 that of the computer that wrote the row down.
int remoteness_of_clock(std::string_view name);

// Times by the names of their columns: the sensor's own clock before that of a computer that took a row over behind it.
void nearest_clock_first(const std::vector<std::string>& names, std::vector<std::size_t>& times);

// Columns that are called times, the nearest clock first.
std::vector<std::size_t> times_by_name(const std::vector<std::string>& names, const std::vector<NamedColumn>& named);

// 0 of a unit that is none of time, or none.
double seconds_of_unit(const std::string& unit);

// How many times as fast as STAMPS another column that rises evenly runs, where it does not run alike. Units in s, 0: not known, so that powers of ten
// tell nothing.
std::optional<double> other_rate(const std::vector<long double>& stamps, double unit_s,
                                 const std::vector<double>& others, double unit_of_others_s);

// Whether each is one more than the one before.
bool counts_by_one(const std::vector<long double>& stamps);

// Of a column that is called a time and does not rise evenly, for people: "does not increase in 2 places, ...". A logger that began anew
// goes back, one that wrote rows twice goes back or stands still.
std::string why_uneven(const std::vector<double>& times);

}  // namespace selfcal::import
