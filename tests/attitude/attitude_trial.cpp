// Intervals that are stated of gyros and accelerometers held against an attitude, against what was drawn.
//
//   selfcal_attitude_trial SEED LOGS [noise]     status 0: as many 95 % intervals hold the truth as have to
//
// The negative control: intervals of 0.6 times the length have to hold too little. `noise`: the attitude's errors are ten times as large for
// a third of each log, as no model has it.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "tests/attitude/tracked_log.hpp"

namespace {

using selfcal::Vector3;
using selfcal::attitude_trial::Course;
using selfcal::attitude_trial::drawn_log;
using selfcal::attitude_trial::drawn_truth;
using selfcal::attitude_trial::TrackedLog;
using selfcal::attitude_trial::Truth;
using selfcal::diagnosis::ByAttitude;
using selfcal::diagnosis::PoseParameter;

constexpr double too_narrow = 0.6;  // the negative control: intervals of as much of the length

struct Tally {
  int all = 0, held = 0, held_by_less = 0;
  double square = 0.0;  // of error over sigma
  void add(double value, double sigma, double truth) {
    constexpr double of_95_percent = 1.959964;
    const double off = (value - truth) / sigma;
    ++all;
    held += std::abs(off) <= of_95_percent ? 1 : 0;
    held_by_less += std::abs(off) <= too_narrow * of_95_percent ? 1 : 0;
    square += off * off;
  }
  double share() const { return 100.0 * held / all; }
};

using Tallies = std::map<std::string, Tally>;

double element(const Eigen::Matrix3d& matrix, const std::string& name) {
  const std::string axes = "xyz";
  const auto i = static_cast<Eigen::Index>(axes.find(name[name.find('_') + 1]));
  const auto j = name.starts_with("scale") ? i : static_cast<Eigen::Index>(axes.find(name.back()));
  return matrix(i, j) - (i == j ? 1.0 : 0.0);
}

void add_three(const std::string& name, const Vector3& value, const Vector3& sigma, const Vector3& truth,
               Tallies& all) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    all[name].add(value(k), sigma(k), truth(k));
  }
}

void add(const ByAttitude& d, const Truth& truth, const Vector3& mean_bias, Tallies& all) {
  for (const PoseParameter& p : d.gyros) {
    all[p.name.starts_with("scale") ? "gyro scale factors" : "gyro misalignments"].add(p.value, p.sigma,
                                                                                       element(truth.M, p.name));
  }
  add_three("gyro bias", d.bias, d.bias_sigma, mean_bias, all);
  if (truth.walk_asd == 0.0) {
    add_three("gyro bias slope", d.slope, d.slope_sigma, truth.slope, all);
  }
  all["smoothing"].add(d.smoothing_s2, d.smoothing_sigma_s2, 0.0);
  all["delay"].add(d.delay_s, d.delay_sigma_s, truth.delay_s);
  all["drift of the clock"].add(d.drift_ppm, d.drift_sigma_ppm, 1e6 * truth.drift);
  for (const PoseParameter& p : d.gravity ? d.gravity->parameters : std::vector<PoseParameter>()) {
    const bool bias = p.name.starts_with("bias");
    all[bias                          ? "accelerometer bias"
        : p.name.starts_with("scale") ? "accelerometer scale factors"
                                      : "accelerometer misalignments"]
        .add(p.value, p.sigma,
             bias ? truth.accel_bias(static_cast<Eigen::Index>(std::string("xyz").find(p.name.back())))
                  : element(truth.K, p.name));
  }
}

// Four kinds: white noise; errors of the attitude that last; a bias that walks; gyros alone, with M symmetric.
struct Kind {
  const char* name;
  double keeps, walk_asd;
  bool gyros_alone;
};
constexpr std::array<Kind, 4> kinds = {{{"white noise", 0.0, 0.0, false},
                                        {"errors of the attitude that last", 0.8, 0.0, false},
                                        {"a bias that walks", 0.0, 2e-5, false},
                                        {"gyros alone", 0.0, 0.0, true}}};

