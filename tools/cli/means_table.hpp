// Tables instead of logs: means of poses, and one accelerometer at the angles of a dividing head.
#pragma once

#include <optional>
#include <string>

#include "estimator/diagnosis/poses/poses.hpp"
#include "protocol/error.hpp"
#include "tools/cli/poses_input.hpp"

namespace selfcal::cli {

struct TableAnswer {
  diagnosis::PoseDiagnosis diagnosis;
  bool si = false;    // readings are rad/s and m/s^2
  std::string notes;  // what was taken for what
};

// Accelerometers in fewer rows than a log has, by names or three columns without any (one that counts the rows may stand before them); or a column
// of angles and one of readings. None: a log, or another sensor. `gyro_unit`: nominal rad/s a raw unit. Errors (bad_input): a row without a number.
Expected<std::optional<TableAnswer>> answer_of_table(const RawFiles& files, const RawColumns& columns, double gyro_unit,
                                                     double false_alarm_rate);

}  // namespace selfcal::cli
