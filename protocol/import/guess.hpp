// A map guessed from names and numbers: every assumption said, every doubt said, nothing silently wrong.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/import_map.hpp"

namespace selfcal::import {

// What the caller knows.
struct GuessKnowledge {
  std::optional<double> latitude_deg;
  std::optional<double> longitude_deg;
  std::optional<double> height_m;
  std::optional<double> sample_rate_hz;
};

struct Remark {
  std::string key;  // of the map: "gyro.unit"
  std::string text;
  bool doubt = false;
};

struct Guess {
  ImportMap map;  // map.unsettled: the keys of the doubts
  std::vector<Remark> remarks;
};

// Errors (bad_input): a file without numbers, or without six columns of them.
Expected<Guess> guess_map(const ColumnSource& source, const GuessKnowledge& knowledge, const std::string& file);

}  // namespace selfcal::import
