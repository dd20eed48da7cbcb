#include "estimator/diagnosis/data/read_out_delay.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/geometry/angles.hpp"
#include "estimator/geometry/rotation.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double most_s = 1.5;
constexpr double block_s = 0.02;  // a read-out of 20" makes 0.3 deg/s of noise of it

// Sizes of the rates over blocks of samples, rad per block: of two axes at right angles, and of three.
struct Speeds {
  std::vector<double> read_outs, gyros;
};

Speeds speeds(const ImuData& data, std::size_t first, std::size_t block, std::size_t blocks) {
  Speeds s;
  for (std::size_t k = 0; k < blocks; ++k) {
    const std::size_t from = first + k * block, to = from + block;
    s.read_outs.push_back(std::hypot(within_half_a_turn(data.gimbal_outer[to - 1] - data.gimbal_outer[from - 1]),
                                     within_half_a_turn(data.gimbal_inner[to - 1] - data.gimbal_inner[from - 1])));
    Vector3 turn = Vector3::Zero();
    for (std::size_t i = from; i < to; ++i) {
      turn += Eigen::Map<const Vector3>(data.delta_theta[i].data());
    }
    s.gyros.push_back(turn.norm());
  }
  return s;
}

// Sum of the squares of what they differ by where the read-outs come `lag` blocks later.
double apart(const Speeds& s, int lag, std::size_t most) {
  double sum = 0.0;
  for (std::size_t k = most; k + most < s.gyros.size(); ++k) {
    const double difference = s.read_outs[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(k) + lag)] - s.gyros[k];
    sum += difference * difference;
  }
  return sum;
}

// Of one turn, in blocks; none where no lag makes one motion of both.
std::optional<double> lag_of(const Speeds& s, std::size_t most) {
  constexpr double one_motion = 0.02;  // of the square of the gyros'
  double square = 0.0;
  for (std::size_t k = most; k + most < s.gyros.size(); ++k) {
    square += s.gyros[k] * s.gyros[k];
  }
  const int end = static_cast<int>(most);
  int best = 0;
  double least = HUGE_VAL;
  for (int lag = -end; lag <= end; ++lag) {
    const double now = apart(s, lag, most);
    best = now < least ? lag : best;
    least = std::min(least, now);
  }
  if (std::abs(best) == end || least > one_motion * square) {
    return std::nullopt;
  }
  const double before = apart(s, best - 1, most), behind = apart(s, best + 1, most);
  const double bend = before - 2.0 * least + behind;
  return bend > 0.0 ? std::optional(best + 0.5 * (before - behind) / bend) : std::nullopt;
}

}  // namespace

std::optional<ReadOutDelay> read_out_delay(const ImuData& data, const std::vector<Segment>& segments) {
  constexpr std::size_t least_turns = 3;
  constexpr double sigmas = 5.0, least_samples = 1.5;
  if (data.gimbal_outer.empty() || data.gimbal_inner.empty()) {
    return std::nullopt;
  }
  const auto block = static_cast<std::size_t>(std::max(1.0, std::round(block_s * data.sample_rate_hz)));
  const double length_s = static_cast<double>(block) / data.sample_rate_hz;
  const auto most = static_cast<std::size_t>(std::ceil(most_s / length_s));
  std::vector<double> delays_s;
  for (const Segment& s : segments) {
    const std::size_t around = 2 * most * block;
    if (!s.rotation || s.first < around + 1 || s.last + around > data.size()) {
      continue;
    }
    const std::size_t first = s.first - around, last = s.last + around;
    const bool lost = std::any_of(data.coasts.begin(), data.coasts.end(),
                                  [&](const Coast& c) { return c.gyros && c.first < last && c.last > first; });
    if (const auto lag = lost ? std::nullopt : lag_of(speeds(data, first, block, (last - first) / block), most)) {
      delays_s.push_back(*lag * length_s);
    }
  }
  if (delays_s.size() < least_turns) {
    return std::nullopt;
  }
  const auto n = static_cast<double>(delays_s.size());
  const double mean = std::accumulate(delays_s.begin(), delays_s.end(), 0.0) / n;
  const double square = std::accumulate(delays_s.begin(), delays_s.end(), 0.0,
                                        [mean](double sum, double d) { return sum + (d - mean) * (d - mean); });
  const ReadOutDelay delay{mean, std::sqrt(square / (n * (n - 1.0)))};
  const bool seen = std::abs(mean) > std::max(sigmas * delay.sigma_s, least_samples / data.sample_rate_hz);
  return seen ? std::optional(delay) : std::nullopt;
}

}  // namespace selfcal::diagnosis
