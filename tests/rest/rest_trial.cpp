// What is said of logs that stand, against what was put into them. The generator is this file's own.
//
//   selfcal_rest_trial SEED CLEAN INJECTED     so many logs of each kind; status 0: all figures as they have to be
//
// Clean logs hold white noise, flicker, walks and quanta, a channel of temperature in half of them: nothing may be named. Injected
// logs have one drift on one axis, ten times the sigma that is stated for it: it has to be named, and its interval to hold it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "estimator/diagnosis/poses/poses.hpp"

namespace {

using selfcal::diagnosis::diagnose_poses;
using selfcal::diagnosis::PoseDiagnosis;
using selfcal::diagnosis::PoseInput;
using selfcal::diagnosis::RestAmplitude;
using selfcal::diagnosis::RestAxis;
using selfcal::diagnosis::RestTerm;

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

// 1/f from processes of the first order an octave apart, from two samples to ten logs; each a tenth of its time is drawn anew.
std::vector<double> flicker(Random& random, std::size_t n, double dt, double size) {
  std::normal_distribution<double> normal;
  std::vector<double> sum(n, 0.0);
  for (double tau = 2.0 * dt; tau < 20.0 * static_cast<double>(n) * dt; tau *= 2.0) {
    const double keep = std::exp(-dt / tau), draw = size * std::sqrt(1.0 - keep * keep);
    double state = size * normal(random);
    for (double& value : sum) {
      state = keep * state + draw * normal(random);
      value += state;
    }
  }
  return sum;
}

struct Log {
  PoseInput input;
  double dt = 0.0;
  std::array<double, 6> bias{};  // what the mean is about, gravity included
  int kind = 0;                  // white noise alone, flicker, a walk, both
  bool wanders = false;          // a walk: the mean is the bias at the middle, which the walk moves
  std::array<double, 6> at_middle{};
  std::vector<double> temperature;
};

double temperature_at(int kind, double share, double phase) {
  switch (kind) {
    case 0: return 25.0 + 10.0 * (1.0 - std::exp(-6.0 * share));               // warms up
    case 1: return -20.0 + 80.0 * (1.0 - std::abs(2.0 * share - 1.0));         // there and back
    case 2: return 20.0 + 3.0 * std::sin(2.0 * M_PI * (3.0 * share + phase));  // a room's control
    default: return 20.0 + 30.0 * share;                                       // one way
  }
}

Log clean_log(Random& random, bool with_channel, int course) {
  std::normal_distribution<double> normal;
  Log log;
  const double seconds = std::exp(uniform(random, std::log(300.0), std::log(7200.0)));
  const std::size_t n = 12000;
  log.dt = seconds / static_cast<double>(n);
  log.input.accel_unit = 1.0;
  log.input.time_s.resize(n);
  log.input.gyro.resize(n);
  log.input.accel.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    log.input.time_s[i] = 100.0 + log.dt * static_cast<double>(i + 1);
  }
  const int kind = log.kind = static_cast<int>(uniform(random, 0.0, 4.0));
  log.wanders = kind >= 2;
  for (int channel = 0; channel < 6; ++channel) {
    const bool gyro = channel < 3;
    const auto axis = static_cast<std::size_t>(channel % 3);
    const double white = gyro ? 1e-3 : 1e-2;  // of a sample
    // Beside the white noise of a mean over a 120th of the log, which is a tenth of a sample's.
    const double slow = 0.1 * white * std::exp(uniform(random, std::log(0.05), std::log(5.0)));
    const double step = 0.1 * white * std::exp(uniform(random, std::log(0.01), std::log(1.0))) / 10.0;  // per sample
    const double quantum = uniform(random, 0.0, 1.0) < 0.5 ? uniform(random, 0.2, 3.0) * white : 0.0;
    std::vector<double> values = kind % 2 == 1 ? flicker(random, n, log.dt, slow / 2.0) : std::vector<double>(n, 0.0);
    const double bias = (gyro ? 0.01 : 0.1) * normal(random) + (channel == 5 ? 9.80665 : 0.0);
    double walk = 0.0, middle = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      walk += log.wanders ? step * normal(random) : 0.0;
      middle = i == n / 2 ? walk : middle;
      double value = bias + values[i] + walk + white * normal(random);
      value = quantum > 0.0 ? quantum * std::round(value / quantum) : value;
      (gyro ? log.input.gyro : log.input.accel)[i][axis] = value;
    }
    log.bias[static_cast<std::size_t>(channel)] = bias;
    log.at_middle[static_cast<std::size_t>(channel)] = bias + middle;
  }
  const double phase = uniform(random, 0.0, 1.0);
  for (std::size_t i = 0; i < n && with_channel; ++i) {
    const double T = temperature_at(course, static_cast<double>(i) / static_cast<double>(n), phase);
    log.temperature.push_back(T);
    log.input.temperature_c.push_back(T + 0.05 * normal(random));
  }
  return log;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) {
    sum += v / static_cast<double>(values.size());
  }
  return sum;
}

