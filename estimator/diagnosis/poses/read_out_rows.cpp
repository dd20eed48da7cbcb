#include "estimator/diagnosis/poses/read_out_rows.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

double interval(const PoseInput& input, std::size_t i) { return input.time_s[i] - input.time_s[i - 1]; }

// Noise of a read-out by its second differences: a steady turn has none.
double noise_of(const std::vector<double>& angle) {
  std::vector<double> bend;
  for (std::size_t i = 2; i < angle.size(); ++i) {
    bend.push_back(std::abs(angle[i] - 2.0 * angle[i - 1] + angle[i - 2]));
  }
  const auto middle = bend.begin() + static_cast<std::ptrdiff_t>(bend.size() / 2);
  std::nth_element(bend.begin(), middle, bend.end());
  return *middle / 1.65;  // 0.6745 sqrt(6)
}

// Mean rate over half a second about each sample; at the ends over less.
std::vector<double> smooth_rate(const PoseInput& input, const std::vector<double>& angle) {
  const auto half = static_cast<std::size_t>(std::max(1.0, 0.25 * sample_rate(input)));
  std::vector<double> rate(angle.size(), 0.0);
  for (std::size_t i = 0; i < angle.size(); ++i) {
    const std::size_t a = i > half ? i - half : 0, b = std::min(angle.size() - 1, i + half);
    rate[i] = (angle[b] - angle[a]) / (input.time_s[b] - input.time_s[a]);
  }
  return rate;
}

double rest_limit(const std::vector<double>& angle) {
  constexpr double least = 0.04 * units::degree, noises = 16.0;  // rad/s: 0.02 deg in half a second
  return std::max(least, noises * noise_of(angle));
}

Vector3 mean_gyro(const PoseInput& input, std::size_t first, std::size_t last) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = first; i < last; ++i) {
    sum += at(input.gyro, i);
  }
  return sum / static_cast<double>(last - first);
}

const ReadOutAxis* axis_called(const ReadOuts& found, bool outer) {
  const auto it = std::find_if(found.axes.begin(), found.axes.end(),
                               [&](const ReadOutAxis& a) { return a.name == (outer ? "outer" : "inner"); });
  return it == found.axes.end() ? nullptr : &*it;
}

// Of the mounts on an axis that whose response a step of rate shows.
const ReadOutAxis* axis_of_step(const PoseInput& input, const ReadOuts& found, const SteadyRate& a,
                                const SteadyRate& b) {
  const Vector3 response = (b.gyro - a.gyro) * (input.gyro_unit / (b.rate - a.rate));
  const ReadOutAxis* nearest = nullptr;
  for (const ReadOutAxis& axis : found.axes) {
    const bool named = axis.name == (a.outer ? "outer" : "inner");
    if (named && (!nearest || (axis.response - response).norm() < (nearest->response - response).norm())) {
      nearest = &axis;
    }
  }
  return nearest;
}

// A stretch of one steady rate to a row; false where the gyros do not turn steadily in it.
bool complete(const PoseInput& input, const std::vector<double>& angle, SteadyRate& s) {
  constexpr double margin_s = 1.2, least_s = 2.0, even = 0.02;
  const auto margin = static_cast<std::size_t>(margin_s * sample_rate(input));
  s.first += margin;
  s.last -= std::min(s.last, margin);
  if (s.last <= s.first || input.time_s[s.last - 1] - input.time_s[s.first] < least_s) {
    return false;
  }
  s.length_s = input.time_s[s.last - 1] - input.time_s[s.first];
  s.rate = (angle[s.last - 1] - angle[s.first]) / s.length_s;
  s.gyro = mean_gyro(input, s.first, s.last);
  const std::size_t middle = (s.first + s.last) / 2;
  const Vector3 early = mean_gyro(input, s.first, middle), late = mean_gyro(input, middle, s.last);
  s.uneven = 0.5 * (late - early).norm();
  return 2.0 * s.uneven * input.gyro_unit < even * std::abs(s.rate);
}

}  // namespace

