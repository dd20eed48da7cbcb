// Expressions of laws: values worked out by hand, what is no expression, and hostile texts.
#include "estimator/laws/expression.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

namespace selfcal::laws {
namespace {

double value(const std::string& text, double fx = 0.0, double since = 0.0, std::vector<double> constants = {}) {
  Channels channels = Channels::Zero(1, static_cast<Eigen::Index>(variable_count));
  channels(0, static_cast<Eigen::Index>(Variable::fx)) = fx;
  channels(0, static_cast<Eigen::Index>(Variable::since)) = since;
  const auto expression = Expression::parse(text);
  EXPECT_TRUE(expression) << text << ": " << (expression ? "" : expression.error().words);
  return expression ? expression->evaluate(channels, constants)(0) : NAN;
}

TEST(Expression, PrecedenceIsThatOfPython) {
  EXPECT_DOUBLE_EQ(value("1+2*3"), 7.0);
  EXPECT_DOUBLE_EQ(value("(1+2)*3"), 9.0);
  EXPECT_DOUBLE_EQ(value("2-3-4"), -5.0);
  EXPECT_DOUBLE_EQ(value("16/4/2"), 2.0);
  EXPECT_DOUBLE_EQ(value("2**3**2"), 512.0);
  EXPECT_DOUBLE_EQ(value("-2**2"), -4.0);
  EXPECT_DOUBLE_EQ(value("2**-1"), 0.5);
  EXPECT_DOUBLE_EQ(value("--3"), 3.0);
  EXPECT_DOUBLE_EQ(value("6/2*3"), 9.0);
  EXPECT_DOUBLE_EQ(value("2*-3"), -6.0);
  EXPECT_DOUBLE_EQ(value("1.5e-3*1e3"), 1.5);
}

TEST(Expression, FunctionsAndConstants) {
  EXPECT_DOUBLE_EQ(value("sin(pi/2)"), 1.0);
  EXPECT_DOUBLE_EQ(value("cos(0)"), 1.0);
  EXPECT_DOUBLE_EQ(value("exp(1)"), std::numbers::e);
  EXPECT_DOUBLE_EQ(value("log(exp(2))"), 2.0);
  EXPECT_DOUBLE_EQ(value("sqrt(9)"), 3.0);
  EXPECT_DOUBLE_EQ(value("abs(-2)+sign(-7)"), 1.0);
  EXPECT_DOUBLE_EQ(value("tanh(0)"), 0.0);
}

TEST(Expression, ReadsVariablesAndFreeConstants) {
  EXPECT_DOUBLE_EQ(value("fx**2 + 1", 3.0), 10.0);
  EXPECT_DOUBLE_EQ(value("exp(-since/?)", 0.0, 40.0, {20.0}), std::exp(-2.0));
  const auto expression = Expression::parse("sin(2*pi*t/?+?)");
  ASSERT_TRUE(expression);
  EXPECT_EQ(expression->free_constants(), 2U);
  EXPECT_EQ(expression->variables().count(), 1U);
  EXPECT_EQ(expression->text(std::vector<double>{0.5, -1.0}), "sin(2*pi*t/0.5+(-1))");
}

TEST(Expression, WhatIsNoneSaysWhere) {
  struct Wrong {
    const char* text;
    std::size_t column;
    const char* words;
  };
  for (const Wrong& w :
       {Wrong{"", 1, "ends"}, Wrong{"fx+", 4, "ends"}, Wrong{"fx fy", 4, "unexpected 'f'"},
        Wrong{"(fx", 4, "closing parenthesis"}, Wrong{"fx)", 3, "unexpected ')'"}, Wrong{"2*gx", 3, "unknown name gx"},
        Wrong{"sin fx", 5, "parenthesis is missing after sin"}, Wrong{"fx^2", 3, "unexpected '^'"},
        Wrong{"fx,fy", 3, "unexpected ','"}, Wrong{"1e999", 1, "no finite number"},
        Wrong{"fx < 1", 4, "unexpected '<'"}, Wrong{"*fx", 1, "unexpected '*'"}, Wrong{"fx\n+1", 3, "0x0a"},
        Wrong{"atan2(fx)", 1, "unknown name atan2"}, Wrong{"f\xc3\xa9", 1, "unknown name f"}}) {
    const auto expression = Expression::parse(w.text);
    ASSERT_FALSE(expression) << w.text;
    EXPECT_EQ(expression.error().column, w.column) << w.text;
    EXPECT_NE(expression.error().words.find(w.words), std::string::npos) << w.text << ": " << expression.error().words;
  }
}

TEST(Expression, HostileTextsEnd) {
  EXPECT_FALSE(Expression::parse(std::string(100000, '(')));
  EXPECT_FALSE(Expression::parse(std::string(990, '(') + "fx"));
  EXPECT_FALSE(Expression::parse(std::string(900, '-') + "("));
  std::string power = "2";
  for (int k = 0; k < 300; ++k) {
    power += "**2";
  }
  EXPECT_FALSE(Expression::parse(power));
  std::string sum = "fx";
  for (int k = 0; k < 300; ++k) {
    sum += "+fx";
  }
  EXPECT_FALSE(Expression::parse(sum));
  std::string deep;
  for (std::size_t k = 0; k < Expression::deepest; ++k) {
    deep += "(";
  }
  deep += "fx";
  deep += std::string(Expression::deepest, ')');
  EXPECT_TRUE(Expression::parse(deep));
}

TEST(Expression, RowByRow) {
  Channels channels = Channels::Zero(3, static_cast<Eigen::Index>(variable_count));
  channels.col(static_cast<Eigen::Index>(Variable::t)) << 0.0, 1.0, 2.0;
  const auto expression = Expression::parse("t*t-1");
  ASSERT_TRUE(expression);
  EXPECT_TRUE(expression->evaluate(channels).isApprox(Eigen::Array3d(-1.0, 0.0, 3.0)));
}

}  // namespace
}  // namespace selfcal::laws
