#include "tests/unit/planning/limit_table.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::test {
namespace {

struct Printed {
  double value, half_unit;
};

Printed parse(const std::string& text) {
  const std::size_t point = text.find('.');
  double unit = 1.0;
  if (point != std::string::npos) {
    unit = std::pow(10.0, -static_cast<double>(text.size() - point - 1));
  } else if (text.ends_with('0')) {
    unit = 10.0;
  }
  return {std::stod(text), 0.5 * unit};
}

std::vector<Printed> split(const std::string& text, char separator) {
  std::vector<Printed> parts;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    parts.push_back(parse(text.substr(at, end - at)));
    at = end + 1;
  }
  return parts;
}

void expect_between(double value, const Printed& low, const Printed& high, double allowed) {
  EXPECT_GE(value, (low.value - low.half_unit) * (1.0 - allowed));
  EXPECT_LE(value, (high.value + high.half_unit) * (1.0 + allowed));
}

// `sigma` of the entry's parameters, in their units.
void expect_entry(const LimitEntry& entry, const Eigen::VectorXd& sigma, double allowed) {
  if (entry.kind == LimitKind::each) {
    const std::vector<Printed> printed = split(entry.text, '/');
    ASSERT_EQ(static_cast<int>(printed.size()), entry.count);
    for (std::size_t k = 0; k < printed.size(); ++k) {
      expect_between(sigma(static_cast<Eigen::Index>(k)), printed[k], printed[k], allowed);
    }
  } else if (entry.kind == LimitKind::range) {
    const std::vector<Printed> printed = split(entry.text, '-');
    expect_between(sigma.minCoeff(), printed[0], printed[1], allowed);
    expect_between(sigma.maxCoeff(), printed[0], printed[1], allowed);
  } else {
    const bool largest = entry.kind == LimitKind::largest;
    const double value = largest ? sigma.maxCoeff() : sigma.norm() / std::sqrt(static_cast<double>(entry.count));
    expect_between(value, parse(entry.text), parse(entry.text), allowed);
  }
}

}  // namespace

