// Costs of functions are probabilities: over all functions and axes they add up to one at most, or p-values would not be
// corrected for all that is tried.
#include "estimator/discovery/dictionary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

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

}  // namespace
}  // namespace selfcal::discovery
