#include "estimator/diagnosis/comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "estimator/diagnosis/catalogue.hpp"
#include "estimator/diagnosis/judgement.hpp"
#include "estimator/diagnosis/still_calibration.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double largest_shift_s = 2.0;    // between the same turns of both
constexpr std::size_t most_effects = 6;
constexpr double share_names = 0.5, share_parameters = 0.1;   // of the false-alarm rate
const double class_log_odds = std::log(100.0);

std::string schedules_differ(const ImuData& a, const ImuData& b) {
  char text[160];
  const std::vector<Segment> first = find_segments(a), second = find_segments(b);
  if (first.size() != second.size()) {
    std::snprintf(text, sizeof text, "not the same schedule: %zu dwells and turns against %zu", first.size(),
                  second.size());
    return text;
  }
  const double offset = second.front().start_s - first.front().start_s;
  for (std::size_t k = 0; k < first.size(); ++k) {
    if (std::abs(second[k].start_s - offset - first[k].start_s) > largest_shift_s) {
      std::snprintf(text, sizeof text, "not the same schedule: part %zu begins at %.1f s against %.1f s", k + 1,
                    first[k].start_s, second[k].start_s - offset);
      return text;
    }
  }
  return {};
}

class Comparer {
 public:
  Comparer(const ImuData& recording, const ImuData& simulation, const DiagnosisOptions& options,
           CalibrationResult of_recording, CalibrationResult of_simulation)
      : recording_(recording),
        simulation_(simulation),
        options_(options),
        calibration_(std::move(of_recording)),
        reference_(std::move(of_simulation)),
        context_(recording),
        pass_(context_, candidates(), true) {}

  Comparison run();

 private:
  std::vector<Candidate> candidates() const;
  SignatureRows difference();
  bool add_best();
  void refine(Candidate& winner);
  void judge();
  void compare_parameters();
  std::vector<int> chosen_columns(std::size_t without = static_cast<std::size_t>(-1)) const;
  double corrected(double log_p) const {
    return log_corrected(log_p, static_cast<double>(pass_.candidates().size()));
  }

  const ImuData& recording_;
  const ImuData& simulation_;
  const DiagnosisOptions& options_;
  CalibrationResult calibration_, reference_;
  RecordingContext context_;
  SignaturePass pass_;
  Eigen::VectorXd simulated_residual_;
  SignatureRows rows_;
  std::vector<Chosen> chosen_;
  Comparison result_;
};

std::vector<Candidate> Comparer::candidates() const {
  std::vector<Candidate> all;
  for (const Effect& effect : catalogue()) {
    for (const double constant : effect.constants) {
      if (!effect.needs_temperature || !recording_.temperature.empty()) {
        all.push_back({&effect, constant, 0, 0});
      }
    }
  }
  return all;
}

SignatureRows Comparer::difference() {
  SignatureRows rows = pass_.run(forward_pass(recording_, calibration_));
  const Eigen::Index n = std::min(rows.residual.size(), simulated_residual_.size());
  rows.residual = (rows.residual.head(n) - simulated_residual_.head(n)) * std::numbers::sqrt2 / 2.0;
  rows.columns = rows.columns.topRows(n) * std::numbers::sqrt2 / 2.0;
  rows.time_s.resize(static_cast<std::size_t>(n));
  return rows;
}

std::vector<int> Comparer::chosen_columns(std::size_t without) const {
  std::vector<int> columns;
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    if (i != without) {
      const std::vector<int> own = columns_of(chosen_[i].candidate);
      columns.insert(columns.end(), own.begin(), own.end());
    }
  }
  return columns;
}

