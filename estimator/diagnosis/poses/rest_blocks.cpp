#include "estimator/diagnosis/poses/rest_blocks.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double most_blocks = 120.0, least_s = 1.0, least_samples = 8.0;

// Sums over the samples of a pose that nothing disturbed.
struct Block {
  Vector3 gyro = Vector3::Zero(), accel = Vector3::Zero();
  double temperature = 0.0, count = 0.0, middle_s = 0.0;
  std::size_t pose = 0;
};

void add_blocks_of(const PoseInput& input, const Pose& p, std::size_t number, double length_s, double rate_hz,
                   std::vector<Block>& all) {
  const double start = input.time_s[p.first], end = input.time_s[p.last - 1] + 1.0 / rate_hz;
  const auto pieces = static_cast<std::size_t>(std::max(1.0, std::floor((end - start) / length_s)));
  const double piece_s = (end - start) / static_cast<double>(pieces);
  std::vector<Block> own(pieces);
  for (std::size_t k = 0; k < pieces; ++k) {
    own[k].pose = number;
    own[k].middle_s = start + (static_cast<double>(k) + 0.5) * piece_s;
  }
  for (const auto& [first, last] : p.quiet) {
    for (std::size_t i = first; i < last; ++i) {
      Block& b = own[std::min(pieces - 1, static_cast<std::size_t>((input.time_s[i] - start) / piece_s))];
      b.gyro += at(input.gyro, i);
      b.accel += at(input.accel, i);
      b.temperature += input.temperature_c.empty() ? 0.0 : input.temperature_c[i];
      b.count += 1.0;
    }
  }
  std::erase_if(own, [&](const Block& b) { return b.count < 0.5 * std::min(piece_s, length_s) * rate_hz; });
  all.insert(all.end(), own.begin(), own.end());
}

// Noise of a smooth series, by its second differences.
double noise_of(const Eigen::VectorXd& v) {
  const Eigen::Index n = v.size() - 2;
  return n < 1 ? HUGE_VAL
               : (v.head(n) - 2.0 * v.segment(1, n) + v.tail(n)).norm() / std::sqrt(6.0 * static_cast<double>(n));
}

double deviation(const Eigen::VectorXd& v) { return std::sqrt((v.array() - v.mean()).square().mean()); }

// Noise of a regressor makes its coefficient smaller: by 4 % where it is a fifth of what moves.
bool moves(const Eigen::VectorXd& temperature) {
  constexpr double times = 5.0, least = 0.01;  // degC: finer than any channel
  return temperature.size() > 0 && temperature.allFinite() &&
         deviation(temperature) > std::max(least, times * noise_of(temperature));
}

// Of each pose the first one of which it is the same stand: only a gap of the log lies between, in which the direction of gravity stayed. What
// stood elsewhere in between has a mean of its own.
std::vector<std::size_t> stands(const PoseInput& input, const std::vector<Pose>& poses) {
  constexpr double longest_s = 60.0, turned = 0.2 * units::degree;
  std::vector<std::size_t> all;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    all.push_back(k);
    if (k == 0 || poses[k].part == poses[k - 1].part || input.sensors == Sensors::gyros) {
      continue;
    }
    const double away_s = input.time_s[poses[k].first] - input.time_s[poses[k - 1].last - 1];
    const double off = poses[k].accel.normalized().cross(poses[k - 1].accel.normalized()).norm();
    all[k] = away_s < longest_s && off < turned ? all[k - 1] : k;
  }
  return all;
}

}  // namespace

RestBlocks rest_blocks(const PoseInput& input, const std::vector<Pose>& poses) {
  const double rate_hz = sample_rate(input);
  double whole = 0.0;
  RestBlocks r;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const auto length = [&](std::size_t j) { return input.time_s[poses[j].last - 1] - input.time_s[poses[j].first]; };
    whole += length(k);
    r.longest = length(k) > length(r.longest) ? k : r.longest;
  }
  r.times.block_s = std::max({least_s, whole / most_blocks, least_samples / rate_hz});
  r.duration_s = input.time_s.back() - input.time_s.front();
  const std::vector<std::size_t> stand = stands(input, poses);
  r.stand = stand[r.longest];
  std::vector<Block> all;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    add_blocks_of(input, poses[k], stand[k], r.times.block_s, rate_hz, all);
  }
  const auto n = static_cast<Eigen::Index>(all.size());
  r.gyro.resize(n, 3);
  r.accel.resize(n, 3);
  r.temperature.resize(input.temperature_c.empty() ? 0 : n);
  r.times.middle_s.resize(n);
  r.times.weight.resize(n);
  std::vector<double> of_longest;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Block& b = all[static_cast<std::size_t>(i)];
    r.gyro.row(i) = b.gyro.transpose() / b.count;
    r.accel.row(i) = b.accel.transpose() / b.count;
    if (r.temperature.size() > 0) {
      r.temperature(i) = b.temperature / b.count;
    }
    r.times.middle_s(i) = b.middle_s - input.time_s.front();
    r.times.weight(i) = b.count / (r.times.block_s * rate_hz);
    r.pose.push_back(b.pose);
    if (b.pose == r.stand) {
      of_longest.push_back(r.times.middle_s(i));
    }
  }
  r.times.pin_s = of_longest.empty() ? 0.0 : of_longest[of_longest.size() / 2] - 0.5 * r.times.block_s;
  if (!moves(r.temperature)) {
    r.temperature.resize(0);
  }
  return r;
}

}  // namespace selfcal::diagnosis
