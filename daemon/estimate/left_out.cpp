#include "daemon/estimate/left_out.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal {
namespace {

constexpr std::size_t most_told = 8;
constexpr double worth_telling = 1.02;

double seconds_of(const CalibrationResult& result) {
  double sum = 0.0, end = -HUGE_VAL;
  for (const LeftOut& l : result.left_out) {
    if (!l.sensors) {
      continue;
    }
    sum += std::max(0.0, l.end_s - std::max(l.start_s, end));
    end = std::max(end, l.end_s);
  }
  return sum;
}

double cost(const CalibrationResult& result, int k) { return result.sigma(k) / result.sigma_whole(k); }

std::string cost_text(const CalibrationResult& result) {
  std::vector<int> dear;
  for (int k = 0; k < sensor_parameter_count; ++k) {
    if (cost(result, k) > worth_telling) {
      dear.push_back(k);
    }
  }
  std::sort(dear.begin(), dear.end(), [&](int a, int b) { return cost(result, a) > cost(result, b); });
  std::string text;
  for (std::size_t i = 0; i < std::min(most_told, dear.size()); ++i) {
    text += fmt::format("{}{} {:.2f} times", text.empty() ? "" : ", ",
                        sensor_parameters[static_cast<std::size_t>(dear[i])].name, cost(result, dear[i]));
  }
  return text.empty() ? "  cost: no sigma is 2 % larger for it\n"
                      : fmt::format("  cost: sigma of {}; the others less\n", text);
}

}  // namespace

std::string left_out_text(const CalibrationResult& result) {
  if (result.left_out.empty()) {
    return {};
  }
  const bool none_of_sensors =
      std::all_of(result.left_out.begin(), result.left_out.end(), [](const LeftOut& l) { return !l.sensors; });
  std::string text = none_of_sensors ? fmt::format("mended in {} stretches:\n", result.left_out.size())
                                     : fmt::format("left out, {:.1f} s of the sensors in {} stretches:\n",
                                                   seconds_of(result), result.left_out.size());
  for (std::size_t i = 0; i < std::min(most_told, result.left_out.size()); ++i) {
    const LeftOut& l = result.left_out[i];
    text += fmt::format("  {:.2f} to {:.2f} s  {}: {}{}\n", l.start_s, l.end_s, l.fault, l.words,
                        l.turn ? "; how far this turn went comes from the dwells beside it" : "");
  }
  if (result.left_out.size() > most_told) {
    text += fmt::format("  and {} more\n", result.left_out.size() - most_told);
  }
  return none_of_sensors ? text : text + cost_text(result);
}

nlohmann::ordered_json left_out_json(const CalibrationResult& result) {
  nlohmann::ordered_json stretches = nlohmann::ordered_json::array(), costs = nlohmann::ordered_json::object();
  for (const LeftOut& l : result.left_out) {
    stretches.push_back(
        {{"start_s", l.start_s}, {"end_s", l.end_s}, {"fault", l.fault}, {"words", l.words}, {"turn", l.turn}});
  }
  for (int k = 0; k < sensor_parameter_count; ++k) {
    costs[std::string(sensor_parameters[static_cast<std::size_t>(k)].name)] = cost(result, k);
  }
  return {{"seconds", seconds_of(result)}, {"stretches", std::move(stretches)}, {"sigma_factor", std::move(costs)}};
}

}  // namespace selfcal
