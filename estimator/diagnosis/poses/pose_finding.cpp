// Poses by the motion.
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/poses/pose_data.hpp"
#include "estimator/diagnosis/poses/pose_motion.hpp"
#include "estimator/diagnosis/poses/pose_quantum.hpp"
#include "estimator/diagnosis/poses/pose_stuck.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

using Series = std::vector<std::array<double, 3>>;

// Scatter of windows of `window` samples: root of the sum of the axes' variances.
std::vector<double> scatter(const Series& series, std::size_t window) {
  std::vector<double> result;
  const Vector3 offset = at(series, 0);  // raw counts are large beside their scatter
  Vector3 sum = Vector3::Zero(), square = Vector3::Zero();
  for (std::size_t i = 0; i < series.size(); ++i) {
    const Vector3 in = at(series, i) - offset;
    sum += in;
    square += in.cwiseAbs2();
    if (i + 1 >= window) {
      const auto n = static_cast<double>(window);
      result.push_back(std::sqrt(std::max(0.0, (square / n - (sum / n).cwiseAbs2()).sum())));
      const Vector3 out = at(series, i + 1 - window) - offset;
      sum -= out;
      square -= out.cwiseAbs2();
    }
  }
  return result;
}

// Means over the quiet stretches, and over their halves.
void take_means(const PoseInput& input, Pose& p) {
  std::size_t total = 0;
  for (const auto& [first, last] : p.quiet) {
    total += last - first;
  }
  std::array<Vector3, 2> gyro = {Vector3::Zero(), Vector3::Zero()}, accel = gyro;
  std::array<double, 2> count{};
  Vector3 steps = Vector3::Zero(), accel_steps = Vector3::Zero();
  double middle = 0.0, stepped = 0.0;
  std::size_t k = 0;
  for (const auto& [first, last] : p.quiet) {
    for (std::size_t i = first; i < last; ++i, ++k) {
      const std::size_t half = 2 * k < total ? 0 : 1;
      gyro[half] += at(input.gyro, i);
      accel[half] += at(input.accel, i);
      count[half] += 1.0;
      middle += input.time_s[i] - input.time_s.front();
      if (i > first) {
        steps += (at(input.gyro, i) - at(input.gyro, i - 1)).cwiseAbs2();
        accel_steps += (at(input.accel, i) - at(input.accel, i - 1)).cwiseAbs2();
        stepped += 1.0;
      }
    }
  }
  const auto n = static_cast<double>(total);
  p.middle_s = middle / n;
  p.length_s = input.time_s[p.last - 1] - input.time_s[p.first];
  p.gyro = (gyro[0] + gyro[1]) / n;
  p.accel = (accel[0] + accel[1]) / n;
  p.gyro_half = 0.5 * (gyro[1] / count[1] - gyro[0] / count[0]);
  p.accel_half = 0.5 * (accel[1] / count[1] - accel[0] / count[0]);
  p.gyro_white = (0.5 * steps / stepped / n).cwiseSqrt();
  p.accel_white = (0.5 * accel_steps / stepped / n).cwiseSqrt();
}

Pose pose_of(const PoseInput& input, std::size_t first, std::size_t last) {
  Pose p;
  p.first = first;
  p.last = last;
  p.quiet = {{first, last}};
  take_means(input, p);
  return p;
}

// What counts as quiet: three times the usual scatter of what scatters no more than twelve times as much as the quietest
// `share`. A table's drive shakes the sensor in one pose ten times as much as in another; a turn scatters more by far.
double quiet_limit(const std::vector<double>& scatters, double share) {
  constexpr double factor = 3.0, reach = 12.0;
  const double most = reach * quantile(scatters, share);
  std::vector<double> still;
  std::copy_if(scatters.begin(), scatters.end(), std::back_inserter(still), [most](double s) { return s <= most; });
  return factor * quantile(still, 0.5);
}

// Scatter of a sensor whose quantum hides its noise: where it rests each axis stands at one count, or between two of them.
double between_two_counts(const Series& series) {
  double square = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    square += std::pow(0.5 * quantum_of(series, axis, 0, series.size()), 2);
  }
  constexpr double rounding = 1e-9;
  return (1.0 + rounding) * std::sqrt(square);
}

