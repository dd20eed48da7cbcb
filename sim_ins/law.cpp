#include "sim_ins/law.hpp"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

namespace selfcal::sim {
namespace {

constexpr std::size_t longest = 1000;
constexpr int deepest = 50;

// What muParser knows beyond a law's grammar begins with one of the characters that are left out here.
constexpr std::string_view allowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.+-*/() \t";

Expected<void> check_text(const std::string& text) {
  if (text.size() > longest) {
    return fail(ErrorKind::bad_input, fmt::format("column {}: longer than {} characters", longest + 1, longest));
  }
  const std::size_t odd = text.find_first_not_of(allowed);
  if (odd != std::string::npos) {
    return fail(ErrorKind::bad_input, fmt::format("column {}: a character that no law has", odd + 1));
  }
  int depth = 0;
  for (std::size_t k = 0; k < text.size(); ++k) {
    depth += text[k] == '(' ? 1 : (text[k] == ')' ? -1 : 0);
    if (depth > deepest) {
      return fail(ErrorKind::bad_input, fmt::format("column {}: nested deeper than {}", k + 1, deepest));
    }
  }
  return {};
}

// ** is muParser's ^, which binds as tightly and from the right as well; of several signs it reads one only.
std::string as_mu_parser_reads(const std::string& expression) {
  std::string text;
  for (std::size_t k = 0; k < expression.size(); ++k) {
    const char c = expression[k];
    if (c == ' ' || c == '\t') {
      text += ' ';
      continue;
    }
    if (c == '*' && expression.compare(k, 2, "**") == 0) {
      text += '^';
      ++k;
      continue;
    }
    const std::size_t before = text.find_last_not_of(' ');
    if (c == '(' && before != std::string::npos) {
      text.resize(before + 1);  // between a function's name and its argument it reads no blank
    }
    if (c == '-' && before != std::string::npos && text[before] == '~') {
      text.erase(before);  // two signs are none, blanks between them or not
      continue;
    }
    const bool sign_place =
        before == std::string::npos || std::string_view("(+-*/^~").find(text[before]) != std::string_view::npos;
    text += c == '-' && sign_place ? '~' : c;
  }
  std::replace(text.begin(), text.end(), '~', '-');
  return text;
}

double sign(double x) { return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0); }

}  // namespace

struct LawEvaluator::Compiled {
  std::array<double, 18> values{};
  mu::Parser parser;
  bool temperature = false;

  static constexpr std::array<const char*, 18> names = {"fx",    "fy",    "fz", "wx", "wy", "wz",
                                                        "outer", "inner", "wo", "wi", "t",  "since",
                                                        "rest",  "so",    "si", "n",  "T",  "dT"};

  Compiled() {
    parser.ClearConst();
    parser.ClearFun();
    parser.ClearPostfixOprt();
    for (std::size_t k = 0; k < names.size(); ++k) {
      parser.DefineVar(names[k], &values[k]);
    }
    parser.DefineConst("pi", std::numbers::pi);
    const auto define = [this](const char* name, double (*function)(double)) { parser.DefineFun(name, function); };
    define("sin", [](double x) { return std::sin(x); });
    define("cos", [](double x) { return std::cos(x); });
    define("exp", [](double x) { return std::exp(x); });
    define("log", [](double x) { return std::log(x); });
    define("sqrt", [](double x) { return std::sqrt(x); });
    define("abs", [](double x) { return std::abs(x); });
    define("sign", sign);
    define("tanh", [](double x) { return std::tanh(x); });
  }
};

LawEvaluator::LawEvaluator(std::unique_ptr<Compiled> compiled) : compiled_(std::move(compiled)) {}
LawEvaluator::LawEvaluator(LawEvaluator&&) noexcept = default;
LawEvaluator& LawEvaluator::operator=(LawEvaluator&&) noexcept = default;
LawEvaluator::~LawEvaluator() = default;

Expected<LawEvaluator> LawEvaluator::compile(const std::string& expression) {
  if (const auto sound = check_text(expression); !sound) {
    return tl::unexpected(sound.error());
  }
  const std::string text = as_mu_parser_reads(expression);
  auto compiled = std::make_unique<Compiled>();
  try {
    compiled->parser.SetExpr(text);
    compiled->parser.Eval();
    for (const auto& [name, address] : compiled->parser.GetUsedVar()) {
      compiled->temperature = compiled->temperature || name == "T" || name == "dT";
    }
  } catch (const mu::Parser::exception_type& problem) {
    return fail(ErrorKind::bad_input, fmt::format("column {}: {}", problem.GetPos() + 1, problem.GetMsg()));
  }
  return LawEvaluator(std::move(compiled));
}

double LawEvaluator::operator()(const LawVariables& v) {
  compiled_->values = {v.f.x(),  v.f.y(),       v.f.z(),       v.omega.x(),  v.omega.y(),   v.omega.z(),
                       v.outer,  v.inner,       v.outer_rate,  v.inner_rate, v.t_h,         v.since_s,
                       v.rest_s, v.outer_sense, v.inner_sense, v.n,          v.temperature, v.temperature_rate};
  return compiled_->parser.Eval();
}

bool LawEvaluator::uses_temperature() const { return compiled_->temperature; }

}  // namespace selfcal::sim
