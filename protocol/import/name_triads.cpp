#include "protocol/import/name_triads.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include "protocol/import/name_words.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::import {
namespace {

bool is_triad(const std::vector<NamedColumn>& all, const std::vector<bool>& among) {
  std::array<bool, 3> there{};
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (among[k] && all[k].axis >= 0) {
      there.at(static_cast<std::size_t>(all[k].axis)) = true;
    }
  }
  return there[0] && there[1] && there[2];
}

// Names by directions of the body: forward, a side, up or down. 0, 1, 2; `sign`: of right and down -1; -1: none.
struct Direction {
  int along = -1, sign = 1;
};
Direction direction_of(const Words& words) {
  static constexpr std::array<std::tuple<std::string_view, int, int>, 16> known{{{"fwd", 0, 1},
                                                                                 {"inline", 0, 1},
                                                                                 {"forward", 0, 1},
                                                                                 {"front", 0, 1},
                                                                                 {"long", 0, 1},
                                                                                 {"longitudinal", 0, 1},
                                                                                 {"left", 1, 1},
                                                                                 {"lat", 1, 1},
                                                                                 {"lateral", 1, 1},
                                                                                 {"port", 1, 1},
                                                                                 {"right", 1, -1},
                                                                                 {"starboard", 1, -1},
                                                                                 {"up", 2, 1},
                                                                                 {"vert", 2, 1},
                                                                                 {"vertical", 2, 1},
                                                                                 {"down", 2, -1}}};
  for (const auto& [word, along, sign] : known) {
    if (is_one_of(words, {word})) {
      return {along, sign};
    }
  }
  return {};
}

}  // namespace

NamedTriads triads_by_name(const std::vector<NamedColumn>& named, Role role) {
  std::array<std::vector<std::size_t>, 3> found;
  const auto is = [role](const NamedColumn& c) { return c.role == role && c.axis >= 0; };
  const bool rates =
      std::count_if(named.begin(), named.end(), [&](const NamedColumn& c) { return is(c) && !c.increment; }) >= 3;
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (is(named[k]) && !(rates && named[k].increment)) {
      found.at(static_cast<std::size_t>(named[k].axis)).push_back(k);
    }
  }
  NamedTriads triads;
  triads.most = std::max({found[0].size(), found[1].size(), found[2].size()});
  for (std::size_t k = 0; k < std::min({found[0].size(), found[1].size(), found[2].size()}); ++k) {
    triads.all.push_back({found[0][k], found[1][k], found[2][k]});
  }
  return triads;
}

std::optional<std::size_t> raw_one_of(const std::vector<std::string>& names,
                                      const std::vector<std::array<std::size_t, 3>>& triads) {
  // How many of a triad's names say so.
  const auto called = [&](const std::array<std::size_t, 3>& triad, std::initializer_list<std::string_view> words) {
    return std::count_if(triad.begin(), triad.end(),
                         [&](std::size_t column) { return is_one_of(words_of(names[column]), words); });
  };
  std::vector<std::size_t> raw, plain;
  for (std::size_t k = 0; k < triads.size(); ++k) {
    const auto as_raw = called(triads[k], {"raw", "uncal", "uncalibrated", "unc", "uncomp", "uncompensated", "unfilt",
                                           "unfiltered", "uncorrected"});
    const auto as_done = called(triads[k], {"cal", "calib", "calibrated", "comp", "compensated", "corr", "corrected",
                                            "filt", "filtered", "lpf", "smooth", "smoothed"});
    constexpr std::ptrdiff_t all = 3;
    if ((as_raw != 0 && as_raw != all) || (as_done != 0 && as_done != all) || (as_raw != 0 && as_done != 0)) {
      return std::nullopt;
    }
    (as_raw == all ? raw : plain).push_back(k);
    if (as_done == all) {
      plain.pop_back();
    }
  }
  if (raw.size() == 1) {
    return raw.front();
  }
  const bool one_plain = raw.empty() && plain.size() == 1 && triads.size() > 1;
  return one_plain ? std::optional(plain.front()) : std::nullopt;
}

bool says_no_gravity(const std::string& name) { return holds(words_of(name), {"linear", "linacc", "user"}); }

void leave_out_linear(const std::vector<std::string>& names, std::vector<NamedColumn>& all) {
  std::vector<bool> plain(all.size(), false), linear(all.size(), false);
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (all[k].role == Role::accelerometer) {
      linear[k] = says_no_gravity(names[k]);
      plain[k] = !linear[k];
    }
  }
  if (is_triad(all, plain) && is_triad(all, linear)) {
    for (std::size_t k = 0; k < all.size(); ++k) {
      all[k].role = linear[k] ? Role::other : all[k].role;
    }
  }
}

void read_directions(const std::vector<std::string>& names, std::vector<NamedColumn>& all, Role role) {
  const auto is = [&](const NamedColumn& c) { return c.role == role && c.axis >= 0; };
  if (std::any_of(all.begin(), all.end(), is)) {
    return;
  }
  std::array<std::optional<std::size_t>, 3> columns;
  int handed = 1;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const Words words = words_of(names[k]);
    const Direction direction = direction_of(words);
    const bool gyro = holds(words, {"gyr", "omega", "angrate", "turnrate"}) || is_one_of(words, {"rate"});
    const bool named = role == Role::gyro ? gyro : holds(words, {"acc", "force", "beschl"});
    if (direction.along < 0 || !named || all[k].axis >= 0) {
      continue;
    }
    std::optional<std::size_t>& column = columns.at(static_cast<std::size_t>(direction.along));
    if (column) {
      return;
    }
    column = k;
    handed *= direction.sign;
  }
  if (!columns[0] || !columns[1] || !columns[2]) {
    return;
  }
  if (handed < 0) {
    std::swap(columns[0], columns[1]);
  }
  for (std::size_t axis = 0; axis < columns.size(); ++axis) {
    all[*columns.at(axis)].role = role;
    all[*columns.at(axis)].axis = static_cast<int>(axis);
  }
}

void read_body_rates(const std::vector<std::string>& names, std::vector<NamedColumn>& all) {
  constexpr std::array<std::string_view, 3> letters{"p", "q", "r"};
  std::array<std::optional<std::size_t>, 3> columns;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (all[k].role == Role::gyro) {
      return;
    }
    const Words words = words_of(std::string_view(names[k]).substr(0, names[k].find_first_of("[(")));
    const auto unit = find_unit(all[k].unit);
    for (std::size_t axis = 0; axis < letters.size(); ++axis) {
      if (!words.empty() && words.front() == letters.at(axis) && unit && unit->quantity == Quantity::angular_rate) {
        columns.at(axis) = k;
      }
    }
  }
  for (std::size_t axis = 0; axis < columns.size() && columns[0] && columns[1] && columns[2]; ++axis) {
    all[*columns.at(axis)].role = Role::gyro;
    all[*columns.at(axis)].axis = static_cast<int>(axis);
  }
}

}  // namespace selfcal::import
