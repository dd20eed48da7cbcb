#include "estimator/diagnosis/poses/pose_axes.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

// One turn: gravity before and behind it, and between them steps of the gyros' integral, raw units times seconds.
struct RawTurn {
  Vector3 from, to;
  std::vector<Vector3> steps;
};

std::vector<RawTurn> raw_turns(const PoseInput& input, const std::vector<Pose>& poses,
                               const std::vector<std::size_t>& turns) {
  constexpr double step_s = 0.05;  // at 200 deg/s a tenth of the size that matters here
  constexpr double least = 15.0 * units::degree;
  std::vector<RawTurn> all;
  for (const std::size_t k : turns) {
    const Pose &from = poses[k], &to = poses[k + 1];
    RawTurn turn{from.u.normalized(), to.u.normalized(), {}};
    if (std::acos(std::clamp(turn.from.dot(turn.to), -1.0, 1.0)) < least) {
      continue;
    }
    const Vector3 bias = 0.5 * (from.gyro + to.gyro);
    double begin = input.time_s[from.last - 1];
    turn.steps.push_back(Vector3::Zero());
    for (std::size_t i = from.last; i < to.first; ++i) {
      if (input.time_s[i] - begin > step_s) {
        turn.steps.push_back(Vector3::Zero());
        begin = input.time_s[i - 1];
      }
      turn.steps.back() += (at(input.gyro, i) - bias) * (input.time_s[i] - input.time_s[i - 1]);
    }
    all.push_back(std::move(turn));
  }
  return all;
}

std::vector<Matrix3> signed_permutations() {
  std::vector<Matrix3> all;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (unsigned int signs = 0; signs < 8; ++signs) {
      Matrix3 P = Matrix3::Zero();
      for (unsigned int i = 0; i < 3; ++i) {
        P(static_cast<Eigen::Index>(i), order.at(i)) = (signs >> i & 1U) != 0U ? -1.0 : 1.0;
      }
      all.push_back(P);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return all;  // the identity first
}

constexpr double another = 1.3;  // times a unit is another unit
constexpr double most_turns = 0.8;

// By how much four turns of five end beside where gravity is at most, rad: half a round is as well three halves.
double usual_error(const std::vector<RawTurn>& turns, const Matrix3& axes, double unit) {
  std::vector<double> errors;
  for (const RawTurn& turn : turns) {
    Vector3 u = turn.from;
    for (const Vector3& step : turn.steps) {
      u = matrix_from_rotation_vector(-unit * (axes * step)) * u;
    }
    errors.push_back(std::acos(std::clamp(u.dot(turn.to), -1.0, 1.0)));
  }
  return quantile(std::move(errors), most_turns);
}

struct Candidate {
  GyroReading reading;
  double error = HUGE_VAL;
};

// From the unit at which the gyros go as far as gravity, which turns that also turn about gravity exceed.
Candidate best_unit(const std::vector<RawTurn>& turns, const Matrix3& axes, double least) {
  constexpr double from = 0.8, by = 1.03;
  constexpr int steps = 78;  // to eight times as much
  Candidate best;
  for (int k = 0; k < steps; ++k) {
    const double unit = from * least * std::pow(by, k);
    const double error = usual_error(turns, axes, unit);
    if (error < best.error) {
      best = {{axes, unit}, error};
    }
  }
  double low = best.reading.unit / by, high = best.reading.unit * by;
  constexpr double golden = 0.618034;
  for (int k = 0; k < 20; ++k) {
    const double a = high - golden * (high - low), b = low + golden * (high - low);
    (usual_error(turns, axes, a) < usual_error(turns, axes, b) ? high : low) =
        usual_error(turns, axes, a) < usual_error(turns, axes, b) ? b : a;
  }
  best.reading.unit = 0.5 * (low + high);
  best.error = usual_error(turns, axes, best.reading.unit);
  return best;
}

std::string axes_words(const Matrix3& axes) {
  std::string words = "(";
  for (Eigen::Index i = 0; i < 3; ++i) {
    Eigen::Index j = 0;
    axes.row(i).cwiseAbs().maxCoeff(&j);
    words += (i > 0 ? ", " : "") + std::string(axes(i, j) < 0.0 ? "-" : "") + "xyz"[j];
  }
  return words + ")";
}

}  // namespace

