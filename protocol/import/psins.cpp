#include "protocol/import/psins.hpp"

#include <string_view>
#include <vector>

#include "protocol/import/text_dialect.hpp"

namespace selfcal::import {

std::optional<PsinsHeader> read_psins(const std::string& preamble) {
  if (preamble.find("PSINS-format") == std::string::npos) {
    return std::nullopt;
  }
  std::vector<std::array<double, 6>> rows;
  std::string_view rest = preamble;
  std::vector<std::string_view> fields;
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    const std::string_view line = trimmed(rest.substr(0, end));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    split_fields(line, ' ', fields);
    if (line.starts_with('%') || fields.size() != 6) {
      continue;
    }
    std::array<double, 6>& row = rows.emplace_back();
    for (std::size_t k = 0; k < row.size(); ++k) {
      const auto value = number_of(fields[k], '.');
      if (!value) {
        return std::nullopt;
      }
      row[k] = *value;
    }
  }
  constexpr std::size_t header_lines = 3;
  if (rows.size() != header_lines || !(rows[1][4] > 0.0) || !(rows[1][5] > 0.0)) {
    return std::nullopt;
  }
  PsinsHeader header;
  header.latitude_deg = rows[1][0];
  header.longitude_deg = rows[1][1];
  header.height_m = rows[1][2];
  header.interval_s = rows[1][4] * 1e-3;
  for (std::size_t k = 0; k < 3; ++k) {
    header.gyro_arcsec[k] = rows[2][k];
    header.accelerometer_mps[k] = rows[2][k + 3] * 1e-6 * rows[1][5];  // ug*s
  }
  return header;
}

}  // namespace selfcal::import
