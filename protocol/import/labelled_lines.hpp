// Lines that say what each of their numbers is: "ax: 0.01, ay: -0.02", "t=1.5 gx=3", {"acc": [0, 0, 9.8]}, one a row.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace selfcal::import {

// A line taken to pieces. Several values behind one label count from 0, "acc[0]"; a label in front of others stands before them, "acc.x"; one letter
// takes the place of an axis before it, "Gyro X: 1, Y: 2". A value that has no label has an empty name.
struct LabelledLine {
  std::vector<std::string> names, units;  // of each value; units that stand behind it, else empty
  std::vector<std::string_view> values;   // numbers, dates, words; of the line
  bool labelled = false;                  // two labels with a colon or an equals sign, or more
  std::size_t numbers = 0;
};
// `words`: a word with a number behind it is a label too ("acc 0.1 0.2 0.3 gyr 1 2 3").
LabelledLine read_labels(std::string_view line, bool words);

// The names of the lines that are most frequent.
struct Labels {
  std::vector<std::string> names, units;
  bool words = false;
  std::string rival;  // names of other lines of which there are a fifth and more; empty: none
};
// Of the first lines of a text; none: most of them hold no labels, or other ones each. `words` as above: the same in all of them.
std::optional<Labels> detect_labels(const std::vector<std::string_view>& lines, bool words);

// Fields of a line in the order of the labels, empty where it lacks one; false: it holds none of them.
bool labelled_fields(std::string_view line, const Labels& labels, std::vector<std::string_view>& fields);

}  // namespace selfcal::import
