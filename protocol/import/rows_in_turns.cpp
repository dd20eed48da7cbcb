#include "protocol/import/rows_in_turns.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "protocol/import/median.hpp"

namespace selfcal::import {
namespace {

constexpr int most_labels = 8;

// Whether the usual step to a row of another label is several times that to the last row of the same one. A clock rises with both.
bool tells_apart(const std::vector<double>& values, const std::vector<int>& labels) {
  constexpr double several = 3.0;
  constexpr std::size_t enough = 50;
  std::array<double, most_labels> last{};
  std::array<bool, most_labels> seen{};
  std::vector<double> within, between;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto label = static_cast<std::size_t>(labels[k]);
    if (!std::isfinite(values[k])) {
      continue;
    }
    if (seen.at(label)) {
      within.push_back(std::abs(values[k] - last.at(label)));
    }
    if (k > 0 && labels[k] != labels[k - 1] && std::isfinite(values[k - 1])) {
      between.push_back(std::abs(values[k] - values[k - 1]));
    }
    last.at(label) = values[k];
    seen.at(label) = true;
  }
  return within.size() > enough && between.size() > enough &&
         median(std::move(between)) > several * median(std::move(within));
}

// Small whole numbers of which two to eight take turns, numbered from 0; empty: none.
std::vector<int> labels_of(const std::vector<double>& values) {
  constexpr double largest = 255.0;
  std::set<double> found;
  std::size_t changes = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!(values[k] >= 0.0 && values[k] <= largest && values[k] == std::floor(values[k]))) {
      return {};
    }
    found.insert(values[k]);
    changes += k > 0 && values[k] != values[k - 1] ? 1 : 0;
    if (found.size() > most_labels) {
      return {};
    }
  }
  if (found.size() < 2 || 2 * changes < values.size()) {
    return {};
  }
  std::vector<int> labels;
  labels.reserve(values.size());
  for (const double value : values) {
    labels.push_back(static_cast<int>(std::distance(found.begin(), found.find(value))));
  }
  return labels;
}

}  // namespace

bool rows_take_turns(const std::vector<std::vector<double>>& values, const std::vector<int>& labels) {
  constexpr std::ptrdiff_t columns = 2;  // one alone may be a status that goes with the label
  return std::count_if(values.begin(), values.end(),
                       [&](const std::vector<double>& column) { return tells_apart(column, labels); }) >= columns;
}

std::string numbered_rows(const ColumnSource& source) {
  ColumnRequest request;
  request.tolerant = true;
  request.most_rows = 2000;
  for (std::size_t k = 0; k < source.names().size(); ++k) {
    request.columns.push_back(k);
  }
  const Expected<ColumnData> data = source.read(request);
  for (std::size_t k = 0; data && k < data->values.size(); ++k) {
    const std::vector<int> labels = labels_of(data->values[k]);
    if (!labels.empty() && rows_take_turns(data->values, labels)) {
      std::set<double> found(data->values[k].begin(), data->values[k].end());
      return fmt::format("rows of several sensors, which {} tells apart: {}: a file for each is read (awk makes them)",
                         source.title(k), fmt::join(found, ", "));
    }
  }
  return {};
}

}  // namespace selfcal::import
