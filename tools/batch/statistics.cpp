#include "tools/batch/statistics.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace selfcal::batch {
namespace {

using Json = nlohmann::ordered_json;

struct Sums {
  std::string name, unit;
  int runs = 0, within_95 = 0;
  double error = 0.0, squared_error = 0.0, squared_sigma = 0.0, squared_ratio = 0.0;
};

constexpr double z_95 = 1.959964;  // of the normal distribution, two-sided

void add(Sums& sums, const Json& estimated, double truth) {
  sums.name = estimated.at("name");
  sums.unit = estimated.at("unit");
  if (!estimated.at("determined").get<bool>()) {
    return;
  }
  const double error = estimated.at("value").get<double>() - truth, sigma = estimated.at("sigma");
  ++sums.runs;
  sums.within_95 += std::abs(error) <= z_95 * sigma ? 1 : 0;
  sums.error += error;
  sums.squared_error += error * error;
  sums.squared_sigma += sigma * sigma;
  sums.squared_ratio += error * error / (sigma * sigma);
}

Json to_json(const Sums& sums) {
  if (sums.runs == 0) {
    return {{"name", sums.name},   {"unit", sums.unit}, {"determined", 0}, {"mean_error", Json()},
            {"rms_error", Json()}, {"sigma", Json()},   {"ratio", Json()}, {"within_95", 0}};
  }
  const double n = sums.runs;
  return {{"name", sums.name},
          {"unit", sums.unit},
          {"determined", sums.runs},
          {"mean_error", sums.error / n},
          {"rms_error", std::sqrt(sums.squared_error / n)},
          {"sigma", std::sqrt(sums.squared_sigma / n)},
          {"ratio", std::sqrt(sums.squared_ratio / n)},
          {"within_95", sums.within_95}};
}

}  // namespace

Expected<Json> calibration_statistics(const BatchFolder& folder, const Task& task) {
  std::vector<Sums> all;
  int runs = 0;
  for (const std::size_t need : task.needs) {
    const auto estimate = folder.result(need);
    const auto simulated = estimate ? folder.result(folder.task(need).needs.front()) : estimate;
    if (!simulated) {
      return tl::unexpected(simulated.error());
    }
    const Json& found = estimate->at("answer").at("parameters");
    const Json& truth = simulated->at("truth").at("parameters");
    all.resize(found.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      if (found[k].at("name") != truth.at(k).at("name") || found[k].at("unit") != truth[k].at("unit")) {
        return fail(ErrorKind::internal, "estimate and truth differ in their parameters");
      }
      add(all[k], found[k], truth[k].at("value"));
    }
    ++runs;
  }
  Json parameters = Json::array();
  for (const Sums& sums : all) {
    parameters.push_back(to_json(sums));
  }
  return Json{{"runs", runs}, {"parameters", std::move(parameters)}};
}

}  // namespace selfcal::batch
