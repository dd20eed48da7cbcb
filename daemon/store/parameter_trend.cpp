#include "daemon/store/parameter_trend.hpp"

#include <fmt/format.h>
#include <time.h>

#include <cmath>

namespace selfcal {
namespace {

constexpr double seconds_per_year = 365.2425 * 86400.0;
// 24 parameters are tested in each run; 4 sigma keeps false alarms below one run in 600 (24 * 6.3e-5).
constexpr double departure_sigma = 4.0;
constexpr double near_limit = 0.8;  // of the limit
constexpr double look_ahead_years = 10.0;
// Values closer together than this say nothing about a slope per year.
constexpr double least_span_years = 0.05;

struct Point {
  double year, value, sigma;
};

struct Line {
  ParameterTrend trend;
  double chi2 = 0.0;
};

Line fit(const std::vector<Point>& points, double ageing, bool with_slope) {
  double sw = 0, swt = 0, swv = 0;
  for (const Point& p : points) {
    const double w = 1.0 / (p.sigma * p.sigma + ageing * ageing);
    sw += w;
    swt += w * p.year;
    swv += w * p.value;
  }
  Line line;
  line.trend.ageing = ageing;
  line.trend.reference_year = swt / sw;
  line.trend.value = swv / sw;
  line.trend.value_sigma = 1.0 / std::sqrt(sw);
  if (with_slope) {
    double stt = 0, stv = 0;
    for (const Point& p : points) {
      const double w = 1.0 / (p.sigma * p.sigma + ageing * ageing);
      const double t = p.year - line.trend.reference_year;
      stt += w * t * t;
      stv += w * t * p.value;
    }
    line.trend.slope_per_year = stv / stt;
    line.trend.slope_sigma = 1.0 / std::sqrt(stt);
  }
  for (const Point& p : points) {
    const double residual = p.value - line.trend.at(p.year);
    line.chi2 += residual * residual / (p.sigma * p.sigma + ageing * ageing);
  }
  return line;
}

}  // namespace

double year_of(const std::string& utc) {
  std::tm parts{};
  if (strptime(utc.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts) == nullptr) {
    return 0.0;
  }
  return static_cast<double>(timegm(&parts)) / seconds_per_year;
}

double ParameterTrend::sigma_at(double year) const {
  return std::hypot(ageing, value_sigma, slope_sigma * (year - reference_year));
}

std::optional<ParameterTrend> parameter_trend(const std::vector<ParameterRecord>& history) {
  std::vector<Point> points;
  for (const ParameterRecord& record : history) {
    if (record.determined && record.sigma > 0) {
      points.push_back({year_of(record.utc), record.value, record.sigma});
    }
  }
  if (points.size() < 2) {
    return std::nullopt;
  }
  double first = points.front().year, last = first, lowest = points.front().value, highest = lowest;
  for (const Point& p : points) {
    first = std::min(first, p.year);
    last = std::max(last, p.year);
    lowest = std::min(lowest, p.value);
    highest = std::max(highest, p.value);
  }
  const bool with_slope = points.size() >= 3 && last - first > least_span_years;
  const double freedom = static_cast<double>(points.size()) - (with_slope ? 2.0 : 1.0);

  // chi^2 falls as ageing grows: bisection for the smallest ageing at which the past is no surprise.
  if (const Line line = fit(points, 0.0, with_slope); line.chi2 <= freedom) {
    return line.trend;
  }
  double low = 0.0, high = highest - lowest;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (fit(points, middle, with_slope).chi2 > freedom ? low : high) = middle;
  }
  return fit(points, high, with_slope).trend;
}

std::vector<std::string> trend_warnings(const std::string& parameter, const std::string& unit,
                                        const std::vector<ParameterRecord>& past, const ParameterRecord& value,
                                        double limit) {
  std::vector<std::string> warnings;
  if (!value.determined) {
    return warnings;
  }
  const double now = year_of(value.utc);
  if (const auto trend = parameter_trend(past)) {
    const double sigma = std::hypot(value.sigma, trend->sigma_at(now));
    const double departure = (value.value - trend->at(now)) / sigma;
    if (std::abs(departure) > departure_sigma) {
      warnings.push_back(fmt::format("{} {:.4g} {} departs from this unit's past: {:.4g} expected, {:.1f} sigma away",
                                     parameter, value.value, unit, trend->at(now), std::abs(departure)));
    }
  }
  if (limit <= 0) {
    return warnings;
  }
  if (std::abs(value.value) > limit) {
    warnings.push_back(fmt::format("{} {:.4g} {} is beyond its limit of {:.4g}", parameter, value.value, unit, limit));
    return warnings;  // nothing ahead to be warned of
  }
  if (std::abs(value.value) > near_limit * limit) {
    warnings.push_back(fmt::format("{} {:.4g} {} is near its limit of {:.4g}", parameter, value.value, unit, limit));
  }
  std::vector<ParameterRecord> all = past;
  all.push_back(value);
  const auto trend = parameter_trend(all);
  // A prediction is made of a slope that is one: beyond three of its sigmas.
  if (!trend || std::abs(trend->slope_per_year) < 3.0 * trend->slope_sigma || trend->slope_sigma <= 0) {
    return warnings;
  }
  const double target = trend->slope_per_year > 0 ? limit : -limit;
  const double years = (target - trend->at(now)) / trend->slope_per_year;
  if (years > 0 && years < look_ahead_years) {
    warnings.push_back(fmt::format("{} changes by {:.3g} {} a year and reaches its limit of {:.4g} in {:.1f} years",
                                   parameter, trend->slope_per_year, unit, limit, years));
  }
  return warnings;
}

}  // namespace selfcal
