#include "protocol/import/guess_time_axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "protocol/import/guess_time.hpp"
#include "protocol/import/guess_units.hpp"
#include "protocol/import/time_axis.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::import {
namespace {

void say(TimeGuess& guess, const char* key, std::string text) {
  guess.remarks.push_back({key, std::move(text), false});
}
void doubt(TimeGuess& guess, const char* key, std::string text) {
  guess.remarks.push_back({key, std::move(text), true});
}

void without_column(const ColumnSource& source, std::optional<double> rate_of_header, std::optional<double> rate_given,
                    TimeGuess& guess) {
  const std::optional<double> rate = rate_of_header ? rate_of_header : rate_given;
  guess.sample_rate_hz = rate;
  if (!rate) {
    return doubt(guess, "time",
                 "no column increases evenly: the sample rate is not known: " + rate_words(source.preamble()));
  }
  guess.interval_s = 1.0 / *rate;
  say(guess, "time",
      fmt::format("no column of it; {} Hz {}", *rate, rate_of_header ? "from the file's header" : "as given"));
}

void guess_unit(const ColumnSource& source, const Roles& roles, const NamedColumn& column, TimeGuess& guess) {
  const double interval = static_cast<double>(1.0L / static_cast<long double>(rate_of(roles.stamps, 1.0L).rate_hz));
  const bool xsens = source.names()[*roles.time].find("SampleTimeFine") != std::string::npos;
  const std::vector<std::string> units = xsens ? xsens_time_units(interval) : time_units_of(roles.stamps, interval);
  const std::string& claimed = column.unit;
  std::string& unit = guess.map.unit;
  if (roles.time_is_date) {
    unit = "date";
  } else if (find_unit(claimed) && find_unit(claimed)->quantity == Quantity::time) {
    unit = claimed;
    const bool long_unit = claimed == "min" || claimed == "h" || claimed == "d";
    if (!long_unit && std::find(units.begin(), units.end(), claimed) == units.end()) {
      doubt(
          guess, "time.unit",
          fmt::format("{} by its name; that would make {:.6g} Hz", claimed, 1.0 / (interval * find_unit(claimed)->si)));
    }
  } else if (const std::string& other = column.other_unit; !other.empty()) {
    unit = units.empty() ? unit : units.front();
    doubt(guess, "time.unit", fmt::format("nobody says how long one of its {} is", other));
  } else if (units.empty()) {
    doubt(guess, "time.unit", fmt::format("intervals of {:.6g}: no unit makes a sample rate of that", interval));
  } else {
    unit = units.front();
    if (units.size() > 1) {
      doubt(guess, "time.unit", fmt::format("intervals of {:.6g}: {} or {}", interval, units[0], units[1]));
    }
  }
}

// A recording counts from its start.
void guess_origin(const Roles& roles, double si, TimeGuess& guess) {
  const double first_s = static_cast<double>(roles.stamps.front()) * si;
  if (first_s < -*guess.interval_s || first_s > 2.5 * *guess.interval_s) {
    guess.map.origin_first = true;
    const std::string first = roles.time_is_date
                                  ? date_words(roles.stamps.front())
                                  : fmt::format("{} {}", static_cast<double>(roles.stamps.front()), guess.map.unit);
    say(guess, "time.origin", fmt::format("the first time, {}, is taken to be one interval after the start", first));
  }
}

}  // namespace

TimeGuess guess_time_axis(const ColumnSource& source, const Roles& roles, const std::vector<NamedColumn>& named,
                          std::optional<double> rate_of_header, std::optional<double> rate_given) {
  TimeGuess guess;
  if (!roles.time) {
    without_column(source, rate_of_header, rate_given, guess);
    return guess;
  }
  guess_unit(source, roles, named[*roles.time], guess);
  const double si = roles.time_is_date ? 1.0 : find_unit(guess.map.unit)->si;
  const RateOfStamps rate = rate_of(roles.stamps, static_cast<long double>(si));
  if (guess.remarks.empty()) {  // else by what is settled
    guess.sample_rate_hz = rate.rate_hz;
  }
  guess.interval_s = 1.0 / rate.rate_hz;
  say(guess, "time.unit",
      fmt::format("{}: {} Hz; intervals vary by {:.2g} % rms{}", guess.map.unit, rate.rate_hz,
                  rate.jitter < 1e-9 ? 0.0 : 100.0 * rate.jitter,
                  rate.gaps > 0 ? fmt::format(", {} gaps", rate.gaps) : ""));
  if (!roles.clock_words.empty()) {
    say(guess, "time.column", roles.clock_words);
  }
  say(guess, "time.stamp", "a time is taken to be the end of its sample's interval");
  guess_origin(roles, si, guess);
  if (rate_given && std::abs(*rate_given / rate.rate_hz - 1.0) > 1e-3) {
    doubt(guess, "time.unit", fmt::format("the times make {} Hz, {} Hz is given", rate.rate_hz, *rate_given));
  }
  return guess;
}

}  // namespace selfcal::import
