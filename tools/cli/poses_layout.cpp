#include "tools/cli/poses_layout.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "tools/cli/column_list.hpp"
#include "tools/cli/plain_layout.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::Sensors;
using import::NamedColumn;
using import::Role;

using Triad = std::array<std::size_t, 3>;

std::vector<std::size_t> as_vector(const Triad& triad) { return {triad.begin(), triad.end()}; }

// The columns of one sensor by their names, or as the caller lists them.
struct Triads {
  std::vector<std::size_t> first;  // x, y, z; empty: none is complete
  std::size_t several = 0;         // of the axis that has most columns
  std::string which;               // of several sets: words on them
};

// Columns of `role`, for what the names call so; 'x' alone is called nothing.
Triads triads_of(const import::ColumnSource& source, const std::vector<NamedColumn>& named, Role role, Role called) {
  const import::NamedTriads by_name = import::triads_by_name(named, called);
  Triads triads;
  triads.several = by_name.most;
  if (by_name.all.empty()) {
    return triads;
  }
  triads.first = as_vector(by_name.all.front());
  if (triads.several == 1) {
    return triads;
  }
  const std::string what = role == Role::gyro ? "gyros" : "accelerometers";
  const std::string option = role == Role::gyro ? "--gyro-columns" : "--accelerometer-columns";
  const auto raw = by_name.all.size() == by_name.most ? import::raw_one_of(source.names(), by_name.all) : std::nullopt;
  if (raw) {
    triads.first = as_vector(by_name.all[*raw]);
    triads.several = 1;
    triads.which =
        fmt::format("of {} sets of {} what the sensor itself gives by its name, from {} on; {} takes another",
                    by_name.all.size(), what, source.title(triads.first.front()), option);
    return triads;
  }
  std::vector<std::string> begins;
  for (const Triad& triad : by_name.all) {
    begins.push_back(source.title(triad.front()));
  }
  triads.which =
      fmt::format("{} sets of {}, x in {}: {} says which", by_name.most, what, fmt::join(begins, ", "), option);
  return triads;
}

// Errors (bad_input): LIST names other columns than three.
Expected<Triads> told_or_named(const import::ColumnSource& source, const std::vector<NamedColumn>& named, Role role,
                               const std::string& list, const std::string& file) {
  if (list.empty()) {
    return triads_of(source, named, role, role);
  }
  const char* option = role == Role::gyro ? "--gyro-columns" : "--accelerometer-columns";
  Expected<std::vector<std::size_t>> columns = listed_columns(file, source, option, list);
  if (columns && columns->size() != 3) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: {} columns, x, y and z are wanted", file, option, columns->size()));
  }
  return columns.map([](std::vector<std::size_t> three) { return Triads{std::move(three), 1, {}}; });
}

bool all_nameless(const import::ColumnSource& source) {
  return std::all_of(source.names().begin(), source.names().end(), [](const std::string& n) { return n.empty(); });
}

std::vector<std::size_t> columns_from(std::size_t first, std::size_t count) {
  std::vector<std::size_t> columns(count);
  std::iota(columns.begin(), columns.end(), first);
  return columns;
}

// Columns that are called a time; without one those of which no name says what they are, for one that rises.
void add_times(const std::vector<NamedColumn>& named, PoseLayout& layout) {
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (named[k].role == Role::time) {
      layout.times.push_back(k);
    }
  }
  const bool called = !layout.times.empty();
  for (std::size_t k = 0; k < named.size() && !called; ++k) {
    if (named[k].role == Role::unknown && named[k].axis < 0) {
      layout.times.push_back(k);
    }
  }
}