// Of windows that hold a sample of a stretch left out it is beyond any limit.
void spoil(const PoseInput& input, const std::vector<LeftOut>& left_out, std::size_t window,
           std::vector<double>& scatters) {
  const double start = input.time_s.front();
  for (const LeftOut& out : left_out) {
    for (std::size_t k = 0; k < scatters.size(); ++k) {
      if (input.time_s[k] - start <= out.last_s && input.time_s[k + window - 1] - start >= out.first_s) {
        scatters[k] = HUGE_VAL;
      }
    }
  }
}

// Gyros alone, which may all lie across the axis that a table turns about: its read-out says that it turns.
bool turns_unseen(const PoseInput& input, std::size_t first, std::size_t last) {
  constexpr double still = 0.1 * units::degree;
  const auto turned = [&](const std::vector<double>& angle) {
    return !angle.empty() && std::abs(angle[last - 1] - angle[first]) > still;
  };
  return input.sensors == Sensors::gyros && (turned(input.outer) || turned(input.inner));
}

std::vector<Pose> quiet_stretches(const PoseInput& input, const std::vector<LeftOut>& left_out, std::size_t window,
                                  double share) {
  std::vector<double> gyro = scatter(input.gyro, window), accel = scatter(input.accel, window);
  spoil(input, left_out, window, gyro);
  spoil(input, left_out, window, accel);
  const double gyro_limit = std::max(quiet_limit(gyro, share), between_two_counts(input.gyro));
  const double accel_limit = std::max(quiet_limit(accel, share), between_two_counts(input.accel));
  const std::vector<std::size_t> gaps = find_gaps(input);
  std::vector<Pose> found;
  std::size_t begin = 0;
  bool inside = false;
  for (std::size_t k = 0; k <= gyro.size(); ++k) {
    const bool quiet =
        k < gyro.size() && gyro[k] <= gyro_limit && accel[k] <= accel_limit && !turns_unseen(input, k, k + window);
    if (quiet && !inside) {
      begin = k;
    } else if (!quiet && inside && k - begin >= window) {
      found.push_back(pose_of(input, begin + window / 2, k + window / 2));  // middles of the windows
      found.back().part = std::upper_bound(gaps.begin(), gaps.end(), found.back().first) - gaps.begin();
    }
    inside = quiet;
  }
  return found;
}

// Raw accelerometer units of one g: nominal, or half the range of the stretches' means.
double raw_gravity(const PoseInput& input, const std::vector<Pose>& stretches) {
  if (input.accel_unit > 0.0) {
    return 9.80665 / input.accel_unit;
  }
  Vector3 low = stretches.front().accel, high = low;
  for (const Pose& p : stretches) {
    low = low.cwiseMin(p.accel);
    high = high.cwiseMax(p.accel);
  }
  return 0.5 * (high - low).maxCoeff();
}

// The sensor stood as it stands: half a degree is what a hand's knock leaves, and what errs |f| by 1e-5.
bool same_pose(const PoseInput& input, const Pose& a, const Pose& b, double raw_per_g) {
  constexpr double limit = 0.5 * units::degree;
  if ((b.accel - a.accel).norm() > limit * raw_per_g) {
    return false;
  }
  constexpr double steady = units::degree;  // a second: no bias changes by that much, and one of them turns
  if ((b.gyro - a.gyro).norm() * input.gyro_unit > steady && input.accel_unit > 0.0) {
    return false;
  }
  if (a.part != b.part) {
    return false;  // nobody knows what it did between them, nor whether it was switched off
  }
  const Vector3 bias = 0.5 * (a.gyro + b.gyro);
  Vector3 turned = Vector3::Zero();
  for (std::size_t i = a.last; i < b.first; ++i) {
    turned += (at(input.gyro, i) - bias) * (input.time_s[i] - input.time_s[i - 1]);
    if (turned.norm() * input.gyro_unit > 20.0 * limit) {
      return false;  // turned away and back
    }
  }
  return turned.norm() * input.gyro_unit < limit;
}

