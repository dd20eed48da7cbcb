#include "estimator/diagnosis/noise/velocity_jumps.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/noise/velocity_noise.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double before_turn_s = 2.0, behind_turn_s = 15.0;
const double seen_log_p = std::log(1e-5);
const double beside_log_p =
    std::log(1e-3);  // within `one_knock_s` of one that is known: people who get in knock more than once
constexpr double one_knock_s = 5.0;

struct Update {
  VectorX h, gain;  // [dynamic], [n]
  double innovation = 0.0, variance = 1.0;
};

struct Step {
  double start_s = 0.0, end_s = 0.0;
  MatrixX Phi, Gamma;
  bool coasted = false;
  std::vector<Update> updates;
};

class Recorder : public PassObserver {
 public:
  explicit Recorder(const PassInput& input)
      : transition_(input.noise.observation, input.noise.biases, input.interval_s), dynamic_(transition_.count()) {}

  void propagated(const Interval& interval, const UdFilter& /*filter*/) override {
    Step step{interval.start_s, interval.end_s, transition_.over(interval), {}, interval.coasted, {}};
    step.Gamma = MatrixX::Zero(dynamic_, sensor_parameter_count);
    step.Gamma.topRows<9>() = interval.Gamma.leftCols<sensor_parameter_count>();
    if (interval.coasted) {  // the position is opened and observed
      step.Phi.topRows<3>().setZero();
      step.Gamma.topRows<3>().setZero();
    }
    steps_.push_back(std::move(step));
  }

  void updated(int /*axis*/, const VectorX& h, const ScalarInnovation& innovation, const UdFilter& filter) override {
    steps_.back().updates.push_back({h, filter.gain(), innovation.value, innovation.variance});
  }

  const std::vector<Step>& steps() const { return steps_; }
  int dynamic() const { return dynamic_; }

 private:
  DynamicTransition transition_;
  int dynamic_;
  std::vector<Step> steps_;
};

// Of an addition to the state: what all innovations from here on say of it, and how well they would.
struct Score {
  VectorX score;
  MatrixX information;

  void back_over(const Update& u) {
    const Eigen::Index d = u.h.size();
    // s' = s - K h^T s
    score.head(d) += (u.innovation / u.variance - u.gain.dot(score)) * u.h;
    const VectorX IK = information * u.gain;
    const double KIK = u.gain.dot(IK);
    information.leftCols(d) -= IK * u.h.transpose();
    information.topRows(d) -= u.h * IK.transpose();
    information.topLeftCorner(d, d) += (KIK + 1.0 / u.variance) * u.h * u.h.transpose();
  }

  void back_over(const Step& step) {
    const Eigen::Index d = step.Phi.rows(), c = step.Gamma.cols();
    MatrixX F = MatrixX::Identity(d + c, d + c);
    F.topLeftCorner(d, d) = step.Phi;
    F.topRightCorner(d, c) = step.Gamma;
    score = (F.transpose() * score).eval();
    const MatrixX back = F.transpose() * information * F;
    information = 0.5 * (back + back.transpose());  // what rounding makes unsymmetric would grow
  }
};

bool near_turn(const std::vector<Segment>& segments, const VelocityJump& jump) {
  return std::any_of(segments.begin(), segments.end(), [&](const Segment& s) {
    return s.rotation && jump.end_s > s.start_s - before_turn_s && jump.start_s < s.end_s + behind_turn_s;
  });
}

double seconds_near_turns(const std::vector<Segment>& segments) {
  double sum = 0.0;
  for (const Segment& s : segments) {
    sum += s.rotation ? s.end_s - s.start_s + before_turn_s + behind_turn_s : 0.0;
  }
  return sum;
}

// The largest of each neighbourhood that the noise would not make, beside those that are known.
std::vector<VelocityJump> seen(const std::vector<VelocityJump>& all, const std::vector<VelocityJump>& known) {
  constexpr double apart_s = 10.0;  // by which the filter has settled behind one
  std::vector<VelocityJump> found;
  for (const VelocityJump& jump : all) {
    const bool largest = std::none_of(all.begin(), all.end(), [&](const VelocityJump& other) {
      return std::abs(other.start_s - jump.start_s) < apart_s && other.chi2 > jump.chi2;
    });
    const bool beside = std::any_of(known.begin(), known.end(), [&](const VelocityJump& other) {
      return std::abs(other.start_s - jump.start_s) < one_knock_s;
    });
    if (largest && log_chi_squared_tail(jump.chi2, 3.0) < (beside ? beside_log_p : seen_log_p)) {
      found.push_back(jump);
    }
  }
  return found;
}

// That `there` jumps and more come in `there_s` where `elsewhere` came in `elsewhere_s`: of Poisson counts whose rate is as unknown as the
// latter leave it (gamma distribution, Jeffreys' prior): negative binomial.
double probability_of(std::size_t there, double there_s, std::size_t elsewhere, double elsewhere_s) {
  const double shape = static_cast<double>(elsewhere) + 0.5, p = there_s / (there_s + elsewhere_s);
  double term = std::pow(1.0 - p, shape), below = 0.0;
  for (std::size_t k = 0; k < there; ++k) {
    below += term;
    term *= p * (shape + static_cast<double>(k)) / static_cast<double>(k + 1);
  }
  return 1.0 - below;
}

// Opens the velocity in the jump's interval: three times its size.
void open(NoiseModel& noise, const VelocityJump& jump, double interval_s) {
  constexpr double wider = 9.0;
  const double variance = wider * jump.size_b.squaredNorm();
  const double factor = 1.0 + variance / (noise.accel_vrw * noise.accel_vrw * interval_s);
  const auto there = std::find_if(noise.shaken.begin(), noise.shaken.end(),
                                  [&](const Disturbance& d) { return d.end_s > jump.start_s + 0.5 * interval_s; });
  if (there != noise.shaken.end() && there->start_s < jump.start_s + 0.5 * interval_s) {
    there->factor += factor;
  } else {
    noise.shaken.insert(there, {jump.start_s, jump.end_s, factor});
  }
}

