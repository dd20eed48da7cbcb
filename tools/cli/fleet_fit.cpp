#include "tools/cli/fleet_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <thread>

#include "estimator/fleet/fleet_model.hpp"
#include "estimator/fleet/interval.hpp"
#include "estimator/fleet/set_watch.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::cli {
namespace {

using fleet::UnitFilter;
using fleet::UnitHistory;
using hub::Value;

constexpr double seconds_per_year = 365.2425 * 86400.0;
constexpr std::size_t all = static_cast<std::size_t>(sensor_parameter_count);
constexpr double shortest_years = 28.0 / 365.2425;
constexpr double unknown_limit_years = 1.0;  // between calibrations where no limit is known

struct Certificate {
  std::string serial;
  int set = 0;
  double year = 0.0;
  std::vector<double> value, sigma, determined;
};

struct Limits {
  std::array<double, all> change{}, size{};  // 0: none
};

struct Type {
  std::vector<Certificate> certificates;  // by serial, then time
  std::vector<std::string> serials;       // of units
  std::array<std::vector<UnitHistory>, all> histories;
  std::array<fleet::TypeModel, all> models;
  Limits limits;
};

struct Fleet {
  std::map<std::string, Type> types;
  std::vector<std::string> sets;
  std::int64_t arrival = 0;
};

Expected<Fleet> load(hub::Connection& connection) {
  Fleet fleet;
  const auto rows = connection.ask(
      "SELECT u.type, c.serial, c.set_name, extract(epoch FROM c.at), c.value, c.sigma, c.determined::int[], c.arrival "
      "FROM certificates c JOIN units u USING (serial) ORDER BY u.type, c.serial, c.at");
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  std::map<std::string, int> numbers;
  for (int i = 0; i < rows->size(); ++i) {
    const auto [set, fresh] = numbers.try_emplace(rows->text(i, 2), static_cast<int>(fleet.sets.size()));
    if (fresh) {
      fleet.sets.push_back(set->first);
    }
    Certificate one{rows->text(i, 1),  set->second,       rows->real(i, 3) / seconds_per_year,
                    rows->reals(i, 4), rows->reals(i, 5), rows->reals(i, 6)};
    if (one.value.size() != all || one.sigma.size() != all || one.determined.size() != all) {
      return fail(ErrorKind::device, fmt::format("hub {}: a certificate of {} has {} values", connection.place(),
                                                 one.serial, one.value.size()));
    }
    fleet.arrival = std::max(fleet.arrival, rows->integer(i, 7));
    fleet.types[rows->text(i, 0)].certificates.push_back(std::move(one));
  }
  const auto limits = connection.ask("SELECT type, position, coalesce(change, 0), coalesce(size, 0) FROM limits");
  if (!limits) {
    return tl::unexpected(limits.error());
  }
  for (int i = 0; i < limits->size(); ++i) {
    const auto type = fleet.types.find(limits->text(i, 0));
    const auto position = static_cast<std::size_t>(limits->integer(i, 1) - 1);
    if (type != fleet.types.end() && position < all) {
      type->second.limits.change[position] = limits->real(i, 2);
      type->second.limits.size[position] = limits->real(i, 3);
    }
  }
  return fleet;
}

void fit(Type& type, int sets) {
  for (const Certificate& one : type.certificates) {
    if (type.serials.empty() || type.serials.back() != one.serial) {
      type.serials.push_back(one.serial);
      for (auto& histories : type.histories) {
        histories.emplace_back();
      }
    }
    for (std::size_t p = 0; p < all; ++p) {
      if (one.determined[p] != 0.0) {
        type.histories[p].back().push_back({one.set, one.year, one.value[p], one.sigma[p]});
      }
    }
  }
  // A parameter at a time on each core; which core takes which changes no bit.
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t p = next++; p < all; p = next++) {
      type.models[p] = fleet::fit_type(type.histories[p], sets);
    }
  };
  std::vector<std::jthread> cores(std::max(1U, std::thread::hardware_concurrency()));
  std::ranges::generate(cores, [&] { return std::jthread(work); });
}

// One set's last window in one parameter.
struct Standing {
  fleet::SetVerdict verdict;
  int measurements = 0;
};

// In the order of time over all units; leaves each unit's filters where its past ends.
std::vector<std::array<Standing, all>> follow(const Type& type, std::size_t sets,
                                              std::vector<std::vector<UnitFilter>>& filters) {
  std::vector<std::array<Standing, all>> standings(sets);
  for (std::size_t p = 0; p < all; ++p) {
    struct Step {
      std::size_t unit;
      fleet::Measurement measurement;
    };
    std::vector<Step> steps;
    for (std::size_t u = 0; u < type.serials.size(); ++u) {
      const UnitHistory& history = type.histories[p][u];
      filters[u].emplace_back(type.models[p], history.empty() ? 0.0 : history.front().year);
      for (const fleet::Measurement& m : history) {
        steps.push_back({u, m});
      }
    }
    std::ranges::stable_sort(steps, {}, [](const Step& step) { return step.measurement.year; });
    std::vector<fleet::SetWatch> watches(type.models[p].sets.begin(), type.models[p].sets.end());
    for (const Step& step : steps) {
      const auto s = static_cast<std::size_t>(step.measurement.set);
      standings[s][p].verdict =
          watches[s].add(static_cast<int>(step.unit), filters[step.unit][p].add(step.measurement));
      ++standings[s][p].measurements;
    }
  }
  return standings;
}

