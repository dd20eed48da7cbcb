#include "protocol/import/guess_attitude.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>

#include "protocol/import/guess_names.hpp"

namespace selfcal::import {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// Words of a name without its unit: letters apart from digits, "quatW" and "q_w" alike. Brackets with digits are an index and stay.
std::vector<std::string> words_of(std::string_view name) {
  const std::size_t bracket = name.find('[');
  if (bracket != std::string_view::npos && (bracket + 1 >= name.size() || !is_digit(name[bracket + 1]))) {
    name = name.substr(0, bracket);
  }
  std::vector<std::string> words(1);
  char before = ' ';
  for (const char c : name.substr(0, name.find('('))) {
    const bool capital = c >= 'A' && c <= 'Z' && before >= 'a' && before <= 'z';
    if ((!is_letter(c) && !is_digit(c)) || capital || is_digit(c) != is_digit(before)) {
      words.emplace_back();
    }
    if (is_letter(c) || is_digit(c)) {
      words.back() += lower(c);
    }
    before = c;
  }
  std::erase(words, std::string());
  return words;
}

bool is_one_of(std::string_view word, std::initializer_list<std::string_view> all) {
  return std::find(all.begin(), all.end(), word) != all.end();
}

bool is_quaternion(std::string_view word) {
  return is_one_of(word, {"q", "quat", "quaternion", "orientation", "ori", "rot", "rotation", "attitude", "att", "qs"});
}

AttitudeClaim claim_of(const std::vector<std::string>& words) {
  const auto any = [&](std::initializer_list<std::string_view> all) {
    return std::any_of(words.begin(), words.end(), [&](const std::string& w) { return is_one_of(w, all); });
  };
  if (any({"ahrs", "ekf", "fused", "fusion", "madgwick", "mahony", "filter", "filtered", "est", "estimate", "estimated",
           "imu", "dmp", "kalman", "onboard"})) {
    return AttitudeClaim::computed;
  }
  return any({"ref",       "reference", "truth", "gt",      "ground",  "groundtruth", "mocap", "vicon",
              "optitrack", "qualisys",  "qtm",   "tracker", "tracked", "optical",     "robot", "tcp",
              "flange",    "arm",       "ee",    "table",   "leica",   "rs"})
             ? AttitudeClaim::reference
             : AttitudeClaim::nothing;
}

// Which of the parts of an attitude a column is, with what its name is without the part.
struct Part {
  AttitudeForm form = AttitudeForm::quaternion;
  bool numbered = false;  // a quaternion's 0 to 3
  std::size_t index = 0;  // w x y z; row by row; roll, pitch, yaw
  std::string stem;
};

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) {
    all += word + ' ';
  }
  return all;
}

std::optional<Part> angle_part(const std::vector<std::string>& words) {
  constexpr std::array<std::array<std::string_view, 3>, 3> names = {
      {{"roll", "roll", "roll"}, {"pitch", "pitch", "pitch"}, {"yaw", "heading", "azimuth"}}};
  for (std::size_t k = 0; k < words.size(); ++k) {
    for (std::size_t index = 0; index < 3; ++index) {
      if (std::find(names.at(index).begin(), names.at(index).end(), words[k]) != names.at(index).end()) {
        std::vector<std::string> stem = words;
        stem.erase(stem.begin() + static_cast<std::ptrdiff_t>(k));
        if (std::any_of(stem.begin(), stem.end(), [](const std::string& w) {
              return is_one_of(w, {"rate", "vel", "velocity", "speed", "acc", "std", "sigma", "dot"});
            })) {
          return std::nullopt;
        }
        return Part{AttitudeForm::angles, false, index, joined(stem)};
      }
    }
  }
  return std::nullopt;
}

// "r 11", "dcm 0 1", "mat 1 3": counted from 1 unless a 0 is among them, which `attitudes_by_name` knows.
std::optional<Part> matrix_part(const std::vector<std::string>& words) {
  const auto is_digit_word = [](const std::string& w) { return w.size() == 1 && is_digit(w[0]); };
  const std::size_t n = words.size();
  int row = -1, column = -1;
  std::size_t stem = 0;
  if (n >= 2 && words[n - 1].size() == 2 && is_digit(words[n - 1][0])) {
    row = words[n - 1][0] - '0';
    column = words[n - 1][1] - '0';
    stem = n - 1;
  } else if (n >= 3 && is_digit_word(words[n - 1]) && is_digit_word(words[n - 2])) {
    row = words[n - 2][0] - '0';
    column = words[n - 1][0] - '0';
    stem = n - 2;
  }
  if (row < 0 || row > 3 || column > 3 ||
      !is_one_of(words[stem - 1], {"r", "rot", "dcm", "mat", "matrix", "c", "rotation", "rotmat"})) {
    return std::nullopt;
  }
  return Part{AttitudeForm::matrix, false, static_cast<std::size_t>(4 * row + column),
              joined({words.begin(), words.begin() + static_cast<std::ptrdiff_t>(stem)})};
}