Expected<PoseLayout> layout_by_names(const std::vector<NamedColumn>& named, Triads gyro, Triads accel,
                                     const RawColumns& columns, const std::string& file) {
  PoseLayout layout;
  layout.by_names = true;
  // Of one sensor alone, if nothing else in the file may be the other one.
  const auto unknown =
      std::count_if(named.begin(), named.end(), [](const NamedColumn& c) { return c.role == Role::unknown; });
  const bool one_of_them = gyro.first.empty() != accel.first.empty() && unknown < 3;
  layout.sensors = columns.sensors.value_or(!one_of_them         ? Sensors::both
                                            : gyro.first.empty() ? Sensors::accelerometers
                                                                 : Sensors::gyros);
  const bool gyros = layout.sensors != Sensors::accelerometers, accels = layout.sensors != Sensors::gyros;
  for (const auto& [wanted, triads, what] :
       {std::tuple{gyros, &gyro, "gyros"}, std::tuple{accels, &accel, "accelerometers"}}) {
    if (wanted && triads->first.empty()) {
      return fail(
          ErrorKind::bad_input,
          fmt::format("{}: by the names of its columns it holds no three {}: `selfcal import --guess` looks for "
                      "them by what they do, --only answers for the others alone",
                      file, what));
    }
    if (wanted && triads->several > 1) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: by the names of its columns it holds {}; poses that stand side by side are read one "
                              "under another (cut and cat make such a file)",
                              file, triads->which));
    }
  }
  for (const auto& [wanted, triads] : {std::pair{gyros, &gyro}, std::pair{accels, &accel}}) {
    layout.notes += wanted && !triads->which.empty() ? (layout.notes.empty() ? "" : "; ") + triads->which : "";
  }
  layout.gyro = gyros ? std::move(gyro.first) : std::vector<std::size_t>{};
  layout.accel = accels ? std::move(accel.first) : std::vector<std::size_t>{};
  if (!columns.rate_hz) {
    add_times(named, layout);
    if (layout.times.empty()) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: no column is called a time: --rate says how many rows a second it holds", file));
    }
  }
  return layout;
}

// The only column that is called a gyro, whatever stands beside it: a table's angle, a temperature.
std::optional<PoseLayout> one_named_gyro(const std::vector<NamedColumn>& named, const RawColumns& columns) {
  const auto is = [](const NamedColumn& c) { return c.role == Role::gyro; };
  const auto found = std::find_if(named.begin(), named.end(), is);
  if (found == named.end() || std::count_if(named.begin(), named.end(), is) != 1 || found->axis < 0) {
    return std::nullopt;
  }
  PoseLayout layout;
  layout.sensors = Sensors::gyros;
  layout.by_names = true;
  layout.gyro = {static_cast<std::size_t>(found - named.begin())};
  layout.only_axis = found->axis;
  if (!columns.rate_hz) {
    add_times(named, layout);
  }
  return columns.rate_hz || !layout.times.empty() ? std::optional(std::move(layout)) : std::nullopt;
}

// What the names call one of `role` where x, y and z are not all there: "column 5 (gz_dps)"; empty: none.
std::string incomplete_triad(const import::ColumnSource& source, const std::vector<NamedColumn>& named, Role role) {
  std::vector<std::string> columns;
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (named[k].role == role && named[k].axis >= 0) {
      columns.push_back(source.title(k));
    }
  }
  return fmt::format("{}", fmt::join(columns, ", "));
}

// Of a planar module, say: what a log holds less than three of is left alone, and said.
std::string left_alone(const import::ColumnSource& source, const std::vector<NamedColumn>& named,
                       const PoseLayout& layout) {
  const std::string gyros = layout.gyro.empty() ? incomplete_triad(source, named, Role::gyro) : std::string();
  const std::string accels =
      layout.accel.empty() ? incomplete_triad(source, named, Role::accelerometer) : std::string();
  std::string words;
  if (!accels.empty()) {
    words =
        fmt::format("{}: left alone, for bias and scale factors by gravity take accelerometers of x, y and z", accels);
  }
  if (!gyros.empty()) {
    words +=
        (words.empty() ? "" : "; ") +
        fmt::format("{}: left alone, for turns take gyros of x, y and z; --only gyros answers for one gyro", gyros);
  }
  return words;
}

}  // namespace

