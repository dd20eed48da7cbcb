#include "estimator/diagnosis/noise/loudness.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
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

// Rates of the parts of intervals [first, last) of a turn, one below another.
Eigen::Matrix<double, Eigen::Dynamic, 3> rates_in_turn(const ImuData& data, const std::vector<Stretch>& stretches,
                                                       std::size_t first, std::size_t last) {
  Eigen::Matrix<double, Eigen::Dynamic, 3> rates(static_cast<Eigen::Index>((last - first) * parts), 3);
  for (std::size_t k = first; k < last; ++k) {
    const std::array<Vector3, parts> of = rates_of(data, stretches[k]);
    for (std::size_t part = 0; part < parts; ++part) {
      rates.row(static_cast<Eigen::Index>((k - first) * parts + part)) = of[part].transpose();
    }
  }
  return rates;
}

// Fills intervals [first, last) of a turn.
void measure_turn(const ImuData& data, const std::vector<Stretch>& stretches, std::size_t first, std::size_t last,
                  std::vector<Loudness>& all) {
  const Eigen::Matrix<double, Eigen::Dynamic, 3> rates = rates_in_turn(data, stretches, first, last);
  const Eigen::Index n = rates.rows();
  constexpr Eigen::Index regressors = 4;
  const Eigen::SelfAdjointEigenSolver<Matrix3> axes(Matrix3(rates.transpose() * rates));
  const Eigen::VectorXd along = rates * axes.eigenvectors().col(2);
  const Eigen::MatrixXd across = rates * axes.eigenvectors().leftCols<2>();
  Eigen::MatrixXd X(n, regressors);
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(n, -1.0, 1.0);
  X << Eigen::VectorXd::Ones(n), t.matrix(), t.square().matrix(), along / along.norm();
  const Eigen::MatrixXd left = across - X * X.colPivHouseholderQr().solve(across);
  const double of_fit = static_cast<double>(n) / static_cast<double>(n - regressors);
  for (std::size_t k = first; k < last; ++k) {
    const auto row = static_cast<Eigen::Index>((k - first) * parts);
    constexpr auto changes = static_cast<Eigen::Index>(parts - 1);
    const Eigen::MatrixXd change = left.middleRows(row + 1, changes) - left.middleRows(row, changes);
    all[k].power = of_fit * change.squaredNorm() / (2.0 * static_cast<double>(changes));
  }
}

// Turns that last for some intervals, which tell by themselves.
void measure_turns(const ImuData& data, const std::vector<Stretch>& stretches, std::vector<Loudness>& all) {
  constexpr std::size_t fewest = 4;
  for (std::size_t k = 0; k < all.size(); ++k) {
    std::size_t end = k;
    while (end < all.size() && all[end].in_turn && stretches[end].last - stretches[end].first >= 2 * parts) {
      ++end;
    }
    if (end - k >= fewest) {
      measure_turn(data, stretches, k, end, all);
    }
    k = std::max(k, end);
  }
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
    if (l.power >= 0.0 && !l.in_turn) {
      told.push_back(l.power);
    }
  }
  return told.size() < enough ? 0.0 : median(std::move(told));
}

}  // namespace

std::vector<Loudness> loudness_of(const ImuData& data, const std::vector<Segment>& segments, double interval_s) {
  const double start_s = data.time_s.front() - 1.0 / data.sample_rate_hz;
  std::vector<Loudness> all;
  std::vector<Stretch> stretches;
  Stretch s;
  for (std::size_t k = 0; s.last < data.size(); ++k) {
    Loudness l{start_s + static_cast<double>(k) * interval_s, start_s + static_cast<double>(k + 1) * interval_s, -1.0,
               false};
    s.first = s.last;
    while (s.last < data.size() && data.time_s[s.last] < l.end_s + 0.5 / data.sample_rate_hz) {
      ++s.last;
    }
    l.in_turn = touches_turn(segments, l);
    if (s.last - s.first >= 2 * parts && !l.in_turn) {
      l.power = square_of_changes(rates_of(data, s));
    }
    all.push_back(l);
    stretches.push_back(s);
  }
  measure_turns(data, stretches, all);
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
  const auto loud =
      std::count_if(all.begin(), all.end(), [](const Loudness& l) { return l.power > louder && !l.in_turn; });
  return static_cast<double>(loud) > often * static_cast<double>(all.size());
}

}  // namespace selfcal::diagnosis
