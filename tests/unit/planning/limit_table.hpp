// The published table of the physical limit (lower bounds from covariance analysis), and how its printed figures are compared.
#pragma once

#include <Eigen/Core>
#include <ostream>
#include <string>
#include <vector>

#include "estimator/models/sensor_model.hpp"

namespace selfcal::test {

// One figure for several parameters is their root mean square, a range bounds each of them, "<=" is the largest.
enum class LimitKind { each, rms, range, largest };

// `text` as the table prints it, slashes between parameters, a dash in a range.
struct LimitEntry {
  int first, count;  // in the table of the 24
  LimitKind kind;
  std::string text;
};

// The base heads 30 deg (as in the reference recordings) at latitude 40 deg.
struct LimitRow {
  std::string name, schedule;
  double dwell_s, pitch_deg, arw_deg_per_sqrt_h, vrw_ug, position_m;
  std::vector<LimitEntry> entries;

  friend std::ostream& operator<<(std::ostream& out, const LimitRow& row) { return out << row.name; }
};

const std::vector<LimitRow>& limit_table();
const LimitRow& limit_row(const std::string& name);

// Expects every entry of the row of `sigma` (SI), within `allowed` (a fraction). A printed figure stands for all values
// that round to it: half a unit of its last significant digit is allowed on top, and a trailing zero ("80") is not
// taken for significant.
void expect_limit(const LimitRow& row, const ParameterVector& sigma, double allowed);

}  // namespace selfcal::test
