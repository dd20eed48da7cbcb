#include "estimator/diagnosis/search/bias_noise.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "estimator/diagnosis/search/remains.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/newton_climb.hpp"

namespace selfcal::diagnosis {
namespace {

using Kind = BiasKernel::Kind;

// The likelihood of noise models about a stage, its terms at the sizes that they were taken out with: one trajectory for all. Where
// another recording is compared with, as `log_likelihood` has it.
class NoiseLikelihood {
 public:
  NoiseLikelihood(const SearchGround& ground, const Stage& stage) : ground_(ground), stage_(stage) {
    if (!ground.context.reference()) {
      navigated_ = navigate(stage.point.pass(stage.hypothesis().noise));
    }
  }
  double of(const std::vector<BiasProcess>& processes) const {
    const NoiseModel noise = with_processes(stage_.hypothesis().noise, processes);
    if (ground_.context.reference()) {
      return log_likelihood(ground_, stage_, noise);
    }
    PassInput input = stage_.point.pass(noise);
    input.navigated = &navigated_;
    const PassOutput out = run_pass(input);
    Eigen::VectorXd residual(3 * static_cast<Eigen::Index>(out.epochs.size()));
    for (std::size_t k = 0; k < out.epochs.size(); ++k) {
      residual.segment<3>(3 * static_cast<Eigen::Index>(k)) =
          out.epochs[k].innovation.cwiseQuotient(out.epochs[k].variance.cwiseSqrt());
    }
    return out.log_likelihood + whitened_gain(ground_.context.colour(), residual);
  }

