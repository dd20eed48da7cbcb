#include "estimator/discovery/law_trial.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "estimator/discovery/piece_model.hpp"
#include "estimator/discovery/scene.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::discovery {
namespace {

constexpr int constant_rounds = 12;
// What an expression may be as large as: squares of it are summed, and a coefficient stands for the rest.
constexpr double smallest_size = 1e-50, largest_size = 1e50;
// Sigma from which a law is not seen: three of it make, rms over the recording, what no such sensor is off by.
constexpr double sigmas_to_see = 3.0;

std::string short_text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

// Root mean square of a law's expression over all recordings.
double rms_of(const LawTerm& law, const std::vector<std::unique_ptr<Scene>>& scenes) {
  double square = 0.0, time = 0.0;
  for (const auto& scene : scenes) {
    const Eigen::ArrayXd values = law.expression.evaluate(scene->table.channels, law.constants);
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      const double dt = scene->table.nodes[static_cast<std::size_t>(i)].dt;
      square += values(i) * values(i) * dt;
      time += dt;
    }
  }
  return std::sqrt(square / time);
}

std::optional<LawTrialFailure> missing_channel(const LawMotion& motion, const std::vector<LawTerm>& laws) {
  for (std::size_t k = 0; k < laws.size(); ++k) {
    const laws::VariableSet missing = laws[k].expression.variables() & ~motion.available();
    for (std::size_t v = 0; v < laws::variable_count; ++v) {
      if (missing.test(v)) {
        return LawTrialFailure{k, std::string(laws::variable_names[v]).append(": the recording has no such channel")};
      }
    }
  }
  return std::nullopt;
}

std::optional<LawTrialFailure> not_finite(const NodeTable& table, const std::vector<LawTerm>& laws) {
  for (std::size_t k = 0; k < laws.size(); ++k) {
    const Eigen::ArrayXd values = laws[k].expression.evaluate(table.channels, laws[k].constants);
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      if (!std::isfinite(values(i))) {
        const double t = table.nodes[static_cast<std::size_t>(i)].time_s;
        return LawTrialFailure{k, "not finite at " + std::to_string(t) + " s after the start"};
      }
    }
    const double largest = values.abs().maxCoeff();
    if (largest == 0.0) {
      return LawTrialFailure{k, "zero all along the recording"};
    }
    if (largest < smallest_size || largest > largest_size) {
      return LawTrialFailure{k, "as large as " + short_text(largest) + ": no coefficient makes a sensor error of that"};
    }
  }
  return std::nullopt;
}

// Values at which a constant is tried before it is refined: both signs, so close that a wave of ten periods is not missed.
std::vector<double> logarithmic(double low, double high, double ratio) {
  const int last = static_cast<int>(std::log(high / low) / std::log(ratio));
  std::vector<double> values;
  for (int k = 0; k <= last; ++k) {
    values.push_back(low * std::pow(ratio, k));
    values.push_back(-values.back());
  }
  return values;
}

// Where the constants of one law start: the best of a grid over the pieces, given what the model has chosen. Of values that fit alike,
// phases a whole turn apart, periods of either sign, the small and positive ones: they are tried first.
class Start {
 public:
  Start(const PieceSums& sums, const PieceModel& model, LawTerm& term) : sums_(sums), model_(model), term_(term) {}

  // Returns how many peaks were to choose from: what the significance of the best one is corrected for.
  double run() {
    if (term_.constants.size() == 2) {
      std::vector<double> second = logarithmic(0.01, 100.0, 1.6);
      second.push_back(0.0);
      for (const double x : logarithmic(1e-3, 1e5, 1.1)) {
        for (const double y : second) {
          gain_of({x, y});
        }
      }
      take();
    }
    constexpr int sweeps = 3;
    double peaks = 1.0;
    for (int sweep = 0; sweep < (term_.constants.size() > 1 ? sweeps : 1); ++sweep) {
      peaks = 1.0;
      for (std::size_t c = 0; c < term_.constants.size(); ++c) {
        peaks *= std::max(1, along(c));
        take();
      }
    }
    return peaks;
  }

 private:
  // Tries one constant over its range; returns the number of peaks of one sign.
  int along(std::size_t constant) {
    int peaks = 0;
    double before = 0.0, last = 0.0;
    for (const double x : logarithmic(1e-3, 1e5, 1.05)) {
      std::vector<double> moved = term_.constants;
      moved[constant] = x;
      const double gain = gain_of(std::move(moved));
      if (x > 0.0) {
        peaks += last > before && last > gain ? 1 : 0;
        before = std::exchange(last, gain);
      }
    }
    return peaks;
  }

  double gain_of(std::vector<double> constants) {
    const Eigen::ArrayXd values = term_.expression.evaluate(sums_.channels, constants);
    if (!values.isFinite().all()) {
      return 0.0;
    }
    const double gain = model_.gain(term_.axis, sums_.means(values));
    constexpr double fits_better = 0.5;
    if (gain > best_gain_ + fits_better) {
      best_gain_ = gain;
      best_ = std::move(constants);
    }
    return gain;
  }

  void take() { term_.constants = best_.empty() ? term_.constants : best_; }

  const PieceSums& sums_;
  const PieceModel& model_;
  LawTerm& term_;
  std::vector<double> best_;
  double best_gain_ = 0.0;
};

