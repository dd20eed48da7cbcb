// Expressions of laws: what a sensor puts out too much, as a function of the motion (README.md lists the variables).
//
// Grammar: numbers, + - * / **, parentheses, unary minus; sin cos exp log sqrt abs sign tanh; pi; the variables; and `?`
// for a constant that is to be fitted. ** binds tighter than unary minus and is right associative, as in Python.
#pragma once

#include <Eigen/Core>
#include <array>
#include <bitset>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace selfcal::laws {

enum class Variable { fx, fy, fz, wx, wy, wz, outer, inner, wo, wi, t, since, rest, so, si, n, T, dT };
inline constexpr std::size_t variable_count = 18;
extern const std::array<std::string_view, variable_count> variable_names;

// Values of the variables, one row per node; columns in the order of Variable.
using Channels = Eigen::Array<double, Eigen::Dynamic, static_cast<int>(variable_count)>;
using VariableSet = std::bitset<variable_count>;

// Where a text is no expression: column from 1, and what is wrong, naming the text that is.
struct ParseError {
  std::size_t column = 0;
  std::string words;
};

class Expression {
 public:
  // Longest text, deepest nesting and most operations that are read; beyond them it is an error, so that hostile texts end.
  static constexpr std::size_t longest = 1000, deepest = 50, most_operations = 200;

  [[nodiscard]] static tl::expected<Expression, ParseError> parse(std::string_view text);

  // One value per row. `constants` are those of the `?` in the order of the text, [free_constants()].
  Eigen::ArrayXd evaluate(const Eigen::Ref<const Channels>& channels, std::span<const double> constants = {}) const;

  const VariableSet& variables() const { return variables_; }
  std::size_t free_constants() const { return free_constants_; }
  // The text as it was given, with numbers in the place of `?`.
  std::string text(std::span<const double> constants = {}) const;

 private:
  friend class Parser;
  enum class Code { number, constant, variable, add, subtract, multiply, divide, power, negate, function };
  struct Operation {
    Code code = Code::number;
    double number = 0.0;
    std::size_t index = 0;  // of the variable, the free constant or the function
  };

  std::string text_;
  std::vector<Operation> operations_;  // postfix
  std::size_t depth_ = 0;              // of the stack
  VariableSet variables_;
  std::size_t free_constants_ = 0;
};

}  // namespace selfcal::laws