 private:
  const SearchGround& ground_;
  const Stage& stage_;
  Navigated navigated_;
};

double log_likelihood_with(const SearchGround& ground, const Stage& stage, const std::vector<BiasProcess>& processes) {
  return log_likelihood(ground, stage, with_processes(stage.hypothesis().noise, processes));
}

std::vector<BiasProcess> without(std::vector<BiasProcess> processes, std::size_t i) {
  processes.erase(processes.begin() + static_cast<std::ptrdiff_t>(i));
  return processes;
}

Stage with_these(const SearchGround& ground, const Stage& stage, std::vector<BiasProcess> processes) {
  Selection selection = stage.selection;
  selection.hypothesis.noise = with_processes(selection.hypothesis.noise, processes);
  selection.hypothesis.processes = std::move(processes);
  return settled(ground.context, stage, std::move(selection));
}

// Size and correlation time by what they do: how fast the variance grows at first, and the time. These two do not trade against each
// other where a strong instability is seen within a few intervals. A walk has the former alone.
double growth_of(const BiasProcess& p) {  // map units^2/s
  return p.kernel.kind == Kind::random_walk ? p.size * p.size / units::hour
                                            : 2.0 * p.size * p.size / p.kernel.correlation_s;
}
void set(BiasProcess& p, double growth, double correlation_s) {
  const bool walks = p.kernel.kind == Kind::random_walk;
  p.size = std::sqrt(growth * (walks ? units::hour : 0.5 * correlation_s));
  p.kernel.correlation_s = walks ? 0.0 : correlation_s;
}

// As the other kind, growing alike at first.
BiasProcess as(Kind kind, BiasProcess p) {
  constexpr double time_s = 600.0;  // somewhere between a dwell and a recording: where a search begins
  if (p.kernel.kind != kind) {
    const double growth = growth_of(p);
    p.kernel.kind = kind;
    set(p, growth, time_s);
  }
  return p;
}

// Covariance of the logarithms, of which a quantity that the data hardly hold has 1.
template <int N>
Eigen::Matrix<double, N, N> log_covariance(const Eigen::Matrix<double, N, N>& information) {
  constexpr double least_information = 1.0;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(information);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(least_information).cwiseInverse().asDiagonal() *
         solver.eigenvectors().transpose();
}

// Process i at the top of the likelihood, which is returned.
double fit(const NoiseLikelihood& likelihood, std::vector<BiasProcess>& processes, std::size_t i) {
  // Farther off what the columns showed it would be another process.
  const NewtonClimb how{.farthest = 20.0, .most_rounds = 5};
  const auto at = [&](double growth, double correlation_s) {
    set(processes[i], growth, correlation_s);
    return likelihood.of(processes);
  };
  BiasProcess& p = processes[i];
  if (p.kernel.kind == Kind::random_walk) {
    const NewtonTop<1> top =
        newton_climb<1>({growth_of(p)}, how, [&](const std::array<double, 1>& x) { return at(x[0], 0.0); });
    set(p, top.at[0], 0.0);
    p.sigma = p.size * 0.5 * std::sqrt(log_covariance<1>(top.information)(0, 0));
    return top.log_likelihood;
  }
  const NewtonTop<2> top = newton_climb<2>({growth_of(p), p.kernel.correlation_s}, how,
                                           [&](const std::array<double, 2>& x) { return at(x[0], x[1]); });
  const Eigen::Matrix2d covariance = log_covariance<2>(top.information);
  set(p, top.at[0], top.at[1]);
  p.sigma = p.size * 0.5 * std::sqrt(covariance.sum());
  p.correlation_sigma_s = p.kernel.correlation_s * std::sqrt(covariance(1, 1));
  return top.log_likelihood;
}

// Of a few sizes and times the best: from where a fit may begin.
BiasProcess roughly(const NoiseLikelihood& likelihood, const Stage& stage, const std::vector<int>& axes,
                    double without) {
  BiasProcess best;
  best.axes = axes;
  const NoiseModel& noise = stage.hypothesis().noise;
  std::vector<BiasProcess> processes = stage.hypothesis().processes;
  processes.push_back(best);
  BiasProcess& p = processes.back();
  for (const double time_s : {20.0, 60.0, 180.0}) {
    // The white noise's mean over its time, once and three times.
    const double white = (p.of_gyro() ? noise.gyro_arw : noise.accel_vrw) / std::sqrt(time_s) / map_unit(axes.front());
    for (const double size : {white, 3.0 * white}) {
      p.kernel = {Kind::instability, time_s};
      p.size = size;
      p.delta_chi2 = 2.0 * (likelihood.of(processes) - without);
      if (p.delta_chi2 > best.delta_chi2) {
        best = p;
      }
    }
  }
  return best;
}

// Process i as the kind that it is, fitted, with the other one beside it. Returns twice what it gains over none.
double fit_kinds(const SearchGround& ground, const Stage& stage, const NoiseLikelihood& likelihood,
                 std::vector<BiasProcess>& processes, std::size_t i) {
  std::vector<BiasProcess> walking = processes, wandering = processes;
  walking[i] = as(Kind::random_walk, processes[i]);
  wandering[i] = as(Kind::instability, processes[i]);
  const double of_walk = fit(likelihood, walking, i), of_instability = fit(likelihood, wandering, i);
  const double least_odds = std::log(20.0);
  const bool walks = of_instability < of_walk + least_odds;
  const double against = walks ? of_instability - of_walk : of_walk - of_instability;
  const BiasProcess other = (walks ? wandering : walking)[i];
  processes = std::move(walks ? walking : wandering);
  processes[i].other = {other.kernel, other.size};
  processes[i].probability_of_other_kind = 1.0 / (1.0 + std::exp(-against));
  processes[i].delta_chi2 =
      2.0 * (log_likelihood_with(ground, stage, processes) - log_likelihood_with(ground, stage, without(processes, i)));
  return processes[i].delta_chi2;
}

// That noise makes as much in one of the places, corrected for their number.
double log_p_of_places(const Stage& stage) {
  const Map map = locate(stage.given_forms(), stage.model.map(), stage.model.first_map_column(), stage.columns());
  return log_corrected(log_normal_tail(map.largest_sigma), std::max(1, map.tests));
}

}  // namespace

int bias_of(int axis) { return axis < 3 ? parameter::gyro_drift + axis : parameter::accel_bias + axis - 3; }

std::vector<std::vector<int>> open_axes(const Hypothesis& hypothesis) {
  // Sensors of one kind are alike: what each axis may do alone, a triad may do with one size.
  std::vector<std::vector<int>> all = {{0}, {1}, {2}, {3}, {4}, {5}, {0, 1, 2}, {3, 4, 5}};
  std::erase_if(all, [&](const std::vector<int>& axes) {
    return std::any_of(hypothesis.processes.begin(), hypothesis.processes.end(), [&](const BiasProcess& p) {
      return std::find_first_of(p.axes.begin(), p.axes.end(), axes.begin(), axes.end()) != p.axes.end();
    });
  });
  return all;
}

NoiseModel with_processes(NoiseModel noise, const std::vector<BiasProcess>& processes) {
  noise.biases.clear();
  for (const BiasProcess& p : processes) {
    for (const int axis : p.axes) {
      BiasNoise bias{.parameter = bias_of(axis)};
      if (p.kernel.kind == Kind::random_walk) {
        bias.rate = p.size * map_unit(axis) / std::sqrt(units::hour);
      } else {
        bias.sigma = p.size * map_unit(axis);
        bias.correlation_s = p.kernel.correlation_s;
      }
      noise.biases.push_back(bias);
    }
  }
  return noise;
}

std::optional<Stage> with_process(const SearchGround& ground, const Stage& stage, const std::vector<BiasProcess>& found,
                                  const Significance& significance) {
  const NoiseLikelihood likelihood(ground, stage);
  std::vector<BiasProcess> best;
  for (const BiasProcess& one : found) {
    std::vector<BiasProcess> processes = stage.hypothesis().processes;
    processes.push_back(one);
    fit_kinds(ground, stage, likelihood, processes, processes.size() - 1);
    if (best.empty() || processes.back().delta_chi2 > best.back().delta_chi2) {
      best = std::move(processes);
    }
  }
  if (best.empty() || !significance.holds(significance.corrected(best.back().log_p()))) {
    return std::nullopt;
  }
  return with_these(ground, stage, std::move(best));
}

std::vector<BiasProcess> best_in_filter(const SearchGround& ground, const Stage& stage) {
  const NoiseLikelihood likelihood(ground, stage);
  const double without = likelihood.of(stage.hypothesis().processes);
  std::vector<BiasProcess> best(2);  // of either triad
  for (const std::vector<int>& axes : open_axes(stage.hypothesis())) {
    const BiasProcess p = roughly(likelihood, stage, axes, without);
    BiasProcess& of_triad = best[p.of_gyro() ? 0 : 1];
    if (p.delta_chi2 > of_triad.delta_chi2) {
      of_triad = p;
    }
  }
  std::erase_if(best, [](const BiasProcess& p) { return p.axes.empty(); });
  return best;
}

std::optional<Stage> explain_remainder(const SearchGround& ground, const Stage& stage) {
  constexpr double rate = 0.01;  // of what remains, and of the process that is to explain it
  if (!stage.hypothesis().noise.axes || ground.context.reference()) {
    return std::nullopt;
  }
  const double seen = log_p_of_places(stage);
  const std::vector<std::vector<int>> open = open_axes(stage.hypothesis());
  if (std::min(seen, structure_left(stage).log_p()) >= std::log(rate) || open.empty()) {
    return std::nullopt;
  }
  const std::vector<BiasProcess> found = best_in_filter(ground, stage);
  std::optional<Stage> explained =
      with_process(ground, stage, found, {std::log(rate), 1.5 * static_cast<double>(open.size()), 0.0});
  constexpr double barely = 1e-5, likely = 0.2;
  if (!explained && seen > std::log(barely)) {
    explained = with_process(ground, stage, found, {std::log(likely), 1.0, 0.0});
    if (explained && std::min(log_p_of_places(*explained), structure_left(*explained).log_p()) < std::log(rate)) {
      return std::nullopt;
    }
  }
  return explained;
}

double gain_of_process(const SearchGround& ground, const Stage& stage, std::size_t i) {
  const std::vector<BiasProcess>& all = stage.hypothesis().processes;
  return 2.0 * (log_likelihood_with(ground, stage, all) - log_likelihood_with(ground, stage, without(all, i)));
}

Stage without_process(const SearchGround& ground, const Stage& stage, std::size_t i) {
  return with_these(ground, stage, without(stage.hypothesis().processes, i));
}

std::optional<Stage> refit_processes(const SearchGround& ground, const Stage& stage) {
  std::vector<BiasProcess> processes = stage.hypothesis().processes;
  if (processes.empty()) {
    return std::nullopt;
  }
  const NoiseLikelihood likelihood(ground, stage);
  for (std::size_t i = 0; i < processes.size(); ++i) {
    fit_kinds(ground, stage, likelihood, processes, i);
  }
  return with_these(ground, stage, std::move(processes));
}

KindAverage average_kinds(const Stage& stage) {
  const auto answer = [&](const NoiseModel& noise) {
    const PassOutput out = run_pass(stage.point.pass(noise));
    const int at = out.layout.parameters();
    return std::pair<ParameterVector, ParameterMatrix>(
        out.mean.segment<sensor_parameter_count>(at),
        out.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at));
  };
  KindAverage average;
  const Hypothesis& h = stage.hypothesis();
  if (h.processes.empty()) {
    return average;
  }
  const auto [value, covariance] = answer(h.noise);
  for (std::size_t i = 0; i < h.processes.size(); ++i) {
    const double p = h.processes[i].probability_of_other_kind;
    std::vector<BiasProcess> processes = h.processes;
    processes[i].kernel = h.processes[i].other.kernel;
    processes[i].size = h.processes[i].other.size;
    const auto [other_value, other_covariance] = answer(with_processes(h.noise, processes));
    const ParameterVector moved = other_value - value;
    average.shift += p * moved;
    average.covariance += p * (other_covariance - covariance) + p * (1.0 - p) * moved * moved.transpose();
  }
  return average;
}

}  // namespace selfcal::diagnosis