std::vector<Pose> put_together(const PoseInput& input, const std::vector<Pose>& stretches) {
  std::vector<Pose> poses;
  // Without gravity nothing but the gyros' unit, which may not be known, tells a knock from a turn: two stands are no harm.
  if (stretches.empty() || input.sensors == Sensors::gyros) {
    return stretches;
  }
  const double raw_per_g = raw_gravity(input, stretches);
  for (const Pose& next : stretches) {
    if (!poses.empty() && same_pose(input, poses.back(), next, raw_per_g)) {
      Pose& p = poses.back();
      p.last = next.last;
      p.quiet.insert(p.quiet.end(), next.quiet.begin(), next.quiet.end());
      take_means(input, p);
    } else {
      poses.push_back(next);
    }
  }
  return poses;
}

// Of a gyro's sample, by white noise: of the usual pose.
double sample_sigma(const std::vector<Pose>& poses, Eigen::Index axis) {
  std::vector<double> all;
  for (const Pose& p : poses) {
    double samples = 0.0;
    for (const auto& [first, last] : p.quiet) {
      samples += static_cast<double>(last - first);
    }
    all.push_back(p.gyro_white(axis) * std::sqrt(samples));
  }
  return quantile(all, 0.5);
}

// What the gyros read at rest where most stretches turn, as on a rate table without an angle: of the rates that are alike
// within `alike` those that last longest, and of such as last about as long the least.
Vector3 rate_at_rest(const std::vector<Pose>& poses, const Vector3& alike) {
  struct Candidate {
    Vector3 rate;
    double seconds;
  };
  std::vector<Candidate> all;
  double longest = 0.0;
  for (const Pose& a : poses) {
    Candidate c{a.gyro, 0.0};
    for (const Pose& b : poses) {
      const bool same = ((a.gyro - b.gyro).cwiseAbs().array() <= alike.array()).all();
      c.seconds += same ? b.length_s : 0.0;
    }
    longest = std::max(longest, c.seconds);
    all.push_back(c);
  }
  constexpr double about = 0.7;
  std::erase_if(all, [&](const Candidate& c) { return c.seconds < about * longest; });
  return std::min_element(all.begin(), all.end(),
                          [](const Candidate& a, const Candidate& b) { return a.rate.norm() < b.rate.norm(); })
      ->rate;
}

// A sensor that turns back and forth without a stop has no rest: what it reads one way it reads the other way with the other
// sign, which no bias does.
bool turns_both_ways(const std::vector<Pose>& poses, const Vector3& rest, const Vector3& alike) {
  constexpr double like = 0.3, as_long = 0.5;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    double one = 0.0, other = 0.0;
    for (const Pose& p : poses) {
      one += std::abs(p.gyro(axis) - rest(axis)) <= alike(axis) ? p.length_s : 0.0;
      other += std::abs(p.gyro(axis) + rest(axis)) <= like * std::abs(rest(axis)) ? p.length_s : 0.0;
    }
    if (std::abs(rest(axis)) > alike(axis) && other > as_long * one) {
      return true;
    }
  }
  return false;
}

// A steady turn is as quiet as a pose. Gyros that read a degree a second, and twenty times the usual deviation, away from
// where they mostly are turn; so do read-outs that move. Biases of one sensor in SI differ by less than a degree a second:
// where most stretches differ by more they turn, and where they rest follows from them. Of gyros alone, whose unit need not be known, ten times the noise of a sample counts as much
// as a degree a second.
void drop_steady_turns(const PoseInput& input, std::vector<Pose>& poses) {
  Vector3 middle, spread, least;
  constexpr double rate = units::degree, of_a_sample = 10.0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values, off;
    for (const Pose& p : poses) {
      values.push_back(p.gyro(axis));
    }
    middle(axis) = quantile(values, 0.5);
    least(axis) = input.sensors == Sensors::gyros ? of_a_sample * sample_sigma(poses, axis) : rate / input.gyro_unit;
    for (const double v : values) {
      off.push_back(std::abs(v - middle(axis)));
    }
    spread(axis) = quantile(off, 0.5);
  }
  const bool si = input.gyros_si && input.accel_unit > 0.0 && input.sensors == Sensors::both;
  if (si && (spread.array() > least.array()).any()) {
    middle = rate_at_rest(poses, least);
    spread.setZero();
  }
  if (si && turns_both_ways(poses, middle, least)) {
    poses.clear();
    return;
  }
  constexpr double deviations = 20.0, read_out = 0.1 * units::degree;
  std::erase_if(poses, [&](const Pose& p) {
    const std::size_t third = (p.last - p.first) / 3;  // read-outs may be late or early by the rest
    for (const std::vector<double>* angle : {&input.outer, &input.inner}) {
      if (!angle->empty() && std::abs((*angle)[p.last - third - 1] - (*angle)[p.first + third]) > read_out) {
        return true;
      }
    }
    const Vector3 off = (p.gyro - middle).cwiseAbs();
    return (off.array() > least.array() && off.array() > deviations * spread.array()).any();
  });
}