// The constant between its neighbours on the grid, in steps of a sixteenth of their ratio.
void Comparer::refine(Candidate& winner) {
  constexpr int steps = 8;
  double best = 0.0, constant = winner.constant;
  for (int k = -steps; k <= steps; ++k) {
    const double trial = winner.constant * std::pow(2.0, static_cast<double>(k) / steps);
    SignaturePass alone(context_, {{winner.effect, trial, 0, 0}}, false);
    const SignatureRows rows = alone.run(forward_pass(recording_, calibration_));
    SignatureRows scaled;
    scaled.residual = rows_.residual;
    scaled.columns = rows.columns.topRows(rows_.residual.size()) * std::numbers::sqrt2 / 2.0;
    const Evidence evidence(scaled);
    const double gain = test_group(evidence, columns_of(alone.candidates().front()), {}).gain;
    if (gain > best) {
      best = gain;
      constant = trial;
    }
  }
  winner.constant = constant;
  pass_.set_constant(winner.first, constant);
  rows_ = difference();
}

bool Comparer::add_best() {
  const Evidence evidence(rows_);
  const std::vector<int> others = chosen_columns();
  double best = std::log(share_names * options_.false_alarm_rate);
  const Candidate* winner = nullptr;
  for (const Candidate& c : pass_.candidates()) {
    const bool taken = std::any_of(chosen_.begin(), chosen_.end(),
                                   [&](const Chosen& x) { return x.candidate.effect->id == c.effect->id; });
    const double log_p = taken ? 0.0 : corrected(test_group(evidence, columns_of(c), others).log_p);
    if (log_p < best) {
      best = log_p;
      winner = &c;
    }
  }
  if (winner == nullptr) {
    return false;
  }
  chosen_.emplace_back();
  chosen_.back().candidate = *winner;
  if (!std::isnan(winner->constant)) {
    refine(chosen_.back().candidate);
  }
  return true;
}

void Comparer::judge() {
  const Evidence evidence(rows_);
  std::vector<int> fold;
  for (const double t : rows_.time_s) {
    fold.push_back(static_cast<int>(context_.segment_at(t)));
  }
  const std::vector<int> all = chosen_columns();
  const Fit fit = evidence.fit(all);
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    Chosen& c = chosen_[i];
    const std::vector<int> others = chosen_columns(i);
    const GroupTest own = test_group(evidence, columns_of(c.candidate), others);
    c.size = fit.value.segment(at, c.candidate.count);
    c.covariance = fit.covariance.block(at, at, c.candidate.count, c.candidate.count);
    at += c.candidate.count;
    c.gain = own.gain;
    c.rank = own.rank;
    c.log_p = corrected(own.log_p);
    c.held_out = held_out_gain(rows_.columns, rows_.residual, fold, all, others);
    for (const Candidate& rival : pass_.candidates()) {
      const std::string& id = rival.effect->id;
      const bool known = std::find(c.equivalent.begin(), c.equivalent.end(), id) != c.equivalent.end() ||
                         std::any_of(chosen_.begin(), chosen_.end(),
                                     [&](const Chosen& x) { return x.candidate.effect->id == id; });
      if (!known && test_group(evidence, columns_of(rival), others).log_p < own.log_p + class_log_odds) {
        c.equivalent.push_back(id);
      }
    }
    result_.diagnosis.findings.push_back(describe(c, evidence.rows));
    result_.diagnosis.model.push_back({c.candidate.effect, c.candidate.constant, c.size, c.covariance});
  }
  const Map after = locate(evidence, pass_.map(), pass_.first_map_column(), all);
  Eigen::VectorXd residual = rows_.residual;
  if (!all.empty()) {
    residual -= rows_.columns(Eigen::all, all) * fit.value;
  }
  const bool moored = calibration_.moored || reference_.moored;
  result_.diagnosis.remaining = after.places;
  result_.diagnosis.after = adequacy(evidence.square - (all.empty() ? 0.0 : fit.gain), evidence.rows,
                                     log_p_white(residual), after, options_.false_alarm_rate, moored);
}

