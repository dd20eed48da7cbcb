#include "estimator/diagnosis/isolability.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/diagnosis/regression/regression.hpp"
#include "estimator/diagnosis/regression/signature_pass.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/diagnosis/turn_ramp.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double planning_rate_hz = 20.0;
// A rival that leaves less than this share of the effect's own square on every recording contains it.
constexpr double contained_share = 1e-6;

struct Trial {
  Experiment experiment;
  Attitude vehicle;
};

Schedule with_dwells_between(const Schedule& done) {
  Schedule s;
  s.rotation_s = done.rotation_s;
  for (std::size_t k = 0; k < done.positions.size(); ++k) {
    if (k > 0) {
      const GimbalPosition& a = done.positions[k - 1];
      const GimbalPosition& b = done.positions[k];
      s.positions.push_back({0.5 * (a.outer_deg + b.outer_deg), 0.5 * (a.inner_deg + b.inner_deg)});
      s.dwell_s.push_back(0.5 * done.dwell_s[k]);
    }
    s.positions.push_back(done.positions[k]);
    s.dwell_s.push_back(0.5 * done.dwell_s[k]);
  }
  return s;
}

std::vector<Trial> trials(const Schedule& done, const Attitude& vehicle) {
  std::vector<Trial> all;
  Schedule longer = done;
  for (double& dwell : longer.dwell_s) {
    dwell *= 2.0;
  }
  all.push_back({{"longer", "the same with dwells twice as long", longer, 0.0, nullptr}, vehicle});
  Schedule slow = done;
  slow.rotation_s *= 3.0;
  all.push_back({{"slow_turns", "the same with turns at a third of the rate", slow, 0.0, nullptr}, vehicle});
  all.push_back({{"dwells_45", "dwells half as long, and one half way through each turn", with_dwells_between(done),
                  0.0, nullptr},
                 vehicle});
  constexpr double tilt = 5.0 * units::degree;
  all.push_back({{"tilted_base", "the host tilted by 5 deg in roll and pitch", done, 0.0, nullptr},
                 {vehicle.roll + tilt, vehicle.pitch + tilt, vehicle.heading}});
  all.push_back({{"second_heading", "the host turned by 90 deg in heading", done, 0.0, nullptr},
                 {vehicle.roll, vehicle.pitch, vehicle.heading + 90.0 * units::degree}});
  return all;
}

// The effect as found and every variant of its rivals.
struct Contest {
  std::vector<Candidate> candidates;  // the effect first
  Eigen::VectorXd size;
};

Contest contest_of(const ModelEffect& model, const Finding& finding) {
  Contest c;
  c.candidates.push_back({model.effect, model.constant, 0, 0});
  c.size = model.size;
  for (const Effect* rival : finding.rivals) {
    for (const double constant : rival->constant.tried()) {
      c.candidates.push_back({rival, constant, 0, 0});
    }
  }
  return c;
}

Eigen::MatrixXd information(const RecordingContext& context, const PassInput& input,
                            std::vector<Candidate>& candidates) {
  SignaturePass pass(context, candidates, false);
  const SignatureRows rows = pass.run(input);
  candidates = pass.candidates();
  return rows.columns.transpose() * rows.columns;
}

// A planned recording is taken to go through the temperatures of this one, stretched to its length: then what follows the
// channel has columns there too. Empty without a channel.
std::vector<double> temperatures_like(const ImuData& data, std::size_t samples) {
  std::vector<double> planned;
  for (std::size_t k = 0; !data.temperature.empty() && k < samples; ++k) {
    planned.push_back(data.temperature[k * data.temperature.size() / samples]);
  }
  return planned;
}

Separation closest_of(const std::vector<Separation>& all, const std::vector<const Effect*>& except) {
  Separation closest;
  bool any = false;
  for (const Separation& s : all) {
    if (std::find(except.begin(), except.end(), s.closest) == except.end() && (!any || s.square < closest.square)) {
      closest = s;
      any = true;
    }
  }
  return closest;
}

