// Which column is what: by name where there are names, else by what numbers can only be.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "protocol/import/column_source.hpp"
#include "protocol/import/guess.hpp"
#include "protocol/import/guess_names.hpp"
#include "protocol/import/motion.hpp"

namespace selfcal::import {

using Values = std::vector<std::vector<double>>;  // by column; NaN where there is no number

struct Roles {
  std::optional<std::size_t> time;
  bool time_is_date = false;
  std::vector<long double> stamps;
  std::string clock_words;  // that the clock begins again where it is full, and where; empty: it does not
  std::optional<std::array<std::size_t, 3>> gyro;
  std::optional<std::array<std::size_t, 3>> accelerometer;
  std::optional<std::array<std::size_t, 2>> gimbal;  // outer, inner where `gimbal_named`; else as they stand
  bool gimbal_named = false;
  std::optional<std::size_t> angle;  // the only free column that its name calls an angle, where there is no pair
  bool angle_of_a_table = false;     // and its name says that it is a read-out, no attitude that somebody computed
  bool angle_is_rate = false;        // how fast that turns
  std::vector<std::size_t> temperature;
};

// Whether a column holds a number in every row, and a row.
bool all_finite(const std::vector<double>& values);

TriadColumns triad_columns(const Values& values, const std::array<std::size_t, 3>& columns);

// BY_FORMAT: the file's format says that the first six columns are gyros and accelerometers. Adds to REMARKS what was assumed and doubted.
// LOST: the rows of the file that VALUES is without. RATE_IS_GIVEN: a column that no name calls a time is none, be it that it rises.
Roles assign_roles(const ColumnSource& source, const std::vector<NamedColumn>& named, const Values& values,
                   const std::vector<bool>& lost, bool by_format, bool rate_is_given, std::vector<Remark>& remarks);

}  // namespace selfcal::import