std::vector<Stop> find_stops(const PoseInput& input, const std::vector<Pose>& poses) {
  const std::vector<double> outer = smooth_rate(input, input.outer), inner = smooth_rate(input, input.inner);
  const double outer_limit = rest_limit(input.outer), inner_limit = rest_limit(input.inner);
  constexpr double least_s = 0.3;
  const auto least = static_cast<std::size_t>(std::max(2.0, least_s * sample_rate(input)));
  std::vector<Stop> stops;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    std::size_t best_first = 0, best = 0, run = 0;
    for (std::size_t i = poses[k].first; i < poses[k].last; ++i) {
      const bool rests = std::abs(outer[i]) < outer_limit && std::abs(inner[i]) < inner_limit;
      run = rests ? run + 1 : 0;
      if (run > best) {
        best = run;
        best_first = i + 1 - run;
      }
    }
    if (best >= least) {
      const std::size_t middle = best_first + best / 2;
      stops.push_back({k, middle, input.outer[middle], input.inner[middle]});
    }
  }
  return stops;
}

std::vector<TurnRow> turns_between(const PoseInput& input, const std::vector<Pose>& poses,
                                   const std::vector<Stop>& stops, const std::vector<Clipping>& clipped,
                                   int& at_the_end) {
  constexpr double least = 1.0 * units::degree;
  std::vector<TurnRow> rows;
  for (std::size_t k = 1; k < stops.size(); ++k) {
    const Stop &a = stops[k - 1], &b = stops[k];
    TurnRow row;
    row.outer = b.outer - a.outer;
    row.inner = b.inner - a.inner;
    row.inner_angle = a.inner;
    if (std::max(std::abs(row.outer), std::abs(row.inner)) < least) {
      continue;
    }
    const Pose &from = poses[a.pose], &to = poses[b.pose];
    if (gyros_clip(input, clipped, from.last, to.first)) {
      ++at_the_end;
      continue;
    }
    row.first = a.middle;
    row.last = b.middle;
    row.bias = 0.5 * (from.gyro + to.gyro);
    row.turned = Vector3::Zero();  // in a pose nothing turns: its samples would add their noise
    row.begins = from.last;
    row.ends = to.first;
    for (std::size_t i = row.begins; i < row.ends; ++i) {
      row.turned += (at(input.gyro, i) - row.bias) * interval(input, i);
    }
    row.noise = variance_of_turn(input, from, to).cwiseSqrt();
    rows.push_back(row);
  }
  return rows;
}

std::vector<SteadyRate> find_steady_rates(const PoseInput& input, const std::vector<Clipping>& clipped,
                                          int& at_the_end) {
  const std::vector<double> outer = smooth_rate(input, input.outer), inner = smooth_rate(input, input.inner);
  const double outer_limit = rest_limit(input.outer), inner_limit = rest_limit(input.inner);
  constexpr double slowest = 2.0 * units::degree, even = 0.01;
  std::vector<SteadyRate> all;
  for (const bool of_outer : {true, false}) {
    const std::vector<double>& rate = of_outer ? outer : inner;
    const std::vector<double>& other = of_outer ? inner : outer;
    const double still = of_outer ? inner_limit : outer_limit;
    std::size_t first = 0;
    for (std::size_t i = 1; i <= rate.size(); ++i) {
      const bool goes_on = i < rate.size() && std::abs(rate[first]) > slowest && std::abs(other[i]) < still &&
                           std::abs(rate[i] - rate[first]) < even * std::abs(rate[first]);
      if (goes_on) {
        continue;
      }
      SteadyRate s;
      s.first = first;
      s.last = i;
      s.outer = of_outer;
      if (complete(input, of_outer ? input.outer : input.inner, s)) {
        if (gyros_clip(input, clipped, s.first, s.last)) {
          ++at_the_end;
        } else {
          all.push_back(s);
        }
      }
      first = i;
    }
  }
  return all;
}

