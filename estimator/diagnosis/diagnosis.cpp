#include "estimator/diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "estimator/diagnosis/dwell_lines.hpp"
#include "estimator/diagnosis/judgement.hpp"
#include "estimator/diagnosis/noise_findings.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/diagnosis/velocity_noise.hpp"
#include "estimator/diagnosis/walk_check.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rejection_rate = 0.01;  // of right names, by the biases that they leave
constexpr double remainder_rate = 0.01;  // and by map, whiteness and size
constexpr double suspicion = 0.05;       // corrected p at which an effect is worth a further experiment
constexpr double seen_z = 3.0;           // an effect of typical size is detectable here beyond it

const std::array<const char*, 6> axis_letters = {"x", "y", "z", "x", "y", "z"};

}  // namespace

Finding describe(const Suspect& suspect) {
  Finding f;
  f.source = suspect.effect;
  f.effect = suspect.effect->id;
  f.equation = suspect.effect->equation;
  f.experiment = suspect.effect->experiment;
  f.log_p = suspect.log_p;
  f.significance = sigma_from_log_p(suspect.log_p);
  return f;
}

Finding describe(const Chosen& chosen, double rows) {
  const Effect& effect = *chosen.candidate.effect;
  Finding f;
  f.source = &effect;
  f.effect = effect.id;
  f.equation = effect.equation;
  f.excited = effect.excited;
  f.experiment = effect.experiment;
  for (Eigen::Index k = 0; k < chosen.size.size(); ++k) {
    const EffectParameter& p = effect.parameters[static_cast<std::size_t>(k)];
    const double value = chosen.size(k) * p.typical;
    f.parameters.push_back(
        {p.name, p.unit, value, std::sqrt(chosen.covariance(k, k)) * p.typical, effect.physics_prefix + p.name, value});
  }
  if (!std::isnan(chosen.candidate.constant)) {
    f.parameters.push_back({std::string(effect.constant.name), std::string(effect.constant.unit),
                            chosen.candidate.constant, chosen.constant_sigma, std::string(effect.constant.physics_key),
                            chosen.candidate.constant * effect.constant.physics_per_unit});
  }
  f.equivalent = ids_of(chosen.equivalent);
  f.rivals = chosen.equivalent;
  for (const auto& [rival, p] : chosen.probability) {
    f.probability[rival->id] = p;
  }
  f.log_p = chosen.log_p;
  f.significance = sigma_from_log_p(chosen.log_p);
  f.delta_bic = chosen.gain - chosen.rank * std::log(rows);
  f.held_out_gain = chosen.held_out;
  return f;
}

Finding describe(const WalkTest& walk, double rows) {
  Finding f;
  f.effect = walk.axis < 3 ? "gyro_random_walk" : "accel_random_walk";
  f.equation = "bias walks: variance grows with time";
  f.excited = "whole recording";
  f.experiment = "a longer recording";
  const double unit = map_unit(walk.axis) / (walk.axis < 3 ? units::degree_per_hour : units::micro_g);
  f.parameters.push_back({axis_letters[static_cast<std::size_t>(walk.axis)],
                          walk.axis < 3 ? "deg/h/sqrt(h)" : "ug/sqrt(h)", walk.rate * unit, walk.sigma * unit});
  f.log_p = log_normal_tail(std::sqrt(walk.gain));
  f.significance = sigma_from_log_p(f.log_p);
  f.delta_bic = walk.gain - std::log(rows);
  f.stochastic = true;
  return f;
}

Adequacy adequacy(const FalseAlarmBudget& budget, double square, double rows, double log_p_white, const Map& map,
                  double alpha, bool motion_fitted, double alpha_elsewhere) {
  Adequacy a;
  a.nis = square / rows;
  a.log_p_white = log_p_white;
  a.largest_sigma = map.largest_sigma;
  a.misfit = std::max(0.0, square - rows);
  const auto good = [&](double sigma, double rate) {
    return log_corrected(log_normal_tail(sigma), std::max(1, map.tests)) > std::log(budget.map * rate);
  };
  const bool map_good =
      good(map.largest_named_sigma, alpha) && good(map.largest_sigma, std::min(alpha, alpha_elsewhere));
  // A fitted model of the base's motion leaves a little correlation; noise densities are known to 2 %: NIS to 4 %.
  const bool white = motion_fitted || log_p_white > std::log(budget.whiteness * alpha);
  const double nis_sigma = std::sqrt(2.0 / rows + 0.04 * 0.04);
  const bool size_good =
      motion_fitted || log_normal_tail(std::max(0.0, a.nis - 1.0) / nis_sigma) > std::log(budget.size * alpha);
  a.accepted = map_good && white && size_good;
  return a;
}

