#include "tools/cli/means_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <regex>
#include <utility>
#include <vector>

#include "estimator/diagnosis/poses/means.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/guess_names.hpp"
#include "protocol/import/units.hpp"
#include "tools/cli/log_units.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::Sensors;
using import::ColumnSource;
using import::NamedColumn;
using import::Quantity;
using import::Role;

constexpr std::size_t rows_of_a_log = 100;

using Triad = std::vector<std::size_t>;  // x y z, or empty

Triad triad_of(const std::vector<NamedColumn>& named, Role role) {
  Triad triad(3, named.size());
  for (std::size_t k = named.size(); k-- > 0;) {
    if (named[k].role == role && named[k].axis >= 0) {
      triad[static_cast<std::size_t>(named[k].axis)] = k;
    }
  }
  return std::count(triad.begin(), triad.end(), named.size()) > 0 ? Triad{} : triad;
}

const std::regex& scatter_words() {
  static const std::regex scatter("(standard)?[ _-]*(std[ _-]*dev|stdev|stddev|std|sigma|deviation)",
                                  std::regex::icase);
  return scatter;
}

// Columns of what the readings of each row scatter by: "std_ax", "ax sigma".
Triad deviations_of(const ColumnSource& source, const std::vector<NamedColumn>& named) {
  std::vector<NamedColumn> plain(named.size());
  for (std::size_t k = 0; k < named.size(); ++k) {
    const std::string& name = source.names()[k];
    if (std::regex_search(name, scatter_words())) {
      plain[k] = import::read_name(std::regex_replace(name, scatter_words(), " "),
                                   k < source.units().size() ? source.units()[k] : "");
    }
  }
  return triad_of(plain, Role::accelerometer);
}

// The last decimal digit that all of a column's numbers need.
double last_digit(const std::vector<double>& values) {
  constexpr int most = 9;
  constexpr double whole = 1e-6;
  double digit = 1.0;
  for (int k = 0; k < most; ++k, digit /= 10.0) {
    if (std::all_of(values.begin(), values.end(), [digit](double v) {
          return std::abs(std::remainder(v / digit, 1.0)) < whole * std::max(1.0, std::abs(v / digit) * 1e-6);
        })) {
      return digit;
    }
  }
  return 0.0;
}

bool is_text(const ColumnSource& source) { return source.dialect() != nullptr; }

Expected<import::ColumnData> read(const ColumnSource& source, std::vector<std::size_t> columns, std::size_t most_rows,
                                  bool tolerant = false) {
  import::ColumnRequest request;
  request.columns = std::move(columns);
  request.tolerant = tolerant;
  if (tolerant) {
    request.most_rows = most_rows;
  }
  return source.read(request);
}

// Rows of a table; 0: as many as a log has.
std::size_t rows_of_table(const ColumnSource& source) {
  const auto data = read(source, {0}, rows_of_a_log, true);
  return !data || data->left_out || data->rows >= rows_of_a_log ? 0 : data->rows;
}

bool counts_rows(const std::vector<double>& values) {
  for (std::size_t k = 1; k < values.size(); ++k) {
    if (values[k] != values[k - 1] + 1.0) {
      return false;
    }
  }
  return values.size() > 1 && (values.front() == 0.0 || values.front() == 1.0);
}

std::string listed(const Triad& columns) {
  std::vector<std::size_t> from_one(columns);
  for (std::size_t& column : from_one) {
    ++column;
  }
  return fmt::format("{}", fmt::join(from_one, ", "));
}

struct TableColumns {
  Triad accel, gyro, deviation;
};

// Which columns are a triad of accelerometers; empty: none.
TableColumns columns_of(const ColumnSource& source, const std::vector<NamedColumn>& named, const RawColumns& asked) {
  TableColumns found;
  found.accel = triad_of(named, Role::accelerometer);
  found.gyro = asked.sensors == Sensors::accelerometers ? Triad{} : triad_of(named, Role::gyro);
  found.deviation = deviations_of(source, named);
  if (found.accel.empty() && triad_of(named, Role::gyro).empty()) {
    found.accel = triad_of(named, Role::unknown);
  }
  const bool nameless =
      std::all_of(source.names().begin(), source.names().end(), [](const std::string& name) { return name.empty(); });
  if (found.accel.empty() && nameless && (named.size() == 3 || named.size() == 4)) {
    const std::size_t first = named.size() - 3;
    const auto numbers = first == 0 ? tl::unexpected(Error{}) : read(source, {0}, rows_of_a_log, true);
    if (first == 0 || (numbers && counts_rows(numbers->values[0]))) {
      found.accel = {first, first + 1, first + 2};
    }
  }
  return found;
}

