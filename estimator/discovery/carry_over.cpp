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
// What follows time since a turn is not seen at one alone.
constexpr std::array<double, 3> dwells_s = {60.0, 110.0, 170.0};

// Another place: a plan, and how far the vehicle leans beside the attitude that it was recorded in.
struct Elsewhere {
  Schedule plan;
  double roll = 0.0, pitch = 0.0;
};

std::array<Elsewhere, 2> places() {
  constexpr Grid between_right_angles{.step_deg = 90.0, .first_deg = 45.0};
  constexpr double slower = 1.7;  // what follows the rate of the turns is not seen at one alone
  std::array<Elsewhere, 2> all = {
      Elsewhere{walk_over_positions({}, dwells_s[1], plan_seed), 8.0 * units::degree, -6.0 * units::degree},
      Elsewhere{walk_over_positions({}, dwells_s[1], plan_seed + 1, between_right_angles), -10.0 * units::degree,
                9.0 * units::degree}};
  all[1].plan.rotation_s *= slower;
  for (Elsewhere& one : all) {
    for (std::size_t k = 0; k < one.plan.dwell_s.size(); ++k) {
      one.plan.dwell_s[k] = dwells_s[k % dwells_s.size()];
    }
  }
  return all;
}

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
  const auto rows = static_cast<Eigen::Index>(n);
  CarryOver result{std::vector<double>(n, 0.0), std::vector<double>(n, 0.0), Eigen::MatrixXd::Zero(rows, rows),
                   Eigen::MatrixXd::Zero(rows, rows)};
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
  const std::array<Elsewhere, 2> all = places();
  const Planning planning(like);
  if (n > 1) {
    const Attitude as_it_stands = like.calibration.initial_attitude;
    result.here = planning.information(all.front().plan, as_it_stands, {terms}, stop);
  }
  for (const Elsewhere& one : all) {
    Attitude vehicle = like.calibration.initial_attitude;
    vehicle.roll += one.roll;
    vehicle.pitch += one.pitch;
    const Eigen::MatrixXd G = planning.information(one.plan, vehicle, {terms}, stop);
    result.information += G;
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = 0; b < n; ++b) {
        const double share = a == b ? 0.0 : left(G, laws, a, b);
        const double in_limits = share / tolerated_share;
        const double weight = laws[b].odds / total / static_cast<double>(all.size());
        result.probability[a] += share <= tolerated_share ? weight : 0.0;
        result.merit[a] += weight / (1.0 + in_limits * in_limits);
      }
    }
  }
  for (double& probability : result.probability) {
    probability = std::min(1.0, probability);  // the weights add up to one but for their rounding
  }
  return result;
}

namespace {

bool alike(const Eigen::MatrixXd& G, const std::vector<PossibleLaw>& laws, std::size_t a, std::size_t b) {
  constexpr double least_share = 0.01;
  const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
  if (laws[a].term.axis != laws[b].term.axis || !(G(i, i) > 0.0) || !(G(j, j) > 0.0)) {
    return a == b;
  }
  const double share = 1.0 - std::min(1.0, G(i, j) * G(i, j) / (G(i, i) * G(j, j)));
  const double size =
      std::max(std::pow(laws[a].coefficient, 2.0) * G(i, i), std::pow(laws[b].coefficient, 2.0) * G(j, j));
  return share < least_share && share * size < 1.0;
}

}  // namespace

bool one_function(const CarryOver& elsewhere, const std::vector<PossibleLaw>& laws, std::size_t a, std::size_t b) {
  return alike(elsewhere.information, laws, a, b);
}

bool one_function_here(const CarryOver& elsewhere, const std::vector<PossibleLaw>& laws, std::size_t a, std::size_t b) {
  return alike(elsewhere.here, laws, a, b);
}

}  // namespace selfcal::discovery