Value number(double value) { return fmt::format("{:.17g}", value); }
Value instant(double year) { return fmt::format("{:.3f}", year * seconds_per_year); }

Expected<void> store_models(hub::Connection& connection, const std::string& id, const std::string& name,
                            const Type& type) {
  for (std::size_t p = 0; p < all; ++p) {
    const fleet::TypeModel& m = type.models[p];
    const auto done = connection.ask(
        "INSERT INTO type_models(fit, type, position, mean, ramp_per_year, unit_sd, ramp_sd, walk_sd, setup_sd, "
        "set_sd, settling, settling_sd, wander_sd, return_years, jumps_per_year, jump_sd) VALUES "
        "($1,$2,$3,$4,$5,$6,$7,$8,$9,$10,$11,$12,$13,$14,$15,$16)",
        {id, name, std::to_string(p + 1), number(m.mean), number(m.ramp_per_year), number(m.unit_sd), number(m.ramp_sd),
         number(m.walk_sd), number(m.setup_sd), number(m.set_sd), number(m.settling), number(m.settling_sd),
         number(m.wander_sd), number(m.return_years), number(m.jumps_per_year), number(m.jump_sd)});
    if (!done) {
      return tl::unexpected(done.error());
    }
  }
  return {};
}

Expected<int> store_sets(hub::Connection& connection, const std::string& id, const std::string& name,
                         const Fleet& fleet, const Type& type, const std::vector<std::array<Standing, all>>& standings,
                         double rate) {
  double first = type.certificates.front().year, last = first;
  for (const Certificate& one : type.certificates) {
    first = std::min(first, one.year);
    last = std::max(last, one.year);
  }
  int accused = 0;
  for (std::size_t s = 0; s < fleet.sets.size(); ++s) {
    bool any = false;
    for (std::size_t p = 0; p < all; ++p) {
      const Standing& standing = standings[s][p];
      if (standing.measurements == 0) {
        continue;
      }
      const double a_year = standing.measurements / std::max(1.0, last - first);
      // Of late, or always.
      const double always = fleet::standing_offset_z(type.models[p], static_cast<int>(s));
      const bool beyond =
          std::abs(standing.verdict.z) > fleet::accusation_limit(rate, sensor_parameter_count, a_year) ||
          std::abs(always) > fleet::accusation_limit(rate, sensor_parameter_count, 0.0);
      any = any || beyond;
      const fleet::SetOffset& offset = type.models[p].sets[s];
      const auto done = connection.ask("INSERT INTO set_offsets VALUES ($1,$2,$3,$4,$5,$6,$7,$8,$9,$10)",
                                       {id, fleet.sets[s], name, std::to_string(p + 1), number(offset.value),
                                        number(offset.sigma), number(standing.verdict.bias), number(standing.verdict.z),
                                        std::to_string(standing.verdict.units), beyond ? "t" : "f"});
      if (!done) {
        return tl::unexpected(done.error());
      }
    }
    accused += any ? 1 : 0;
  }
  return accused;
}

struct Due {
  double years = 0.0;
  std::optional<std::size_t> parameter;
};

// The interval of all parameters together, and which of them alone asks for the shortest.
Due due_of(const Type& type, const Certificate& last, const std::vector<UnitFilter>& filters,
           const FitOptions& options) {
  std::vector<fleet::Watched> watched;
  Due due{unknown_limit_years, std::nullopt};
  double shortest = options.longest_years;
  for (std::size_t p = 0; p < all; ++p) {
    if (type.limits.change[p] > 0.0) {
      watched.push_back({&filters[p], last.value[p], type.limits.change[p]});
      const double alone = fleet::interval_years(std::span(&watched.back(), 1), last.year, options.risk, shortest_years,
                                                 options.longest_years);
      if (alone < shortest) {
        shortest = alone;
        due.parameter = p;
      }
    }
  }
  if (!watched.empty()) {
    due.years = fleet::interval_years(watched, last.year, options.risk, shortest_years, options.longest_years);
  }
  return due;
}

