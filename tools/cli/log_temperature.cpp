#include "tools/cli/log_temperature.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "protocol/import/units.hpp"

namespace selfcal::cli {

namespace {

// "temp_raw", "TEMP_ADC"
bool called_raw(std::string title) {
  std::transform(title.begin(), title.end(), title.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto holds = [&title](const char* word) { return title.find(word) != std::string::npos; };
  return holds("raw") || holds("adc") || holds("lsb") || holds("counts");
}

}  // namespace

LogTemperature temperature_of(const std::vector<double>& values, const import::NamedColumn& named,
                              const std::string& title, bool chosen, bool counts) {
  constexpr double coldest = -60.0, hottest = 150.0;
  const bool said = named.unit == "C" || named.unit == "K" || named.unit == "F";
  LogTemperature taken;
  taken.celsius.reserve(values.size());
  for (const double value : values) {
    taken.celsius.push_back(import::celsius(value, named.unit));
  }
  if (chosen || values.empty()) {
    return taken;
  }
  const auto [low, high] = std::minmax_element(taken.celsius.begin(), taken.celsius.end());
  const bool outside = *low < coldest || *high > hottest;
  const auto whole = [](double value) { return value == std::floor(value); };
  const bool register_of_sensor =
      !said && (counts || called_raw(title)) && std::all_of(values.begin(), values.end(), whole);
  if (outside || register_of_sensor) {
    taken.notes = fmt::format("{} is left alone: {:g} to {:g} {}; --temperature-column takes it for degC", title, *low,
                              *high, outside ? "are no degC" : "are whole numbers whose degrees nobody says");
    taken.celsius.clear();
  } else if (!said) {
    taken.notes = fmt::format("{} is taken for degC, which its name does not say", title);
  }
  return taken;
}

}  // namespace selfcal::cli
