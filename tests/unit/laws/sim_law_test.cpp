// The virtual INS's evaluator against the estimator's on the same values: two programs that share no code.
#include <gtest/gtest.h>

#include <cmath>

#include "estimator/laws/expression.hpp"
#include "sim_ins/law.hpp"

namespace selfcal {
namespace {

sim::LawVariables some_values(int k) {
  const auto wave = [k](double phase) { return std::sin(1.7 * k + phase); };
  sim::LawVariables v;
  v.f = {wave(0.1), wave(0.2), wave(0.3)};
  v.omega = {20.0 * wave(0.4), 20.0 * wave(0.5), 20.0 * wave(0.6)};
  v.outer = 3.0 * wave(0.7);
  v.inner = 3.0 * wave(0.8);
  v.outer_rate = 18.0 * wave(0.9);
  v.inner_rate = 18.0 * wave(1.0);
  v.t_h = 0.4 + 0.3 * wave(1.1);
  v.since_s = k == 0 ? 1e9 : 60.0 + 50.0 * wave(1.2);
  v.rest_s = 40.0 + 39.0 * wave(1.3);
  v.outer_sense = k % 3 - 1.0;
  v.inner_sense = (k / 3) % 3 - 1.0;
  v.n = k;
  v.temperature = 4.0 * wave(1.4);
  v.temperature_rate = 0.1 * wave(1.5);
  return v;
}

laws::Channels channels_of(const sim::LawVariables& v) {
  laws::Channels row(1, static_cast<Eigen::Index>(laws::variable_count));
  row << v.f.x(), v.f.y(), v.f.z(), v.omega.x(), v.omega.y(), v.omega.z(), v.outer, v.inner, v.outer_rate, v.inner_rate,
      v.t_h, v.since_s, v.rest_s, v.outer_sense, v.inner_sense, v.n, v.temperature, v.temperature_rate;
  return row;
}

TEST(SimLaw, BothEvaluatorsAgree) {
  for (const char* text : {"fx",
                           "exp(-since/45.2)*so",
                           "-fx**2",
                           "2**-1*fy",
                           "fx*fy*fz",
                           "sin(2*outer)*cos(inner)",
                           "log(1+rest/3)*sign(n)",
                           "wx*wy/(1.2+fz)",
                           "abs(wo)-abs(wi)",
                           "t**2-t",
                           "tanh(4*wx*fy)",
                           "T*dT+si",
                           "sqrt(abs(fx*fy))*-3",
                           "(fx+fy)*(fx-fy)",
                           "sign(t-0.4)*pi",
                           "2**3**2/512",
                           "1-2-3",
                           "8/4/2",
                           "--fx",
                           "- \t-fx*-- -fy",
                           "exp \t(-since/45.2) * ( so - 1 )",
                           "1.5e-3*n"}) {
    const auto expression = laws::Expression::parse(text);
    auto evaluator = sim::LawEvaluator::compile(text);
    ASSERT_TRUE(expression) << text;
    ASSERT_TRUE(evaluator) << text << ": " << evaluator.error().message;
    for (int k = 0; k < 12; ++k) {
      const sim::LawVariables v = some_values(k);
      const double ours = expression->evaluate(channels_of(v))(0), theirs = (*evaluator)(v);
      EXPECT_NEAR(ours, theirs, 1e-12 * (1.0 + std::abs(ours))) << text << ", values " << k;
    }
  }
}

TEST(SimLaw, RefusesWhatNoLawHas) {
  for (const char* text : {"", "fx<1", "fx^2", "rnd(1)", "a=3", "fx;fy", "fx?1:2", "min(fx,fy)", "sin", "(fx", "e",
                           "fx fy", "\"x\"", "sum(fx)", "fx && fy"}) {
    EXPECT_FALSE(sim::LawEvaluator::compile(text)) << text;
  }
  EXPECT_FALSE(sim::LawEvaluator::compile(std::string(2000, '1')));
  EXPECT_FALSE(sim::LawEvaluator::compile(std::string(200, '(') + "1" + std::string(200, ')')));
}

}  // namespace
}  // namespace selfcal
