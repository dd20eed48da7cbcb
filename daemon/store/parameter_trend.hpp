// How a parameter of one INS moves over the years, and whether a new value belongs to that past.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/store/run_store.hpp"

namespace selfcal {

// Weighted straight line through the determined values: weights 1/(sigma^2 + ageing^2), ageing being the scatter
// beyond sigma that the past itself shows (so that the line's chi^2 per degree of freedom is at most 1).
struct ParameterTrend {
  double reference_year = 0.0;  // weighted mean time of the values, years since 1970
  double value = 0.0;           // there
  double value_sigma = 0.0;
  double slope_per_year = 0.0;
  double slope_sigma = 0.0;
  double ageing = 0.0;  // 1 sigma, in the parameter's unit

  double at(double year) const { return value + slope_per_year * (year - reference_year); }
  double sigma_at(double year) const;  // of a new value, but for its own sigma
};

// Nothing from fewer than two determined values. From two, the slope is unknown and taken as zero, its ageing as
// their difference.
std::optional<ParameterTrend> parameter_trend(const std::vector<ParameterRecord>& history);

double year_of(const std::string& utc);  // years since 1970; 0 where the text is no time

// One line for each thing an operator should know about `value` (none: all is well). `limit` 0: none known.
std::vector<std::string> trend_warnings(const std::string& parameter, const std::string& unit,
                                        const std::vector<ParameterRecord>& past, const ParameterRecord& value,
                                        double limit);

}  // namespace selfcal