struct Started {
  std::vector<LawTerm> laws;
  std::vector<double> peaks;  // [laws]
};

// Each law given the ones before it.
Started started(std::vector<LawTerm> laws, const std::vector<std::unique_ptr<Scene>>& scenes) {
  Started result{std::move(laws), {}};
  result.peaks.assign(result.laws.size(), 1.0);
  if (std::all_of(result.laws.begin(), result.laws.end(), [](const LawTerm& t) { return t.constants.empty(); })) {
    return result;
  }
  std::vector<PieceSums> each;
  each.reserve(scenes.size());
  for (const auto& scene : scenes) {
    each.push_back(sum_over_pieces(scene->motion, scene->input, scene->trace, scene->beside));
  }
  const PieceSums sums = join(std::move(each));
  Dictionary nothing;
  nothing.means.resize(sums.piece_dt.size(), 0);
  PieceModel model(sums, nothing);
  std::vector<Eigen::VectorXd> chosen;
  for (std::size_t k = 0; k < result.laws.size(); ++k) {
    LawTerm& term = result.laws[k];
    result.peaks[k] = term.constants.empty() ? 1.0 : Start(sums, model, term).run();
    const Eigen::ArrayXd values = term.expression.evaluate(sums.channels, term.constants);
    if (values.isFinite().all()) {
      chosen.push_back(model.column(term.axis, sums.means(values)));
      model.choose(chosen);
    }
  }
  return result;
}

double significance_of(const TriedLaw& law) {
  const double degrees = 1.0 + static_cast<double>(law.constants.size());
  return sigma_from_log_p(std::min(0.0, log_chi_squared_tail(law.gain, degrees) + law.log_peaks));
}

}  // namespace

tl::expected<std::vector<TriedLaw>, LawTrialFailure> try_laws(std::span<const UnitRecording> recordings,
                                                              const std::vector<LawTerm>& laws,
                                                              const std::vector<double>& stated) {
  const std::vector<std::unique_ptr<Scene>> scenes = scenes_of(recordings);
  for (const auto& scene : scenes) {
    scene->table = collect_nodes(scene->motion, scene->input);
    if (auto failure = missing_channel(scene->motion, laws)) {
      return tl::unexpected(std::move(*failure));
    }
  }
  const Started start = started(laws, scenes);
  for (const auto& scene : scenes) {
    if (auto failure = not_finite(scene->table, start.laws)) {
      return tl::unexpected(std::move(*failure));
    }
  }
  const LawFit fit = fit_laws(laws_on(scenes), start.laws, constant_rounds);
  std::vector<TriedLaw> tried;
  auto at = static_cast<Eigen::Index>(laws.size());
  for (std::size_t k = 0; k < laws.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    TriedLaw law;
    law.term = fit.terms[k];
    law.expression = law.term.expression.text(law.term.constants);
    law.coefficient = fit.coefficient(row);
    law.sigma = std::sqrt(fit.covariance(row, row));
    for (std::size_t c = 0; c < law.term.constants.size(); ++c, ++at) {
      law.constants.push_back({"constant " + std::to_string(c + 1), "", law.term.constants[c],
                               std::sqrt(std::max(0.0, fit.covariance(at, at)))});
    }
    law.gain = fit.gain[k];
    law.held_out_gain = fit.held_out_gain[k];
    law.log_peaks = std::log(start.peaks[k]);
    law.significance = significance_of(law);
    law.share = std::clamp(law.gain / std::max(1.0, fit.square_before - fit.rows), 0.0, 1.0);
    law.stated = stated[k];
    law.collinear = fit.collinear[k];
    const int bias = law.term.axis < 3 ? parameter::gyro_drift : parameter::accel_bias;
    law.least_sigma_unseen =
        plausible_limit()(bias) / unit_of(law.term.axis) / (sigmas_to_see * rms_of(law.term, scenes));
    tried.push_back(std::move(law));
  }
  return tried;
}

void adopt(const JointFit& joint, std::vector<TriedLaw>& tried) {
  auto constant = static_cast<Eigen::Index>(tried.size());
  for (std::size_t k = 0; k < tried.size(); ++k) {
    TriedLaw& law = tried[k];
    const auto row = static_cast<Eigen::Index>(k);
    const double alone = law.coefficient / law.sigma;
    law.coefficient = joint.shared.coefficient(row);
    law.sigma = std::sqrt(std::max(0.0, joint.shared.coefficient_covariance(row, row)));
    for (Constant& c : law.constants) {
      c.sigma = std::sqrt(std::max(0.0, joint.shared.coefficient_covariance(constant, constant)));
      ++constant;
    }
    // The fall of the square goes with the square of the coefficient in its sigma.
    const double together = law.coefficient / law.sigma;
    law.gain *= alone != 0.0 ? together * together / (alone * alone) : 0.0;
    law.significance = significance_of(law);
    for (const Entangled& e : joint.entangled) {
      if (e.law == k) {
        const diagnosis::Effect& effect = *joint.effects[e.effect].effect;
        law.shares_with.push_back(effect.id + " " + effect.parameters[static_cast<std::size_t>(e.coefficient)].name);
      }
    }
  }
}

}  // namespace selfcal::discovery
