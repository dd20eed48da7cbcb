// Dates and times of the day as loggers write them.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace selfcal::import {

// Seconds since 1970 of a date and time, or since midnight of a time alone. ISO 8601 (a blank for the T, / for -, offset or Z optional);
// 04-Oct-2023; 10/4/2023 with the month first unless that is none or the marks are points; hh:mm:ss, parts of a second behind a point, a comma or a
// third colon; mm:ss.fff; AM, PM; "Wed Dec 22 21:09:46 2021", as C's ctime writes it.
std::optional<long double> date_of(std::string_view field);

// 2021-12-22 21:09:46.000 of seconds since 1970, for people; 21:09:46.000 where they are those of a time alone.
std::string date_words(long double seconds);

}  // namespace selfcal::import