// Gyros alone that turn all the time are quietest where their rate is at its largest, and no gravity says that they turn. What rests scatters by
// little more than from sample to sample; what turns changes its rate by many times that.
void drop_what_turns(const PoseInput& input, std::vector<Pose>& poses) {
  constexpr double most = 5.0;  // coloured noise of a sensor: 3
  std::erase_if(poses, [&](const Pose& p) {
    Vector3 square = Vector3::Zero();
    double count = 0.0;
    for (const auto& [first, last] : p.quiet) {
      for (std::size_t i = first; i < last; ++i) {
        square += (at(input.gyro, i) - p.gyro).cwiseAbs2();
        count += 1.0;
      }
    }
    // gyro_white is of the mean of as many.
    return ((square / count).array() > most * most * count * p.gyro_white.array().square()).any();
  });
}

}  // namespace

Vector3 at(const std::vector<std::array<double, 3>>& series, std::size_t i) {
  return Eigen::Map<const Vector3>(series[i].data());
}

FoundPoses find_poses(const PoseInput& input, const std::vector<LeftOut>& left_out) {
  const double rate = sample_rate(input);
  const auto window = std::max<std::size_t>(4, static_cast<std::size_t>(std::lround(rate)));  // 1 s, or four samples
  if (input.time_s.size() < 20 * window) {
    return {};
  }
  FoundPoses found;
  // Where the quietest twentieth of a log moves, as that of a vehicle which stood for a while, less than it rests.
  const auto is_moving = [&input](const Pose& p) { return moves(input, p); };
  for (const double share : {0.05, 0.02, 0.005}) {
    found.poses = put_together(input, quiet_stretches(input, left_out, window, share));
    if (std::none_of(found.poses.begin(), found.poses.end(), is_moving)) {
      break;
    }
  }
  found.moving = static_cast<int>(std::erase_if(found.poses, is_moving));
  if (input.accel_zero_known) {
    found.zero_elsewhere = forces_of_another_zero(input, found.poses);
  }
  found.other_forces = drop_other_forces(input, found.poses);
  if (!found.poses.empty()) {
    const std::size_t before = found.poses.size();
    drop_steady_turns(input, found.poses);
    found.steady_turns = static_cast<int>(before - found.poses.size());
  }
  if (input.sensors == Sensors::gyros) {
    drop_what_turns(input, found.poses);
  }
  add_hidden(input, found.poses);
  return found;
}

std::vector<LeftOut> find_left_out(const PoseInput& input, const std::vector<StuckAxis>& stuck) {
  constexpr double least_s = 0.5;
  constexpr std::array<double, 3> zero{};
  std::vector<LeftOut> all;
  const auto add = [&](std::size_t first, std::size_t last, const char* words) {
    all.push_back({input.time_s[first] - input.time_s.front(), input.time_s[last - 1] - input.time_s.front(),
                   last - first, words});
  };
  const auto runs = [&](auto goes_on, double least, const char* words) {
    std::size_t first = 0;
    bool inside = false;
    for (std::size_t i = 1; i <= input.time_s.size(); ++i) {
      const bool now = i < input.time_s.size() && goes_on(i);
      if (now && !inside) {
        first = i;
      } else if (!now && inside && input.time_s[i - 1] - input.time_s[first] >= least) {
        add(first, i, words);
      }
      inside = now;
    }
  };
  for (const std::size_t i : find_gaps(input)) {
    all.push_back({input.time_s[i - 1] - input.time_s.front(), input.time_s[i] - input.time_s.front(), 0,
                   "the log holds no sample"});
  }
  for (const StuckAxis& s : stuck) {
    if (!s.throughout) {
      add(s.first, s.last, s.gyro ? "a gyro stands at one value" : "an accelerometer stands at one value");
    }
  }
  if (input.sensors != Sensors::both) {  // three axes of a coarse sensor may well stand still in a pose
    return all;
  }
  runs([&](std::size_t i) { return input.accel[i] == zero; }, 0.0, "the accelerometers give zero");
  runs(
      [&](std::size_t i) {
        return input.accel[i] != zero && input.accel[i] == input.accel[i - 1] && input.gyro[i] == input.gyro[i - 1];
      },
      least_s, "all axes stand at one value");
  return all;
}

