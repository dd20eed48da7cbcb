#include "estimator/diagnosis/noise/loudness.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t parts = 4;    // of an interval
constexpr double margin_s = 0.5;    // between a turn as found and as it was
constexpr std::size_t enough = 60;  // intervals

struct Stretch {
  std::size_t first = 0, last = 0;
};

Vector3 sum_over(const ImuData& data, const Stretch& s) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = s.first; i < s.last; ++i) {
    sum += Eigen::Map<const Vector3>(data.delta_theta[i].data());
  }
  return sum;
}

std::array<Vector3, parts> rates_of(const ImuData& data, const Stretch& s) {
  const std::size_t part = (s.last - s.first) / parts;
  std::array<Vector3, parts> rate;
  for (std::size_t k = 0; k < parts; ++k) {
    rate[k] = sum_over(data, {s.first + k * part, s.first + (k + 1) * part}) / static_cast<double>(part);
  }
  return rate;
}

// Mean square of what the rate changes by from part to part, of one axis.
double square_of_changes(const std::array<Vector3, parts>& rate) {
  double sum = 0.0;
  for (std::size_t k = 1; k < parts; ++k) {
    sum += (rate[k] - rate[k - 1]).squaredNorm();
  }
  return sum / (3.0 * static_cast<double>(parts - 1));
}

bool touches_turn(const std::vector<Segment>& segments, const Loudness& interval) {
  return std::any_of(segments.begin(), segments.end(), [&](const Segment& s) {
    return s.rotation && s.start_s - margin_s < interval.end_s && s.end_s + margin_s > interval.start_s;
  });
}

// Intervals that tell nothing by themselves (negative) are as loud as those on both sides.
void fill_between(std::vector<Loudness>& all) {
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (all[k].power >= 0.0) {
      continue;
    }
    std::size_t end = k;
    while (end < all.size() && all[end].power < 0.0) {
      ++end;
    }
    const double before = k > 0 ? all[k - 1].power : end < all.size() ? all[end].power : 1.0;
    const double behind = end < all.size() ? all[end].power : before;
    for (; k < end; ++k) {
      all[k].power = 0.5 * (before + behind);
    }
  }
}

double median_power(const std::vector<Loudness>& all) {
  std::vector<double> told;
  for (const Loudness& l : all) {
    if (l.power >= 0.0) {
      told.push_back(l.power);
    }
  }
  return told.size() < enough ? 0.0 : median(std::move(told));
}

}  // namespace

std::vector<Loudness> loudness_of(const ImuData& data, const std::vector<Segment>& segments, double interval_s) {
  const double start_s = data.time_s.front() - 1.0 / data.sample_rate_hz;
  std::vector<Loudness> all;
  Stretch s;
  for (std::size_t k = 0; s.last < data.size(); ++k) {
    Loudness l{start_s + static_cast<double>(k) * interval_s, start_s + static_cast<double>(k + 1) * interval_s, -1.0};
    s.first = s.last;
    while (s.last < data.size() && data.time_s[s.last] < l.end_s + 0.5 / data.sample_rate_hz) {
      ++s.last;
    }
    if (s.last - s.first >= 2 * parts && !touches_turn(segments, l)) {
      l.power = square_of_changes(rates_of(data, s));
    }
    all.push_back(l);
  }
  const double usual = median_power(all);
  if (!(usual > 0.0)) {
    return {};
  }
  for (Loudness& l : all) {
    l.power /= usual;
  }
  fill_between(all);
  return all;
}

bool changes_its_loudness(const std::vector<Loudness>& all) {
  constexpr double louder = 12.0, often = 0.01;
  const auto loud = std::count_if(all.begin(), all.end(), [](const Loudness& l) { return l.power > louder; });
  return static_cast<double>(loud) > often * static_cast<double>(all.size());
}

}  // namespace selfcal::diagnosis
