// Sentences for a terminal of 80 columns.
#pragma once

#include <string>
#include <vector>

namespace selfcal::cli {

constexpr std::size_t terminal_columns = 80;

// Parts with a separator behind each but the last, broken at 80 columns; all lines but the first are indented.
std::string wrapped(const std::string& start, const std::vector<std::string>& parts, const std::string& separator);
// A sentence, broken at blanks.
std::string lines_of(const std::string& start, const std::string& sentence);
// A text line by line, each broken so behind its first word.
std::string folded(const std::string& text);

}  // namespace selfcal::cli
