#include "estimator/diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

#include "estimator/diagnosis/catalogue.hpp"
#include "estimator/diagnosis/dwell_lines.hpp"
#include "estimator/diagnosis/judgement.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/diagnosis/velocity_noise.hpp"
#include "estimator/diagnosis/walk_check.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// The false alarms allowed are shared out: names, the map's single biases and those of an axis together, whiteness, size
// of the innovations, noise and lines.
constexpr double share_names = 0.45, share_map = 0.1, share_structure = 0.1, share_white = 0.1, share_size = 0.1,
                 share_noise = 0.15;
constexpr double rejection_rate = 0.01;  // of right names, by the biases that they leave
constexpr double remainder_rate = 0.01;  // and by map, whiteness and size
constexpr double suspicion = 0.05;       // corrected p at which an effect is worth a further experiment
constexpr double seen_z = 3.0;           // an effect of typical size is detectable here beyond it

const std::array<const char*, 6> axis_letters = {"x", "y", "z", "x", "y", "z"};

double log_normal_tail(double z) { return log_chi_squared_tail(z * z, 1.0); }

// A warm-up and the measured temperature share an id: with a channel the recording was asked about the latter.
const Effect& effect_called(const std::string& id, bool temperature) {
  const std::vector<Effect>& all = catalogue();
  const auto asked = std::find_if(all.begin(), all.end(),
                                  [&](const Effect& e) { return e.id == id && e.needs_temperature == temperature; });
  return asked != all.end() ? *asked
                            : *std::find_if(all.begin(), all.end(), [&](const Effect& e) { return e.id == id; });
}

}  // namespace

