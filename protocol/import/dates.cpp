#include "protocol/import/dates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <string>

namespace selfcal::import {
namespace {

// One to `most` digits.
std::optional<int> digits(std::string_view& text, std::size_t least, std::size_t most) {
  const std::size_t there = std::min(text.find_first_not_of("0123456789"), text.size());
  if (there < least) {
    return std::nullopt;
  }
  const std::size_t count = std::min(there, most);
  int value = 0;
  std::from_chars(text.data(), text.data() + count, value);
  text.remove_prefix(count);
  return value;
}

bool take(std::string_view& text, char c) {
  const bool there = text.starts_with(c);
  text.remove_prefix(there ? 1 : 0);
  return there;
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// Seconds, 0 to 61, parts behind a point, a comma or a colon.
std::optional<long double> seconds_of(std::string_view& text) {
  const std::size_t length = std::min(text.find_first_not_of("0123456789.,:"), text.size());
  std::string number(text.substr(0, length));
  std::replace_if(
      number.begin(), number.end(), [](char c) { return c == ',' || c == ':'; }, '.');
  long double value = 0.0L;
  const auto [stopped, error] = std::from_chars(number.data(), number.data() + number.size(), value);
  constexpr long double leap_minute = 61.0L;
  if (number.empty() || error != std::errc{} || stopped != number.data() + number.size() || value >= leap_minute) {
    return std::nullopt;
  }
  text.remove_prefix(length);
  return value;
}

// hh:mm:ss, and AM or PM behind it; mm:ss.fff, as spreadsheets show it.
std::optional<long double> clock_of(std::string_view& text) {
  const auto hours = digits(text, 1, 2);
  if (!hours || !take(text, ':')) {
    return std::nullopt;
  }
  const auto minutes = digits(text, 2, 2);
  constexpr int hours_a_day = 24, noon = 12, minutes_an_hour = 60, seconds_a_minute = 60;
  if (!minutes || *minutes >= minutes_an_hour) {
    return std::nullopt;
  }
  if (text.starts_with('.') || text.starts_with(',')) {
    const std::string behind = fmt::format("0.{}", text.substr(1));
    std::string_view rest = behind;
    const auto part = seconds_of(rest);
    text.remove_prefix(part ? text.size() - rest.size() : 0);
    return part ? std::optional(static_cast<long double>(*hours * seconds_a_minute + *minutes) + *part) : std::nullopt;
  }
  if (*hours > hours_a_day || !take(text, ':')) {
    return std::nullopt;
  }
  const auto seconds = seconds_of(text);
  if (!seconds) {
    return std::nullopt;
  }
  int hour = *hours;
  std::string_view behind = text;
  take(behind, ' ');
  if (behind.size() >= 2 && lower(behind[1]) == 'm' && (lower(behind[0]) == 'a' || lower(behind[0]) == 'p')) {
    if (hour < 1 || hour > noon) {
      return std::nullopt;
    }
    hour = hour % noon + (lower(behind[0]) == 'p' ? noon : 0);
    text = behind.substr(2);
  }
  return static_cast<long double>((hour * minutes_an_hour + *minutes) * seconds_a_minute) + *seconds;
}

// Z, +hh:mm, +hhmm, +hh: seconds ahead of UTC.
std::optional<int> offset_of(std::string_view text) {
  if (text.empty() || text == "Z" || text == "z") {
    return 0;
  }
  const int sign = text.front() == '-' ? -1 : 1;
  if (text.front() != '-' && text.front() != '+') {
    return std::nullopt;
  }
  text.remove_prefix(1);
  const auto hours = digits(text, 2, 2);
  take(text, ':');
  const auto minutes = text.empty() ? std::optional<int>(0) : digits(text, 2, 2);
  if (!hours || !minutes || !text.empty()) {
    return std::nullopt;
  }
  constexpr int hour_s = 3600, minute_s = 60;
  return sign * (*hours * hour_s + *minutes * minute_s);
}

// 1 to 12 of a name's first three letters; none.
std::optional<int> month_of(std::string_view& text) {
  constexpr std::array<std::string_view, 12> names{"jan", "feb", "mar", "apr", "may", "jun",
                                                   "jul", "aug", "sep", "oct", "nov", "dec"};
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (text.size() > 3 &&
        std::equal(names[k].begin(), names[k].end(), text.begin(), [](char a, char b) { return a == lower(b); })) {
      text.remove_prefix(3);
      return static_cast<int>(k) + 1;
    }
  }
  return std::nullopt;
}

struct Date {
  int year = 0, month = 0, day = 0;
};

// With the mark that stands in front of the time behind it taken.
std::optional<Date> day_of(std::string_view& text) {
  const auto first = digits(text, 1, 4);
  const char mark = text.empty() ? ' ' : text.front();
  if (!first || (mark != '-' && mark != '/' && mark != '.')) {
    return std::nullopt;
  }
  take(text, mark);
  const bool named = !text.empty() && (text.front() < '0' || text.front() > '9');
  const auto second = named ? month_of(text) : digits(text, 1, 2);
  if (!second || !take(text, mark)) {
    return std::nullopt;
  }
  const auto third = digits(text, 1, 4);
  if (!third || !(take(text, 'T') || take(text, ' '))) {
    return std::nullopt;
  }
  constexpr int least_year = 1900, months = 12;
  if (*first >= least_year) {
    return Date{*first, *second, *third};
  }
  const bool month_first = !named && mark != '.' && *first <= months;
  return *third < least_year
             ? std::nullopt
             : std::optional(month_first ? Date{*third, *first, *second} : Date{*third, *second, *first});
}

constexpr long double day_s = 86400.0L;

// Since 1970; none of a day that no calendar has.
std::optional<long double> days_of(const Date& day) {
  const std::chrono::year_month_day date{std::chrono::year{day.year},
                                         std::chrono::month{static_cast<unsigned>(day.month)},
                                         std::chrono::day{static_cast<unsigned>(day.day)}};
  return date.ok() ? std::optional(static_cast<long double>(std::chrono::sys_days(date).time_since_epoch().count()))
                   : std::nullopt;
}

void take_blanks(std::string_view& text) {
  while (take(text, ' ')) {
  }
}

// "Wed Dec 22 21:09:46 2021", as C's ctime writes it: the day of the week may lack, GMT, UTC or an offset may stand before the year.
std::optional<long double> named_day_first(std::string_view text) {
  constexpr std::array<std::string_view, 7> weekdays{"mon", "tue", "wed", "thu", "fri", "sat", "sun"};
  const auto begins = [&text](std::string_view word) {
    return text.size() > word.size() &&
           std::equal(word.begin(), word.end(), text.begin(), [](char a, char b) { return a == lower(b); });
  };
  if (std::any_of(weekdays.begin(), weekdays.end(), begins)) {
    text.remove_prefix(weekdays.front().size());
    take(text, ',');
    take_blanks(text);
  }
  const auto month = month_of(text);
  if (!month || !take(text, ' ')) {
    return std::nullopt;
  }
  take_blanks(text);
  const auto day = digits(text, 1, 2);
  if (!day || !take(text, ' ')) {
    return std::nullopt;
  }
  const auto seconds = clock_of(text);
  if (!seconds || !take(text, ' ')) {
    return std::nullopt;
  }
  if (begins("gmt") || begins("utc")) {
    text.remove_prefix(3);
  }
  const std::size_t blank = text.find(' ');
  const auto offset = blank == std::string_view::npos ? std::optional(0) : offset_of(text.substr(0, blank));
  text.remove_prefix(blank == std::string_view::npos ? 0 : blank + 1);
  const auto year = digits(text, 4, 4);
  const auto days = offset && year && text.empty() ? days_of({*year, *month, *day}) : std::nullopt;
  return days ? std::optional(*days * day_s + *seconds - static_cast<long double>(*offset)) : std::nullopt;
}

}  // namespace

std::optional<long double> date_of(std::string_view field) {
  std::string_view text = field;
  long double days = 0.0L;
  if (!field.empty() && lower(field.front()) >= 'a' && lower(field.front()) <= 'z') {
    return named_day_first(field);
  }
  if (field.find_first_of("-/.") < field.find(':')) {
    const auto day = day_of(text);
    const auto since_1970 = day ? days_of(*day) : std::nullopt;
    if (!since_1970) {
      return std::nullopt;
    }
    days = *since_1970;
    take_blanks(text);
  }
  const auto seconds = clock_of(text);
  const auto offset = seconds ? offset_of(text) : std::nullopt;
  if (!offset) {
    return std::nullopt;
  }
  return days * day_s + *seconds - static_cast<long double>(*offset);
}

std::string date_words(long double seconds) {
  constexpr int hour_s = 3600, minute_s = 60;
  const long double days = std::floor(seconds / day_s);
  const auto in_day = static_cast<double>(seconds - days * day_s);
  const int whole = static_cast<int>(in_day);
  const std::string clock = fmt::format("{:02}:{:02}:{:06.3f}", whole / hour_s, whole % hour_s / minute_s,
                                        std::floor(1e3 * (in_day - minute_s * (whole / minute_s))) / 1e3);
  constexpr long double year_10000 = 2932897.0L;  // in days
  if (days == 0.0L || !(std::abs(days) < year_10000)) {
    return clock;
  }
  const std::chrono::year_month_day date{std::chrono::sys_days(std::chrono::days(static_cast<int>(days)))};
  return fmt::format("{:04}-{:02}-{:02} {}", static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                     static_cast<unsigned>(date.day()), clock);
}

}  // namespace selfcal::import
