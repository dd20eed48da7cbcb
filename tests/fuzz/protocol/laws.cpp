// Any text as an expression of a law and as a file of laws: no crash, an end, one line that says what is wrong. What is an
// expression has a value, comes back from its own text, and is one for the virtual INS's evaluator too, which shares no code.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/laws/expression.hpp"
#include "protocol/law_file/law_file.hpp"
#include "sim_ins/law.hpp"

namespace selfcal {
namespace {

void must(bool condition) {
  if (!condition) {
    std::abort();
  }
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void use(const laws::Expression& expression) {
  laws::Channels motion(2, static_cast<Eigen::Index>(laws::variable_count));
  motion.row(0).setLinSpaced(-1.5, 2.0);
  motion.row(1).setLinSpaced(3.0, 1e3);
  std::vector<double> constants(expression.free_constants());
  for (std::size_t k = 0; k < constants.size(); ++k) {
    constants[k] = 0.25 + 0.5 * static_cast<double>(k);
  }
  const Eigen::ArrayXd value = expression.evaluate(motion, constants);
  must(value.size() == 2);
  const std::string text = expression.text(constants);
  const auto again = laws::Expression::parse(text);
  if (!again) {  // numbers are longer than `?`
    must(text.size() > laws::Expression::longest);
    return;
  }
  const Eigen::ArrayXd twice = again->evaluate(motion);
  must(same(value(0), twice(0)) && same(value(1), twice(1)));
  must(again->variables() == expression.variables());
  if (const auto compiled = sim::LawEvaluator::compile(text); !compiled) {
    std::fprintf(stderr, "%s: %s\n", text.c_str(), compiled.error().message.c_str());
    std::abort();
  }
}

void as_expression(std::string_view text) {
  const auto expression = laws::Expression::parse(text);
  if (expression) {
    use(*expression);
    return;
  }
  must(!expression.error().words.empty() && expression.error().column >= 1);
  must(expression.error().column <= text.size() + 1);
}

void as_file(std::string_view text) {
  const auto laws = parse_laws(text, "laws.toml");
  if (!laws) {
    must(laws.error().message.starts_with("laws.toml") && laws.error().message.find('\n') == std::string::npos);
    return;
  }
  must(laws->size() <= most_laws);
  std::vector<LawText> sound;  // only what is an expression is ever written
  for (const LawText& law : *laws) {
    if (!law.process.empty() || laws::Expression::parse(law.expression)) {
      sound.push_back(law);
    }
  }
  if (sound.empty()) {
    return;
  }
  const auto again = parse_laws(format_laws(sound), "laws.toml");
  must(again && again->size() == sound.size());
  for (std::size_t k = 0; k < sound.size(); ++k) {
    const LawText &read = (*again)[k], &given = sound[k];
    must(read.axis == given.axis && read.expression == given.expression && read.process == given.process);
    must(read.coefficient.has_value() == given.coefficient.has_value());
    const double value = given.coefficient.value_or(0.0);  // written with nine digits
    must(std::abs(read.coefficient.value_or(0.0) - value) <= 1e-8 * std::abs(value));
  }
}

}  // namespace
}  // namespace selfcal

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  selfcal::as_expression(text);
  selfcal::as_file(text);
  return 0;
}