std::vector<Clipping> find_clipping(const PoseInput& input) {
  // Values thin out towards an end that is none: there are more at the end of a range than in the hundredth before it, by more than chance.
  constexpr double near = 0.01, sure = 3.0;
  constexpr double at_rest = 0.5;  // what stands there for half of the time is no end of a range
  std::vector<Clipping> all;
  for (int k = 0; k < 6; ++k) {
    const Series& series = k < 3 ? input.gyro : input.accel;
    const auto axis = static_cast<std::size_t>(k % 3);
    const auto [low, high] = std::minmax_element(series.begin(), series.end(),
                                                 [axis](const auto& a, const auto& b) { return a[axis] < b[axis]; });
    const double range = (*high)[axis] - (*low)[axis];
    Clipping c{.gyro = k < 3, .axis = k % 3};
    for (const double end : {(*low)[axis], (*high)[axis]}) {
      double step = range;  // to the value next to the end: of coarse readings more than a hundredth of the range
      for (const auto& row : series) {
        const double off = std::abs(row[axis] - end);
        step = off > 0.0 ? std::min(step, off) : step;
      }
      std::size_t there = 0, before = 0, first = 0, last = 0;
      for (std::size_t i = 0; i < series.size(); ++i) {
        if (series[i][axis] == end) {
          first = there++ == 0 ? i : first;
          last = i;
        } else if (std::abs(series[i][axis] - end) <= std::max(near * range, step)) {
          ++before;
        }
      }
      const auto more = static_cast<double>(there) - static_cast<double>(before);
      const bool clips = more > sure * std::sqrt(static_cast<double>(there + before)) &&
                         static_cast<double>(there) < at_rest * static_cast<double>(series.size());
      if (clips) {
        const double from = input.time_s[first] - input.time_s.front(), to = input.time_s[last] - input.time_s.front();
        c.first_s = c.samples == 0 ? from : std::min(c.first_s, from);
        c.last_s = std::max(c.last_s, to);
        c.samples += there;
        c.limit = std::max(c.limit, std::abs(end));
        (end == (*low)[axis] ? c.low : c.high) = end;
      }
    }
    if (c.samples > 0) {
      all.push_back(c);
    }
  }
  return all;
}

bool gyros_clip(const PoseInput& input, const std::vector<Clipping>& clipped, std::size_t first, std::size_t last) {
  return std::any_of(clipped.begin(), clipped.end(), [&](const Clipping& c) {
    const auto stands = [&](const auto& row) { return std::abs(row[static_cast<std::size_t>(c.axis)]) >= c.limit; };
    const auto begin = input.gyro.begin();
    return c.gyro &&
           std::any_of(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(last), stands);
  });
}

int drop_clipped(const PoseInput& input, const std::vector<Clipping>& clipped, std::vector<Pose>& poses) {
  constexpr double most =
      0.01;  // of a pose's samples; what white noise cuts off moves the mean by less than a tenth of its sigma
  const auto at_the_end = [&](const Pose& p, const Clipping& c) {
    double count = 0.0, all = 0.0;
    for (const auto& [first, last] : p.quiet) {
      for (std::size_t i = first; i < last; ++i) {
        const double value = input.accel[i][static_cast<std::size_t>(c.axis)];
        count += value <= c.low || value >= c.high ? 1.0 : 0.0;
        all += 1.0;
      }
    }
    return count > most * all;
  };
  return static_cast<int>(std::erase_if(poses, [&](const Pose& p) {
    return std::any_of(clipped.begin(), clipped.end(), [&](const Clipping& c) { return !c.gyro && at_the_end(p, c); });
  }));
}

}  // namespace selfcal::diagnosis
