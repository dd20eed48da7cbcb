#include "estimator/planning/remedy.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "estimator/planning/schedule_model.hpp"

namespace selfcal {
namespace {

constexpr double dwell_s = 30.0;
constexpr double move_s = 5.0;
constexpr double worthwhile = 0.9;  // of sigma before
constexpr std::size_t most_named = 3;
constexpr int quarters[] = {0, 90, 180, 270};

struct Turn {
  GimbalPosition from, to;
  ParameterMatrix covariance;  // after it
};

std::vector<std::pair<GimbalPosition, GimbalPosition>> quarter_turns() {
  const auto at = [](int outer, int inner) {
    return GimbalPosition{static_cast<double>(outer), static_cast<double>(inner)};
  };
  std::vector<std::pair<GimbalPosition, GimbalPosition>> turns;
  for (const int a : quarters) {
    for (const int b : {0, 90, 180}) {
      turns.push_back({at(a, b), at(a, b + 90)});
      turns.push_back({at(b, a), at(b + 90, a)});
    }
  }
  return turns;
}

// What the 24 are known to after each of the turns.
std::vector<Turn> try_turns(const ParameterMatrix& covariance, const Installation& installation) {
  ScheduleModel model(installation);
  // A covariance of 24 states that were estimated together is singular to rounding: 1e-12 of each variance is added.
  ParameterMatrix regular = covariance;
  regular.diagonal() *= 1.0 + 1e-12;
  std::vector<Turn> turns;
  for (const auto& [from, to] : quarter_turns()) {
    UdFilter filter = model.start();
    filter.set_constant_covariance(regular);
    model.dwell(filter, from, dwell_s);
    model.move(filter, from, to, move_s);
    model.dwell(filter, to, dwell_s);
    turns.push_back({from, to, ScheduleModel::covariance(filter)});
  }
  return turns;
}

std::string words_of(const UndeterminedDirection& direction) {
  char text[160];
  if (direction.supply.empty()) {
    std::snprintf(text, sizeof text, "; no single turn with dwells of %.0f s takes a tenth off: dwell longer", dwell_s);
    return text;
  }
  std::snprintf(text, sizeof text, "; supplied by extra positions (outer/inner deg, %.0f s each): ", dwell_s);
  std::string words = text;
  for (std::size_t k = 0; k < direction.supply.size(); ++k) {
    const SupplyingTurn& turn = direction.supply[k];
    std::snprintf(text, sizeof text, "%s%.0f/%.0f and %.0f/%.0f (sigma then %.2g)", k == 0 ? "" : ", or ",
                  turn.from.outer_deg, turn.from.inner_deg, turn.to.outer_deg, turn.to.inner_deg, turn.sigma_after);
    words += text;
  }
  return words;
}

}  // namespace

void add_remedies(std::vector<UndeterminedDirection>& directions, const ParameterMatrix& covariance,
                  const Installation& installation) {
  if (directions.empty()) {
    return;
  }
  const std::vector<Turn> turns = try_turns(covariance, installation);
  for (UndeterminedDirection& direction : directions) {
    const ParameterVector weight = direction.direction.cwiseQuotient(installation.tolerance);
    for (const Turn& turn : turns) {
      const double after = std::sqrt(std::max(0.0, weight.dot(turn.covariance * weight)));
      if (after < worthwhile * direction.sigma) {
        direction.supply.push_back({turn.from, turn.to, after});
      }
    }
    std::stable_sort(direction.supply.begin(), direction.supply.end(),
                     [](const SupplyingTurn& a, const SupplyingTurn& b) { return a.sigma_after < b.sigma_after; });
    direction.supply.resize(std::min(direction.supply.size(), most_named));
    direction.words += words_of(direction);
  }
}

Installation installation_of(const CalibrationResult& result, const earth::Position& site,
                             const ParameterVector& tolerance) {
  Installation installation;
  installation.attitude = result.initial_attitude;
  installation.site = site;
  installation.gyro_arw = result.gyro_arw;
  installation.accel_vrw = result.accel_vrw;
  installation.position_sigma = result.position_sigma;
  for (const MotionModel& motion : result.noise.observation.motion) {  // what of a moored base cannot be foreseen
    installation.position_sigma = std::max(installation.position_sigma, motion.unforeseen(1.0));
  }
  installation.tolerance = tolerance;
  return installation;
}

}  // namespace selfcal