class Opening {
 public:
  Opening(PassInput& input, const std::vector<Segment>& segments, std::vector<VelocityJump> opened)
      : input_(input), segments_(segments), turns_s_(seconds_near_turns(segments)), opened_(std::move(opened)) {}

  // Round by round, for a large one hides those beside it. False: there was none.
  bool open_all() {
    constexpr int most_rounds = 8;
    int round = 0;
    while (round < most_rounds && open_some()) {
      ++round;
    }
    return round > 0;
  }

  std::vector<VelocityJump> take() {
    std::sort(opened_.begin(), opened_.end(),
              [](const VelocityJump& a, const VelocityJump& b) { return a.start_s < b.start_s; });
    return std::move(opened_);
  }

 private:
  bool open_some() {
    constexpr double most_share = 1.0 / 30.0;
    const std::vector<VelocityJump> all = jumps_by_interval(input_);
    std::vector<VelocityJump> found = seen(all, opened_);
    const auto in_turns =
        std::partition(found.begin(), found.end(), [&](const VelocityJump& j) { return !near_turn(segments_, j); });
    if (in_turns != found.end() && !likely_in_turns(found)) {
      found.erase(in_turns, found.end());
    }
    if (found.empty() ||
        static_cast<double>(opened_.size() + found.size()) > most_share * static_cast<double>(all.size())) {
      return false;
    }
    for (const VelocityJump& jump : found) {
      open(input_.noise, jump, input_.interval_s);
      opened_.push_back(jump);
    }
    return true;
  }

  // Whether those in turns are as many as those elsewhere make likely: an effect stands in turns alone. Somebody who gets in knocks several
  // times within seconds: what follows within `one_s` is one disturbance, where it began.
  bool likely_in_turns(const std::vector<VelocityJump>& found) const {
    constexpr double chance = 0.05, one_s = 15.0;
    std::vector<VelocityJump> all = opened_;
    all.insert(all.end(), found.begin(), found.end());
    std::sort(all.begin(), all.end(),
              [](const VelocityJump& a, const VelocityJump& b) { return a.start_s < b.start_s; });
    std::size_t there = 0, elsewhere = 0;
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (k == 0 || all[k].start_s - all[k - 1].start_s > one_s) {
        ++(near_turn(segments_, all[k]) ? there : elsewhere);
      }
    }
    const double elsewhere_s = segments_.back().end_s - segments_.front().start_s - turns_s_;
    return elsewhere > 0 && probability_of(there, turns_s_, elsewhere, elsewhere_s) > chance;
  }

  PassInput& input_;
  const std::vector<Segment>& segments_;
  double turns_s_;
  std::vector<VelocityJump> opened_;
};

}  // namespace

std::vector<VelocityJump> jumps_by_interval(const PassInput& input) {
  const Navigated own = input.navigated != nullptr ? Navigated{} : navigate(input);
  PassInput replayed = input;
  replayed.navigated = input.navigated != nullptr ? input.navigated : &own;
  Recorder recorder(replayed);
  run_pass(replayed, {}, {}, &recorder);
  const int n = recorder.dynamic() + sensor_parameter_count;
  Score s{VectorX::Zero(n), MatrixX::Zero(n, n)};
  std::vector<VelocityJump> all;
  std::size_t index = recorder.steps().size();
  for (auto step = recorder.steps().rbegin(); step != recorder.steps().rend(); ++step) {
    const Matrix3 C_bn = replayed.navigated->C_nb[--index].transpose();
    for (auto u = step->updates.rbegin(); u != step->updates.rend(); ++u) {
      s.back_over(*u);
    }
    if (!step->coasted) {
      // Somewhere within the interval: on the average the position has gone on for half of it.
      MatrixX W = MatrixX::Zero(n, 3);
      W.block<3, 3>(StateLayout::position, 0).diagonal().setConstant(0.5 * (step->end_s - step->start_s));
      W.block<3, 3>(StateLayout::velocity, 0).setIdentity();
      const Vector3 b = W.transpose() * s.score;
      const Matrix3 covariance = (W.transpose() * s.information * W).inverse();
      const Vector3 size = covariance * b;
      if (size.allFinite()) {
        const Matrix3 of_sensors = C_bn * covariance * C_bn.transpose();
        all.push_back({step->start_s, step->end_s, C_bn * size, of_sensors.diagonal().cwiseSqrt(), b.dot(size)});
      }
    }
    s.back_over(*step);
  }
  std::reverse(all.begin(), all.end());
  return all;
}

std::vector<VelocityJump> open_velocity_jumps(PassInput& input, const std::vector<Segment>& segments,
                                              std::vector<VelocityJump> opened) {
  const Navigated navigated = navigate(input);
  PassInput trial = input;
  trial.navigated = &navigated;
  Opening opening(trial, segments, std::move(opened));
  // What was no noise had its share of the densities: beside a few jumps smaller ones stand out.
  constexpr int most_fits = 2;
  for (int fit = 0; fit < most_fits && opening.open_all(); ++fit) {
    const auto fitted = refit_velocity_noise(trial.noise, [&](const NoiseModel& other) {
      PassInput with = trial;
      with.noise = other;
      return run_pass(with).log_likelihood;
    });
    trial.noise = fitted.value_or(trial.noise);
  }
  input.noise = trial.noise;
  return opening.take();
}

}  // namespace selfcal::diagnosis
