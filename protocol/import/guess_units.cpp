#include "protocol/import/guess_units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <iterator>

namespace selfcal::import {
namespace {

constexpr double gravity = 9.807;  // m/s^2; normal gravity differs by 0.3 %

struct Tolerance {
  double match;  // ln: calibration errors
  double rival;  // ln: another unit as near as that cannot be told apart
};

// Hardly anybody writes an IMU's data so: only where a name says it, or where nothing else is as near.
bool is_rare(std::string_view unit) {
  return unit == "cm/s^2" || unit == "mm/s^2" || unit == "mGal" || unit == "rpm" || unit == "arcmin" ||
         unit == "rad/h" || unit == "mdeg/s" || unit == "cm/s" || unit == "mg*s";
}

std::string words(const UnitFit& fit) {
  return fmt::format("{} ({})", fit.unit, fit.increments ? "increments" : "rates");
}

// EXPECTED of a unit is what it would be multiplied by; SEEN is what the numbers want.
std::optional<UnitFit> best_unit(double seen, double interval_s, const UnitClaim& claim, Quantity rate,
                                 Quantity increment, const Tolerance& tolerance) {
  std::vector<UnitFit> fits;
  for (const Unit& unit : known_units()) {
    const bool increments = unit.quantity == increment;
    if ((unit.quantity != rate && !increments) || (!claim.unit.empty() && claim.unit != unit.name) ||
        (claim.unit.empty() && claim.increments && !increments)) {
      continue;
    }
    const double factor = increments ? unit.si : unit.si * interval_s;
    const double off = std::abs(std::log(seen / factor));
    const bool known = std::any_of(fits.begin(), fits.end(), [&](const UnitFit& f) {
      return f.increments == increments && std::abs(f.off - off) < 1e-9;  // deg/h and arcsec/s are one
    });
    if (off < 2.0 * tolerance.match && !known) {
      fits.push_back({std::string(unit.name), increments, off, {}});
    }
  }
  std::sort(fits.begin(), fits.end(), [](const UnitFit& a, const UnitFit& b) { return a.off < b.off; });
  if (fits.empty() || fits.front().off > tolerance.match) {
    return std::nullopt;
  }
  const auto usual = std::find_if(fits.begin(), fits.end(), [](const UnitFit& f) { return !is_rare(f.unit); });
  UnitFit best = usual != fits.end() && usual->off <= tolerance.match ? *usual : fits.front();
  // Who writes increments says so, as a rule.
  const auto rates = std::find_if(fits.begin(), fits.end(), [&](const UnitFit& f) {
    return !f.increments && !is_rare(f.unit) && f.off < tolerance.match &&
           f.off < std::max(tolerance.rival, 3.0 * best.off);
  });
  if (best.increments && !claim.increments && claim.unit.empty() && rates != fits.end()) {
    best = *rates;
  }
  for (const UnitFit& fit : fits) {
    const bool other = fit.unit != best.unit || fit.increments != best.increments;
    if (other && fit.off < (is_rare(fit.unit) ? best.off : std::max(tolerance.rival, 3.0 * best.off))) {
      best.rivals.push_back(words(fit));
    }
  }
  return best;
}

// Those of NAMES that make a rate from LOWEST to HIGHEST, the most usual one first.
std::vector<std::string> units_by_rate(double interval, std::initializer_list<const char*> names, double lowest,
                                       double highest) {
  struct Way {
    std::string unit;
    double strangeness;
  };
  std::vector<Way> ways;
  ways.reserve(names.size());
  for (const char* name : names) {
    const double rate = 1.0 / (interval * find_unit(name).value_or(Unit{{}, Quantity::time, 1.0}).si);
    constexpr double usual = 150.0;
    if (rate > lowest * (1.0 - 1e-3) && rate < highest) {
      ways.push_back({name, std::abs(std::log(rate / usual))});
    }
  }
  std::sort(ways.begin(), ways.end(), [](const Way& a, const Way& b) { return a.strangeness < b.strangeness; });
  std::vector<std::string> units;
  units.reserve(ways.size());
  for (Way& way : ways) {
    units.push_back(std::move(way.unit));
  }
  return units;
}

}  // namespace

std::optional<UnitFit> gyro_unit(double rad_per_sample, double interval_s, const UnitClaim& claim) {
  return best_unit(rad_per_sample, interval_s, claim, Quantity::angular_rate, Quantity::angle, {0.25, 0.06});
}

std::optional<UnitFit> accelerometer_unit(double size, double interval_s, const UnitClaim& claim) {
  return best_unit(gravity * interval_s / size, interval_s, claim, Quantity::acceleration, Quantity::velocity,
                   {0.08, 0.03});
}

double nearness(const TriadColumns& triad) {
  constexpr double of_counts = 0.01, of_numbers = 0.03;
  const bool whole = std::all_of(std::begin(triad.column), std::end(triad.column), [](const auto* values) {
    return std::all_of(values->begin(), values->end(), [](double v) { return v == std::floor(v); });
  });
  return whole ? of_counts : of_numbers;
}

TemperatureFit temperature_unit(double mean, const std::string& claimed, bool whole, bool counts) {
  if (claimed == "C" || claimed == "K" || claimed == "F") {
    const double celsius_of = celsius(mean, claimed);
    const bool fits = celsius_of > -60.0 && celsius_of < 130.0;
    return {claimed,
            fits ? fmt::format("{}, by its name", claimed)
                 : fmt::format("{} by its name: {:.4g} would be {:.4g} C", claimed, mean, celsius_of),
            !fits};
  }
  if (whole && counts) {
    return {"C", fmt::format("{:.4g}: C, or counts as the sensors' are", mean), true};
  }
  if (mean > 200.0) {
    const bool fits = mean < 400.0 && !whole;
    return {"K", fmt::format("{}: {:.4g}", fits ? "K" : "K, or counts", mean), !fits};
  }
  if (mean > -40.0 && mean < 45.0) {
    return {"C", fmt::format("C: {:.4g}", mean), false};
  }
  return {"C", fmt::format("{:.4g}: C, F or counts", mean), true};
}

std::vector<std::string> time_units(double interval) {
  return units_by_rate(interval, {"s", "ms", "us", "ns"}, 1.0, 20000.0);
}

std::vector<std::string> time_units_of(const std::vector<long double>& stamps, double interval) {
  std::vector<std::string> units = time_units(interval);
  if (units.size() < 2 || stamps.empty()) {
    return units;
  }
  const auto seconds_of = [](const std::string& unit) { return static_cast<long double>(find_unit(unit)->si); };
  constexpr long double year_2000 = 946684800.0L, year_2100 = 4102444800.0L;  // s since 1970
  std::vector<std::string> dated;
  std::copy_if(units.begin(), units.end(), std::back_inserter(dated), [&](const std::string& unit) {
    const long double first = stamps.front() * seconds_of(unit);
    return first > year_2000 && first < year_2100;
  });
  if (dated.size() == 1) {
    return dated;
  }
  // Nobody keeps a log that is over within a second. Whole numbers may as well be rows that were counted.
  const bool whole =
      std::all_of(stamps.begin(), stamps.end(), [](long double stamp) { return stamp == std::floor(stamp); });
  const auto lasts = [&](const std::string& unit) {
    return (stamps.back() - stamps.front()) * seconds_of(unit) > 1.0L;
  };
  if (!whole && std::any_of(units.begin(), units.end(), lasts)) {
    std::erase_if(units, [&](const std::string& unit) { return !lasts(unit); });
  }
  return units;
}

std::vector<std::string> xsens_time_units(double interval) {
  return units_by_rate(interval, {"100us", "us"}, 2.0, 5000.0);
}

}  // namespace selfcal::import
