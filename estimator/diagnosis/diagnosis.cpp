#include "estimator/diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "estimator/diagnosis/noise/dwell_lines.hpp"
#include "estimator/diagnosis/noise/noise_findings.hpp"
#include "estimator/diagnosis/noise/process_check.hpp"
#include "estimator/diagnosis/noise/velocity_jumps.hpp"
#include "estimator/diagnosis/noise/velocity_noise.hpp"
#include "estimator/diagnosis/search/judgement.hpp"
#include "estimator/diagnosis/still_calibration.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double suspicion = 0.05;  // corrected p at which an effect is worth a further experiment
constexpr double seen_z = 3.0;      // an effect of typical size is detectable here beyond it

DataFault fault_of(const NamedTerm& term, const ImuData& data) {
  const Effect& effect = *term.effect;
  Eigen::VectorXd unit(term.amplitude.size());
  for (Eigen::Index k = 0; k < unit.size(); ++k) {
    unit(k) = effect.parameters[static_cast<std::size_t>(k)].typical;
  }
  const Eigen::VectorXd sigma = term.covariance.diagonal().cwiseSqrt();
  return {effect.id, effect.data_fault(term.amplitude.cwiseProduct(unit), sigma.cwiseProduct(unit), data.site), 0,
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

std::optional<Remainder> remainder_of(const SearchResult& found) {
  if (found.open_forms.empty()) {
    return std::nullopt;
  }
  Remainder r;
  r.share = found.square_of_forms / found.misfit;
  r.sigma = std::sqrt(std::max(0.0, found.square_of_forms));
  for (const OpenForm& f : found.open_forms) {
    r.forms.push_back({f.effect->id, words_of(f.kind), f.square / found.misfit});
  }
  r.places = found.map_without_forms.places;
  return r;
}

InnovationColour colour_of_rows(const SignatureRows& rows, const RecordingContext& context) {
  constexpr std::size_t axes = 3;
  std::vector<std::size_t> segment;
  for (std::size_t row = 0; row < rows.time_s.size(); row += axes) {
    segment.push_back(context.segment_at(rows.time_s[row]));
  }
  return colour_of(rows.residual, segment);
}

// The densities fitted beside what was named: what was left out had taken its share of them.
NoiseModel beside(const Stage& stage, const NoiseModel& noise) {
  PassInput trial = stage.point.pass(noise);
  const Navigated navigated = navigate(trial);
  trial.navigated = &navigated;
  const auto fitted = refit_velocity_noise(noise, [&](const NoiseModel& other) {
    trial.noise = other;
    return run_pass(trial).log_likelihood;
  });
  return fitted.value_or(noise);
}

// Noise of the loudest tenth over that of the median.
double loudest_of(const std::vector<Disturbance>& shaken) {
  std::vector<double> factor;
  factor.reserve(shaken.size());
  for (const Disturbance& d : shaken) {
    factor.push_back(d.factor);
  }
  std::sort(factor.begin(), factor.end());
  return factor.empty() ? 1.0 : std::sqrt(factor[factor.size() * 9 / 10] / factor[factor.size() / 2]);
}

// Whether a beat of the accelerometers' quantum can make the line that a sway was found at: its velocity is up to quantum/pi.
bool within_beat(const Finding& f, const NoiseCheck& noise) {
  if (f.source == nullptr || f.source->constant.kind != EffectConstant::Kind::spectrum) {
    return false;
  }
  double square = 0.0, quantum = 0.0;
  for (std::size_t k = 0; k < f.source->parameters.size(); ++k) {
    square += std::pow(f.parameters[k].value * f.source->parameters[k].si_per_unit, 2);
  }
  for (std::size_t axis = 3; axis < noise.axes.size(); ++axis) {
    quantum = std::max(quantum, std::sqrt(12.0) * noise.axes[axis].increment_sigma);
  }
  const double frequency_hz = f.parameters[f.source->parameters.size()].value;
  return 2.0 * std::numbers::pi * frequency_hz * std::sqrt(square) < quantum / std::numbers::pi;
}

class Diagnoser {
 public:
  Diagnoser(ImuData data, const DiagnosisOptions& options, const std::function<void(const std::string&)>& say)
      : data_(data),
        options_(options),
        say_(say),
        log_names_(std::log(budget_of_one.names * options.false_alarm_rate)) {}

  DiagnosisOutcome run();

 private:
  CorrectedRecording quiet_dwells(std::vector<VibrationLine>& lines) const;
  void name();
  NoiseModel jumps_beside(const Stage& stage);
  void leave_unjudged();
  void judge_noise_alone();
  SearchResult searched(const RecordingContext& context, const PassInput& input);
  void decide(const RecordingContext& context, const SearchResult& found);
  Rules rules() const;
  Quanta quanta() const { return {d_.calibration.gyro_quantum, d_.calibration.accel_quantum}; }
  void say(const std::string& words) const {
    if (say_) {
      say_(words);
    }
  }

  ImuData data_;
  const DiagnosisOptions& options_;
  const std::function<void(const std::string&)>& say_;
  double log_names_;
  bool beats_ = false;  // the accelerometers' quantum colours the innovations
  Diagnosis d_;
};

// The recording without the lines that alias into the filter beside white noise of the accelerometers' integral.
CorrectedRecording Diagnoser::quiet_dwells(std::vector<VibrationLine>& lines) const {
  AngleVelocity theta(data_.delta_theta.begin(), data_.delta_theta.end());
  AngleVelocity velocity(data_.delta_v.begin(), data_.delta_v.end());
  lines = subtract_dwell_lines(data_, observed(find_segments(data_), data_), quanta(), theta, velocity);
  return {data_, std::move(theta), std::move(velocity)};
}

void Diagnoser::name() {
  CorrectedRecording recording(data_);
  PassInput input = forward_pass(recording.data(), d_.calibration);
  if (colours_innovations(input, d_.noise)) {
    std::vector<VibrationLine> lines;
    CorrectedRecording quiet = quiet_dwells(lines);
    PassInput without_lines = forward_pass(quiet.data(), d_.calibration);
    beats_ = fit_velocity_noise_and_point(without_lines, d_.noise, find_segments(data_));
    if (beats_) {
      if (!without_lines.noise.shaken.empty()) {
        d_.loudest = loudest_of(without_lines.noise.shaken);
        d_.jumps = open_velocity_jumps(without_lines, find_segments(data_));
      }
      recording = std::move(quiet);
      input = without_lines;
      input.data = &recording.data();
      d_.noise.lines.insert(d_.noise.lines.end(), lines.begin(), lines.end());
    }
  }
  RecordingContext context(recording.data());
  d_.mean_temperature_c = context.has_temperature() ? context.mean_temperature() : 0.0;
  say("signatures");
  if (beats_) {
    context.set_colour(colour_of_rows(SignaturePass(context, {}, false).run(input), context));
  }
  SearchResult found = searched(context, input);
  if (beats_ && !found.empty()) {  // what was left out coloured the innovations too
    context.set_colour({});
    Hypothesis named = found.stage.hypothesis();
    if (!named.terms
             .empty()) {  // a process alone is noise itself: what it is not stationary in stays with the densities
      named.noise = beside(found.stage, jumps_beside(found.stage));
    }
    input.noise = named.noise;
    input.noise.biases.clear();
    const LinearModel model = LinearModel::about(context, found.stage.point, named, {}, false);
    SignatureRows left = model.rows();
    left.residual = model.residual_after(columns_of(model.terms()));
    context.set_colour(colour_of_rows(left, context));
    found = searched(context, input);
  }
  decide(context, found);
}

// The catalogue's names. The columns of an effect are made along the attitude that the gyros tell, and hold their noise: once what the 24
// make as well is projected out of them, names fit the noise itself. Where that turns the attitude far, they are asked for only if
// something is seen that the 24 do not explain.
SearchResult Diagnoser::searched(const RecordingContext& context, const PassInput& input) {
  constexpr double far =
      0.5e-3;  // rad: at 0.7 mrad and 30 ug/sqrt(Hz) clean recordings have names of 18 sigma, at 0.3 none
  constexpr double never = -1e9;
  SearchResult found = search(context, input, {log_names_, say_, options_.stop});
  const double wanders = input.noise.gyro_arw * std::sqrt(data_.time_s.back() - data_.time_s.front());
  if (wanders > far && !found.empty() && judge(found, rules()).before.accepted) {
    d_.attitude_wanders = wanders;
    found = search(context, input, {never, say_, options_.stop});
  }
  return found;
}

// What was named stood in the turns, and no jump there was believed beside it.
NoiseModel Diagnoser::jumps_beside(const Stage& stage) {
  PassInput without = stage.point.pass(stage.hypothesis().noise);
  if (!without.noise.shaken.empty()) {
    d_.jumps = open_velocity_jumps(without, find_segments(data_), d_.jumps);
  }
  return without.noise;
}

void Diagnoser::decide(const RecordingContext& context, const SearchResult& found) {
  const Judgement judgement = judge(found, rules());
  if (!found.empty() || !judgement.before.accepted) {
    const ByQuantity by = locate_by_quantities(context, found.stage);
    d_.located_by = by.before;
    d_.remaining_by = by.after;
  }
  write_down(found, judgement, d_);
  // A fault of the data ends the diagnosis only where it explains what is seen: a name that the remainder rejects is none, and beside names that
  // explain more it is one of several accounts of what they leave.
  constexpr double most_of_it = 0.5;
  for (const NamedTerm& term : found.named) {
    if (term.effect->data_fault != nullptr && judgement.after.accepted && term.delta_chi2 > most_of_it * found.misfit) {
      d_.model.clear();
      d_.findings.clear();
      d_.faults.push_back(fault_of(term, data_));
      leave_unjudged();
      return;
    }
  }
  for (Finding& f : d_.findings) {
    if (beats_ && within_beat(f, d_.noise)) {
      f.effect = "vibration_line";
      f.stochastic = true;
    }
  }
  d_.remainder = judgement.after.accepted ? remainder_of(found) : std::nullopt;
  const std::vector<Finding> noise = noise_findings(d_.calibration, found.noise, d_.noise, options_.assumed,
                                                    std::log(budget_of_one.noise * options_.false_alarm_rate));
  d_.findings.insert(d_.findings.end(), noise.begin(), noise.end());
  for (const Suspect& s : found.prospects) {
    (s.expected_z < seen_z ? d_.undetectable : d_.detectable).push_back({s.effect, s.expected_z});
  }
  for (const Suspect& s : found.suspects) {
    if (s.log_p < std::log(suspicion)) {
      d_.suspected.push_back(describe(s));
    }
  }
  // A moored base moves, and the calibration models it: sway that is found once more is no mismatch.
  const bool only_motion =
      d_.calibration.moored && std::all_of(d_.findings.begin(), d_.findings.end(), [](const Finding& f) {
        return f.source != nullptr && f.source->motion_of_moored_base;
      });
  const bool named = !d_.findings.empty() && !only_motion;
  d_.mismatch = named || d_.unexplained;
  d_.verdict = verdict_of(named, d_.unexplained, !d_.suspected.empty());
}

Rules Diagnoser::rules() const {
  return {.budget = budget_of_one,
          .alpha = options_.false_alarm_rate,
          .motion_fitted = d_.calibration.moored,
          .coloured = beats_,
          .goes_on = [this](const BiasProcess& process) {
            return goes_on_inside_dwells(data_, d_.calibration.noise, process);
          }};
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
  d_.base_tilt = base_tilt(data_, observed(find_segments(data_), data_));
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
  if (std::string none = no_readings(data_.delta_theta, data_.delta_v); !none.empty()) {
    return {std::nullopt, std::move(none)};
  }
  if (data_.coasts.empty()) {  // else they were found and left out
    d_.faults = find_data_faults(data_);
  }
  const bool faulty = !d_.faults.empty();
  say("calibration");
  CalibrationOutcome calibration = calibrate_still(data_, options_.calibration, options_.stop);
  if (!calibration.result) {
    return {std::nullopt, (faulty ? d_.faults.front().words + "; " : std::string()) + calibration.failure.message};
  }
  d_.calibration = std::move(*calibration.result);
  d_.noise = check_noise(data_, observed(find_segments(data_), data_), quanta());
  data_.coasts = d_.calibration.coasts;  // with the turns as found
  if (faulty) {
    leave_unjudged();
    return {std::move(d_), {}};
  }
  if (turned(data_)) {
    d_.read_out_delay = read_out_delay(data_, find_segments(data_));
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
