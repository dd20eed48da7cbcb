#include "tools/cli/dwell_table.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>

#include "daemon/estimate/quantity_text.hpp"
#include "estimator/diagnosis/regression/signature_pass.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/geometry/units.hpp"
#include "tools/cli/finding_text.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::LocatedColumn;

constexpr double visible = 1e-6;  // information below which a bias in the dwell would not be seen

std::map<int, std::array<std::string, 6>> biases(const ImuData& data, const diagnosis::Diagnosis& d) {
  const diagnosis::RecordingContext context(data);
  diagnosis::SignaturePass pass(context, {}, true);
  const diagnosis::SignatureRows rows = pass.run(diagnosis::forward_pass(data, d.calibration));
  std::map<int, std::array<std::string, 6>> table;
  Eigen::Index column = pass.first_map_column();
  for (const LocatedColumn& m : pass.map()) {
    const auto signature = rows.columns.col(column++);
    const double information = signature.squaredNorm();
    if (m.kind != LocatedColumn::Kind::dwell) {
      continue;
    }
    const auto axis = static_cast<std::size_t>(m.axis);
    const double unit = diagnosis::map_unit(m.axis) / (m.axis < 3 ? units::degree_per_hour : units::micro_g);
    const double sigma = unit / std::sqrt(information);
    const double bias = unit * signature.dot(rows.residual) / information;
    const bool shown = information > visible && std::abs(bias) >= shown_sigma * sigma;
    table[m.index][axis] = shown ? quantity_text(bias, sigma).value : ".";
  }
  return table;
}

}  // namespace

std::string dwell_table(const ImuData& data, const diagnosis::Diagnosis& d) {
  std::string text = fmt::format(
      "\nbias that each dwell shows against the 24 (gyros deg/h, accelerometers ug; . within {:.0f} sigma):\n"
      "  {:>3}{:>12}{:>10}{:>10}{:>10}{:>9}{:>9}{:>9}\n",
      shown_sigma, "no.", "outer/inner", "gyro x", "gyro y", "gyro z", "accel x", "accel y", "accel z");
  const auto table = biases(data, d);
  int number = 0;
  for (const SegmentSummary& segment : d.calibration.segments) {
    if (segment.rotation) {
      continue;
    }
    const auto found = table.find(number++);
    if (found == table.end()) {
      continue;
    }
    const auto& b = found->second;
    text += fmt::format("  {:>3}{:>12}{:>10}{:>10}{:>10}{:>9}{:>9}{:>9}\n", number,
                        fmt::format("{:.0f}/{:.0f}", segment.outer_deg, segment.inner_deg), b[0], b[1], b[2], b[3],
                        b[4], b[5]);
  }
  return text;
}

}  // namespace selfcal::cli
