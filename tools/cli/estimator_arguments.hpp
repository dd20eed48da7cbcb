// Options that several commands share: noise figures in the units people write, tolerances by name.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimator/passes/calibration.hpp"
#include "protocol/error.hpp"

namespace CLI {
class App;
}

namespace selfcal::cli {

// --arw, --vrw, --position-noise: nullopt where not given.
struct NoiseArguments {
  std::optional<double> arw_deg_per_sqrt_h;
  std::optional<double> vrw_ug_per_sqrt_hz;
  std::optional<double> position_sigma_m;

  void add_to(CLI::App& app);
  NoiseOptions in_si() const;
};

// --tolerance NAME=VALUE, repeated: NAME is a parameter (gyro_scale_y) or a group (gyro_scale), VALUE in its unit.
Expected<ParameterVector> tolerance_from(const std::vector<std::string>& arguments);

}  // namespace selfcal::cli
