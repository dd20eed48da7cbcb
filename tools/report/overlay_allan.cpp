#include <algorithm>
#include <cmath>

#include "tools/report/overlay_noise.hpp"
#include "tools/report/overlay_parts.hpp"

namespace selfcal::report {
namespace {

// Edf of one stretch of n integrals at m (NIST SP 1065, table 5): white phase, white frequency, flicker, random walk.
double edf(double n, double m, double slope) {
  if (slope < -0.75) {
    return (n + 1.0) * (n - 2.0 * m) / (2.0 * (n - m));
  }
  const double white = (1.5 * (n - 1.0) / m - 2.0 * (n - 2.0) / n) * 4.0 * m * m / (4.0 * m * m + 5.0);
  if (slope < -0.25) {
    return white;
  }
  if (slope < 0.25) {
    return m == 1.0 ? 2.0 * (n - 2.0) * (n - 2.0) / (2.3 * n - 4.9) : 5.0 * n * n / (4.0 * m * (n + 3.0 * m));
  }
  const double k = n - 1.0;
  return (n - 2.0) / m * (k * k - 3.0 * m * k + 4.0 * m * m) / ((n - 3.0) * (n - 3.0));
}

// Squared differences at one averaging time, over 2 tau^2.
Parts allan_parts(const ImuData& data, const std::vector<Range>& ranges,
                  const std::vector<std::vector<double>>& integrals, std::size_t m) {
  Parts parts(ranges);
  const double tau = static_cast<double>(m) / data.sample_rate_hz;
  for (std::size_t number = 0; number < ranges.size(); ++number) {
    const std::vector<double>& integral = integrals[number];
    for (std::size_t k = 0; k + 2 * m < integral.size(); ++k) {
      const double d = integral[k + 2 * m] - 2.0 * integral[k + m] + integral[k];
      parts.add(number, ranges[number], ranges[number].first + k, d * d / (2.0 * tau * tau));
    }
  }
  return parts;
}

double pooled_freedom(const std::vector<Range>& ranges, std::size_t m, double slope) {
  double count = 0.0, scatter = 0.0;
  for (const Range& r : ranges) {
    if (r.size() > 2 * m) {
      const auto own = static_cast<double>(r.size() + 1 - 2 * m);
      count += own;
      scatter += own * own / std::max(1.0, edf(static_cast<double>(r.size() + 1), static_cast<double>(m), slope));
    }
  }
  return scatter > 0.0 ? count * count / scatter : 0.0;
}

struct Allan {
  std::vector<Parts> parts;  // of each averaging time
  std::vector<double> freedom;
};

// The slope of the deviation says which noise rules at an averaging time.
Allan allan_of(const ImuData& data, std::size_t sensor, const std::vector<Range>& ranges,
               const std::vector<std::size_t>& lengths) {
  std::vector<std::vector<double>> integrals;
  for (const Range& r : ranges) {
    std::vector<double> integral(r.size() + 1, 0.0);
    for (std::size_t i = 0; i < r.size(); ++i) {
      integral[i + 1] = integral[i] + increment(data, sensor, r.first + i);
    }
    integrals.push_back(std::move(integral));
  }
  Allan all;
  std::vector<double> variance;
  for (const std::size_t m : lengths) {
    all.parts.push_back(allan_parts(data, ranges, integrals, m));
    variance.push_back(mean_of(all.parts.back().all()));
  }
  for (std::size_t k = 0; k < lengths.size(); ++k) {
    const std::size_t before = k > 0 ? k - 1 : k, behind = k + 1 < lengths.size() ? k + 1 : k;
    const bool known = behind > before && variance[before] > 0.0 && variance[behind] > 0.0;
    const double octaves = static_cast<double>(behind - before) * std::log(2.0);
    const double slope = known ? 0.5 * std::log(variance[behind] / variance[before]) / octaves : -0.5;
    all.freedom.push_back(pooled_freedom(ranges, lengths[k], slope));
  }
  return all;
}

}  // namespace

std::vector<OverlayCurve> overlay_allan(const ImuData& recording, const ImuData& simulation) {
  const std::vector<Range> own = quiet(recording), others = quiet(simulation);
  std::size_t longest = 0;
  for (const Range& r : own) {
    longest = std::max(longest, r.size());
  }
  std::vector<std::size_t> lengths;
  for (std::size_t m = 1; 6 * m <= longest; m *= 2) {
    lengths.push_back(m);
  }
  std::vector<OverlayCurve> curves;
  for (std::size_t sensor = 0; sensor < sensor_count && !lengths.empty(); ++sensor) {
    const Allan a = allan_of(recording, sensor, own, lengths), b = allan_of(simulation, sensor, others, lengths);
    OverlayCurve curve{OverlayKind::allan,
                       "allan-" + std::to_string(sensor),
                       sensor_name(sensor),
                       "averaging time",
                       "s",
                       "Allan deviation",
                       sensor < 3 ? "deg/h" : "ug",
                       true,
                       {}};
    for (std::size_t k = 0; k < lengths.size(); ++k) {
      const std::vector<Part>&of_a = a.parts[k].all(), &of_b = b.parts[k].all();
      if (a.freedom[k] < 3.0 || b.freedom[k] < 3.0 || !(mean_of(of_a) > 0.0) || !(mean_of(of_b) > 0.0)) {
        continue;
      }
      OverlayPoint p = ratio_point(static_cast<double>(lengths[k]) / recording.sample_rate_hz, mean_of(of_a),
                                   mean_of(of_b), a.freedom[k], b.freedom[k], scatter_of(of_a, of_b));
      for (double* value : {&p.recording, &p.simulation, &p.low, &p.high}) {
        *value = std::sqrt(*value) / page_unit(sensor);
      }
      curve.points.push_back(p);
    }
    curves.push_back(std::move(curve));
  }
  return curves;
}

}  // namespace selfcal::report
