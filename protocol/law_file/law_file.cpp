#include "protocol/law_file/law_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "protocol/recording/atomic_file.hpp"
#include "protocol/toml_file/toml_text.hpp"

namespace selfcal {
namespace {

constexpr std::array<std::string_view, 6> axes = {"gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"};
constexpr std::array<std::string_view, 4> processes = {"jump per turn", "random walk", "white", "line"};
constexpr std::array<std::string_view, 8> keys = {"axis",  "expression", "process",      "coefficient",
                                                  "sigma", "unit",       "frequency_hz", "constants"};

class LawReader {
 public:
  LawReader(const toml::table& table, const std::string& file, std::size_t number)
      : table_(table), file_(file), number_(number) {}

  Expected<LawText> read() {
    for (const auto& [key, value] : table_) {
      if (std::find(keys.begin(), keys.end(), key.str()) == keys.end()) {
        refuse(key.str(), "unknown key");
      }
    }
    LawText law;
    const std::string axis = text("axis"), unit = text("unit");
    law.expression = text("expression");
    law.process = text("process");
    law.coefficient = number("coefficient");
    law.sigma = number("sigma");
    law.frequency_hz = number("frequency_hz");
    const auto found = std::find(axes.begin(), axes.end(), axis);
    if (found == axes.end()) {
      refuse("axis", axis.empty() ? "missing" : fmt::format("no axis is called {}", one_line(axis)));
    } else {
      law.axis = static_cast<int>(found - axes.begin());
      check_unit(law.axis, unit);
    }
    check_form(law);
    if (problem_) {
      return tl::unexpected(*problem_);
    }
    return law;
  }

 private:
  void refuse(std::string_view key, std::string_view what) {
    if (!problem_) {
      const toml::node* node = table_.get(key);
      const auto line = (node != nullptr ? node->source() : table_.source()).begin.line;
      problem_ = Error{ErrorKind::bad_input,
                       fmt::format("{}:{}: law {}: {}: {}", file_, line, number_, one_line(std::string(key)), what)};
    }
  }
  std::string text(std::string_view key) {
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      return {};
    }
    const auto value = node->value_exact<std::string>();
    if (!value) {
      refuse(key, "no text");
    }
    return value.value_or("");
  }
  std::optional<double> number(std::string_view key) {
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      return std::nullopt;
    }
    const auto value = node->is_number() ? node->value<double>() : std::nullopt;
    if (!value || !std::isfinite(*value)) {
      refuse(key, "no finite number");
      return std::nullopt;
    }
    return value;
  }
  void check_unit(int axis, const std::string& unit) {
    if (!unit.empty() && unit != unit_of_axis(axis)) {
      refuse("unit", fmt::format("\"{}\" where {} is in {}", one_line(unit), axes[static_cast<std::size_t>(axis)],
                                 unit_of_axis(axis)));
    }
  }
  void check_form(const LawText& law) {
    if (law.expression.empty() == law.process.empty()) {
      refuse("expression",
             law.expression.empty() ? "neither an expression nor a process" : "an expression and a process");
    }
    if (!law.process.empty() && std::find(processes.begin(), processes.end(), law.process) == processes.end()) {
      refuse("process", fmt::format("no process is called {}", one_line(law.process)));
    }
    if ((law.process == "line") != law.frequency_hz.has_value()) {
      refuse("frequency_hz", law.frequency_hz ? "of no line" : "missing");
    }
    if (law.sigma && *law.sigma < 0.0) {
      refuse("sigma", fmt::format("{} is negative", *law.sigma));
    }
  }

  const toml::table& table_;
  const std::string& file_;
  std::size_t number_;
  std::optional<Error> problem_;
};

}  // namespace

std::string_view name_of_axis(int axis) { return axes[static_cast<std::size_t>(axis)]; }
std::string_view unit_of_axis(int axis) { return axis < 3 ? "deg/h" : "ug"; }

Expected<std::vector<LawText>> parse_laws(std::string_view text, const std::string& name) {
  const auto root = parse_toml(text, name);
  if (!root) {
    return tl::unexpected(root.error());
  }
  const toml::array* tables = (*root)["law"].as_array();
  if (tables == nullptr || tables->empty() || !tables->is_homogeneous<toml::table>()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: no [[law]]", name));
  }
  if (tables->size() > most_laws) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {} laws, {} at most", name, tables->size(), most_laws));
  }
  std::vector<LawText> laws;
  for (std::size_t k = 0; k < tables->size(); ++k) {
    auto law = LawReader(*tables->get_as<toml::table>(k), name, k + 1).read();
    if (!law) {
      return tl::unexpected(law.error());
    }
    laws.push_back(std::move(*law));
  }
  return laws;
}

Expected<std::vector<LawText>> read_laws(const std::filesystem::path& path) {
  constexpr std::size_t longest = 1 << 20;
  const Expected<std::string> text = read_text_file(path, longest);
  if (!text) {
    return tl::unexpected(text.error());
  }
  return parse_laws(*text, path.string());
}

std::string format_laws(const std::vector<LawText>& laws) {
  std::string text;
  for (const LawText& law : laws) {
    text += fmt::format("\n[[law]]\naxis = \"{}\"\n", name_of_axis(law.axis));
    text += law.process.empty() ? fmt::format("expression = \"{}\"\n", law.expression)
                                : fmt::format("process = \"{}\"\n", law.process);
    text += law.coefficient ? fmt::format("coefficient = {:.9g}\n", *law.coefficient) : "";
    text += fmt::format("unit = \"{}\"\n", unit_of_axis(law.axis));
    text += law.sigma ? fmt::format("sigma = {:.3g}\n", *law.sigma) : "";
    text += law.frequency_hz ? fmt::format("frequency_hz = {:.9g}\n", *law.frequency_hz) : "";
  }
  return text;
}

}  // namespace selfcal
