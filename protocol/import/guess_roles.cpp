#include "protocol/import/guess_roles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iterator>

#include "estimator/geometry/units.hpp"
#include "protocol/import/gravity_columns.hpp"
#include "protocol/import/guess_axes.hpp"
#include "protocol/import/guess_time.hpp"
#include "protocol/import/guess_time_column.hpp"
#include "protocol/import/guess_units.hpp"
#include "protocol/import/name_words.hpp"
#include "protocol/import/table_read_outs.hpp"
#include "protocol/import/time_steps.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::import {
namespace {

class Assigner {
 public:
  Assigner(const ColumnSource& source, const std::vector<NamedColumn>& named, const Values& values,
           const std::vector<bool>& lost, bool rate_is_given, std::vector<Remark>& remarks)
      : source_(source),
        named_(named),
        values_(values),
        lost_(lost),
        rate_is_given_(rate_is_given),
        remarks_(remarks),
        used_(values.size(), false) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      used_[k] = !all_finite(values[k]);  // of no use
    }
  }

  Roles assign() {
    find_time();
    roles_.gyro = triad_by_name(Role::gyro, "gyro.columns");
    roles_.accelerometer = triad_by_name(Role::accelerometer, "accelerometer.columns");
    find_gimbal_by_name();
    for (std::size_t k = 0; k < named_.size(); ++k) {
      if (named_[k].role == Role::temperature && !used_[k]) {
        take(k);
        roles_.temperature.push_back(k);
        say("temperature.columns", fmt::format("{}, by its name", source_.title(k)));
      } else if (named_[k].role == Role::counter || named_[k].role == Role::other) {
        used_[k] = true;
      }
    }
    find_accelerometers();
    find_gyros();
    find_gimbal();
    tell_unused();
    return std::move(roles_);
  }

 private:
  void say(const char* key, std::string text) { remarks_.push_back({key, std::move(text), false}); }
  void doubt(const char* key, std::string text) { remarks_.push_back({key, std::move(text), true}); }
  void doubt_if_new(const char* key, std::string text) {
    if (std::none_of(remarks_.begin(), remarks_.end(), [key](const Remark& r) { return r.doubt && r.key == key; })) {
      doubt(key, std::move(text));
    }
  }
  void take(std::size_t column) {
    used_[column] = true;
    taken_.push_back(column);
  }

  void find_time() {
    FoundTime found = find_time_column(source_, named_, values_, lost_, rate_is_given_);
    std::move(found.remarks.begin(), found.remarks.end(), std::back_inserter(remarks_));
    roles_.clock_words = std::move(found.clock_words);
    if (found.column) {
      roles_.time = found.column;
      roles_.time_is_date = found.is_date;
      roles_.stamps = std::move(found.stamps);
      take(*found.column);
    }
    for (std::size_t k = 0; k < values_.size() && rate_is_given_; ++k) {
      used_[k] = used_[k] || counts_by_one({values_[k].begin(), values_[k].end()});
    }
  }

  // The first x, y and z that are named so, the second ones, and so on. `several`: there are more of some than of all.
  std::vector<Triad> triads_by_name(Role role, bool& several) const {
    std::array<std::vector<std::size_t>, 3> found;
    for (std::size_t k = 0; k < named_.size(); ++k) {
      if (named_[k].role == role && named_[k].axis >= 0 && !used_[k]) {
        found.at(static_cast<std::size_t>(named_[k].axis)).push_back(k);
      }
    }
    const std::size_t most = std::max({found[0].size(), found[1].size(), found[2].size()});
    std::vector<Triad> triads(std::min({found[0].size(), found[1].size(), found[2].size()}));
    for (std::size_t k = 0; k < triads.size(); ++k) {
      triads[k] = {found[0][k], found[1][k], found[2][k]};
    }
    several = most > 1;
    return triads;
  }
  // A column that is named so and of no use, for many lines lack its number.
  void doubt_incomplete(Role role, const char* key) {
    for (std::size_t k = 0; k < named_.size(); ++k) {
      const auto lacks =
          std::count_if(values_[k].begin(), values_[k].end(), [](double v) { return !std::isfinite(v); });
      if (named_[k].role == role && named_[k].axis >= 0 && lacks > 0) {
        return doubt(key, fmt::format("{} is named so, but {} of {} lines lack its number: take them out of the file",
                                      source_.title(k), lacks, values_[k].size()));
      }
    }
  }

  std::optional<Triad> triad_by_name(Role role, const char* key) {
    bool several = false;
    std::vector<Triad> triads = triads_by_name(role, several);
    if (triads.empty()) {
      doubt_incomplete(role, key);
      return std::nullopt;
    }
    // A phone's "linear acceleration" is without gravity.
    const std::size_t named_so = triads.size();
    if (role == Role::accelerometer && named_so > 1) {
      std::vector<Triad> heavy = triads;
      std::erase_if(heavy, [this](const Triad& triad) {
        const auto size = size_of_triad(values_, triad, block());
        return !size || size->scatter > most_scatter_of_gravity;
      });
      if (heavy.size() == 1) {
        triads = heavy;
        several = false;
      }
    }
    const auto raw = raw_one_of(source_.names(), triads);
    const Triad triad = triads[several && raw ? *raw : 0];
    for (const std::size_t k : triad) {
      take(k);
    }
    const std::string which =
        fmt::format("{}, {}, {}", source_.title(triad[0]), source_.title(triad[1]), source_.title(triad[2]));
    const char* words = several && raw ? ": of several the sensor's own by its name"
                        : several      ? ": the first of several that are named so"
                        : named_so > 1 ? ": of several that are named so the only ones of gravity's size throughout"
                                       : ", by their names";
    remarks_.push_back({key, which + words, several});
    return triad;
  }

  void find_gimbal_by_name() {
    std::optional<std::size_t> outer;
    std::optional<std::size_t> inner;
    std::vector<std::size_t> plain;
    for (std::size_t k = 0; k < named_.size(); ++k) {
      if (used_[k]) {
        continue;
      }
      outer = named_[k].role == Role::outer && !outer ? k : outer;
      inner = named_[k].role == Role::inner && !inner ? k : inner;
      if (named_[k].role == Role::gimbal) {
        plain.push_back(k);
      }
    }
    if (outer && inner) {
      roles_.gimbal = {*outer, *inner};
      roles_.gimbal_named = true;
    } else if (plain.size() == 2 && !outer && !inner) {
      roles_.gimbal = {plain[0], plain[1]};
    }
    if (roles_.gimbal) {
      take((*roles_.gimbal)[0]);
      take((*roles_.gimbal)[1]);
    }
  }

  // Runs of three free columns side by side.
  std::vector<Triad> free_triads() const {
    std::vector<Triad> all;
    for (std::size_t k = 0; k + 2 < values_.size(); ++k) {
      if (!used_[k] && !used_[k + 1] && !used_[k + 2]) {
        all.push_back({k, k + 1, k + 2});
      }
    }
    return all;
  }

  // Samples of a block: a turn takes some seconds, and a recording a thousand of them.
  std::size_t block() const { return std::clamp<std::size_t>(values_.front().size() / 2000, 2, 25); }

  // What an interval of the time may be in s.
  std::vector<double> intervals_s() const {
    std::vector<double> all;
    if (roles_.time && roles_.stamps.size() > 1) {
      const auto interval = static_cast<double>(median_interval(roles_.stamps));
      if (roles_.time_is_date) {
        return {interval};
      }
      for (const std::string& unit : time_units_of(roles_.stamps, interval)) {
        all.push_back(interval * find_unit(unit)->si);
      }
    }
    return all;
  }

  void find_accelerometers() {
    if (roles_.accelerometer) {
      return;
    }
    const auto found = gravity_columns(values_, free_triads(), block(), intervals_s());
    if (!found) {
      doubt_if_new("gyro.columns", "not looked for: without accelerometers nothing shows them");
      return doubt_if_new("accelerometer.columns", "no three columns side by side of a constant size, as gravity has");
    }
    roles_.accelerometer = found->triad;
    accelerometers_to_show_ = found->moves;
    if (found->is_direction) {
      doubt("accelerometer.columns",
            "their size has no noise: a direction, as a filter makes it of all sensors (a phone's \"gravity\")");
    }
    if (found->alike > 1) {
      doubt("accelerometer.columns",
            fmt::format("{} sets of three columns side by side have a constant size, as gravity has", found->alike));
    }
    for (const std::size_t k : *roles_.accelerometer) {
      take(k);
    }
    say("accelerometer.columns",
        fmt::format("columns {} to {}: their size is constant within {:.2g} %{}", roles_.accelerometer->front() + 1,
                    roles_.accelerometer->back() + 1, 100.0 * found->scatter,
                    found->words.empty() ? ", as gravity's is" : ": " + found->words));
  }

  // Whether none of three columns stands still throughout.
  bool varies(const Triad& triad) const {
    return std::none_of(triad.begin(), triad.end(), [this](std::size_t k) { return is_constant(values_[k]); });
  }

  // What turns the specific force.
  void find_gyros() {
    if (roles_.gyro || !roles_.accelerometer) {
      return;
    }
    struct Candidate {
      Triad triad;
      double explained, gimbal, contrast;
    };
    std::vector<Candidate> candidates;
    const std::vector<Triad> free = free_triads();
    double best = 0.3;
    for (const auto& triad : free) {
      const Motion motion = find_motion(triad_columns(values_, triad), triad_columns(values_, *roles_.accelerometer),
                                        std::nullopt, block());
      const auto fit = motion.turns ? gyros_by_gravity(motion) : std::nullopt;
      if (fit && fit->explained > 0.3) {
        const auto pair = roles_.gimbal ? std::nullopt : best_gimbal(triad);
        candidates.push_back({triad, fit->explained, pair ? pair->score : 0.0, least_contrast(motion)});
        best = std::max(best, fit->explained);
      }
    }
    // Turns about the vertical are not seen so: two gyros and a stranger may explain as much. What leaves a gimbal that fits
    // is right; else, a gyro turns and rests.
    std::erase_if(candidates, [best](const Candidate& c) { return c.explained < best - 0.05; });
    if (std::any_of(candidates.begin(), candidates.end(), [this](const Candidate& c) { return varies(c.triad); })) {
      std::erase_if(candidates, [this](const Candidate& c) { return !varies(c.triad); });
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
      return std::abs(a.gimbal - b.gimbal) > 0.02 ? a.gimbal > b.gimbal : a.contrast > b.contrast;
    });
    if (!candidates.empty()) {
      roles_.gyro = candidates.front().triad;
      if (candidates.size() > 1 && candidates[0].gimbal == 0.0) {
        doubt("gyro.columns", fmt::format("columns {} to {} explain the turning of the specific force as well",
                                          candidates[1].triad.front() + 1, candidates[1].triad.back() + 1));
      }
    }
    if (roles_.gyro) {
      say("gyro.columns", fmt::format("columns {} to {}: they explain {:.0f} % of how the specific force turns",
                                      roles_.gyro->front() + 1, roles_.gyro->back() + 1, 100.0 * best));
    } else if (!free.empty()) {
      roles_.gyro = nearest_zero(values_, free);
      doubt("gyro.columns", fmt::format("columns {} to {}: three that are free; nothing shows that they are gyros",
                                        roles_.gyro->front() + 1, roles_.gyro->back() + 1));
      if (accelerometers_to_show_) {
        doubt_if_new("accelerometer.columns", "they turn, and no three columns beside them turn them, as gyros would");
      }
    } else {
      return doubt("gyro.columns", "no three columns side by side are left");
    }
    for (const std::size_t k : *roles_.gyro) {
      take(k);
    }
  }

  struct GimbalPair {
    std::array<std::size_t, 2> columns{};
    double score = 0.0;
  };
  // Two free columns side by side, none of GYRO's, whose angles the accelerometers and the gyros bear out.
  std::optional<GimbalPair> best_gimbal(const std::array<std::size_t, 3>& gyro) const {
    constexpr double good_gravity = 0.98;  // as guess_orientation wants them
    constexpr double good_turns = 0.95;
    std::optional<GimbalPair> best;
    const auto is_free = [&](std::size_t k) {
      return !used_[k] && !is_rate(k) && std::find(gyro.begin(), gyro.end(), k) == gyro.end();
    };
    for (std::size_t k = 0; k + 1 < values_.size(); ++k) {
      if (!is_free(k) || !is_free(k + 1)) {
        continue;
      }
      for (const double unit : {units::degree, 1.0}) {
        std::array<std::vector<double>, 2> angle{values_[k], values_[k + 1]};
        for (auto& column : angle) {
          std::transform(column.begin(), column.end(), column.begin(), [unit](double v) { return v * unit; });
        }
        const Motion motion =
            find_motion(triad_columns(values_, gyro), triad_columns(values_, *roles_.accelerometer), angle, block());
        const std::vector<Rest> rests = rests_of(motion);
        for (const bool swapped : {false, true}) {
          const auto gravity = accelerometers_by_gimbal(rests, swapped);
          const auto turns = gyros_by_gimbal(motion, turns_of(motion, rests), swapped);
          if (gravity && turns && gravity->explained > good_gravity && turns->explained > good_turns &&
              (!best || gravity->explained + turns->explained > best->score)) {
            best = {{k, k + 1}, gravity->explained + turns->explained};
          }
        }
      }
    }
    return best;
  }

  void find_gimbal() {
    if (roles_.gimbal || !roles_.gyro || !roles_.accelerometer) {
      return;
    }
    if (const auto pair = best_gimbal(*roles_.gyro)) {
      roles_.gimbal = pair->columns;
      take(pair->columns[0]);
      take(pair->columns[1]);
    }
  }

  bool says(std::size_t column, std::initializer_list<std::string_view> words) const {
    return name_says(source_.names()[column], words);
  }
  bool is_read_out(std::size_t column) const {
    return named_[column].role == Role::gimbal ||
           says(column, {"gimbal", "outer", "inner", "axis", "angle", "table", "encoder"});
  }
  bool is_rate(std::size_t column) const {
    const auto unit = find_unit(named_[column].unit);
    return unit && unit->quantity == Quantity::angular_rate;
  }
  bool is_angle(std::size_t column) const {
    const std::string& unit = named_[column].unit;
    if (named_[column].role == Role::other || is_rate(column)) {
      return false;
    }
    return unit == "deg" || unit == "rad" || is_read_out(column) || says(column, {"azimuth", "pitch", "yaw", "roll"});
  }

  // Roll, pitch and yaw, all three: nobody calls the axes of a gimbal so, of which there are two.
  bool is_attitude(const std::vector<std::size_t>& angles) const {
    const auto told = [&](std::initializer_list<std::string_view> words) {
      return std::any_of(angles.begin(), angles.end(), [&](std::size_t k) { return says(k, words); });
    };
    return told({"roll"}) && told({"pitch"}) && told({"yaw", "azimuth", "heading"}) &&
           std::none_of(angles.begin(), angles.end(), [this](std::size_t k) { return is_read_out(k); });
  }

  // The only free column that its name calls a table's rate.
  std::optional<std::size_t> rate_of_a_table() const {
    std::optional<std::size_t> found;
    for (std::size_t k = 0; k < values_.size(); ++k) {
      const bool taken = std::find(taken_.begin(), taken_.end(), k) != taken_.end();
      if (!taken && all_finite(values_[k]) && table_read_out(named_[k], source_.names()[k]) == TableReadOut::rate) {
        if (found) {
          return std::nullopt;
        }
        found = k;
      }
    }
    return roles_.gimbal ? std::nullopt : found;
  }

  void tell_unused() {
    std::string rest;
    std::vector<std::size_t> angles;
    const auto is_free = [this](std::size_t k) { return std::find(taken_.begin(), taken_.end(), k) == taken_.end(); };
    for (std::size_t k = 0; k < values_.size() && !roles_.gimbal; ++k) {
      if (is_free(k) && is_angle(k)) {
        angles.push_back(k);
      }
    }
    // A table's own angle before an attitude beside it.
    if (angles.size() > 1 &&
        std::count_if(angles.begin(), angles.end(), [this](auto k) { return is_read_out(k); }) == 1) {
      std::erase_if(angles, [this](std::size_t k) { return !is_read_out(k); });
    }
    if (angles.size() == 1 && all_finite(values_[angles.front()])) {
      roles_.angle = angles.front();
      roles_.angle_of_a_table = is_read_out(angles.front());
      take(angles.front());
    } else if (is_attitude(angles)) {
      say("gimbal", fmt::format("{} and those beside it: an attitude that was computed, no read-outs",
                                source_.title(angles.front())));
    } else if (const std::optional<std::size_t> rate = rate_of_a_table(); rate && angles.empty()) {
      roles_.angle = rate;
      roles_.angle_of_a_table = roles_.angle_is_rate = true;
      take(*rate);
    } else if (!angles.empty()) {
      doubt("gimbal", fmt::format("{}: angles by the name, but no two columns side by side fit gravity and the turns",
                                  source_.title(angles.front())));
    }
    for (std::size_t k = 0; k < values_.size(); ++k) {
      if (is_free(k)) {
        rest += fmt::format("{}{}", rest.empty() ? "" : ", ", source_.title(k));
      }
    }
    if (!rest.empty()) {
      say("columns", fmt::format("not taken over: {}", rest));
    }
  }

  const ColumnSource& source_;
  const std::vector<NamedColumn>& named_;
  const Values& values_;
  const std::vector<bool>& lost_;
  bool rate_is_given_;
  std::vector<Remark>& remarks_;
  std::vector<bool> used_;
  std::vector<std::size_t> taken_;
  Roles roles_;
  bool accelerometers_to_show_ = false;  // found by their size alone, and turning
};

}  // namespace

bool all_finite(const std::vector<double>& values) {
  return !values.empty() && std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

TriadColumns triad_columns(const Values& values, const std::array<std::size_t, 3>& columns) {
  TriadColumns triad;
  for (std::size_t k = 0; k < 3; ++k) {
    triad.column[k] = &values[columns[k]];
  }
  return triad;
}

Roles assign_roles(const ColumnSource& source, const std::vector<NamedColumn>& named, const Values& values,
                   const std::vector<bool>& lost, bool by_format, bool rate_is_given, std::vector<Remark>& remarks) {
  if (by_format) {
    Roles roles;
    roles.gyro = {0, 1, 2};
    roles.accelerometer = {3, 4, 5};
    return roles;
  }
  return Assigner(source, named, values, lost, rate_is_given, remarks).assign();
}

}  // namespace selfcal::import