std::vector<std::vector<SteadyRate>> mounts_of(const PoseInput& input, const std::vector<SteadyRate>& rates,
                                               const std::vector<Pose>& poses, bool outer) {
  Vector3 at_rest = Vector3::Zero();
  for (const Pose& p : poses) {
    at_rest += p.gyro / static_cast<double>(poses.size());
  }
  struct Mount {
    Vector3 response;
    std::vector<SteadyRate> rates;
  };
  constexpr double apart = 0.3;  // rad: more than any misalignment
  std::vector<Mount> mounts;
  for (const SteadyRate& s : rates) {
    if (s.outer != outer) {
      continue;
    }
    const Vector3 response = (s.gyro - at_rest) * (input.gyro_unit / s.rate);
    const auto same = std::find_if(mounts.begin(), mounts.end(), [&](const Mount& m) {
      return poses.empty() || (m.response.normalized() - response.normalized()).norm() < apart;
    });
    if (same == mounts.end()) {
      mounts.push_back({response, {s}});
    } else {
      same->rates.push_back(s);
    }
  }
  std::vector<std::vector<SteadyRate>> all;
  all.reserve(mounts.size());
  for (Mount& m : mounts) {
    all.push_back(std::move(m.rates));
  }
  return all;
}

std::vector<Delay> delays_of_turns(const PoseInput& input, const std::vector<TurnRow>& rows, const ReadOuts& found) {
  std::vector<Delay> delays;
  // Where both axes turn, what the gyros make of each is known only as far as both responses are.
  const auto alone = [](const TurnRow& row) { return row.about_outer() || row.about_inner(); };
  constexpr std::ptrdiff_t enough = 3;
  const bool only_alone = std::count_if(rows.begin(), rows.end(), alone) >= enough;
  for (const TurnRow& row : rows) {
    const bool outer = std::abs(row.outer) > std::abs(row.inner);
    if (axis_called(found, outer) == nullptr || (only_alone && !alone(row))) {
      continue;
    }
    const std::vector<double>& angle = outer ? input.outer : input.inner;
    const Vector3 along =
        row.turned.normalized();  // the axis of this turn: that of the outer one goes with the inner angle
    const double middle = 0.5 * (input.time_s[row.first] + input.time_s[row.last]);
    // First moments. In the poses the gyros would add their noise; the read-out may turn late.
    double by_gyros = 0.0, by_read_out = 0.0;
    for (std::size_t i = row.begins; i < row.ends; ++i) {
      by_gyros += (input.time_s[i] - middle) * along.dot(at(input.gyro, i) - row.bias) * interval(input, i);
    }
    for (std::size_t i = row.first + 1; i <= row.last; ++i) {
      by_read_out += (input.time_s[i] - middle) * (angle[i] - angle[i - 1]);
    }
    const double read_out = by_read_out / (outer ? row.outer : row.inner), gyros = by_gyros / along.dot(row.turned);
    delays.push_back({middle + read_out - input.time_s.front(), read_out - gyros});
  }
  return delays;
}

std::vector<Delay> delays_of_steps(const PoseInput& input, const std::vector<SteadyRate>& rates,
                                   const ReadOuts& found) {
  std::vector<Delay> delays;
  for (std::size_t k = 1; k < rates.size(); ++k) {
    const SteadyRate &a = rates[k - 1], &b = rates[k];
    constexpr double least = 0.05;  // of a rate
    if (a.outer != b.outer || b.first < a.last || std::abs(b.rate - a.rate) < least * std::abs(a.rate)) {
      continue;
    }
    const ReadOutAxis* axis = axis_of_step(input, found, a, b);
    constexpr double other_mount = 0.2;
    if (axis == nullptr || ((b.gyro - a.gyro) * (input.gyro_unit / (b.rate - a.rate)) - axis->response).norm() >
                               other_mount * axis->response.norm()) {
      continue;
    }
    const std::vector<double>& angle = a.outer ? input.outer : input.inner;
    const Vector3 along = axis->response * (input.gyro_unit / axis->response.squaredNorm());
    double turned = 0.0;
    for (std::size_t i = a.last + 1; i <= b.first; ++i) {
      turned += along.dot(at(input.gyro, i) - found.gyro_bias) * interval(input, i);
    }
    const double off = turned - (angle[b.first] - angle[a.last]);
    delays.push_back(
        {0.5 * (input.time_s[a.last] + input.time_s[b.first]) - input.time_s.front(), off / (b.rate - a.rate)});
  }
  return delays;
}

}  // namespace selfcal::diagnosis
