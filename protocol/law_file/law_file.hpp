// Files of laws: physics beyond the 24 parameters as equations (README.md has the format).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal {

// One [[law]] as it is written. Whether the expression is one is the reader's business: it has the evaluator.
struct LawText {
  int axis = 0;                              // 0..2 gyro x y z, 3..5 accelerometer x y z, b axes
  std::string expression;                    // empty: a process
  std::string process;                       // "jump per turn", "random walk", "white", "line"; empty: an expression
  std::optional<double> coefficient, sigma;  // in unit_of_axis; none: to be fitted
  std::optional<double> frequency_hz;        // of a line
};

std::string_view name_of_axis(int axis);  // gyro_x ... accel_z
std::string_view unit_of_axis(int axis);  // deg/h or ug

inline constexpr std::size_t most_laws = 64;

// bad_input naming file, line, law number and key: unknown keys, an axis or unit that is none, both or neither of
// expression and process, numbers that are not finite. Other tables of the file, such as [[effect]], are left alone.
[[nodiscard]] Expected<std::vector<LawText>> parse_laws(std::string_view toml, const std::string& name);
[[nodiscard]] Expected<std::vector<LawText>> read_laws(const std::filesystem::path& path);

// As [[law]] tables, numbers with nine digits, sigma with three. Expressions must be ones: they are not escaped.
std::string format_laws(const std::vector<LawText>& laws);

}  // namespace selfcal