namespace {

DataFault fault_of(const Chosen& chosen, const ImuData& data) {
  const Effect& effect = *chosen.candidate.effect;
  Eigen::VectorXd unit(chosen.size.size());
  for (Eigen::Index k = 0; k < unit.size(); ++k) {
    unit(k) = effect.parameters[static_cast<std::size_t>(k)].typical;
  }
  const Eigen::VectorXd sigma = chosen.covariance.diagonal().cwiseSqrt();
  return {effect.id, effect.data_fault(chosen.size.cwiseProduct(unit), sigma.cwiseProduct(unit), data.site), 0,
          data.size()};
}

const char* words_of(FormKind kind) {
  switch (kind) {
    case FormKind::in_turns: return "it is another while the gimbal turns";
    case FormKind::constants: return "it has more than one time constant";
    case FormKind::time: return "it changes in the course of the recording";
    case FormKind::attitude: return "it changes with the attitude";
    case FormKind::rate: return "it changes with the rate of turning";
  }
  return "";
}

std::optional<Remainder> remainder_of(const Naming& naming) {
  const OpenForms& forms = naming.forms();
  if (forms.empty()) {
    return std::nullopt;
  }
  Remainder r;
  r.share = naming.share_of_misfit(forms.square);
  r.sigma = std::sqrt(std::max(0.0, forms.square));
  for (const FormFamily& f : forms.families) {
    r.forms.push_back(
        {naming.chosen()[f.chosen].candidate.effect->id, words_of(f.kind), naming.share_of_misfit(f.square)});
  }
  r.places = naming.map_without_forms().places;
  return r;
}

class Diagnoser {
 public:
  Diagnoser(const ImuData& data, const DiagnosisOptions& options, const std::function<void(const std::string&)>& say)
      : data_(data),
        options_(options),
        say_(say),
        log_names_(std::log(budget_of_one.names * options.false_alarm_rate)) {}

  DiagnosisOutcome run();

 private:
  CorrectedRecording quiet_dwells();
  void name();
  void leave_unjudged();
  void judge_noise_alone();
  void decide(const Naming& naming);
  void say(const std::string& words) const {
    if (say_) {
      say_(words);
    }
  }

