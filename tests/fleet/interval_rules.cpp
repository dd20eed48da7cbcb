#include "tests/fleet/interval_rules.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/fleet/interval.hpp"
#include "tests/fleet/oracle.hpp"

namespace selfcal::fleet {
namespace {

constexpr double sigma = 1.0;                   // of a calibration: all is in units of it
constexpr double look_years = 2.0 / 365.2425;   // at the truth: a fast part must not hide between two looks
constexpr double plan_years = 14.0 / 365.2425;  // steps in which an oracle looks ahead
constexpr double shortest_years = 28.0 / 365.2425, least_years = 0.1, most_years = 5.0;

class FixedYear : public IntervalRule {
 public:
  double next_years(const Calibration&) override { return 1.0; }
};

// Longer where the unit was within 80 % of its limits, shorter where it was out.
class Staircase : public IntervalRule {
 public:
  explicit Staircase(double limit) : limit_(limit) {}
  double next_years(const Calibration& now) override {
    double change = 0.0;
    for (std::size_t p = 0; p < now.previous.size(); ++p) {
      change = std::max(change, std::abs(now.found[p] - now.previous[p]));
    }
    const double factor = now.before == 0.0 ? 1.0 : change > limit_ ? 0.6 : change > 0.8 * limit_ ? 1.0 : 1.25;
    years_ = std::clamp(years_ * factor, least_years, most_years);
    return years_;
  }

 private:
  double limit_, years_ = 1.0;
};

// Of each parameter the last five changes; their mean rate is its drift, their spread about it its stability. The next interval is
// the time after which the drift and twice the spread reach the limit, at most half as long again and at least half as long as
// the one before.
class ControlChart : public IntervalRule {
 public:
  explicit ControlChart(double limit) : limit_(limit) {}
  double next_years(const Calibration& now) override {
    last_.resize(now.found.size());
    if (now.before == 0.0) {
      return years_;
    }
    double least = 1.5 * years_;
    for (std::size_t p = 0; p < last_.size(); ++p) {
      auto& changes = last_[p];
      changes.emplace_back(now.found[p] - now.previous[p], now.before);
      if (changes.size() > 5) {
        changes.erase(changes.begin());
      }
      least = std::min(least, reached_after(changes));
    }
    years_ = std::clamp(least, std::max(least_years, 0.5 * years_), most_years);
    return years_;
  }

 private:
  double reached_after(const std::vector<std::pair<double, double>>& changes) const {
    double change = 0.0, time = 0.0, spread = 0.0;
    for (const auto& [c, t] : changes) {
      change += c;
      time += t;
    }
    for (const auto& [c, t] : changes) {
      spread += std::pow(c - change / time * t, 2);
    }
    spread = std::sqrt(spread / std::max<double>(1.0, static_cast<double>(changes.size()) - 1.0));
    return std::max(0.0, limit_ - 2.0 * spread) / std::max(1e-9, std::abs(change / time));
  }

  double limit_, years_ = 1.0;
  std::vector<std::vector<std::pair<double, double>>> last_;
};

class ByForecast : public IntervalRule {
 public:
  ByForecast(const std::vector<TypeModel>& models, double limit, double risk) : limit_(limit), risk_(risk) {
    for (const TypeModel& model : models) {
      filters_.emplace_back(model, 0.0);
      set_sd_.push_back(model.set_sd);
    }
  }
  double next_years(const Calibration& now) override {
    std::vector<Watched> watched;
    for (std::size_t p = 0; p < filters_.size(); ++p) {
      filters_[p].add({0, now.year, now.found[p], std::hypot(sigma, set_sd_[p])});
      watched.push_back({&filters_[p], now.found[p], limit_});
    }
    return interval_years(watched, now.year, risk_, shortest_years, most_years);
  }

