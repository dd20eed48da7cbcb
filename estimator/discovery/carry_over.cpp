#include "estimator/discovery/carry_over.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/discovery/planned_rotation.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {
namespace {

constexpr double tolerated_share = 0.1;  // of the misfit's power: what is called a prediction
constexpr unsigned plan_seed = 71;
constexpr std::array<double, 3> dwells_s = {60.0, 110.0,
                                            170.0};  // what follows time since a turn is not seen at one alone
// How far the vehicle leans beside the attitude that it was recorded in.
constexpr double further_roll = 8.0 * units::degree, further_pitch = -6.0 * units::degree;

// What law a leaves of law b.
double left(const Eigen::MatrixXd& G, const std::vector<PossibleLaw>& laws, std::size_t a, std::size_t b) {
  const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
  const double ca = laws[a].coefficient, cb = laws[b].coefficient;
  const double truth = cb * cb * G(j, j);
  return truth > 0.0 ? std::max(0.0, ca * ca * G(i, i) - 2.0 * ca * cb * G(i, j) + truth) / truth : 1.0;
}

}  // namespace

CarryOver carry_over(const UnitRecording& like, const std::vector<PossibleLaw>& laws, const std::stop_token& stop) {
  const std::size_t n = laws.size();
  CarryOver result{std::vector<double>(n, 0.0), std::vector<double>(n, 0.0)};
  std::vector<LawTerm> terms;
  double total = 0.0;
  for (const PossibleLaw& law : laws) {
    terms.push_back(law.term);
    if (needs_temperature(law.term.expression)) {
      terms.back().expression = *laws::Expression::parse("0*t");
      terms.back().constants.clear();
    }
    total += law.odds;
  }
  Attitude vehicle = like.calibration.initial_attitude;
  vehicle.roll += further_roll;
  vehicle.pitch += further_pitch;
  Schedule plan = walk_over_positions({}, dwells_s[1], plan_seed);
  for (std::size_t k = 0; k < plan.dwell_s.size(); ++k) {
    plan.dwell_s[k] = dwells_s[k % dwells_s.size()];
  }
  const Eigen::MatrixXd G = planned_information(plan, like, vehicle, terms, stop);
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < n; ++b) {
      const double share = a == b ? 0.0 : left(G, laws, a, b);
      const double in_limits = share / tolerated_share;
      result.probability[a] += (share <= tolerated_share ? laws[b].odds : 0.0) / total;
      result.merit[a] += laws[b].odds / total / (1.0 + in_limits * in_limits);
    }
  }
  return result;
}

}  // namespace selfcal::discovery
