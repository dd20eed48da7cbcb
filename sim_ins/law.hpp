// Laws concealed in the virtual INS: an expression on one sensor axis, evaluated by muParser on the true motion.
//
// The estimator has an evaluator of its own (estimator/laws): a fault of one must not be repeated by the other.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "estimator/geometry/rotation.hpp"
#include "protocol/error.hpp"

namespace selfcal::sim {

// The variables of a law at one instant; units are those of the law's text.
struct LawVariables {
  Vector3 f = Vector3::Zero();                       // specific force in b, g
  Vector3 omega = Vector3::Zero();                   // angular rate in b, deg/s
  double outer = 0.0, inner = 0.0;                   // rad
  double outer_rate = 0.0, inner_rate = 0.0;         // deg/s
  double t_h = 0.0;                                  // since the start
  double since_s = 1e9, rest_s = 1e9;                // since the end of the last turn; rest 0 while turning
  double outer_sense = 0.0, inner_sense = 0.0;       // -1, 0, 1
  double n = 0.0;                                    // turns begun
  double temperature = 0.0, temperature_rate = 0.0;  // less its mean, degC; degC/min
};

enum class LawProcess { none, jump_per_turn, random_walk, white, line };

struct Law {
  int axis = 0;  // 0..2 gyro x y z, 3..5 accelerometer
  std::string expression;
  LawProcess process = LawProcess::none;
  double coefficient = 0.0;   // SI: rad/s, m/s^2; random walk per sqrt(s); white per sqrt(Hz)
  double frequency_hz = 0.0;  // of a line
  bool uses_temperature = false;
};

// Compiled; moves, does not copy.
class LawEvaluator {
 public:
  // bad_input with the column where the text is no expression of a law.
  [[nodiscard]] static Expected<LawEvaluator> compile(const std::string& expression);
  LawEvaluator(LawEvaluator&&) noexcept;
  LawEvaluator& operator=(LawEvaluator&&) noexcept;
  ~LawEvaluator();

  double operator()(const LawVariables& variables);
  bool uses_temperature() const;

 private:
  struct Compiled;
  explicit LawEvaluator(std::unique_ptr<Compiled> compiled);
  std::unique_ptr<Compiled> compiled_;
};

}  // namespace selfcal::sim