std::optional<Part> quaternion_part(std::vector<std::string> words) {
  if (words.empty()) {
    return std::nullopt;
  }
  std::string last = words.back();
  words.pop_back();
  constexpr std::string_view letters = "wxyz";
  // "qw", "quatw"
  if (last.size() > 1 && letters.find(last.back()) != std::string_view::npos &&
      is_quaternion(std::string_view(last).substr(0, last.size() - 1))) {
    words.push_back(last.substr(0, last.size() - 1));
    last = last.substr(last.size() - 1);
  }
  if (last.size() != 1 ||
      std::none_of(words.begin(), words.end(), [](const std::string& w) { return is_quaternion(w); })) {
    return std::nullopt;
  }
  if (letters.find(last[0]) != std::string_view::npos) {
    return Part{AttitudeForm::quaternion, false, letters.find(last[0]), joined(words)};
  }
  if (last[0] >= '0' && last[0] <= '4') {
    return Part{AttitudeForm::quaternion, true, static_cast<std::size_t>(last[0] - '0'), joined(words)};
  }
  return std::nullopt;
}

using Group = std::map<std::size_t, std::size_t>;  // index to column

// The columns of indices FIRST on, if all are there.
std::vector<std::size_t> all_of(const Group& group, const std::vector<std::size_t>& indices) {
  std::vector<std::size_t> columns;
  for (const std::size_t index : indices) {
    const auto found = group.find(index);
    if (found != group.end()) {
      columns.push_back(found->second);
    }
  }
  return columns.size() == indices.size() ? columns : std::vector<std::size_t>();
}

std::vector<std::size_t> columns_of(const Part& part, const Group& group) {
  if (part.form == AttitudeForm::angles) {
    return all_of(group, {0, 1, 2});
  }
  if (part.form == AttitudeForm::quaternion) {
    const std::vector<std::size_t> from_zero = all_of(group, {0, 1, 2, 3});
    return from_zero.empty() && part.numbered ? all_of(group, {1, 2, 3, 4}) : from_zero;
  }
  const std::vector<std::size_t> from_zero = all_of(group, {0, 1, 2, 4, 5, 6, 8, 9, 10});
  return from_zero.empty() ? all_of(group, {5, 6, 7, 9, 10, 11, 13, 14, 15}) : from_zero;
}

}  // namespace

std::vector<AttitudeColumns> attitudes_by_name(const std::vector<std::string>& names,
                                               const std::vector<std::string>& units) {
  std::map<std::string, std::pair<Part, Group>> groups;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::vector<std::string> words = words_of(names[k]);
    auto part = quaternion_part(words);
    part = part ? part : matrix_part(words);
    part = part ? part : angle_part(words);
    if (part) {
      const std::string key =
          part->stem + std::to_string(static_cast<int>(part->form)) + std::to_string(static_cast<int>(part->numbered));
      auto& group = groups.try_emplace(key, *part, Group()).first->second;
      group.second.try_emplace(part->index, k);
    }
  }
  std::vector<AttitudeColumns> all;
  for (const auto& [key, group] : groups) {
    AttitudeColumns found;
    found.form = group.first.form;
    found.columns = columns_of(group.first, group.second);
    if (found.columns.empty()) {
      continue;
    }
    found.order_known = !group.first.numbered;
    found.claim = claim_of(words_of(names[found.columns.front()]));
    const std::size_t first = found.columns.front();
    found.unit =
        read_name(names[first], first < units.size() ? std::string_view(units[first]) : std::string_view{}).unit;
    all.push_back(std::move(found));
  }
  std::sort(all.begin(), all.end(),
            [](const AttitudeColumns& a, const AttitudeColumns& b) { return a.columns.front() < b.columns.front(); });
  return all;
}

}  // namespace selfcal::import
