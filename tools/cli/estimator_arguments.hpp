// Options that several commands share: noise figures in the units people write, tolerances by name.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/passes/calibration.hpp"
#include "protocol/command_line/command_line.hpp"
#include "protocol/error.hpp"

namespace selfcal::cli {

// --arw, --vrw, --position-noise: nullopt where not given.
struct NoiseArguments {
  std::optional<double> arw_deg_per_sqrt_h;
  std::optional<double> vrw_ug_per_sqrt_hz;
  std::optional<double> position_sigma_m;

  void add_to(Options& options);
  NoiseOptions in_si() const;
};

// The parameters that NAME means: one (gyro_scale_y) or a group (gyro_scale). An error, with OPTION before it, where
// there is none, or where NAME covers several units (gyro) and one value is meant for all.
enum class Units { one, any };
Expected<std::vector<std::size_t>> parameters_called(std::string_view name, const std::string& option,
                                                     Units units = Units::one);

// --tolerance NAME=VALUE, repeated, VALUE in the parameters' unit.
Expected<ParameterVector> tolerance_from(const std::vector<std::string>& arguments);

}  // namespace selfcal::cli
