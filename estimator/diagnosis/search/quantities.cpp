#include "estimator/diagnosis/search/quantities.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string_view>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr int angle_bins = 8, axis_bins = 6, most_temperature_bins = 10;
constexpr double least_sigma = 3.0;

int angle_bin(double angle) {
  const double turns = angle / (2.0 * std::numbers::pi);
  return static_cast<int>(std::lround(angle_bins * (turns - std::floor(turns)))) % angle_bins;
}

// 2 axis, 1 more where it points the other way.
int axis_bin(const Vector3& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return 2 * static_cast<int>(axis) + (direction(axis) < 0.0 ? 1 : 0);
}

void bias_while(bool inside, const EffectContext& c, Columns velocity, Columns angle) {
  if (inside) {
    angle.leftCols<3>().diagonal().array() += c.dt;
    velocity.rightCols<3>().diagonal().array() += c.dt;
  }
}

void outer_columns(const EffectContext& c, double bin, Columns velocity, Columns angle) {
  bias_while(std::isfinite(c.outer) && angle_bin(c.outer) == std::lround(bin), c, velocity, angle);
}
void inner_columns(const EffectContext& c, double bin, Columns velocity, Columns angle) {
  bias_while(std::isfinite(c.inner) && angle_bin(c.inner) == std::lround(bin), c, velocity, angle);
}
void gravity_columns(const EffectContext& c, double bin, Columns velocity, Columns angle) {
  bias_while(axis_bin(c.u) == std::lround(bin), c, velocity, angle);
}
void earth_rate_columns(const EffectContext& c, double bin, Columns velocity, Columns angle) {
  bias_while(axis_bin(c.earth_rate_b) == std::lround(bin), c, velocity, angle);
}
template <int Width>
void temperature_columns(const EffectContext& c, double bin, Columns velocity, Columns angle) {
  bias_while(std::isfinite(c.temperature) && std::floor(c.temperature / Width) == bin, c, velocity, angle);
}

Effect quantity(std::string_view id, void (*columns)(const EffectContext&, double, Columns, Columns)) {
  Effect effect;
  effect.id = id;
  effect.sensor = columns;
  for (int axis = 0; axis < 6; ++axis) {
    effect.parameters.push_back({axis_ids[static_cast<std::size_t>(axis)], axis < 3 ? "deg/h" : "ug",
                                 axis < 3 ? units::degree_per_hour : units::micro_g, axis < 3 ? 0.01 : 10.0});
  }
  return effect;
}

// An angle in bins of 45 deg, or a direction by the axis of b that is nearest to it.
struct AttitudeBins {
  bool angle;
  const char* words;  // of the angle, or of the direction
  Effect effect;
};

const std::array<AttitudeBins, 4>& attitudes() {
  static const std::array<AttitudeBins, 4> all = {
      {{true, "outer", quantity("outer_angle", outer_columns)},
       {true, "inner", quantity("inner_angle", inner_columns)},
       {false, "up", quantity("gravity", gravity_columns)},
       {false, "the Earth's axis", quantity("earth_rate", earth_rate_columns)}}};
  return all;
}

struct TemperatureBins {
  int width_c;
  Effect effect;
};

const std::array<TemperatureBins, 4>& temperatures() {
  static const std::array<TemperatureBins, 4> all = {{{1, quantity("temperature", temperature_columns<1>)},
                                                      {2, quantity("temperature", temperature_columns<2>)},
                                                      {5, quantity("temperature", temperature_columns<5>)},
                                                      {20, quantity("temperature", temperature_columns<20>)}}};
  return all;
}

template <typename Bins>
const Bins* bins_of(const std::array<Bins, 4>& all, const Effect& effect) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Bins& b) { return &b.effect == &effect; });
  return found == all.end() ? nullptr : &*found;
}

std::string words_of(const Candidate& bin, std::size_t axis, double mean_temperature_c) {
  const int k = static_cast<int>(std::lround(bin.constant));
  std::array<char, 80> text{};
  if (const TemperatureBins* t = bins_of(temperatures(), *bin.effect)) {
    std::snprintf(text.data(), text.size(), "between %.1f and %.1f degC", mean_temperature_c + k * t->width_c,
                  mean_temperature_c + (k + 1) * t->width_c);
  } else if (const AttitudeBins* a = bins_of(attitudes(), *bin.effect); !a->angle) {
    std::snprintf(text.data(), text.size(), "while %c%c is nearest to %s", "+-"[k % 2], "xyz"[k / 2], a -> words);
  } else {
    std::snprintf(text.data(), text.size(), "%s angle %d deg +- 22.5", a->words, k * 360 / angle_bins);
  }
  return std::string(axis < 3 ? "gyro " : "accelerometer ") + "xyz"[axis % 3] + ", " + text.data();
}

}  // namespace

std::vector<Candidate> quantity_bins(const RecordingContext& context) {
  std::vector<Candidate> bins;
  const ImuData& data = context.data();
  const bool gimbal = !data.gimbal_outer.empty() && !data.gimbal_inner.empty();
  for (const AttitudeBins& a : attitudes()) {
    for (int k = 0; (gimbal || !a.angle) && k < (a.angle ? angle_bins : axis_bins); ++k) {
      bins.push_back({&a.effect, static_cast<double>(k), 0, 0});
    }
  }
  if (context.has_temperature()) {
    const auto [least, most] = std::minmax_element(data.temperature.begin(), data.temperature.end());
    const double low = *least - context.mean_temperature(), high = *most - context.mean_temperature();
    for (const TemperatureBins& t : temperatures()) {
      const auto first = static_cast<int>(std::floor(low / t.width_c)),
                 last = static_cast<int>(std::floor(high / t.width_c));
      if (last - first < most_temperature_bins) {
        for (int k = first; k <= last; ++k) {
          bins.push_back({&t.effect, static_cast<double>(k), 0, 0});
        }
        break;
      }
    }
  }
  return bins;
}

std::vector<Located> locate_by_quantity(const Evidence& evidence, const std::vector<Candidate>& bins,
                                        const std::vector<int>& fitted, double mean_temperature_c) {
  std::vector<Located> all;
  const SingleTest test(evidence, fitted);
  for (const Candidate& bin : bins) {
    for (std::size_t axis = 0; axis < axis_ids.size(); ++axis) {
      const auto bias = test(bin.first + static_cast<int>(axis));
      if (!bias || std::abs(bias->z) < least_sigma) {
        continue;
      }
      Located l;
      l.where = bin.effect->id;
      l.axis = axis_ids[axis];
      l.significance = std::abs(bias->z);
      l.size = bias->size * bin.effect->parameters[axis].typical;
      l.words = words_of(bin, axis, mean_temperature_c);
      const auto same =
          std::find_if(all.begin(), all.end(), [&](const Located& other) { return other.where == l.where; });
      if (same == all.end()) {
        all.push_back(l);
      } else if (same->significance < l.significance) {
        *same = l;
      }
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Located& a, const Located& b) { return a.significance > b.significance; });
  return all;
}

}  // namespace selfcal::diagnosis
