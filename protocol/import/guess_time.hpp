// Whether a column may be a time, and where it is none.
#pragma once

#include <string>
#include <vector>

namespace selfcal::import {

// It increases throughout, nearly all intervals about as long: a time, and no slowly rising quantity.
bool rises_evenly(const std::vector<long double>& stamps);

// Of a column that is called a time and does not rise evenly, for people: "does not increase in 2 places, ...". A logger that began anew
// goes back, one that wrote rows twice goes back or stands still.
std::string why_uneven(const std::vector<double>& times);

}  // namespace selfcal::import
