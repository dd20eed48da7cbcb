// Which column of a log is its time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/import/guess_roles.hpp"

namespace selfcal::import {

struct FoundTime {
  std::optional<std::size_t> column;
  bool is_date = false;
  std::vector<long double> stamps;
  std::string clock_words;  // as in Roles
  std::vector<Remark> remarks;
};

// By its name, the sensor's own clock first; else one that rises evenly, unless the caller knows the rate. `lost`: rows that `values` is without.
FoundTime find_time_column(const ColumnSource& source, const std::vector<NamedColumn>& named, const Values& values,
                           const std::vector<bool>& lost, bool rate_is_given);

}  // namespace selfcal::import
