// Costs of functions are probabilities: over all functions and axes they add up to one at most, or p-values would not be
// corrected for all that is tried.
#include "estimator/discovery/dictionary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>

namespace selfcal::discovery {
namespace {

// Nodes at which nothing is a function of anything else, so that no function is left out as a constant.
PieceSums everything_varies() {
  constexpr int nodes = 400;
  PieceSums sums;
  std::mt19937 engine(3);
  const auto draw = [&engine] { return 2.0 * static_cast<double>(engine()) / 4294967296.0 - 1.0; };
  sums.channels.resize(nodes, static_cast<Eigen::Index>(laws::variable_count));
  sums.piece_dt = Eigen::VectorXd::Constant(nodes, 5.0);
  for (int k = 0; k < nodes; ++k) {
    for (Eigen::Index v = 0; v < sums.channels.cols(); ++v) {
      sums.channels(k, v) = draw();
    }
    sums.channels(k, static_cast<Eigen::Index>(laws::Variable::since)) = 100.0 * std::abs(draw());
    sums.channels(k, static_cast<Eigen::Index>(laws::Variable::rest)) = 100.0 * std::abs(draw());
    sums.nodes.push_back({5.0 * k + 2.5, 5.0});
    sums.piece_of.push_back(k);
    sums.pieces.push_back({5.0 * k, 5.0 * (k + 1), k / 20, false});
  }
  return sums;
}

TEST(Dictionary, ProbabilitiesAddUpToOneAtMost) {
  laws::VariableSet all;
  all.set();
  const Dictionary dictionary = make_dictionary(everything_varies(), all);
  double sum = 0.0;
  for (const Function& f : dictionary.functions) {
    sum += f.second ? 0.0 : axis_count * std::exp(-f.cost);
  }
  EXPECT_LE(sum, 1.0 + 1e-9);
  EXPECT_GT(sum, 0.95);  // what is missing are pairs of one quantity with itself
}

TEST(Dictionary, NoFunctionTwice) {
  laws::VariableSet all;
  all.set();
  const Dictionary dictionary = make_dictionary(everything_varies(), all);
  std::set<std::pair<std::string, double>> seen;
  std::size_t doubles = 0;
  for (const Function& f : dictionary.functions) {
    doubles += seen.emplace(dictionary.pattern(f), f.constant).second ? 0 : 1;
  }
  EXPECT_EQ(doubles, 0U) << "of " << dictionary.functions.size();
}

// sin(outer)**2 alone is cos(2*outer) and a constant; times a kernel it is neither.
TEST(Dictionary, SquaresOfSinesStandBesideAKernelAndNotAlone) {
  laws::VariableSet all;
  all.set();
  const Dictionary dictionary = make_dictionary(everything_varies(), all);
  std::set<std::string> patterns;
  for (const Function& f : dictionary.functions) {
    patterns.insert(dictionary.pattern(f));
  }
  EXPECT_FALSE(patterns.contains("cos(inner)**2"));
  for (const char* kernel : {"exp(-since/?)", "log(1+rest/?)*sign(n)", "exp(-t/?)", "sin(2*pi*t/?)"}) {
    EXPECT_TRUE(patterns.contains(std::string(kernel) + "*cos(inner)**2")) << kernel;
  }
}

TEST(Dictionary, OfWavesThatOnePlanCannotTellApartTheLongerOneIsMoreProbable) {
  laws::VariableSet all;
  all.set();
  const Dictionary dictionary = make_dictionary(everything_varies(), all);
  const Function *slow = nullptr, *fast = nullptr;
  for (const Function& f : dictionary.functions) {
    if (dictionary.pattern(f) == "sin(2*pi*t/?)*wx") {
      slow = slow == nullptr || f.constant > slow->constant ? &f : slow;
      fast = fast == nullptr || f.constant < fast->constant ? &f : fast;
    }
  }
  ASSERT_TRUE(slow != nullptr && fast != nullptr);
  // Equal probability on a logarithmic scale: the density on the scale of frequency goes with the period.
  EXPECT_NEAR(fast->cost - slow->cost, std::log(slow->constant / fast->constant), 1e-9);
}

PieceSums twenty_dwells() {
  PieceSums sums = everything_varies();
  for (Eigen::Index k = 0; k < sums.channels.rows(); ++k) {
    sums.channels(k, static_cast<Eigen::Index>(laws::Variable::n)) = static_cast<double>(k / 20);
  }
  return sums;
}

// sin(a*n) and sin((2*pi - a)*n) are one function of a whole number but for their sign: no period is less than two turns.
TEST(Dictionary, WavesOverTheCountOfTurnsAreHalfAPeriodApartAndNoneTwice) {
  laws::VariableSet all;
  all.set();
  const Dictionary dictionary = make_dictionary(twenty_dwells(), all);
  std::set<double> periods;
  for (const Function& f : dictionary.functions) {
    if (f.kernel == Kernel::turn_wave && !f.second && dictionary.pattern(f) == "sin(2*pi*n/?)*wx") {
      EXPECT_GE(f.partner, 0);
      periods.insert(f.constant);
    }
  }
  ASSERT_EQ(periods.size(), 19U);  // of 20 dwells: 40 turns over 1, 2, ..., 19
  EXPECT_DOUBLE_EQ(*periods.rbegin(), 40.0);
  EXPECT_DOUBLE_EQ(*periods.begin(), 40.0 / 19.0);
}

// The search goes from 0.35 to 2.9 times each of its values, and a gravity of 1.004 g is as much as the Earth has.
TEST(Dictionary, NoQuotientHasAPole) {
  laws::VariableSet all;
  all.set();
  const Dictionary dictionary = make_dictionary(everything_varies(), all);
  laws::Channels most = laws::Channels::Zero(3, static_cast<Eigen::Index>(laws::variable_count));
  for (const laws::Variable v : {laws::Variable::fx, laws::Variable::fy, laws::Variable::fz}) {
    most.col(static_cast<Eigen::Index>(v)) << -1.004, 0.0, 1.004;
  }
  for (const laws::Variable v : {laws::Variable::outer, laws::Variable::inner}) {
    most.col(static_cast<Eigen::Index>(v)) << -1.5707963, 3.1415927, 1.5707963;
  }
  std::set<std::string> seen;
  for (const Factor& f : dictionary.factors) {
    if (f.kernel == Kernel::quotient) {
      seen.insert(f.text);
      for (const double factor : {0.35, 1.0, 2.9}) {
        const Eigen::ArrayXd values =
            laws::Expression::parse(f.text)->evaluate(most, std::vector<double>{factor * f.constant});
        EXPECT_TRUE((values > 0.0).all() && (values < 40.0).all()) << f.text << " " << factor * f.constant;
      }
    }
  }
  EXPECT_EQ(seen.size(), 14U);
}

// A wave over the time of the same period, in dwells, is ten times as probable and more: equal dwells do not tell them apart.
TEST(Dictionary, QuotientsAndWavesOverTurnsStandAloneAndTimesAQuantity) {
  laws::VariableSet all;
  all.set();
  const Dictionary dictionary = make_dictionary(twenty_dwells(), all);
  std::map<std::string, double> least;
  for (const Function& f : dictionary.functions) {
    const auto [at, first] = least.emplace(dictionary.pattern(f), f.cost);
    at->second = std::min(at->second, f.cost);
  }
  for (const char* text : {"1/(1+?+fy)*so", "1/(1+?-cos(inner))", "sin(2*pi*n/?)", "sin(2*pi*n/?)*fz"}) {
    EXPECT_TRUE(least.contains(text)) << text;
  }
  EXPECT_GT(least["sin(2*pi*n/?)"] - least["sin(2*pi*t/?)"], std::log(10.0));
}

}  // namespace
}  // namespace selfcal::discovery