 private:
  double limit_, risk_;
  std::vector<UnitFilter> filters_;
  std::vector<double> set_sd_;
};

class Oracle : public IntervalRule {
 public:
  Oracle(const Nature& nature, std::size_t parameters, double limit, double rate, bool truth)
      : noise_(sigma * sigma + nature.setup * nature.setup + nature.sets * nature.sets),
        limit_(limit),
        rate_(rate),
        truth_(truth),
        filters_(parameters, LawFilter(nature)) {}
  double next_years(const Calibration& now) override {
    for (std::size_t p = 0; p < filters_.size(); ++p) {
      if (truth_) {
        filters_[p].know(now.year, (*now.truth)[p].parts());
      } else {
        filters_[p].add(now.year, now.found[p], noise_);
      }
    }
    double years = shortest_years;
    for (int step = 1; years < most_years; ++step) {
      double rate = 0.0;
      for (std::size_t p = 0; p < filters_.size(); ++p) {
        rate += leaving_rate(filters_[p].departure(now.year + years, now.found[p]), limit_);
      }
      if (rate > rate_) {
        break;
      }
      years = shortest_years + step * plan_years;
    }
    return years;
  }

 private:
  double noise_, limit_, rate_;
  bool truth_;
  std::vector<LawFilter> filters_;
};

}  // namespace

MakeRule fixed_year() {
  return [] { return std::make_unique<FixedYear>(); };
}
MakeRule staircase(double limit) {
  return [=] { return std::make_unique<Staircase>(limit); };
}
MakeRule control_chart(double limit) {
  return [=] { return std::make_unique<ControlChart>(limit); };
}
MakeRule by_forecast(const std::vector<TypeModel>& models, double limit, double risk) {
  return [&models, limit, risk] { return std::make_unique<ByForecast>(models, limit, risk); };
}
MakeRule oracle(const Nature& nature, std::size_t parameters, double limit, double rate, bool truth) {
  return [&nature, parameters, limit, rate, truth] {
    return std::make_unique<Oracle>(nature, parameters, limit, rate, truth);
  };
}

Outcome live(int units, double years, const Nature& nature, std::size_t parameters, double limit, std::uint64_t seed,
             int which, const MakeRule& make) {
  Outcome outcome;
  for (int unit = 0; unit < units; ++unit) {
    std::mt19937_64 random(seed + static_cast<std::uint64_t>(unit));
    std::mt19937_64 noise(seed + 7919u * static_cast<std::uint64_t>(unit) + static_cast<std::uint64_t>(which));
    std::normal_distribution<double> normal;
    std::vector<AgeingValue> truth;
    for (std::size_t p = 0; p < parameters; ++p) {
      truth.emplace_back(nature, random);
    }
    const auto rule = make();
    Calibration now{.found = std::vector<double>(parameters), .previous = {}, .truth = &truth};
    double due = 0.0;
    bool left = false, first = true;
    for (int k = 0; k * look_years < years; ++k) {
      const double year = k * look_years;
      bool beyond = false;
      std::vector<double> value(parameters);
      for (std::size_t p = 0; p < parameters; ++p) {
        value[p] = truth[p].at(year);
        beyond = beyond || (!first && std::abs(value[p] - now.found[p]) > limit);
      }
      left = left || beyond;
      outcome.looks += first ? 0 : 1;
      outcome.beyond += beyond ? 1 : 0;
      if (year < due) {
        continue;
      }
      now.previous = first ? std::vector<double>{} : now.found;
      now.before = first ? 0.0 : year - now.year;
      now.year = year;
      for (std::size_t p = 0; p < parameters; ++p) {
        now.found[p] = value[p] + nature.setup * normal(noise) + nature.sets * normal(noise) + sigma * normal(noise);
      }
      ++outcome.calibrations;
      outcome.intervals += first ? 0 : 1;
      outcome.left += left ? 1 : 0;
      due = year + rule->next_years(now);
      first = left = false;
    }
  }
  return outcome;
}

}  // namespace selfcal::fleet
