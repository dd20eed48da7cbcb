// Units as people write them.
#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "protocol/import/guess_names.hpp"

namespace selfcal::import {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// "radianspersecond", "meters/second2": what people write in full, blanks left out, as it is written for short.
std::string without_long_words(std::string text) {
  constexpr std::array<std::array<std::string_view, 2>, 13> pairs{{{"radians", "rad"},
                                                                   {"radian", "rad"},
                                                                   {"degrees", "deg"},
                                                                   {"degree", "deg"},
                                                                   {"meters", "m"},
                                                                   {"metres", "m"},
                                                                   {"meter", "m"},
                                                                   {"metre", "m"},
                                                                   {"squared", "2"},
                                                                   {"seconds", "s"},
                                                                   {"second", "s"},
                                                                   {"sec", "s"},
                                                                   {"per", "/"}}};
  for (const auto& [word, brief] : pairs) {
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at)) {
      text.replace(at, word.size(), brief);
      at += brief.size();
    }
  }
  return text;
}

}  // namespace

// Blanks, points, carets and parentheses are taken out first.
std::string known_unit(std::string_view written) {
  std::string text;
  constexpr std::string_view degree_signs[] = {"\xC2\xB0", "\xC2\xBA"};  // and the ordinal that is taken for it
  constexpr std::string_view micro_signs[] = {"\xC2\xB5", "\xCE\xBC"};
  constexpr std::string_view square = "\xC2\xB2", one = "\xC2\xB9", minus = "\xE2\x81\xBB", times = "\xC2\xB7";
  for (std::size_t k = 0; k < written.size(); ++k) {
    const std::string_view rest = written.substr(k);
    if (rest.starts_with(degree_signs[0]) || rest.starts_with(degree_signs[1])) {
      text += "deg";
      ++k;
    } else if (rest.starts_with(micro_signs[0]) || rest.starts_with(micro_signs[1])) {
      text += 'u';
      ++k;
    } else if (rest.starts_with(square)) {
      text += '2';
      ++k;
    } else if (rest.starts_with(one)) {
      text += '1';
      ++k;
    } else if (rest.starts_with(minus)) {
      text += '-';
      k += minus.size() - 1;
    } else if (rest.starts_with(times)) {
      ++k;
    } else if (std::string_view(" ^*.()").find(written[k]) == std::string_view::npos) {
      text += lower(written[k]);
    }
  }
  struct Known {
    std::string_view written, unit;
  };
  static constexpr std::array<Known, 92> known{{
      {"rad/s", "rad/s"},
      {"rads", "rad/s"},
      {"rads-1", "rad/s"},
      {"radps", "rad/s"},
      {"rad/sec", "rad/s"},
      {"deg/s", "deg/s"},
      {"degs", "deg/s"},
      {"dps", "deg/s"},
      {"deg/sec", "deg/s"},
      {"degs-1", "deg/s"},
      {"deg/s-1", "deg/s"},
      {"degps", "deg/s"},
      {"degree/s", "deg/s"},
      {"degrees/s", "deg/s"},
      {"deg/h", "deg/h"},
      {"deg/hour", "deg/h"},
      {"degh", "deg/h"},
      {"deg/hr", "deg/h"},
      {"dph", "deg/h"},
      {"mrad/s", "mrad/s"},
      {"rad/h", "rad/h"},
      {"mdeg/s", "mdeg/s"},
      {"mdps", "mdeg/s"},
      {"rpm", "rpm"},
      {"rev/s", "rev/s"},
      {"revs", "rev/s"},
      {"rps", "rev/s"},
      {"1/min", "rpm"},
      {"arcsec/s", "arcsec/s"},
      {"rad", "rad"},
      {"deg", "deg"},
      {"arcsec", "arcsec"},
      {"\"", "arcsec"},
      {"mrad", "mrad"},
      {"urad", "urad"},
      {"arcmin", "arcmin"},
      {"m/s2", "m/s^2"},
      {"ms2", "m/s^2"},
      {"mps2", "m/s^2"},
      {"m/s/s", "m/s^2"},
      {"ms-2", "m/s^2"},
      {"m/sec2", "m/s^2"},
      {"g", "g"},
      {"mg", "mg"},
      {"ug", "ug"},
      {"ft/s2", "ft/s^2"},
      {"cm/s2", "cm/s^2"},
      {"gal", "cm/s^2"},
      {"mm/s2", "mm/s^2"},
      {"mgal", "mGal"},
      {"ft/s/s", "ft/s^2"},
      {"g's", "g"},
      {"milli-g", "mg"},
      {"n/kg", "m/s^2"},
      {"m/s", "m/s"},
      {"mps", "m/s"},
      {"ms-1", "m/s"},
      {"gs", "g*s"},
      {"mgs", "mg*s"},
      {"ugs", "ug*s"},
      {"mm/s", "mm/s"},
      {"cm/s", "cm/s"},
      {"ft/s", "ft/s"},
      {"s", "s"},
      {"sec", "s"},
      {"seconds", "s"},
      {"ms", "ms"},
      {"msec", "ms"},
      {"us", "us"},
      {"usec", "us"},
      {"h", "h"},
      {"hr", "h"},
      {"hrs", "h"},
      {"hour", "h"},
      {"hours", "h"},
      {"min", "min"},
      {"mins", "min"},
      {"minute", "min"},
      {"minutes", "min"},
      {"d", "d"},
      {"days", "d"},
      {"ns", "ns"},
      {"nsec", "ns"},
      {"nanoseconds", "ns"},
      {"milliseconds", "ms"},
      {"microseconds", "us"},
      {"c", "C"},
      {"degc", "C"},
      {"celsius", "C"},
      {"k", "K"},
      {"f", "F"},
      {"degf", "F"},
  }};
  const auto unit_of = [](const std::string& name) {
    const auto* const found =
        std::find_if(known.begin(), known.end(), [&](const Known& k) { return k.written == name; });
    return found == known.end() ? std::string() : std::string(found->unit);
  };
  const std::string unit = unit_of(text);
  return unit.empty() ? unit_of(without_long_words(std::move(text))) : unit;
}

}  // namespace selfcal::import