Finding describe(const Chosen& chosen, double rows) {
  const Effect& effect = *chosen.candidate.effect;
  Finding f;
  f.effect = effect.id;
  f.equation = effect.equation;
  f.excited = effect.excited;
  f.experiment = effect.experiment;
  for (Eigen::Index k = 0; k < chosen.size.size(); ++k) {
    const EffectParameter& p = effect.parameters[static_cast<std::size_t>(k)];
    f.parameters.push_back(
        {p.name, p.unit, chosen.size(k) * p.typical, std::sqrt(chosen.covariance(k, k)) * p.typical});
  }
  if (!std::isnan(chosen.candidate.constant)) {
    f.parameters.push_back({std::string(effect.constant_name), std::string(effect.constant_unit),
                            chosen.candidate.constant, chosen.constant_sigma});
  }
  f.equivalent = chosen.equivalent;
  f.probability = chosen.probability;
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

namespace {

// 1 sigma of a triad's density over itself: what the fit states (gyros beside a quantum), or of a fit to the mean spectrum.
// Gyros: pieces of 32 s, accelerometers: of 3.2 s (sensor_noise.cpp); of each,
// three axes of 21 bins, of which the taper leaves a third independent, scatter by 1/sqrt(21 pieces) of the square;
// half of that in the density, twice that because white angle is fitted too. Below 3 % the model of the noise counts.
double relative_density_sigma(const CalibrationResult& calibration, bool gyro) {
  constexpr double least = 0.03;
  if (gyro && calibration.gyro_arw_sigma > 0.0) {
    return std::max(least, calibration.gyro_arw_sigma / calibration.gyro_arw);
  }
  double dwells_s = 0.0;
  for (const SegmentSummary& s : calibration.segments) {
    dwells_s += s.rotation ? 0.0 : s.end_s - s.start_s;
  }
  const double pieces = std::max(1.0, dwells_s / (gyro ? 32.0 : 3.2));
  return std::max(least, 1.0 / std::sqrt(21.0 * pieces));
}

// Densities (`fitted`), quanta and lines against what the simulation assumes. Densities and quanta are judged beyond 5 sigma:
// their sigma is that of a fit to smoothed spectra, and good to some tens of per cent itself.
void judge_noise(const CalibrationResult& calibration, const NoiseModel& fitted, const NoiseCheck& noise,
                 const AssumedNoise& assumed, double log_threshold, std::vector<Finding>& findings) {
  if (noise.pieces < 20) {
    return;
  }
  for (int triad = 0; triad < 2; ++triad) {
    const bool gyro = triad == 0;
    const double expected = gyro ? assumed.gyro_arw : assumed.accel_vrw;
    const double unit = gyro ? units::degree_per_sqrt_hour : units::micro_g_per_sqrt_hz;
    const double quantum = gyro ? assumed.gyro_quantum : assumed.accel_quantum;
    Finding level, coarse;
    level.effect = gyro ? "gyro_noise_level" : "accel_noise_level";
    level.equation = "white noise of another density";
    coarse.effect = "quantisation";
    coarse.equation = "white noise of the integral of another size: quantum = sqrt(12) times";
    // Densities are those of the filter, mean of the axes: a coarse quantum at a slow rate is far from white,
    // and a fit to the whole spectrum of one axis takes it for noise.
    const double density = gyro ? fitted.gyro_arw : fitted.accel_vrw;
    const double density_sigma = relative_density_sigma(calibration, gyro);
    const double z = (density / expected - 1.0) / density_sigma;
    // On a moored base the gyros' density hides behind the motion.
    const bool judged = expected > 0.0 && !(gyro && calibration.moored);
    if (judged && std::abs(z) > 5.0) {
      level.parameters.push_back(
          {"mean", gyro ? "deg/sqrt(h)" : "ug/sqrt(Hz)", density / unit, density_sigma * density / unit});
      level.log_p = log_normal_tail(z);
    }
    for (int k = 0; k < 3; ++k) {
      const int axis_index = 3 * triad + k;
      const auto axis = static_cast<std::size_t>(axis_index);
      const AxisNoise& n = noise.axes[axis];
      const double found = std::sqrt(12.0) * n.increment_sigma;
      const double excess = n.increment_sigma * n.increment_sigma - quantum * quantum / 12.0;
      const double z_quantum = excess / n.increment_variance_sigma;
      const double log_p = log_corrected(log_normal_tail(z_quantum), 6.0);
      if (quantum > 0.0 && found > 2.0 * quantum && z_quantum > 5.0 && log_p < log_threshold) {
        coarse.parameters.push_back({std::string(gyro ? "gyro_" : "accel_") + axis_letters[axis],
                                     gyro ? "arcsec" : "m/s", gyro ? found / units::arcsecond : found, 0.0});
        coarse.log_p = std::min(coarse.log_p, log_p);
      }
    }
    for (Finding* f : {&level, &coarse}) {
      if (!f->parameters.empty()) {
        f->significance = sigma_from_log_p(f->log_p);
        f->stochastic = true;
        f->excited = "dwells";
        findings.push_back(*f);
      }
    }
  }
  for (const VibrationLine& line : noise.lines) {
    const bool gyro = line.axis < 3;
    // The beat of the gyro's quantum with a steady rate makes lines of an angle of up to quantum/pi.
    const double beat = gyro ? 2.0 * line.frequency_hz * calibration.gyro_quantum : 0.0;
    if (line.log_p < log_threshold && line.amplitude > beat) {
      Finding f;
      f.effect = "vibration_line";
      f.equation = "a sin(2 pi f t)";
      f.excited = "dwells";
      f.stochastic = true;
      f.log_p = line.log_p;
      f.significance = sigma_from_log_p(line.log_p);
      f.parameters = {{std::string(gyro ? "gyro_" : "accel_") + axis_letters[static_cast<std::size_t>(line.axis)],
                       gyro ? "deg/h" : "ug", line.amplitude / (gyro ? units::degree_per_hour : units::micro_g), 0.0},
                      {"frequency_hz", "Hz", line.frequency_hz, 0.0}};
      findings.push_back(f);
    }
  }
}

}  // namespace

Adequacy adequacy(double square, double rows, double log_p_white, const Map& map, double alpha, bool motion_fitted,
                  double alpha_elsewhere) {
  Adequacy a;
  a.nis = square / rows;
  a.log_p_white = log_p_white;
  a.largest_sigma = map.largest_sigma;
  a.misfit = std::max(0.0, square - rows);
  const auto good = [&](double sigma, double rate) {
    return log_corrected(log_normal_tail(sigma), std::max(1, map.tests)) > std::log(share_map * rate);
  };
  const bool map_good =
      good(map.largest_named_sigma, alpha) && good(map.largest_sigma, std::min(alpha, alpha_elsewhere));
  // A fitted model of the base's motion leaves a little correlation; noise densities are known to 2 %: NIS to 4 %.
  const bool white = motion_fitted || log_p_white > std::log(share_white * alpha);
  const double nis_sigma = std::sqrt(2.0 / rows + 0.04 * 0.04);
  const bool size_good =
      motion_fitted || log_normal_tail(std::max(0.0, a.nis - 1.0) / nis_sigma) > std::log(share_size * alpha);
  a.accepted = map_good && white && size_good;
  return a;
}

namespace {

DataFault wrong_latitude(const Chosen& chosen, const ImuData& data) {
  const double unit = chosen.candidate.effect->parameters.front().typical;
  const double stated = data.site.latitude / units::degree;
  char words[160];
  std::snprintf(words, sizeof words,
                "the Earth's rate as sensed stands as at latitude %.3f +- %.3f deg, the site's is %.3f deg",
                stated + chosen.size(0) * unit, std::sqrt(chosen.covariance(0, 0)) * unit, stated);
  return {"wrong_site", words, 0, data.size()};
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
      : data_(data), options_(options), say_(say), log_names_(std::log(share_names * options.false_alarm_rate)) {}

  DiagnosisOutcome run();

 private:
  ImuData quiet_dwells();
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
  AngleVelocity theta_, velocity_;  // increments without the dwells' lines
  bool beats_ = false;              // the accelerometers' quantum colours the innovations
  Diagnosis d_;
};

// The recording without the lines that alias into the filter beside white noise of the accelerometers' integral.
ImuData Diagnoser::quiet_dwells() {
  theta_.assign(data_.delta_theta.begin(), data_.delta_theta.end());
  velocity_.assign(data_.delta_v.begin(), data_.delta_v.end());
  const std::vector<VibrationLine> lines = subtract_dwell_lines(data_, find_segments(data_), theta_, velocity_);
  d_.noise.lines.insert(d_.noise.lines.end(), lines.begin(), lines.end());
  ImuData quiet = data_;
  quiet.delta_theta = theta_;
  quiet.delta_v = velocity_;
  return quiet;
}

void Diagnoser::name() {
  ImuData data = data_;
  PassInput input = forward_pass(data, d_.calibration);
  if (fit_velocity_noise(input, d_.noise)) {
    data = quiet_dwells();
    input = forward_pass(data, d_.calibration);
    beats_ = fit_velocity_noise(input, d_.noise);
  }
  const RecordingContext context(data);
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
  d_.before = adequacy(naming.square_before(), naming.rows(), beats_ ? 0.0 : naming.log_p_white_before(),
                       naming.map_before(), alpha, d_.calibration.moored);
  const bool nothing_found = naming.chosen().empty() && naming.walks().empty();
  d_.after = adequacy(naming.square_after(), naming.rows(), beats_ ? 0.0 : naming.log_p_white_after(), after,
                      nothing_found ? alpha : std::max(alpha, remainder_rate), d_.calibration.moored, alpha);
  if (!nothing_found || !d_.before.accepted) {
    const Naming::ByQuantity by = naming.locate_by_quantities();
    d_.located_by = by.before;
    d_.remaining_by = by.after;
  }
  std::vector<Finding> named;
  for (const Chosen& c : naming.chosen()) {
    if (c.candidate.effect->id == "wrong_site" && d_.after.accepted) {
      d_.faults.push_back(wrong_latitude(c, data_));
      leave_unjudged();
      return;
    }
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
                        left.log_p_elsewhere > std::log(share_structure * alpha);
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
  d_.unexplained = !d_.after.accepted;
  d_.remainder = d_.after.accepted ? remainder_of(naming) : std::nullopt;
  if (d_.unexplained) {
    d_.model.clear();  // rejected names are no equations of a model: nothing is carried over or taken out
  }
  // A name that leaves something behind is the best fitting, not the truth.
  std::vector<Finding>& destination = d_.after.accepted ? d_.findings : d_.rejected;
  destination.insert(destination.end(), named.begin(), named.end());
  judge_noise(d_.calibration, naming.noise(), d_.noise, options_.assumed, std::log(share_noise * alpha), d_.findings);
  d_.value = naming.value();
  d_.value_as_named = naming.value_as_named();
  d_.covariance = naming.covariance();
  d_.sigma = d_.covariance.diagonal().cwiseSqrt();

  for (const Suspect& s : naming.prospects()) {
    (s.expected_z < seen_z ? d_.undetectable : d_.detectable).push_back({s.effect, s.expected_z});
  }
  for (const Suspect& s : naming.suspects()) {
    if (s.log_p < std::log(suspicion)) {
      const Effect& effect = effect_called(s.effect, !data_.temperature.empty());
      Finding f;
      f.effect = effect.id;
      f.equation = effect.equation;
      f.experiment = effect.experiment;
      f.log_p = s.log_p;
      f.significance = sigma_from_log_p(s.log_p);
      d_.suspected.push_back(f);
    }
  }
  // A moored base moves, and the calibration models it: sway that is found once more is no mismatch.
  const bool only_motion =
      d_.calibration.moored &&
      std::all_of(d_.findings.begin(), d_.findings.end(), [](const Finding& f) { return f.effect == "base_sway"; });
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
  judge_noise(d_.calibration, d_.calibration.noise, d_.noise, options_.assumed,
              std::log(share_noise * options_.false_alarm_rate), d_.findings);
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