// When the expected value passes its size, looked for month by month in the next twenty years; nothing where it does not.
std::optional<std::pair<double, std::size_t>> passes_of(const Type& type, double year,
                                                        const std::vector<UnitFilter>& filters) {
  std::optional<std::pair<double, std::size_t>> first;
  int months = 240;
  for (std::size_t p = 0; p < all; ++p) {
    const fleet::UnitState now = filters[p].at(year);
    const double size = type.limits.size[p];
    // A drift is one beyond two of its sigmas.
    if (!(size > 0.0) || std::abs(now.slope()) < 2.0 * now.slope_sigma()) {
      continue;
    }
    for (int k = 0; k < months; ++k) {
      const double when = year + k / 12.0;
      if (std::abs(filters[p].at(when).value()) >= size) {
        first = {when, p};
        months = k;
      }
    }
  }
  return first;
}

Expected<void> store_unit(hub::Connection& connection, const std::string& id, const Type& type, const Certificate& last,
                          const std::vector<UnitFilter>& filters, const FitOptions& options) {
  const Due due = due_of(type, last, filters, options);
  const auto passes = passes_of(type, last.year, filters);
  std::vector<double> level, level_sigma, next, next_sigma, ramp, ramp_sigma;
  for (std::size_t p = 0; p < all; ++p) {
    const fleet::UnitState now = filters[p].at(last.year), then = filters[p].at(last.year + due.years);
    level.push_back(now.value());
    level_sigma.push_back(now.sigma());
    next.push_back(then.value());
    next_sigma.push_back(std::sqrt(filters[p].variance_of_measurement(then.year, last.sigma[p])));
    ramp.push_back(now.slope());
    ramp_sigma.push_back(now.slope_sigma());
  }
  const auto position = [](std::size_t p) { return std::to_string(p + 1); };
  const auto done = connection.ask(
      "INSERT INTO forecasts VALUES "
      "($1,$2,to_timestamp($3),to_timestamp($4),$5,$6,$7,$8,$9,$10,$11,to_timestamp($12),$13)",
      {id, last.serial, instant(last.year), instant(last.year + due.years),
       due.parameter ? Value(position(*due.parameter)) : Value(), hub::sql_array(level), hub::sql_array(level_sigma),
       hub::sql_array(next), hub::sql_array(next_sigma), hub::sql_array(ramp), hub::sql_array(ramp_sigma),
       passes ? instant(passes->first) : Value(), passes ? Value(position(passes->second)) : Value()});
  if (!done) {
    return tl::unexpected(done.error());
  }
  return {};
}

Expected<int> store_type(hub::Connection& connection, const std::string& id, const std::string& name,
                         const Fleet& fleet, const Type& type, const FitOptions& options) {
  std::vector<std::vector<UnitFilter>> filters(type.serials.size());
  const auto standings = follow(type, fleet.sets.size(), filters);
  if (auto ok = store_models(connection, id, name, type); !ok) {
    return tl::unexpected(ok.error());
  }
  auto accused = store_sets(connection, id, name, fleet, type, standings, options.false_accusation);
  if (!accused) {
    return accused;
  }
  std::size_t unit = 0;
  for (std::size_t i = 0; i < type.certificates.size(); ++i) {
    if (i + 1 < type.certificates.size() && type.certificates[i + 1].serial == type.certificates[i].serial) {
      continue;
    }
    if (auto ok = store_unit(connection, id, type, type.certificates[i], filters[unit], options); !ok) {
      return tl::unexpected(ok.error());
    }
    ++unit;
  }
  return accused;
}

Expected<FitCounts> store(hub::Connection& connection, const Fleet& fleet, const FitOptions& options) {
  if (auto ok = connection.execute("BEGIN; LOCK TABLE fits IN SHARE ROW EXCLUSIVE MODE; DELETE FROM fits"); !ok) {
    return tl::unexpected(ok.error());
  }
  const auto id = connection.ask("INSERT INTO fits(software, arrival) VALUES ($1, $2) RETURNING id",
                                 {SELFCAL_VERSION, std::to_string(fleet.arrival)});
  if (!id) {
    return tl::unexpected(id.error());
  }
  FitCounts counts;
  counts.types = fleet.types.size();
  counts.sets = fleet.sets.size();
  for (const auto& [name, type] : fleet.types) {
    const auto accused = store_type(connection, id->text(0, 0), name, fleet, type, options);
    if (!accused) {
      return tl::unexpected(accused.error());
    }
    counts.accused += *accused;
    counts.certificates += type.certificates.size();
    counts.units += type.serials.size();
  }
  if (auto ok = connection.execute("COMMIT"); !ok) {
    return tl::unexpected(ok.error());
  }
  return counts;
}

}  // namespace

Expected<FitCounts> fit_fleet(hub::Connection& connection, const FitOptions& options) {
  auto fleet = load(connection);
  if (!fleet) {
    return tl::unexpected(fleet.error());
  }
  for (auto& [name, type] : fleet->types) {
    fit(type, static_cast<int>(fleet->sets.size()));
  }
  auto counts = store(connection, *fleet, options);
  if (!counts) {
    (void)connection.execute("ROLLBACK");
  }
  return counts;
}

}  // namespace selfcal::cli