const std::vector<LimitRow>& limit_table() {
  constexpr int bias = parameter::accel_bias, drift = parameter::gyro_drift, scale = parameter::accel_scale_pos,
                A = parameter::accel_misalignment, K = parameter::gyro_scale, G = parameter::gyro_misalignment;
  using enum LimitKind;
  static const std::vector<LimitRow> table = {LimitRow{"table2_level",
                                                       "table2",
                                                       150,
                                                       0,
                                                       0.001,
                                                       5,
                                                       0.01,
                                                       {{bias, 3, rms, "9.4"},
                                                        {drift, 3, each, ".0014/.0021/.0016"},
                                                        {scale, 6, rms, "9.4"},
                                                        {A, 3, each, "1.9/25/1.9"},
                                                        {K, 3, each, "6.0/80/6.0"},
                                                        {G, 6, each, "1.9/25/.20/1.9/.20/3.9"}}},
                                              LimitRow{"table2_level_noise_by_10",
                                                       "table2",
                                                       150,
                                                       0,
                                                       0.0001,
                                                       0.5,
                                                       0.01,
                                                       {{bias, 3, rms, "2.3"},
                                                        {drift, 3, rms, ".0002"},
                                                        {scale, 6, rms, "2.3"},
                                                        {A, 3, each, ".5/2.6/.5"},
                                                        {K, 3, each, "1.4/8.5/1.4"},
                                                        {G, 6, each, ".5/2.6/.03/.5/.03/.9"}}},
                                              LimitRow{"table2_pitch90",
                                                       "table2",
                                                       150,
                                                       90,
                                                       0.001,
                                                       5,
                                                       0.01,
                                                       {{bias, 3, rms, "0.96"},
                                                        {drift, 3, each, ".0016/.0014/.0015"},
                                                        {scale, 6, rms, "1.0"},
                                                        {A, 3, each, ".25/.25/.25"},
                                                        {K, 3, each, ".79/.79/.79"},
                                                        {G, 6, each, ".32/.32/.20/.32/.20/.20"}}},
                                              LimitRow{"horizontal_level",
                                                       "horizontal",
                                                       150,
                                                       0,
                                                       0.001,
                                                       5,
                                                       0.01,
                                                       {{bias, 3, range, "0.81-0.89"},
                                                        {drift, 3, rms, ".0015"},
                                                        {scale, 6, range, "0.85-0.91"},
                                                        {A, 3, each, ".20/.25/.20"},
                                                        {K, 3, each, ".77/.77/.69"},
                                                        {G, 6, each, ".22/.31/.21/.28/.21/.20"}}},
                                              LimitRow{"horizontal_60_s",
                                                       "horizontal",
                                                       60,
                                                       0,
                                                       0.001,
                                                       5,
                                                       0.01,
                                                       {{bias, 3, range, "0.82-0.90"},
                                                        {drift, 3, each, ".0027/.0027/.0024"},
                                                        {scale, 6, range, "0.92-0.97"},
                                                        {A, 3, each, ".20/.25/.20"},
                                                        {K, 3, each, ".77/.77/.69"},
                                                        {G, 6, each, ".22/.32/.21/.28/.21/.20"}}},
                                              LimitRow{"horizontal_20_s",
                                                       "horizontal",
                                                       20,
                                                       0,
                                                       0.001,
                                                       5,
                                                       0.01,
                                                       {{bias, 3, range, "1.3-1.5"},
                                                        {drift, 3, rms, ".006"},
                                                        {scale, 6, range, "1.5-1.8"},
                                                        {A, 3, each, ".45/.58/.44"},
                                                        {K, 3, each, ".83/.98/.77"},
                                                        {G, 6, largest, ".61"}}},
                                              LimitRow{"horizontal_half_the_noise",
                                                       "horizontal",
                                                       150,
                                                       0,
                                                       0.0005,
                                                       2.5,
                                                       0.01,
                                                       {{bias, 3, range, "0.44-0.48"},
                                                        {drift, 3, rms, ".0008"},
                                                        {scale, 6, range, "0.46-0.49"},
                                                        {A, 3, largest, ".13"},
                                                        {K, 3, largest, ".41"},
                                                        {G, 6, largest, ".17"}}},
                                              LimitRow{"horizontal_10_um",
                                                       "horizontal",
                                                       150,
                                                       0,
                                                       0.001,
                                                       5,
                                                       1e-5,
                                                       {{bias, 3, each, "0.63/.68/.63"},
                                                        {drift, 3, rms, ".0015"},
                                                        {scale, 6, range, ".67-.71"},
                                                        {A, 3, each, ".15/.19/.15"},
                                                        {K, 3, each, ".60/.60/.54"},
                                                        {G, 6, each, ".17/.24/.16/.21/.16/.15"}}},
                                              LimitRow{"table2_pitch90_10_um",
                                                       "table2",
                                                       150,
                                                       90,
                                                       0.001,
                                                       5,
                                                       1e-5,
                                                       {{bias, 3, rms, "0.73"},
                                                        {drift, 3, range, ".0014-.0016"},
                                                        {scale, 6, range, ".76-.78"},
                                                        {A, 3, rms, ".19"},
                                                        {K, 3, rms, ".61"},
                                                        {G, 6, each, ".25/.25/.16/.25/.16/.16"}}},
                                              LimitRow{"table2_level_10_um",
                                                       "table2",
                                                       150,
                                                       0,
                                                       0.001,
                                                       5,
                                                       1e-5,
                                                       {{bias, 3, range, "2.0-2.1"},
                                                        {drift, 3, each, ".0014/.0021/.0016"},
                                                        {scale, 6, range, "2.0-2.1"},
                                                        {A, 3, each, ".42/25/.42"},
                                                        {K, 3, each, "1.3/80/1.3"},
                                                        {G, 6, each, ".44/25/.16/.45/.16/.84"}}}};
  return table;
}

const LimitRow& limit_row(const std::string& name) {
  for (const LimitRow& row : limit_table()) {
    if (row.name == name) {
      return row;
    }
  }
  throw std::out_of_range("no row " + name);
}

void expect_limit(const LimitRow& row, const ParameterVector& sigma, double allowed) {
  for (const LimitEntry& entry : row.entries) {
    SCOPED_TRACE(testing::Message() << row.name << ": " << entry.text << " from "
                                    << sensor_parameters[static_cast<std::size_t>(entry.first)].name);
    Eigen::VectorXd in_units(entry.count);
    for (int k = 0; k < entry.count; ++k) {
      const auto index = static_cast<std::size_t>(entry.first + k);
      in_units(k) = sigma(entry.first + k) / sensor_parameters[index].si_per_unit;
    }
    expect_entry(entry, in_units, allowed);
  }
}

}  // namespace selfcal::test
