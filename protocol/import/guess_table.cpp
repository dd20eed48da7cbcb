#include "protocol/import/guess_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace selfcal::import {
namespace {

// What the gyros and the read-out show of one turn, or of a stretch of time.
struct Step {
  Vector3 gyro = Vector3::Zero();
  double by = 0.0;
};

// From rest to rest a read-out that is late does not matter.
std::vector<Step> steps_between_rests(const Motion& motion) {
  std::vector<Step> steps;
  for (const Turn& turn : turns_of(motion, rests_of(motion))) {
    steps.push_back({turn.gyro, turn.by[0]});
  }
  return steps;
}

// About their mean, which holds the gyros' bias.
std::vector<Step> steps_of_time(const Motion& motion, std::size_t blocks) {
  std::vector<Step> steps;
  Step mean;
  for (std::size_t k = 0; k + blocks <= motion.blocks.size(); k += blocks) {
    Step step;
    for (std::size_t j = k; j < k + blocks; ++j) {
      step.gyro += motion.blocks[j].gyro;
      step.by += motion.blocks[j].to[0] - motion.blocks[j].from[0];
    }
    mean.gyro += step.gyro;
    mean.by += step.by;
    steps.push_back(step);
  }
  for (Step& step : steps) {
    step.gyro -= mean.gyro / static_cast<double>(steps.size());
    step.by -= mean.by / static_cast<double>(steps.size());
  }
  return steps;
}

double mean_square(const std::vector<Step>& steps) {
  double sum = 0.0;
  for (const Step& step : steps) {
    sum += step.by * step.by / static_cast<double>(steps.size());
  }
  return sum;
}

}  // namespace

std::optional<TableAxis> table_axis(const TriadColumns& gyro, const TriadColumns& accel,
                                    const std::vector<double>& angle, double angle_unit, std::size_t samples) {
  std::array<std::vector<double>, 2> angles{angle, std::vector<double>(angle.size(), 0.0)};
  for (double& value : angles[0]) {
    value *= angle_unit;
  }
  const Motion motion = find_motion(gyro, accel, angles, samples);
  constexpr std::size_t fewest = 3;
  std::vector<Step> steps = steps_between_rests(motion);
  const bool stops = steps.size() >= fewest;
  if (!stops) {
    // Over a second or so, or over a quarter of one where a table goes forth and back meanwhile: where it turns more.
    constexpr std::size_t second = 4;
    steps = steps_of_time(motion, second);
    std::vector<Step> shorter = steps_of_time(motion, 1);
    if (mean_square(shorter) > mean_square(steps)) {
      steps = std::move(shorter);
    }
  }
  Vector3 product = Vector3::Zero();
  double of_angle = 0.0, of_gyro = 0.0;
  for (const Step& step : steps) {
    product += step.gyro * step.by;
    of_angle += step.by * step.by;
    of_gyro += step.gyro.squaredNorm();
  }
  if (steps.size() < fewest || !(of_angle > 0.0) || !(of_gyro > 0.0)) {
    return std::nullopt;
  }
  TableAxis found;
  found.per_rad = product / of_angle;
  found.explained = product.squaredNorm() / (of_angle * of_gyro);
  found.turns = stops ? static_cast<int>(steps.size()) : 0;
  return found;
}

TableFit fit_table(const TriadColumns& gyro, const TriadColumns& accel, const std::vector<double>& angle,
                   const std::string& claimed, const UnitClaim& gyros, std::optional<double> interval_s) {
  constexpr double good_turns = 0.95;  // as of a gimbal with two
  const auto samples =
      interval_s ? static_cast<std::size_t>(std::clamp(0.25 / *interval_s, 4.0, 2000.0)) : std::size_t{25};
  const bool known = find_unit(claimed) && find_unit(claimed)->quantity == Quantity::angle;
  const bool gyros_known = find_unit(gyros.unit).has_value() && interval_s;
  TableFit fit;
  for (const std::string& unit : known ? std::vector<std::string>{claimed} : std::vector<std::string>{"deg", "rad"}) {
    const auto axis = table_axis(gyro, accel, angle, find_unit(unit)->si, samples);
    if (!axis) {
      continue;
    }
    fit.explained = std::max(fit.explained, axis->explained);
    const bool good = axis->explained > good_turns;
    fit.good = fit.good || good;
    if (good && (!gyros_known || gyro_unit(1.0 / axis->per_rad.norm(), *interval_s, gyros))) {
      fit.ways.push_back({unit, *axis});
    }
  }
  return fit;
}

}  // namespace selfcal::import
