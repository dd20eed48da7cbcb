#include "estimator/diagnosis/search/locate.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <unsupported/Eigen/FFT>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t most_places = 12;
constexpr double least_sigma = 3.0;

std::string describe(const Located& l) {
  char text[160];
  const double seconds_from = l.start_s, seconds_to = l.end_s;
  const std::string sensor = (l.axis[0] == 'g' ? "gyro " : "accelerometer ") + l.axis.substr(l.axis.size() - 1);
  if (l.where == "after_turn") {
    std::snprintf(text, sizeof text, "%s, %.0f to %.0f s after each turn", sensor.c_str(), seconds_from, seconds_to);
  } else if (l.where == "time") {
    std::snprintf(text, sizeof text, "%s, minutes %.0f to %.0f", sensor.c_str(), seconds_from / 60.0,
                  seconds_to / 60.0);
  } else {
    std::snprintf(text, sizeof text, "%s, %s %d (%.0f to %.0f s)", sensor.c_str(), l.where.c_str(), l.position,
                  seconds_from, seconds_to);
  }
  return text;
}

}  // namespace

SingleTest::SingleTest(const Evidence& e, const std::vector<int>& fitted) : evidence_(e), fitted_(fitted) {
  if (!fitted.empty()) {
    solver_ = solver_beside(e.information(fitted, fitted));
    fitted_score_ = solver_.solve(Eigen::VectorXd(e.score(fitted)));
  }
}

std::optional<SingleTest::Result> SingleTest::operator()(int column) const {
  constexpr double least = 1e-6;  // information: a bias there would not be seen
  double g = evidence_.information(column, column);
  double b = evidence_.score(column);
  const double alone = g;
  if (!fitted_.empty()) {
    const Eigen::VectorXd x = evidence_.information(fitted_, column);
    g -= x.dot(solver_.solve(x));
    b -= x.dot(fitted_score_);
  }
  if (g < least || g < least * alone) {
    return std::nullopt;
  }
  return Result{b / std::sqrt(g), b / g};
}

Map locate(const Evidence& e, const std::vector<LocatedColumn>& map, int first_map_column,
           const std::vector<int>& fitted) {
  Map result;
  const SingleTest test(e, fitted);
  const Eigen::VectorXd sizes = e.fit(fitted).value;
  for (std::size_t k = 0; k < map.size(); ++k) {
    const int column = first_map_column + static_cast<int>(k);
    const auto bias = test(column);
    if (!bias) {
      continue;
    }
    ++result.tests;
    const double significance = std::abs(bias->z);
    result.largest_sigma = std::max(result.largest_sigma, significance);
    if (square_within(e, {column}, fitted, sizes) >= significance * significance) {
      result.largest_named_sigma = std::max(result.largest_named_sigma, significance);
    }
    if (significance < least_sigma) {
      continue;
    }
    const LocatedColumn& m = map[k];
    Located l;
    l.axis = axis_ids[static_cast<std::size_t>(m.axis)];
    l.start_s = m.start_s;
    l.end_s = m.end_s;
    l.significance = significance;
    l.size = bias->size * (m.axis < 3 ? map_unit(0) / units::degree_per_hour : map_unit(3) / units::micro_g);
    switch (m.kind) {
      case LocatedColumn::Kind::dwell:
        l.where = "dwell";
        l.position = m.index + 1;
        break;
      case LocatedColumn::Kind::rotation:
        l.where = "rotation";
        l.position = m.index + 1;
        break;
      case LocatedColumn::Kind::after_turn: l.where = "after_turn"; break;
      case LocatedColumn::Kind::time: l.where = "time"; break;
    }
    l.words = describe(l);
    result.places.push_back(l);
  }
  std::stable_sort(result.places.begin(), result.places.end(),
                   [](const Located& a, const Located& b) { return a.significance > b.significance; });
  if (result.places.size() > most_places) {
    result.places.resize(most_places);
  }
  return result;
}

double square_within(const Evidence& e, const std::vector<int>& place, const std::vector<int>& named,
                     const Eigen::VectorXd& size) {
  return named.empty() ? 0.0 : fit_columns(e.information(place, place), e.information(place, named) * size).delta_chi2;
}

namespace {

// Of a series less its mean, bins 1 to n/2 - 1: squares over n.
std::vector<double> periodogram(const Eigen::VectorXd& series) {
  Eigen::VectorXcd spectrum;
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, series);
  std::vector<double> power;
  for (Eigen::Index k = 1; k <= series.size() / 2 - 1; ++k) {
    power.push_back(std::norm(spectrum(k)) / static_cast<double>(series.size()));
  }
  return power;
}

// Mean of the bins around k but for k's own and its neighbours. Coloured misfit is no line: a peak stands against its neighbours.
double around(const std::vector<double>& power, Eigen::Index k) {
  constexpr Eigen::Index half = 24, own = 2;
  double sum = 0.0;
  int count = 0;
  for (Eigen::Index j = std::max<Eigen::Index>(0, k - half); j <= std::min(std::ssize(power) - 1, k + half); ++j) {
    if (std::abs(j - k) > own) {
      sum += power[static_cast<std::size_t>(j)];
      ++count;
    }
  }
  return sum / count;
}

}  // namespace

std::vector<InnovationLine> innovation_lines(const SignatureRows& rows, double interval_s) {
  std::vector<InnovationLine> lines;
  const Eigen::Index epochs = rows.residual.size() / 3;
  for (int axis = 0; axis < 3 && epochs > 64; ++axis) {
    Eigen::VectorXd series(epochs);
    for (Eigen::Index k = 0; k < epochs; ++k) {
      series(k) = rows.residual(3 * k + axis);
    }
    series.array() -= series.mean();
    const double variance = series.squaredNorm() / static_cast<double>(epochs);
    const std::vector<double> power = periodogram(series);
    const Eigen::Index bins = std::ssize(power);
    double best = 0.0;
    Eigen::Index at = 0;
    for (Eigen::Index k = 0; k < bins; ++k) {
      const double ratio = power[static_cast<std::size_t>(k)] / std::max(around(power, k), 0.05 * variance);
      if (ratio > best && k > 5) {  // slower than five periods is drift
        best = ratio;
        at = k;
      }
    }
    lines.push_back({axis, static_cast<double>(at + 1) / (static_cast<double>(epochs) * interval_s),
                     log_corrected(-best, static_cast<double>(bins))});
  }
  return lines;
}

}  // namespace selfcal::diagnosis