  const ImuData& data_;
  const DiagnosisOptions& options_;
  const std::function<void(const std::string&)>& say_;
  double log_names_;
  bool beats_ = false;  // the accelerometers' quantum colours the innovations
  Diagnosis d_;
};

// The recording without the lines that alias into the filter beside white noise of the accelerometers' integral.
CorrectedRecording Diagnoser::quiet_dwells() {
  AngleVelocity theta(data_.delta_theta.begin(), data_.delta_theta.end());
  AngleVelocity velocity(data_.delta_v.begin(), data_.delta_v.end());
  const std::vector<VibrationLine> lines = subtract_dwell_lines(data_, find_segments(data_), theta, velocity);
  d_.noise.lines.insert(d_.noise.lines.end(), lines.begin(), lines.end());
  return {data_, std::move(theta), std::move(velocity)};
}

void Diagnoser::name() {
  CorrectedRecording recording(data_);
  PassInput input = forward_pass(recording.data(), d_.calibration);
  if (fit_velocity_noise(input, d_.noise)) {
    recording = quiet_dwells();
    input = forward_pass(recording.data(), d_.calibration);
    beats_ = fit_velocity_noise(input, d_.noise);
  }
  const RecordingContext context(recording.data());
  d_.mean_temperature_c = context.has_temperature() ? context.mean_temperature() : 0.0;
  say("signatures");
  Naming naming(context, input, log_names_);
  naming.run(say_, options_.stop);
  decide(naming);
}

void Diagnoser::decide(const Naming& naming) {
  const double alpha = options_.false_alarm_rate;
  const Map after = naming.map_after();
  d_.log_p_limit = naming.log_p_limit();
  d_.located = naming.map_before().places;
  d_.remaining = after.places;
  // Beats of a quantum drift in frequency and leave a comb that no line takes out: named as quantum and lines, and no
  // question of whiteness any more.
  d_.before = adequacy(budget_of_one, naming.square_before(), naming.rows(), beats_ ? 0.0 : naming.log_p_white_before(),
                       naming.map_before(), alpha, d_.calibration.moored);
  const bool nothing_found = naming.chosen().empty() && naming.walks().empty();
  d_.after = adequacy(budget_of_one, naming.square_after(), naming.rows(), beats_ ? 0.0 : naming.log_p_white_after(),
                      after, nothing_found ? alpha : std::max(alpha, remainder_rate), d_.calibration.moored, alpha);
  if (!nothing_found || !d_.before.accepted) {
    const Naming::ByQuantity by = naming.locate_by_quantities();
    d_.located_by = by.before;
    d_.remaining_by = by.after;
  }
  std::vector<Finding> named;
  for (const Chosen& c : naming.chosen()) {
    named.push_back(describe(c, naming.rows()));
    named.back().share = naming.share_of_misfit(c.gain);
    d_.model.push_back({c.candidate.effect, c.candidate.constant, c.size, c.covariance});
  }
  bool jumps = false;
  for (const WalkTest& w : naming.walks()) {
    const bool real = walks_inside_dwells(data_, d_.calibration.noise, w);
    jumps = jumps || !real;
    (real ? named : d_.rejected).push_back(describe(w, naming.rows()));
  }
  std::stable_sort(named.begin(), named.end(), [](const Finding& a, const Finding& b) { return a.log_p < b.log_p; });
  // What was named must explain: where it makes most of what is seen it is held to more than a recording in which nothing
  // was found. What it has no part in speaks neither for it nor against it.
  if (!d_.calibration.moored) {
    const Naming::Structure left = naming.structure();
    d_.after.log_p_structure = left.log_p();
    d_.after.accepted = d_.after.accepted && left.log_p_named > std::log(rejection_rate) &&
                        left.log_p_elsewhere > std::log(budget_of_one.structure * alpha);
  }
  // Beside an effect of hundreds of sigma the linearisation, and an equation that is right to 3 % of the amplitude, leave a
  // thousandth of its square, in one place or in all: not worth a verdict.
  constexpr double worth_a_verdict = 1e-3;
  const double least = std::max(16.0, worth_a_verdict * d_.before.misfit);
  if (!named.empty() && d_.after.misfit < worth_a_verdict * d_.before.misfit &&
      d_.after.largest_sigma * d_.after.largest_sigma < least) {
    d_.after.accepted = true;
  }
  const bool itself = naming.log_p_likeness() > std::log(rejection_rate);
  d_.after.accepted = d_.after.accepted && !jumps && itself && !naming.entangled();
  // A fault of the data ends the diagnosis only where it explains what is seen: a name that the remainder rejects is none.
  for (const Chosen& c : naming.chosen()) {
    if (c.candidate.effect->data_fault != nullptr && d_.after.accepted) {
      d_.model.clear();
      d_.rejected.clear();
      d_.faults.push_back(fault_of(c, data_));
      leave_unjudged();
      return;
    }
  }
  d_.unexplained = !d_.after.accepted;
  d_.remainder = d_.after.accepted ? remainder_of(naming) : std::nullopt;
  if (d_.unexplained) {
    d_.model.clear();  // rejected names are no equations of a model: nothing is carried over or taken out
  }
  // A name that leaves something behind is the best fitting, not the truth.
  std::vector<Finding>& destination = d_.after.accepted ? d_.findings : d_.rejected;
  destination.insert(destination.end(), named.begin(), named.end());
  std::vector<Finding> noise =
      noise_findings(d_.calibration, naming.noise(), d_.noise, options_.assumed, std::log(budget_of_one.noise * alpha));
  d_.findings.insert(d_.findings.end(), noise.begin(), noise.end());
  d_.value = naming.value();
  d_.value_as_named = naming.value_as_named();
  d_.covariance = naming.covariance();
  d_.sigma = d_.covariance.diagonal().cwiseSqrt();

  for (const Suspect& s : naming.prospects()) {
    (s.expected_z < seen_z ? d_.undetectable : d_.detectable).push_back({s.effect, s.expected_z});
  }
  for (const Suspect& s : naming.suspects()) {
    if (s.log_p < std::log(suspicion)) {
      d_.suspected.push_back(describe(s));
    }
  }
  // A moored base moves, and the calibration models it: sway that is found once more is no mismatch.
  const bool only_motion =
      d_.calibration.moored && std::all_of(d_.findings.begin(), d_.findings.end(), [](const Finding& f) {
        return f.source != nullptr && f.source->motion_of_moored_base;
      });
  d_.mismatch = (!d_.findings.empty() && !only_motion) || d_.unexplained;
  if (!d_.findings.empty() && !only_motion) {
    d_.verdict = DiagnosisVerdict::named;
  } else if (d_.unexplained) {
    d_.verdict = DiagnosisVerdict::none_of_the_above;
  } else if (!d_.suspected.empty()) {
    d_.verdict = DiagnosisVerdict::not_enough_information;
  }
}

// What faulty data do to the filter looks like anything: nothing else is concluded from them.
void Diagnoser::leave_unjudged() {
  d_.verdict = DiagnosisVerdict::data_fault;
  d_.mismatch = true;
  d_.before.nis = d_.after.nis = d_.calibration.consistency.nis_mean;
  d_.before.accepted = d_.after.accepted = false;
  d_.value = d_.value_as_named = d_.calibration.value;
  d_.covariance = d_.calibration.covariance;
  d_.sigma = d_.calibration.sigma;
}

// The verdict on the noise needs no turn, and nothing else has one.
void Diagnoser::judge_noise_alone() {
  d_.nothing_turned = true;
  const Consistency& consistency = d_.calibration.consistency;
  for (Adequacy* a : {&d_.before, &d_.after}) {
    a->nis = consistency.nis_mean;
    a->log_p_white = std::log(consistency.whiteness_p_value);
    a->accepted = consistency.verdict == Verdict::consistent;
  }
  d_.findings = noise_findings(d_.calibration, d_.calibration.noise, d_.noise, options_.assumed,
                               std::log(budget_of_one.noise * options_.false_alarm_rate));
  d_.verdict = d_.findings.empty() ? DiagnosisVerdict::not_enough_information : DiagnosisVerdict::named;
  d_.mismatch = !d_.findings.empty();
  d_.value = d_.value_as_named = d_.calibration.value;
  d_.covariance = d_.calibration.covariance;
  d_.sigma = d_.calibration.sigma;
}

DiagnosisOutcome Diagnoser::run() {
  say("data");
  d_.faults = find_data_faults(data_);
  const bool faulty = !d_.faults.empty();
  d_.noise = check_noise(data_, find_segments(data_));
  say("calibration");
  CalibrationOutcome calibration = calibrate_still(data_, options_.calibration, options_.stop);
  if (!calibration.result) {
    return {std::nullopt, (faulty ? d_.faults.front().words + "; " : std::string()) + calibration.failure.message};
  }
  d_.calibration = std::move(*calibration.result);
  if (faulty) {
    leave_unjudged();
    return {std::move(d_), {}};
  }
  const auto turns = [](const SegmentSummary& s) { return s.rotation; };
  if (std::any_of(d_.calibration.segments.begin(), d_.calibration.segments.end(), turns)) {
    name();
  } else {
    judge_noise_alone();
  }
  if (options_.stop.stop_requested()) {
    return {std::nullopt, "stopped"};
  }
  if (!d_.value.allFinite() || !d_.covariance.allFinite() || !d_.value_as_named.allFinite()) {
    return {std::nullopt, "internal error: the parameters of the diagnosis are not finite"};
  }
  return {std::move(d_), {}};
}

}  // namespace

DiagnosisOutcome diagnose(const ImuData& data, const DiagnosisOptions& options,
                          const std::function<void(const std::string&)>& progress) {
  if (data.size() < 2) {
    return {std::nullopt, "the recording is empty"};
  }
  return Diagnoser(data, options, progress).run();
}

}  // namespace selfcal::diagnosis
