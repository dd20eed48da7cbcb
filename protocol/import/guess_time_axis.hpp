// What the times of a log are: their unit, their rate, where they begin.
#pragma once

#include <optional>
#include <vector>

#include "protocol/import/guess.hpp"
#include "protocol/import/guess_names.hpp"
#include "protocol/import/guess_roles.hpp"

namespace selfcal::import {

struct TimeGuess {
  TimeMap map;                           // but for the column
  std::optional<double> sample_rate_hz;  // for the map; none where it follows from what is to be settled
  std::optional<double> interval_s;      // none: not known
  std::vector<Remark> remarks;
};

// By the column that `roles` found, or else by the rate of the file's header or the caller's, Hz.
TimeGuess guess_time_axis(const ColumnSource& source, const Roles& roles, const std::vector<NamedColumn>& named,
                          std::optional<double> rate_of_header, std::optional<double> rate_given);

}  // namespace selfcal::import