enum class Drift { ramp, temperature };

// Adds it to one channel, less its mean, so that the mean stays what it was.
void inject(const Log& log, Drift drift, int channel, double size, PoseInput& input) {
  const double middle =
      drift == Drift::temperature ? mean_of(log.temperature) : 0.5 * (input.time_s.front() + input.time_s.back());
  for (std::size_t i = 0; i < input.time_s.size(); ++i) {
    const double course = drift == Drift::temperature ? log.temperature[i] : input.time_s[i];
    (channel < 3 ? input.gyro : input.accel)[i][static_cast<std::size_t>(channel % 3)] += size * (course - middle);
  }
}

const RestAxis* axis_of(const PoseDiagnosis& d, int channel) {
  return d.rest ? &d.rest->axes[static_cast<std::size_t>(channel)] : nullptr;
}

// The equation as named or as a member of a class; null: neither.
const RestAmplitude* found(const RestAxis* axis, const std::string& id, bool of_temperature, bool* in_class) {
  if (axis == nullptr) {
    return nullptr;
  }
  const auto is = [&](const RestAmplitude& a) {
    return a.equation.id == id && a.equation.of_temperature == of_temperature;
  };
  for (const RestTerm& term : axis->terms) {
    *in_class = !term.as_well.empty();
    if (is(term.found)) {
      return &term.found;
    }
    for (const RestAmplitude& other : term.as_well) {
      if (is(other)) {
        return &other;
      }
    }
  }
  return nullptr;
}

struct Score {
  int asked = 0, right = 0;
  void count(bool good) {
    ++asked;
    right += good ? 1 : 0;
  }
  double percent() const { return asked > 0 ? 100.0 * right / asked : 0.0; }
};

constexpr double false_alarm_rate = 0.01, half_width = 1.96;

struct Figures {
  int alarms = 0, unanswered = 0;
  std::array<Score, 4> means;  // by the kind of noise
  Score named, confounded, coefficients;
};

void judge_clean(Random& random, int count, Figures& f) {
  for (int k = 0; k < count; ++k) {
    const Log log = clean_log(random, k % 2 == 0, k / 2 % 4);
    const PoseDiagnosis d = diagnose_poses(log.input, false_alarm_rate);
    if (!d.rest) {
      ++f.unanswered;
      continue;
    }
    bool any = false;
    for (std::size_t c = 0; c < 6; ++c) {
      const RestAxis& a = d.rest->axes[c];
      for (const RestTerm& t : a.terms) {
        any = true;
        std::printf("  clean log %d: %s of channel %zu, log p %.1f\n", k, t.found.equation.id.c_str(), c, t.log_p);
      }
      f.means[static_cast<std::size_t>(log.kind)].count(std::abs(a.mean - (log.wanders ? log.at_middle : log.bias)[c]) <
                                                        half_width * a.mean_sigma);
    }
    f.alarms += any ? 1 : 0;
  }
}