std::optional<GyroReading> read_gyros_by_turns(const PoseInput& input, const std::vector<Pose>& poses,
                                               const std::vector<std::size_t>& turns) {
  constexpr std::size_t enough = 5, most = 40;
  std::vector<RawTurn> raw = raw_turns(input, poses, turns);
  if (raw.size() < enough) {
    return {};
  }
  raw.resize(std::min(raw.size(), most));
  std::vector<double> ratios;
  for (const RawTurn& turn : raw) {
    double far = 0.0;
    for (const Vector3& step : turn.steps) {
      far += step.norm();
    }
    if (far > 0.0) {
      ratios.push_back(std::acos(std::clamp(turn.from.dot(turn.to), -1.0, 1.0)) / far);
    }
  }
  if (ratios.size() < enough) {
    return {};
  }
  const double least = quantile(std::move(ratios), 0.5);
  constexpr double close =
      4.0 * units::degree;  // misalignments of 2 % and scale factors of 3 % in turns of a right angle
  constexpr double sure = 3.0;
  Candidate best, second, as_told;
  for (const Matrix3& axes : signed_permutations()) {
    const Candidate one = best_unit(raw, axes, least);
    as_told = axes.isIdentity() ? one : as_told;
    if (one.error < best.error) {
      second = best;
      best = one;
    } else if (one.error < second.error) {
      second = one;
    }
  }
  if (as_told.error < close && as_told.error < sure * best.error) {
    return as_told.reading;  // other axes are worth asking for only where these fail
  }
  return best.error < close && sure * best.error < second.error ? std::optional(best.reading) : std::nullopt;
}

PoseInput with_unit_by_turns(const PoseInput& input, const std::vector<Pose>& poses,
                             const std::vector<std::size_t>& turns, PoseDiagnosis& d) {
  PoseInput used = input;
  const auto reading = knows_gyro_unit(input) ? std::nullopt : read_gyros_by_turns(input, poses, turns);
  if (!reading) {
    return used;
  }
  d.gyros_contradict = contradiction(input, *reading);
  if (reading->unit < another && reading->unit > 1.0 / another) {
    used.gyros_si = true;
  } else {
    used.gyro_unit = d.gyro_raw_unit = reading->unit;
  }
  return used;
}

std::string contradiction(const PoseInput& input, const GyroReading& reading) {
  std::string words;
  if (!reading.axes.isIdentity()) {
    words = "gravity turns as the gyros say once they are taken as " + axes_words(reading.axes);
    // Accelerometers that are all reversed turn alike: an even number of exchanges and signs can be theirs.
    if (reading.axes.determinant() > 0.0) {
      const Matrix3 inverse = reading.axes.transpose();
      const bool reversed = inverse.diagonal().sum() < 0.0;
      words += ", or the accelerometers as " + axes_words(reversed ? Matrix3(-inverse) : inverse);
    }
    words += ": order or sign of an axis is wrong";
  }
  const double ratio = reading.unit / input.gyro_unit;
  if (input.gyros_si && (ratio > another || ratio < 1.0 / another)) {
    std::array<char, 200> text{};
    constexpr double alike = 0.1;
    const bool increments = std::abs(ratio / sample_rate(input) - 1.0) < alike;
    std::snprintf(text.data(), text.size(), "gravity turns %.4g times as far as the gyros say%s", ratio,
                  increments ? ": they are increments, not rates" : ": another unit, or a time in another one");
    words += (words.empty() ? "" : "; ") + std::string(text.data());
  }
  return words;
}

std::string turns_elsewhere(const PoseInput& input, const std::vector<Pose>& poses,
                            const std::vector<std::size_t>& turns, double off) {
  constexpr std::size_t enough = 5;
  constexpr double hardly = 0.2;  // of gravity's turn
  const std::vector<RawTurn> raw = raw_turns(input, poses, turns);
  if (raw.size() < enough) {
    return {};
  }
  double still = 0.0;
  for (const RawTurn& turn : raw) {
    double far = 0.0;
    for (const Vector3& step : turn.steps) {
      far += step.norm() * input.gyro_unit;
    }
    still += far < hardly * std::acos(std::clamp(turn.from.dot(turn.to), -1.0, 1.0)) ? 1.0 : 0.0;
  }
  std::array<char, 240> text{};
  if (still > most_turns * static_cast<double>(raw.size())) {
    std::snprintf(
        text.data(), text.size(),
        "between %.0f of %zu poses gravity turns and the gyros do not: the turns are not in the log, or were cut out",
        still, raw.size() + 1);
  } else {
    std::snprintf(
        text.data(), text.size(),
        "the gyros carry gravity wrong by %.0f deg, and no order or sign of the axes mends it: they stand aslant in "
        "the accelerometers, or rows of the turns are missing in the log or twice in it",
        off / units::degree);
  }
  return text.data();
}

}  // namespace selfcal::diagnosis
