#include "protocol/import/guess_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <regex>

#include "protocol/import/name_words.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::import {
namespace {

bool increasing(const std::vector<long double>& values) {
  return values.size() > 2 &&
         std::adjacent_find(values.begin(), values.end(), [](auto a, auto b) { return !(b > a); }) == values.end();
}

bool even(const std::vector<long double>& values) {
  std::vector<long double> steps;
  for (std::size_t k = 1; k < values.size(); ++k) {
    steps.push_back(values[k] - values[k - 1]);
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  const long double typical = *middle;
  const auto like = std::count_if(steps.begin(), steps.end(),
                                  [typical](auto s) { return s > typical / 2 && s < typical + typical / 2; });
  return static_cast<double>(like) > 0.9 * static_cast<double>(steps.size());
}

}  // namespace

bool rises_evenly(const std::vector<long double>& stamps) { return increasing(stamps) && even(stamps); }

std::string rate_in_head(std::string_view head) {
  std::string found;
  while (!head.empty()) {
    const std::size_t end = std::min(head.find('\n'), head.size());
    const std::string line(head.substr(0, end));
    head.remove_prefix(std::min(end + 1, head.size()));
    if (!holds(words_of(line), {"rate", "frequency", "speed"})) {
      continue;
    }
    std::smatch match;
    static const std::regex hertz("([0-9]+(?:\\.[0-9]+)?) ?[Hh][Zz]");
    if (std::regex_search(line, match, hertz)) {
      if (!found.empty() && found != match[1]) {
        return {};
      }
      found = match[1];
    }
  }
  return found;
}

std::string rate_words(std::string_view head) {
  const std::string said = rate_in_head(head);
  return said.empty() ? "--rate gives it" : fmt::format("the head says {} Hz, --rate {} takes it", said, said);
}

std::string counter_words(std::string_view head) {
  return " rises by 1: a time in units of the interval, or a counter: " + rate_words(head);
}

int remoteness_of_clock(std::string_view name) {
  const Words words = words_of(name);
  if (holds(words, {"header", "device", "sensor"}) || is_one_of(words, {"imu"})) {
    return 0;
  }
  return is_one_of(words, {"server", "host", "pc", "system", "received", "recv", "arrival", "logging"}) ? 2 : 1;
}

void nearest_clock_first(const std::vector<std::string>& names, std::vector<std::size_t>& times) {
  std::stable_sort(times.begin(), times.end(), [&names](std::size_t a, std::size_t b) {
    return remoteness_of_clock(names[a]) < remoteness_of_clock(names[b]);
  });
}

std::vector<std::size_t> times_by_name(const std::vector<std::string>& names, const std::vector<NamedColumn>& named) {
  std::vector<std::size_t> times;
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (named[k].role == Role::time) {
      times.push_back(k);
    }
  }
  nearest_clock_first(names, times);
  return times;
}

double seconds_of_unit(const std::string& unit) {
  const auto known = find_unit(unit);
  return known && known->quantity == Quantity::time ? known->si : 0.0;
}

std::optional<double> other_rate(const std::vector<long double>& stamps, double unit_s,
                                 const std::vector<double>& others, double unit_of_others_s) {
  const std::vector<long double> rival(others.begin(), others.end());
  if (stamps.size() != rival.size() || stamps.size() < 2 || !rises_evenly(rival)) {
    return std::nullopt;
  }
  constexpr double alike = 0.02;  // of the length: rows wait on their way, and two clocks differ
  const auto ratio = static_cast<double>((rival.back() - rival.front()) / (stamps.back() - stamps.front()));
  if (unit_s > 0.0 && unit_of_others_s > 0.0) {
    const double faster = ratio * unit_of_others_s / unit_s;
    return std::abs(faster - 1.0) < alike ? std::nullopt : std::optional(faster);
  }
  // Of unknown units: s, ms, 100us, us and ns differ by a power of ten.
  const double tens = std::pow(10.0, std::round(std::log10(ratio)));
  return std::abs(ratio / tens - 1.0) < alike ? std::nullopt : std::optional(ratio / tens);
}

bool counts_by_one(const std::vector<long double>& stamps) {
  return std::adjacent_find(stamps.begin(), stamps.end(), [](auto a, auto b) { return b - a != 1.0L; }) == stamps.end();
}

std::string why_uneven(const std::vector<double>& times) {
  std::size_t places = 0, first = 0;
  for (std::size_t k = 1; k < times.size(); ++k) {
    if (times[k] <= times[k - 1]) {
      first = places++ == 0 ? k : first;
    }
  }
  constexpr double most = 0.01;  // more is no fault of a time, but no time
  if (places == 0 || static_cast<double>(places) > most * static_cast<double>(times.size())) {
    return "does not increase evenly";
  }
  return fmt::format(
      "does not increase in {} place{}, first from {:.10g} to {:.10g} at row {} of the numbers: cut the file where it "
      "begins anew, take "
      "out rows that stand twice",
      places, places == 1 ? "" : "s", times[first - 1], times[first], first + 1);
}

}  // namespace selfcal::import