void judge_injected(Random& random, int count, Figures& f) {
  constexpr double sigmas = 10.0, strong = 30.0;
  for (int k = 0; k < count; ++k) {
    const Drift drift = k % 2 == 0 ? Drift::ramp : Drift::temperature;
    const int course = static_cast<int>(uniform(random, 0.0, 4.0)),
              channel = static_cast<int>(uniform(random, 0.0, 6.0));
    const bool of_temperature = drift == Drift::temperature;
    const Log log = clean_log(random, of_temperature || k % 4 == 0, course);
    const std::string id = of_temperature ? (channel < 3 ? "gyro_temperature" : "accel_temperature")
                                          : (channel < 3 ? "gyro_drift_ramp" : "accel_bias_ramp");
    bool in_class = false;
    // A strong one first, for its sigma; a coefficient of seconds and degrees alike, in units of a sample's noise.
    const double white = channel < 3 ? 1e-3 : 1e-2, span = of_temperature ? 30.0 : log.input.time_s.back() - 100.0;
    PoseInput loud = log.input;
    inject(log, drift, channel, strong * white / span, loud);
    const PoseDiagnosis of_loud = diagnose_poses(loud, false_alarm_rate);
    const RestAmplitude* size = found(axis_of(of_loud, channel), id, of_temperature, &in_class);
    if (size == nullptr) {
      f.named.count(false);
      std::printf("  injected log %d: a strong %s of channel %d, course %d, is not named\n", k, id.c_str(), channel,
                  course);
      continue;
    }
    const double truth = sigmas * size->sigma;
    PoseInput input = log.input;
    inject(log, drift, channel, truth, input);
    const PoseDiagnosis d = diagnose_poses(input, false_alarm_rate);
    const RestAmplitude* seen = found(axis_of(d, channel), id, of_temperature, &in_class);
    f.named.count(seen != nullptr);
    if (seen == nullptr) {
      const RestAxis* a = axis_of(d, channel);
      std::printf("  injected log %d: %s of channel %d, course %d: %s\n", k, id.c_str(), channel, course,
                  a != nullptr && !a->terms.empty() ? a->terms.front().found.equation.id.c_str() : "nothing");
      continue;
    }
    f.coefficients.count(std::abs(seen->value - truth) < half_width * seen->sigma);
    const bool same = course == 3 && !log.temperature.empty();  // one way: temperature and time are one
    if (same) {
      f.confounded.count(in_class);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: selfcal_rest_trial SEED CLEAN INJECTED\n");
    return 2;
  }
  Random random(std::strtoull(argv[1], nullptr, 10));
  Figures f;
  const int clean = std::atoi(argv[2]), injected = std::atoi(argv[3]);
  judge_clean(random, clean, f);
  judge_injected(random, injected, f);
  std::printf("seed %s\n", argv[1]);
  std::printf("clean logs that name something: %d of %d; not answered: %d\n", f.alarms, clean, f.unanswered);
  constexpr std::array words = {"white noise", "flicker", "a walk", "flicker and a walk"};
  Score means;
  for (std::size_t kind = 0; kind < words.size(); ++kind) {
    std::printf("means within 95 %%, %s: %.1f %% of %d\n", words[kind], f.means[kind].percent(), f.means[kind].asked);
    means.asked += f.means[kind].asked;
    means.right += f.means[kind].right;
  }
  std::printf("means within 95 %%, all: %.1f %% of %d\n", means.percent(), means.asked);
  std::printf("drifts of 10 sigma named: %.1f %% of %d\n", f.named.percent(), f.named.asked);
  std::printf("coefficients within 95 %%: %.1f %% of %d\n", f.coefficients.percent(), f.coefficients.asked);
  std::printf("temperature that goes with time said to be confounded: %.1f %% of %d\n", f.confounded.percent(),
              f.confounded.asked);
  // Of so many logs chance makes three sigma of the shares that have to be kept.
  const auto above = [](const Score& s, double share) {
    return s.percent() / 100.0 >= share - 3.0 * std::sqrt(share * (1.0 - share) / std::max(1, s.asked));
  };
  const auto below = [](const Score& s, double share) {
    return s.percent() / 100.0 <= share + 3.0 * std::sqrt(share * (1.0 - share) / std::max(1, s.asked));
  };
  constexpr double low = 0.93, high = 0.97, few = 0.01, most = 0.95;
  const Score alarms{clean, f.alarms};
  // Six means of a log have their kind of noise in common.
  const Score logs{clean, static_cast<int>(std::lround(means.percent() / 100.0 * clean))};
  const bool good = f.unanswered == 0 && below(alarms, few) && above(f.named, most) && above(logs, low) &&
                    below(logs, high) && above(f.coefficients, low) && below(f.coefficients, high) &&
                    above(f.confounded, most);
  std::printf("%s\n", good ? "all as it has to be" : "NOT as it has to be");
  return good ? 0 : 1;
}