// The difference of the 24, with what the findings shift them by.
void Comparer::compare_parameters() {
  result_.difference = calibration_.value - reference_.value;
  for (const Chosen& c : chosen_) {
    result_.difference += rows_.shift.middleCols(c.candidate.first, c.candidate.count) * c.size;
  }
  ParameterMatrix P = calibration_.covariance + reference_.covariance;
  const std::vector<int> columns = chosen_columns();
  if (!columns.empty()) {
    const Eigen::MatrixXd S = rows_.shift(Eigen::all, columns);
    P += S * Evidence(rows_).fit(columns).covariance * S.transpose();
  }
  result_.sigma = P.diagonal().cwiseSqrt();
}

Comparison Comparer::run() {
  const RecordingContext simulated(simulation_);
  simulated_residual_ = SignaturePass(simulated, {}, false).run(forward_pass(simulation_, reference_)).residual;
  rows_ = difference();
  Diagnosis& d = result_.diagnosis;
  const Evidence evidence(rows_);
  const Map before = locate(evidence, pass_.map(), pass_.first_map_column(), {});
  d.located = before.places;
  d.before = adequacy(evidence.square, evidence.rows, log_p_white(rows_.residual), before, options_.false_alarm_rate,
                      calibration_.moored || reference_.moored);
  while (chosen_.size() < most_effects && add_best()) {
  }
  judge();
  compare_parameters();
  const double z = result_.difference.cwiseAbs().cwiseQuotient(result_.sigma).maxCoeff();
  const bool same_parameters = log_corrected(log_chi_squared_tail(z * z, 1.0), sensor_parameter_count) >
                               std::log(share_parameters * options_.false_alarm_rate);
  d.unexplained = !d.after.accepted;
  constexpr double tolerable_share = 0.1;   // as in a diagnosis: names must explain all but this much of the misfit
  if (d.unexplained && d.after.misfit > tolerable_share * d.before.misfit) {
    d.rejected.swap(d.findings);
    d.model.clear();
  }
  d.mismatch = !d.findings.empty() || d.unexplained || !same_parameters;
  d.verdict = !d.findings.empty()  ? DiagnosisVerdict::named
              : d.unexplained      ? DiagnosisVerdict::none_of_the_above
                                   : DiagnosisVerdict::adequate;
  d.value = calibration_.value;
  d.value_as_named = calibration_.value;
  d.sigma = calibration_.sigma;
  d.calibration = calibration_;
  const std::vector<Segment> first = find_segments(recording_), second = find_segments(simulation_);
  for (std::size_t k = 0; k < first.size(); ++k) {
    if (!first[k].rotation) {
      result_.attitude_difference =
          std::max({result_.attitude_difference, std::abs(std::remainder(first[k].outer - second[k].outer, 2 * std::numbers::pi)),
                    std::abs(std::remainder(first[k].inner - second[k].inner, 2 * std::numbers::pi))});
    }
  }
  const Eigen::AngleAxisd start(calibration_.C_nb_start.transpose() * reference_.C_nb_start);
  result_.attitude_difference = std::max(result_.attitude_difference, std::abs(start.angle()));
  return std::move(result_);
}

}  // namespace

ComparisonOutcome compare(const ImuData& recording, const ImuData& simulation, const DiagnosisOptions& options,
                          const std::function<void(const std::string&)>& progress) {
  if (recording.size() < 2 || simulation.size() < 2) {
    return {std::nullopt, "a recording is empty"};
  }
  if (std::string differ = schedules_differ(recording, simulation); !differ.empty()) {
    return {std::nullopt, std::move(differ)};
  }
  if (progress) {
    progress("calibrations");
  }
  CalibrationOutcome first = calibrate_still(recording, options.calibration);
  CalibrationOutcome second = calibrate_still(simulation, options.calibration);
  if (!first.result || !second.result) {
    return {std::nullopt, first.result ? "the simulation: " + second.failure.message : first.failure.message};
  }
  if (progress) {
    progress("difference");
  }
  return {Comparer(recording, simulation, options, std::move(*first.result), std::move(*second.result)).run(), {}};
}

}  // namespace selfcal::diagnosis