TrackedLog log_of(const Kind& kind, Truth& truth, std::mt19937_64& random) {
  truth = drawn_truth(random);
  truth.attitude_keeps = kind.keeps;
  truth.walk_asd = kind.walk_asd;
  if (kind.gyros_alone) {
    truth.M = (0.5 * (truth.M + truth.M.transpose())).eval();
  }
  Course course;
  course.stops = 14;
  TrackedLog log = drawn_log(truth, course, random);
  log.input.sensors = kind.gyros_alone ? selfcal::diagnosis::Sensors::gyros : selfcal::diagnosis::Sensors::both;
  return log;
}

void make_loud(TrackedLog& log, std::mt19937_64& random) {
  auto& q = log.input.attitude->readings.front().q_rm;
  std::normal_distribution<double> normal(0.0, 3e-3);
  for (std::size_t k = q.size() / 3; k < 2 * q.size() / 3; ++k) {
    const Vector3 phi(normal(random), normal(random), normal(random));
    q[k] = Eigen::Quaterniond(Eigen::AngleAxisd(phi.norm(), phi.normalized())) * q[k];
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: selfcal_attitude_trial SEED LOGS [noise]\n");
    return 2;
  }
  const auto seed = static_cast<std::uint64_t>(std::atoll(argv[1]));
  const int logs = std::atoi(argv[2]);
  const bool loud = argc > 3 && std::string(argv[3]) == "noise";
  Tallies all;
  std::map<std::string, Tally> of_kind;
  int failed = 0;
  for (int k = 0; k < logs; ++k) {
    std::mt19937_64 random(seed * 1000003 + static_cast<std::uint64_t>(k));
    const Kind& kind = kinds.at(static_cast<std::size_t>(k) % kinds.size());
    Truth truth;
    TrackedLog log = log_of(kind, truth, random);
    if (loud) {
      make_loud(log, random);
    }
    const auto d = selfcal::diagnosis::diagnose_poses(log.input, 0.01);
    if (!d.by_attitude || !d.by_attitude->failure.empty() || (!kind.gyros_alone && !d.by_attitude->gravity)) {
      std::printf("log %d: %s\n", k, d.by_attitude ? d.by_attitude->failure.c_str() : "no answer");
      for (const std::string& words : d.by_attitude ? d.by_attitude->invisible : std::vector<std::string>()) {
        std::printf("  %s\n", words.c_str());
      }
      ++failed;
      continue;
    }
    Tallies one;
    add(*d.by_attitude, truth, log.mean_bias, one);
    for (const auto& [name, tally] : one) {
      for (Tally* sum :
           {&all[name], &of_kind[kind.name], &of_kind["all"], &of_kind[std::string(kind.name) + ": " + name]}) {
        sum->all += tally.all;
        sum->held += tally.held;
        sum->held_by_less += tally.held_by_less;
        sum->square += tally.square;
      }
    }
  }
  for (const Tallies* tallies : {&all, &of_kind}) {
    for (const auto& [name, tally] : *tallies) {
      std::printf("%-34s %5d intervals of 95 %%: %5.1f %% hold the truth; rms of error over sigma %.2f\n", name.c_str(),
                  tally.all, tally.share(), std::sqrt(tally.square / tally.all));
    }
  }
  // 93 to 97 %, and beside it three sigma of what so few show by chance: a log's intervals are as good as six independent ones.
  const double share = of_kind["all"].share();
  const double chance = 3.0 * 100.0 * std::sqrt(0.05 * 0.95 / (6.0 * std::max(1, logs)));
  const double by_less = 100.0 * of_kind["all"].held_by_less / of_kind["all"].all;
  std::printf("negative control: intervals of %.1f times the length hold %.1f %%, which has to be too little\n",
              too_narrow, by_less);
  const bool good = failed == 0 && share > 93.0 - chance && share < 97.0 + chance && by_less < 93.0 - chance;
  std::printf("%d logs, seed %llu: %.1f %% (93 to 97, chance %.1f), %d not answered: %s\n", logs,
              static_cast<unsigned long long>(seed), share, chance, failed, good ? "good" : "NOT AS IT HAS TO BE");
  return good ? 0 : 1;
}