Expected<PoseLayout> pose_layout(const import::ColumnSource& source, const std::vector<NamedColumn>& named,
                                 const RawColumns& columns, const std::string& file) {
  if (named.size() < columns.temperature) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}: {} columns, {} are needed", file, source.form(),
                                                  named.size(), columns.temperature));
  }
  if (const std::string mixed = source.mixed_rows(); !mixed.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", file, mixed));
  }
  Expected<Triads> of_gyros = told_or_named(source, named, Role::gyro, columns.gyros, file);
  Expected<Triads> of_accels = told_or_named(source, named, Role::accelerometer, columns.accelerometers, file);
  if (!of_gyros || !of_accels) {
    return tl::unexpected((of_gyros ? of_accels : of_gyros).error());
  }
  Triads &gyro = *of_gyros, &accel = *of_accels;
  const Sensors sensors = columns.sensors.value_or(Sensors::both);
  // "x", "y", "z" of a phone's file of one sensor.
  if (columns.sensors && gyro.several + accel.several == 0) {
    const bool gyros = sensors == Sensors::gyros;
    (gyros ? gyro : accel) = triads_of(source, named, gyros ? Role::gyro : Role::accelerometer, Role::unknown);
  }
  const auto saying = [&](PoseLayout layout) {
    if (const std::string words = columns.sensors ? std::string() : left_alone(source, named, layout); !words.empty()) {
      layout.notes += (layout.notes.empty() ? "" : "; ") + words;
    }
    return layout;
  };
  const bool of_one_gyro = sensors == Sensors::gyros || (!columns.sensors && accel.several > 0 && accel.first.empty());
  if (gyro.first.empty() && of_one_gyro) {
    if (std::optional<PoseLayout> one = one_named_gyro(named, columns)) {
      return saying(std::move(*one));
    }
  }
  if (!gyro.first.empty() || !accel.first.empty()) {
    return layout_by_names(named, std::move(gyro), std::move(accel), columns, file).map(saying);
  }
  const auto no_triad =
      fail(ErrorKind::bad_input, fmt::format("{}: some columns are called gyros or accelerometers, but no x, y and z "
                                             "of either; --only gyros or --only accelerometers takes what there is",
                                             file));
  const bool some_named = !all_nameless(source) && gyro.several + accel.several > 0;
  if (some_named && sensors != Sensors::gyros) {
    return no_triad;
  }
  Expected<PoseLayout> layout = plain_layout(source, named, sensors, columns, file);
  if (layout && layout->only_axis >= 0) {
    layout->only_axis = std::max(0, named[layout->gyro.front()].axis);
  }
  if (layout) {
    layout->names_unread = !all_nameless(source);
  }
  if (layout && some_named && layout->only_axis < 0) {
    return no_triad;
  }
  return layout;
}

std::string layout_words(const PoseLayout& layout, std::size_t time, const std::string& unit_of_time,
                         const RawColumns& columns) {
  const auto numbers = [](std::vector<std::size_t> all) {
    for (std::size_t& column : all) {
      ++column;
    }
    return fmt::format("{}", fmt::join(all, ", "));
  };
  const bool plain = (layout.gyro.empty() || layout.gyro == columns_from(1, layout.gyro.size())) &&
                     (layout.accel.empty() || layout.accel == columns_from(layout.gyro.empty() ? 1 : 4, 3));
  if (plain && time == 0 && unit_of_time == "s" && !columns.rate_hz && !layout.names_unread) {
    return {};
  }
  std::string words = layout.by_names       ? "by the names "
                      : layout.names_unread ? "no name says what the columns are, in their order "
                                            : "no names: ";
  words += columns.rate_hz ? fmt::format("rows follow one another at {} Hz", *columns.rate_hz)
                           : fmt::format("time is column {} in {}", time + 1, unit_of_time);
  words += layout.gyro.empty()     ? std::string()
           : layout.only_axis >= 0 ? fmt::format(", the one gyro is column {}, taken for {}", layout.gyro.front() + 1,
                                                 "xyz"[layout.only_axis])
                                   : ", gyros are " + numbers(layout.gyro);
  words += layout.accel.empty() ? std::string() : ", accelerometers " + numbers(layout.accel);
  return words;
}

}  // namespace selfcal::cli