std::vector<std::array<double, 3>> rows_of(const std::vector<std::vector<double>>& values, std::size_t first,
                                           double unit) {
  std::vector<std::array<double, 3>> rows(values[first].size());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k] = {unit * values[first][k], unit * values[first + 1][k], unit * values[first + 2][k]};
  }
  return rows;
}

std::array<double, 3> digits_of(const std::vector<std::vector<double>>& values, std::size_t first, double unit) {
  return {unit * last_digit(values[first]), unit * last_digit(values[first + 1]), unit * last_digit(values[first + 2])};
}

// A time that a name calls so and whose unit it says, rising; else the order of the rows says nothing of time.
void add_time(const ColumnSource& source, const std::vector<NamedColumn>& named, diagnosis::PoseMeans& means) {
  for (std::size_t k = 0; k < named.size() && !means.timed; ++k) {
    const auto unit = import::find_unit(named[k].unit);
    if (named[k].role != Role::time || !unit || unit->quantity != Quantity::time) {
      continue;
    }
    const auto data = read(source, {k}, rows_of_a_log);
    if (data && std::adjacent_find(data->values[0].begin(), data->values[0].end(), std::greater_equal<>()) ==
                    data->values[0].end()) {
      means.timed = true;
      means.rows.time_s = data->values[0];
      std::for_each(means.rows.time_s.begin(), means.rows.time_s.end(), [&unit](double& t) { t *= unit->si; });
    }
  }
  if (!means.timed) {
    means.rows.time_s.resize(means.rows.accel.size());
    std::iota(means.rows.time_s.begin(), means.rows.time_s.end(), 0.0);
  }
}

Expected<std::optional<TableAnswer>> answer_of_means(const ColumnSource& source, const std::vector<NamedColumn>& named,
                                                     const TableColumns& found, const RawFiles& files,
                                                     const RawColumns& asked, double gyro_unit, double alpha) {
  std::vector<std::size_t> wanted = found.accel;
  wanted.insert(wanted.end(), found.gyro.begin(), found.gyro.end());
  wanted.insert(wanted.end(), found.deviation.begin(), found.deviation.end());
  const std::size_t thermal = asked.temperature > 0 ? asked.temperature : named_temperature(named);
  if (thermal > 0) {
    wanted.push_back(thermal - 1);
  }
  const auto data = read(source, wanted, rows_of_a_log);
  if (!data) {
    return tl::unexpected(data.error());
  }
  diagnosis::PoseMeans means;
  diagnosis::PoseInput& rows = means.rows;
  const double accel_si = unit_of(named, found.accel, Quantity::acceleration);
  const double gyro_si = asked.raw_gyros ? 0.0 : unit_of(named, found.gyro, Quantity::angular_rate);
  const double unit = accel_si > 0.0 ? accel_si : 1.0, rate = gyro_si > 0.0 ? gyro_si : 1.0;
  rows.accel = rows_of(data->values, 0, unit);
  rows.gyro.assign(rows.accel.size(), {});
  rows.sensors = found.gyro.empty() ? Sensors::accelerometers : Sensors::both;
  std::size_t next = 3;
  if (!found.gyro.empty()) {
    rows.gyro = rows_of(data->values, next, rate);
    means.gyro_digit = is_text(source) ? digits_of(data->values, next, rate) : std::array<double, 3>{};
    next += 3;
  }
  if (!found.deviation.empty()) {
    const double own = unit_of(named, found.deviation, Quantity::acceleration);
    means.accel_deviation = rows_of(data->values, next, own > 0.0 ? own : unit);
    next += 3;
  }
  if (thermal > 0) {
    rows.temperature_c = data->values[next];
    for (double& t : rows.temperature_c) {
      t = import::celsius(t, named[thermal - 1].unit);
    }
  }
  means.accel_digit = is_text(source) ? digits_of(data->values, 0, unit) : std::array<double, 3>{};
  rows.gyros_si = gyro_si > 0.0;
  rows.gyro_unit = gyro_unit;
  rows.accel_unit = accel_si > 0.0 ? 1.0 : 0.0;
  set_place(files.latitude_deg, files.height_m, rows);
  add_time(source, named, means);
  TableAnswer answer;
  answer.si = accel_si > 0.0 && (found.gyro.empty() || gyro_si > 0.0);
  answer.notes = fmt::format("a table of means, a row a pose: accelerometers are columns {}{}{}", listed(found.accel),
                             found.gyro.empty() ? "" : ", gyros " + listed(found.gyro),
                             found.deviation.empty() ? "" : ", standard deviations " + listed(found.deviation));
  answer.diagnosis = diagnosis::diagnose_means(means, alpha);
  return std::optional(std::move(answer));
}

struct HeadColumns {
  std::size_t angle = 0, reading = 0;
};

