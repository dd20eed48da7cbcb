#include "estimator/laws/expression.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace selfcal::laws {

const std::array<std::string_view, variable_count> variable_names = {
    "fx", "fy", "fz", "wx", "wy", "wz", "outer", "inner", "wo", "wi", "t", "since", "rest", "so", "si", "n", "T", "dT"};

namespace {

struct Function {
  std::string_view name;
  void (*apply)(Eigen::ArrayXd& x);
};

const std::array<Function, 8> functions = {{
    {"sin", [](Eigen::ArrayXd& x) { x = x.sin().eval(); }},
    {"cos", [](Eigen::ArrayXd& x) { x = x.cos().eval(); }},
    {"exp", [](Eigen::ArrayXd& x) { x = x.exp().eval(); }},
    {"log", [](Eigen::ArrayXd& x) { x = x.log().eval(); }},
    {"sqrt", [](Eigen::ArrayXd& x) { x = x.sqrt().eval(); }},
    {"abs", [](Eigen::ArrayXd& x) { x = x.abs().eval(); }},
    {"sign", [](Eigen::ArrayXd& x) { x = x.sign().eval(); }},
    {"tanh", [](Eigen::ArrayXd& x) { x = x.tanh().eval(); }},
}};

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

// A character of a hostile text as it can be shown.
std::string shown(char c) {
  std::array<char, 32> text{};
  const bool printable = c >= ' ' && c <= '~';
  std::snprintf(text.data(), text.size(), printable ? "'%c'" : "the character 0x%02x",
                printable ? c : static_cast<int>(static_cast<unsigned char>(c)));
  return text.data();
}

std::string joined(std::string_view a, std::string_view b) { return std::string(a).append(b); }

}  // namespace

// Recursive descent; each function reads one level of precedence and appends its operations.
class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) { e_.text_ = std::string(text); }

  tl::expected<Expression, ParseError> run() {
    if (text_.size() > Expression::longest) {
      return tl::unexpected(ParseError{Expression::longest + 1, "the expression is longer than 1000 characters"});
    }
    sum(0);
    skip_blanks();
    if (ok() && at_ < text_.size()) {
      fail(joined("unexpected ", shown(text_[at_])));
    }
    if (!ok()) {
      return tl::unexpected(error_);
    }
    return std::move(e_);
  }

 private:
  using Code = Expression::Code;

  bool ok() const { return error_.words.empty(); }
  void fail(std::string words) { fail_at(at_, std::move(words)); }
  void fail_at(std::size_t at, std::string words) {
    if (ok()) {
      error_ = {at + 1, std::move(words)};
    }
  }
  void skip_blanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) {
      ++at_;
    }
  }
  // Reads `token` if it stands here; "*" does not stand where "**" does.
  bool take(std::string_view token) {
    skip_blanks();
    const bool here = text_.substr(at_).starts_with(token) && !(token == "*" && text_.substr(at_).starts_with("**"));
    at_ += here ? token.size() : 0;
    return here;
  }
  void emit(Code code, double number = 0.0, std::size_t index = 0) {
    if (e_.operations_.size() == Expression::most_operations) {
      fail("the expression has more than 200 operations");
    }
    if (!ok()) {
      return;
    }
    e_.operations_.push_back({code, number, index});
    const bool pushes = code == Code::number || code == Code::constant || code == Code::variable;
    const bool pops = code == Code::add || code == Code::subtract || code == Code::multiply || code == Code::divide ||
                      code == Code::power;
    stack_ += pushes ? 1 : 0;
    stack_ -= pops ? 1 : 0;
    e_.depth_ = std::max(e_.depth_, stack_);
  }

  void sum(std::size_t level) {
    if (level > Expression::deepest) {
      return fail("the expression is nested deeper than 50");
    }
    product(level);
    while (ok()) {
      if (take("+")) {
        product(level);
        emit(Code::add);
      } else if (take("-")) {
        product(level);
        emit(Code::subtract);
      } else {
        return;
      }
    }
  }
  void product(std::size_t level) {
    signed_factor(level);
    while (ok()) {
      if (take("*")) {
        signed_factor(level);
        emit(Code::multiply);
      } else if (take("/")) {
        signed_factor(level);
        emit(Code::divide);
      } else {
        return;
      }
    }
  }
  void signed_factor(std::size_t level) {
    bool negative = false;
    while (take("-")) {
      negative = !negative;
    }
    power(level);
    if (negative) {
      emit(Code::negate);
    }
  }
  void power(std::size_t level) {
    if (level > Expression::deepest) {
      return fail("the expression is nested deeper than 50");
    }
    primary(level);
    if (ok() && take("**")) {
      signed_factor(level + 1);
      emit(Code::power);
    }
  }
  void primary(std::size_t level) {
    skip_blanks();
    if (at_ == text_.size()) {
      return fail("the expression ends where a value is expected");
    }
    if (take("(")) {
      return inside(level);
    }
    if (take("?")) {
      return emit(Code::constant, 0.0, e_.free_constants_++);
    }
    if (is_digit(text_[at_]) || text_[at_] == '.') {
      return number();
    }
    if (is_letter(text_[at_])) {
      return name(level);
    }
    fail(joined("unexpected ", shown(text_[at_])));
  }
  void inside(std::size_t level) {
    sum(level + 1);
    if (ok() && !take(")")) {
      fail("a closing parenthesis is missing");
    }
  }
  void number() {
    const char* const begin = text_.data() + at_;
    double value = 0.0;
    const auto [end, problem] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (problem != std::errc{} || !std::isfinite(value)) {
      return fail("no finite number");
    }
    at_ += static_cast<std::size_t>(end - begin);
    emit(Code::number, value);
  }
  void name(std::size_t level) {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (is_letter(text_[at_]) || is_digit(text_[at_]))) {
      ++at_;
    }
    const std::string_view word = text_.substr(begin, at_ - begin);
    if (word == "pi") {
      return emit(Code::number, std::numbers::pi);
    }
    const auto function =
        std::find_if(functions.begin(), functions.end(), [&](const Function& f) { return f.name == word; });
    if (function != functions.end()) {
      if (!take("(")) {
        return fail(joined("a parenthesis is missing after ", word));
      }
      inside(level);
      return emit(Code::function, 0.0, static_cast<std::size_t>(function - functions.begin()));
    }
    const auto variable = std::find(variable_names.begin(), variable_names.end(), word);
    if (variable == variable_names.end()) {
      return fail_at(begin, joined("unknown name ", word.substr(0, 40)));
    }
    const auto index = static_cast<std::size_t>(variable - variable_names.begin());
    e_.variables_.set(index);
    emit(Code::variable, 0.0, index);
  }

  std::string_view text_;
  std::size_t at_ = 0, stack_ = 0;
  Expression e_;
  ParseError error_;
};