Split plan_split(const Diagnosis& d, const ModelEffect& model, const Finding& finding, const ImuData& data,
                 const Schedule& done) {
  Contest contest = contest_of(model, finding);
  const RecordingContext context(data);
  const Eigen::MatrixXd now = information(context, forward_pass(data, d.calibration), contest.candidates);
  std::vector<Trial> tried = trials(done, d.calibration.initial_attitude);
  std::vector<std::vector<Separation>> results;
  const double ramp = turn_ramp(data);
  for (Trial& trial : tried) {
    const IdealRecording ideal(trial.experiment.schedule, trial.vehicle, data.site, planning_rate_hz, ramp);
    const std::vector<double> temperature = temperatures_like(data, ideal.data().size());
    ImuData as_planned = ideal.data();
    as_planned.temperature = temperature;
    const RecordingContext planned(as_planned);
    PassInput input = forward_pass(as_planned, d.calibration);
    input.parameters.setZero();
    input.C_nb = ideal.C_nb_start();
    results.push_back(
        separations(now + information(planned, input, contest.candidates), contest.candidates, contest.size));
  }
  Split split;
  split.effect = model.effect;
  split.rivals = finding.rivals;
  const std::vector<Separation> here = separations(now, contest.candidates, contest.size);
  for (std::size_t r = 0; r < here.size(); ++r) {
    const bool contained = here[r].share < contained_share &&
                           std::all_of(results.begin(), results.end(),
                                       [r](const auto& result) { return result[r].share < contained_share; });
    if (contained) {
      split.contain.push_back(here[r].closest);
    }
  }
  split.separation_now = std::sqrt(closest_of(here, split.contain).square);
  for (std::size_t k = 0; k < tried.size(); ++k) {
    const Separation s = closest_of(results[k], split.contain);
    if (s.closest != nullptr) {
      tried[k].experiment.separation = std::sqrt(s.square);
      tried[k].experiment.closest = s.closest;
      split.experiments.push_back(std::move(tried[k].experiment));
    }
  }
  std::stable_sort(split.experiments.begin(), split.experiments.end(),
                   [](const Experiment& a, const Experiment& b) { return a.separation > b.separation; });
  return split;
}

}  // namespace

std::vector<Separation> separations(const Eigen::MatrixXd& G, const std::vector<Candidate>& columns,
                                    const Eigen::VectorXd& size) {
  std::vector<Separation> all;
  const auto n = static_cast<Eigen::Index>(columns.front().count);
  const double own = size.dot(G.topLeftCorner(n, n) * size);
  for (std::size_t k = 1; k < columns.size(); ++k) {
    const Candidate& c = columns[k];
    const Eigen::LDLT<Eigen::MatrixXd> solver = solver_beside(G.block(c.first, c.first, c.count, c.count));
    const Eigen::VectorXd x = G.block(c.first, 0, c.count, n) * size;
    const double left = std::max(0.0, own - x.dot(solver.solve(x)));
    const Separation s{left, own > 0.0 ? left / own : 0.0, c.effect};
    const auto same = std::find_if(all.begin(), all.end(), [&](const Separation& o) { return o.closest == s.closest; });
    if (same == all.end()) {
      all.push_back(s);
    } else if (s.square < same->square) {
      *same = s;
    }
  }
  return all;
}

std::vector<Split> plan_splits(const Diagnosis& d, const ImuData& data, const Schedule& done) {
  std::vector<Split> splits;
  for (const Finding& finding : d.findings) {
    const auto model =
        std::find_if(d.model.begin(), d.model.end(), [&](const ModelEffect& m) { return m.effect == finding.source; });
    if (!finding.rivals.empty() && model != d.model.end() && model->effect->sensor != nullptr) {
      splits.push_back(plan_split(d, *model, finding, data, done));
    }
  }
  return splits;
}

}  // namespace selfcal::diagnosis
