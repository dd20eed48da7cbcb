#include "tests/fleet/interval_rules.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace selfcal::fleet {
namespace {

constexpr double sigma = 1.0;  // of a calibration: all is in units of it

// ILAC-G24, method 2: of each parameter the last five changes; their mean rate is its drift, their spread about it its stability.
// The next interval is the time after which the drift and twice the spread reach the limit, at most half as long again and at
// least half as long as the one before.
class ControlChart {
 public:
  explicit ControlChart(std::size_t parameters) : last_(parameters) {}
  void add(std::size_t parameter, double change, double interval_years) {
    auto& changes = last_[parameter];
    changes.push_back({change, interval_years});
    if (changes.size() > 5) {
      changes.erase(changes.begin());
    }
  }
  double interval(double limit, double before) const {
    double least = 1.5 * before;
    for (const auto& changes : last_) {
      double change = 0.0, time = 0.0, spread = 0.0;
      for (const auto& [c, t] : changes) {
        change += c;
        time += t;
      }
      for (const auto& [c, t] : changes) {
        spread += std::pow(c - change / time * t, 2);
      }
      spread = std::sqrt(spread / std::max<double>(1.0, static_cast<double>(changes.size()) - 1.0));
      least = std::min(least, std::max(0.0, limit - 2.0 * spread) / std::max(1e-9, std::abs(change / time)));
    }
    return std::clamp(least, std::max(0.1, 0.5 * before), 5.0);
  }

 private:
  std::vector<std::vector<std::pair<double, double>>> last_;
};

}  // namespace

void live(int units, double years, const Nature& nature, const std::vector<TypeModel>& models, double limit,
          double risk, std::uint64_t seed, Rule& rule, int which) {
  constexpr double look = 14.0 / 365.2425;
  for (int unit = 0; unit < units; ++unit) {
    std::mt19937_64 random(seed + static_cast<std::uint64_t>(unit));
    std::mt19937_64 noise(seed + 7919u * static_cast<std::uint64_t>(unit) + static_cast<std::uint64_t>(which));
    std::normal_distribution<double> normal;
    std::vector<AgeingValue> truth;
    std::vector<UnitFilter> filters;
    for (const TypeModel& model : models) {
      truth.emplace_back(nature, random);
      filters.emplace_back(model, 0.0);
    }
    std::vector<double> measured(models.size()), value(models.size());
    ControlChart chart(models.size());
    double due = 0.0, last = 0.0, interval = 1.0;
    bool left = false, first = true;
    for (int k = 0; k * look < years; ++k) {
      const double year = k * look;
      bool beyond = false;
      for (std::size_t p = 0; p < models.size(); ++p) {
        value[p] = truth[p].at(year);
        beyond = beyond || (!first && std::abs(value[p] - measured[p]) > limit);
      }
      left = left || beyond;
      if (year < due) {
        continue;
      }
      bool out = false, near_limit = false;
      for (std::size_t p = 0; p < models.size(); ++p) {
        const double found =
            value[p] + nature.setup * normal(noise) + nature.sets * normal(noise) + sigma * normal(noise);
        out = out || (!first && std::abs(found - measured[p]) > limit);
        if (!first) {
          chart.add(p, found - measured[p], year - last);
        }
        near_limit = near_limit || (!first && std::abs(found - measured[p]) > 0.8 * limit);
        measured[p] = found;
        Measurement m{0, year, found, std::hypot(sigma, nature.sets)};
        filters[p].add(m);
      }
      ++rule.calibrations;
      if (!first) {
        ++rule.intervals;
        rule.left += left ? 1 : 0;
      }
      if (which == 3) {
        interval = first ? interval : chart.interval(limit, interval);
      } else if (which ==
                 1) {  // ILAC-G24, method 1: longer where it was within 80 % of its limits, shorter where it was out
        interval = std::clamp(interval * (first ? 1.0 : out ? 0.6 : near_limit ? 1.0 : 1.25), 0.1, 5.0);
      } else if (which == 2) {
        std::vector<Watched> parameters;
        for (std::size_t p = 0; p < models.size(); ++p) {
          parameters.push_back({&filters[p], measured[p], limit});
        }
        interval = interval_years(parameters, year, risk, 4 * look, 5.0);
      }
      first = false;
      left = false;
      last = year;
      due = last + interval;
    }
  }
}

}  // namespace selfcal::fleet
