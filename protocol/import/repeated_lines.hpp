// Texts for people: each sample in a line or several of words and numbers, the same words every time.
//
//   Acceleration X: -0.19, Y: 0.14, Z: 9.88 m/s^2
//   Rotation X: 0.01, Y: -0.01, Z: 0.00 rad/s
//
// What repeats is found by the lines without their numbers. The words before a number name it; one letter takes the place of an axis before it; numbers
// without words between them are counted, "Acc (mg)[0]".
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

// A line with '#' in the place of its numbers, dates and times of the day, blanks made one; what stands there.
struct Skeleton {
  std::string text;
  std::vector<std::string_view> values;  // of the line
};
Skeleton skeleton_of(std::string_view line);

// Null: the first lines do not repeat, or hold fewer than three numbers a sample. An error where the file cannot be read.
Expected<std::unique_ptr<ColumnSource>> open_repeated_lines(const std::filesystem::path& file);

}  // namespace selfcal::import
