// Accelerometers that drift while nine poses are taken: nine unknowns, and no residual to show it.
#include <gtest/gtest.h>

#include <cmath>

#include "estimator/diagnosis/poses/poses.hpp"
#include "tests/unit/diagnosis/accelerometers_by_hand.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr int poses = 9;
const Vector3 size = Vector3(6.0, -4.0, 5.0) * test::mg;

// Of the biases, their mean over the log taken for the truth: rms and largest of what they are off by, in sigma, and the median of sigma.
struct Off {
  double rms = 0.0, largest = 0.0, median_mg = 0.0;
};
template <typename Share>
Off of_draws(Share share) {
  Off off;
  std::vector<double> sigma;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    double mean = 0.0;
    for (int k = 0; k < 1000; ++k) {
      mean += 1e-3 * share((k + 0.5) / 1000.0);
    }
    const PoseDiagnosis d = diagnose_poses(
        test::hand_turned(poses, seed, [&](double passed, const Vector3&) { return Vector3(share(passed) * size); }),
        0.01);
    EXPECT_TRUE(d.failure.empty()) << d.failure;
    EXPECT_EQ(d.poses, poses) << seed;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      const PoseParameter& p = d.accel_parameters[k];
      const double by = (p.value - test::bias(axis) - mean * size(axis)) / p.sigma;
      off.rms += by * by;
      off.largest = std::max(off.largest, std::abs(by));
      sigma.push_back(p.sigma / test::mg);
    }
  }
  off.rms = std::sqrt(off.rms / static_cast<double>(sigma.size()));
  std::sort(sigma.begin(), sigma.end());
  off.median_mg = sigma[sigma.size() / 2];
  return off;
}

TEST(AccelDrift, IsHeldInSigmaOfFewPoses) {
  const Off clean = of_draws([](double) { return 0.0; });
  const Off ramp = of_draws([](double passed) { return passed; });
  const Off warm = of_draws([](double passed) { return 1.0 - std::exp(-3.0 * passed); });
  // Sixty that are about as large as sigma: an rms beyond 1.5 is one case in a million, were they independent; the three of a draw are not.
  for (const Off& off : {clean, ramp, warm}) {
    EXPECT_LT(off.rms, 1.5);
    EXPECT_LT(off.largest, 5.0);
  }
  // The negative control: sensors that do not drift are known by their noise, 5 ug of a mean, as the poses thin it out.
  EXPECT_LT(clean.median_mg, 0.1 * ramp.median_mg);
}

}  // namespace
}  // namespace selfcal::diagnosis
