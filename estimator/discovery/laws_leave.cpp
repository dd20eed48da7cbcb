#include "estimator/discovery/laws_leave.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/regression/evidence.hpp"
#include "estimator/diagnosis/search/bias_noise.hpp"
#include "estimator/diagnosis/search/judgement.hpp"
#include "estimator/diagnosis/search/quantities.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/column_pass.hpp"
#include "estimator/discovery/law_motion.hpp"
#include "estimator/discovery/pieces.hpp"
#include "estimator/discovery/scene.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/whiteness.hpp"

namespace selfcal::discovery {
namespace {

BiasNoise as_bias(const DiscoveredProcess& process, const diagnosis::RecordingContext& context) {
  BiasNoise bias{.parameter = diagnosis::bias_of(process.axis)};
  const double size = process.size * unit_of(process.axis);
  if (process.kind == ProcessKind::random_walk) {
    bias.rate = size / std::sqrt(units::hour);
    return bias;
  }
  bias.sigma = size;
  for (const diagnosis::Turn& turn : context.turns()) {
    bias.drawn_anew_s.push_back(turn.start_s);
  }
  return bias;
}

// A forward pass over these increments of the recording, the processes in its filter.
PassInput pass_with(const ImuData& data, const UnitRecording& recording, std::span<const DiscoveredProcess> processes,
                    const diagnosis::RecordingContext& context) {
  PassInput input = diagnosis::forward_pass(data, recording.calibration);
  for (const DiscoveredProcess& process : processes) {
    input.noise.biases.push_back(as_bias(process, context));
  }
  return input;
}

// `rest`, about the recording's calibration, less what the effects beside it are off by.
diagnosis::CorrectedRecording less_effects(const UnitRecording& recording, const diagnosis::CorrectedRecording& rest) {
  const diagnosis::RecordingContext context(rest.data());
  const PassInput input = diagnosis::forward_pass(rest.data(), recording.calibration);
  EffectColumns columns(context, recording.beside);
  const ColumnSums sums = run_columns(input, trace_pass(input), columns);
  const Eigen::VectorXd move = solve_scaled(sums.information, sums.score);
  // Of a constant's logarithm: beyond that its signature is no longer nearly linear in it.
  constexpr double largest_step = 0.33;
  diagnosis::Correction correction;
  Eigen::Index at = 0;
  for (const EffectTerm& term : recording.beside) {
    const Eigen::Index n = term.size.size();
    const double constant = term.constant_free
                                ? term.constant * std::exp(std::clamp(move(at + n), -largest_step, largest_step))
                                : term.constant;
    correction.add(*term.effect, constant, term.size + move.segment(at, n));
    correction.add(*term.effect, term.constant, -term.size);
    at += term.count();
  }
  return {context, input, std::move(correction)};
}

}  // namespace

diagnosis::CorrectedRecording less_laws(const UnitRecording& recording, const LawFit& fit) {
  diagnosis::CorrectedRecording rest(recording.data);
  if (!fit.terms.empty()) {
    const diagnosis::RecordingContext context(recording.data);
    const LawMotion motion(context);
    const PassInput input = diagnosis::forward_pass(recording.data, recording.calibration);
    rest = without_laws(motion, collect_nodes(motion, input), input, fit.terms, fit.coefficient);
  }
  return recording.beside.empty() ? rest : less_effects(recording, rest);
}

LawFit fit_of_told(std::span<const UnitRecording> recordings, const Discovery& found, const std::stop_token& stop) {
  if (found.described.empty()) {
    return found.fit;
  }
  const std::vector<std::unique_ptr<Scene>> scenes = scenes_with_tables(recordings);
  std::vector<LawTerm> told;
  told.reserve(found.laws.size());
  for (const DiscoveredLaw& law : found.laws) {
    told.push_back(law.term);
  }
  return fit_laws(laws_on(scenes), std::move(told), 0, stop);
}

Left left_by(const UnitRecording& recording, const LawFit& fit, std::span<const DiscoveredProcess> processes,
             bool coloured) {
  const diagnosis::CorrectedRecording rest = less_laws(recording, fit);
  const diagnosis::RecordingContext context(recording.data);
  std::vector<diagnosis::Candidate> bins = diagnosis::quantity_bins(context);
  int columns = 0;
  for (diagnosis::Candidate& bin : bins) {
    bin.first = columns;
    bin.count = static_cast<int>(bin.effect->parameters.size());
    columns += bin.count;
  }
  diagnosis::SignaturePass pass(context, bins, true);
  const diagnosis::SignatureRows rows = pass.run(pass_with(rest.data(), recording, processes, context));
  const diagnosis::Evidence evidence(rows);
  diagnosis::Shown shown{evidence.square, test_whiteness(rows.residual).log_p,
                         diagnosis::locate(evidence, pass.map(), pass.first_map_column(), {})};
  const diagnosis::Rules rules{.budget = diagnosis::budget_of_one,
                               .motion_fitted = recording.calibration.moored,
                               .coloured = coloured,
                               .goes_on = {}};
  Left left;
  left.adequacy = diagnosis::adequacy(rules, shown, evidence.rows, rules.alpha, rules.alpha);
  left.places = std::move(shown.map.places);
  left.by_quantity = diagnosis::locate_by_quantity(evidence, bins, {}, context.mean_temperature());
  return left;
}

ClassAverage beside_processes(std::span<const UnitRecording> recordings, const LawFit& fit,
                              std::span<const DiscoveredProcess> processes, const std::stop_token& stop) {
  ClassAverage beside;
  for (const UnitRecording& recording : recordings) {
    const diagnosis::RecordingContext context(recording.data);
    const diagnosis::CorrectedRecording rest = less_laws(recording, fit);
    const PassInput input = pass_with(rest.data(), recording, processes, context);
    const PassTrace trace = trace_pass(input);
    const LawMotion motion(context);
    const NodeTable table = collect_nodes(motion, input);
    LawColumns columns(motion, table, fit.terms, true);
    const ColumnSums sums = run_beside(recording.beside, context, input, trace, columns, stop);
    const int first = sums.pass.layout.parameters();
    ParameterVector parameters = input.parameters + sums.pass.mean.segment<sensor_parameter_count>(first);
    ParameterMatrix covariance =
        sums.pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(first, first);
    if (!fit.terms.empty()) {
      // What is left of the laws where the processes take their part of what the fit gave to them.
      const Eigen::VectorXd scale = column_scale(fit.terms, fit.coefficient);
      const Eigen::MatrixXd shift = sums.shift * scale.asDiagonal();
      Eigen::MatrixXd information = scale.asDiagonal() * sums.information * scale.asDiagonal();
      constexpr double wide = 100.0;  // of the fit's sigma: holds what the recording leaves open
      information.diagonal() += (wide * wide * fit.covariance.diagonal()).cwiseInverse();
      const Eigen::LDLT<Eigen::MatrixXd> solver(information);
      parameters += shift * solver.solve(scale.asDiagonal() * sums.score);
      covariance += shift * solver.solve(shift.transpose());
    }
    beside.parameters.push_back(parameters);
    beside.covariance.push_back(covariance);
  }
  return beside;
}

}  // namespace selfcal::discovery
