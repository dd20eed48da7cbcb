#include "daemon/run/measured_parameters.hpp"

#include "daemon/store/parameter_trend.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal {

RunStore::Parameters measured_parameters(const CalibrationResult& result) {
  RunStore::Parameters parameters;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    const auto index = static_cast<Eigen::Index>(i);
    parameters.value[i] = result.value(index) / sensor_parameters[i].si_per_unit;
    parameters.sigma[i] = result.sigma(index) / sensor_parameters[i].si_per_unit;
    parameters.determined[i] = result.determined[i];
  }
  return parameters;
}

std::vector<std::string> history_warnings(const RunStore& store, const RunRecord& run, const std::string& utc,
                                          const RunStore::Parameters& parameters, const Limits& limits) {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    const auto past = store.parameter_history(run.serial, static_cast<int>(i));
    if (!past) {
      return all;
    }
    const ParameterRecord now{run.id, utc, parameters.value[i], parameters.sigma[i], parameters.determined[i]};
    const SensorParameter& parameter = sensor_parameters[i];
    const auto warnings =
        trend_warnings(std::string(parameter.name), std::string(parameter.unit), *past, now, limits[i].value_or(0.0));
    all.insert(all.end(), warnings.begin(), warnings.end());
  }
  return all;
}

}  // namespace selfcal