// A column of angles and one that may be an accelerometer's.
std::optional<HeadColumns> head_of(const ColumnSource& source, const std::vector<NamedColumn>& named,
                                   const RawColumns& asked) {
  std::vector<std::size_t> angles, readings;
  for (std::size_t k = 0; k < named.size(); ++k) {
    const auto data = read(source, {k}, rows_of_a_log, true);
    if (!data || data->rows == 0 || !std::isfinite(data->values[0][0]) || k + 1 == asked.temperature ||
        std::regex_search(source.names()[k], scatter_words()) || counts_rows(data->values[0])) {
      continue;
    }
    const auto unit = import::find_unit(named[k].unit);
    const bool other = unit && unit->quantity != Quantity::acceleration;
    if (k + 1 == asked.angle || (asked.angle == 0 && called_angle(named[k], source.names()[k]))) {
      angles.push_back(k);
    } else if (!other && (named[k].role == Role::unknown || named[k].role == Role::accelerometer)) {
      readings.push_back(k);
    } else if (named[k].role == Role::gyro) {
      return std::nullopt;
    }
  }
  return angles.size() == 1 && readings.size() == 1 ? std::optional(HeadColumns{angles[0], readings[0]}) : std::nullopt;
}

Expected<std::optional<TableAnswer>> answer_of_head(const ColumnSource& source, const std::vector<NamedColumn>& named,
                                                    const HeadColumns& found, const RawFiles& files, double alpha) {
  const auto data = read(source, {found.angle, found.reading}, 0);
  if (!data) {
    return tl::unexpected(data.error());
  }
  const std::string& file = files.poses.front();
  const auto [low, high] = std::minmax_element(data->values[0].begin(), data->values[0].end());
  constexpr double round_in_rad = 6.4;
  if (named[found.angle].unit.empty() && data->rows > 1 && *high - *low < round_in_rad) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: angles from {:.4g} to {:.4g}: a name with their unit says whether they are rad or "
                            "part of a turn in deg",
                            file, source.title(found.angle), *low, *high));
  }
  diagnosis::PoseInput place;
  set_place(files.latitude_deg, files.height_m, place);
  diagnosis::HeadReadings readings;
  const double unit = unit_of_angle(named[found.angle]);
  const double si = unit_of(named, {found.reading}, Quantity::acceleration);
  readings.angle_rad = data->values[0];
  for (double& angle : readings.angle_rad) {
    angle *= unit;
  }
  readings.reading = data->values[1];
  readings.per_g = si > 0.0 ? place.gravity / si : 0.0;
  readings.gravity_sigma = place.gravity_sigma / place.gravity;
  TableAnswer answer;
  answer.si = si > 0.0;
  answer.notes = fmt::format("one accelerometer on a dividing head: angle is column {}, its reading {}",
                             found.angle + 1, found.reading + 1);
  diagnosis::PoseDiagnosis& d = answer.diagnosis;
  d.dividing_head = diagnosis::judge_dividing_head(readings, alpha);
  d.failure = d.dividing_head->failure;
  d.sensors = Sensors::accelerometers;
  d.accel_adequate = true;
  d.poses = d.dividing_head->stops;
  d.supports.emplace_back("gravity along one accelerometer at the angles of a dividing head");
  d.invisible.emplace_back("the tilt of the head's axis: it shortens 1 g by its square");
  d.invisible.emplace_back(
      "an angle that is wrong by twice the turn, as of a head that runs eccentrically: it looks like K0, K2 and Kip");
  constexpr int for_third = 12;
  if (d.dividing_head->angles < for_third) {
    d.invisible.emplace_back("a cubic part, a drift: 12 angles and more show them");
  }
  return std::optional(std::move(answer));
}

}  // namespace

Expected<std::optional<TableAnswer>> answer_of_table(const RawFiles& files, const RawColumns& columns, double gyro_unit,
                                                     double false_alarm_rate) {
  const bool none = columns.sensors == Sensors::gyros || files.poses.size() != 1 || !files.gyros.empty();
  const auto source = none ? tl::unexpected(Error{}) : import::open_columns(files.poses.front());
  if (!source || (*source)->names().empty()) {
    return std::optional<TableAnswer>();
  }
  const std::vector<NamedColumn> named = import::read_names((*source)->names(), (*source)->units());
  const TableColumns found = columns_of(**source, named, columns);
  if (!found.accel.empty()) {
    return columns.rate_hz || rows_of_table(**source) == 0
               ? std::optional<TableAnswer>()
               : answer_of_means(**source, named, found, files, columns, gyro_unit, false_alarm_rate);
  }
  const std::optional<HeadColumns> head = head_of(**source, named, columns);
  return head ? answer_of_head(**source, named, *head, files, false_alarm_rate) : std::optional<TableAnswer>();
}

}  // namespace selfcal::cli