tl::expected<Expression, ParseError> Expression::parse(std::string_view text) { return Parser(text).run(); }

Eigen::ArrayXd Expression::evaluate(const Eigen::Ref<const Channels>& channels,
                                    std::span<const double> constants) const {
  std::vector<Eigen::ArrayXd> stack;
  stack.reserve(depth_);
  const auto combine = [&stack](auto operation) {
    const Eigen::ArrayXd right = std::move(stack.back());
    stack.pop_back();
    Eigen::ArrayXd& left = stack.back();
    operation(left, right);
  };
  for (const Operation& o : operations_) {
    switch (o.code) {
      case Code::number: stack.emplace_back(Eigen::ArrayXd::Constant(channels.rows(), o.number)); break;
      case Code::constant: stack.emplace_back(Eigen::ArrayXd::Constant(channels.rows(), constants[o.index])); break;
      case Code::variable: stack.emplace_back(channels.col(static_cast<Eigen::Index>(o.index))); break;
      case Code::add: combine([](auto& a, const auto& b) { a += b; }); break;
      case Code::subtract: combine([](auto& a, const auto& b) { a -= b; }); break;
      case Code::multiply: combine([](auto& a, const auto& b) { a *= b; }); break;
      case Code::divide: combine([](auto& a, const auto& b) { a /= b; }); break;
      case Code::power:
        combine([](auto& a, const auto& b) {
          for (Eigen::Index i = 0; i < a.size(); ++i) {
            a(i) = std::pow(a(i), b(i));
          }
        });
        break;
      case Code::negate: stack.back() = -stack.back(); break;
      case Code::function: functions[o.index].apply(stack.back()); break;
    }
  }
  return stack.front();
}

std::string Expression::text(std::span<const double> constants) const {
  std::string result;
  std::size_t next = 0;
  for (const char c : text_) {
    if (c != '?' || next >= constants.size()) {
      result += c;
      continue;
    }
    char number[32];
    const double value = constants[next++];
    std::snprintf(number, sizeof number, value < 0.0 ? "(%.6g)" : "%.6g", value);
    result += number;
  }
  return result;
}

}  // namespace selfcal::laws
