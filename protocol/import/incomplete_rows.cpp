#include "protocol/import/incomplete_rows.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal::import {
namespace {

template <typename Number>
void mark(const std::vector<Number>& values, double most, std::vector<bool>& rows) {
  const auto lacking = std::count_if(values.begin(), values.end(), [](Number v) { return !std::isfinite(v); });
  if (static_cast<double>(lacking) <= most * static_cast<double>(values.size())) {
    for (std::size_t row = 0; row < values.size(); ++row) {
      rows[row] = rows[row] || !std::isfinite(values[row]);
    }
  }
}

template <typename Number>
void keep(const std::vector<bool>& lost, std::vector<Number>& values) {
  std::size_t kept = 0;
  for (std::size_t row = 0; row < values.size(); ++row) {
    if (!lost[row]) {
      values[kept++] = values[row];
    }
  }
  values.resize(kept);
}

}  // namespace

std::vector<bool> incomplete_rows(const ColumnData& data, double most) {
  std::vector<bool> rows(data.rows, false);
  for (const std::vector<double>& values : data.values) {
    mark(values, most, rows);
  }
  mark(data.stamps, most, rows);
  return rows;
}

void leave_out(const std::vector<bool>& rows, ColumnData& data) {
  std::vector<std::pair<std::size_t, std::size_t>> skipped;
  std::size_t part = 0, kept = 0;
  for (std::size_t row = 0; row < data.rows; ++row) {
    while (part + 1 < data.skipped.size() && data.skipped[part + 1].first <= row) {
      ++part;
    }
    if (rows[row]) {
      continue;
    }
    if (!data.skipped.empty()) {
      const std::size_t ahead = row + data.skipped[part].second - kept;
      if (skipped.empty() || skipped.back().second != ahead) {
        skipped.emplace_back(kept, ahead);
      }
    }
    ++kept;
  }
  for (std::vector<double>& values : data.values) {
    keep(rows, values);
  }
  keep(rows, data.stamps);
  data.skipped = std::move(skipped);
  data.rows = kept;
}

}  // namespace selfcal::import
