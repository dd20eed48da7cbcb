#include "tools/cli/poses_attitude.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/guess_attitude.hpp"
#include "protocol/import/guess_names.hpp"
#include "protocol/import/incomplete_rows.hpp"
#include "protocol/import/units.hpp"
#include "tools/cli/column_list.hpp"
#include "tools/cli/log_time.hpp"

namespace selfcal::cli {
namespace {

using Eigen::Quaterniond;
using import::AttitudeClaim;
using import::AttitudeColumns;
using import::AttitudeForm;
using Values = std::vector<std::vector<double>>;  // by column of the attitude

const Quaterniond none(NAN, NAN, NAN, NAN);

std::string titles(const import::ColumnSource& source, const std::vector<std::size_t>& columns) {
  const auto [first, last] = std::minmax_element(columns.begin(), columns.end());
  return fmt::format("{} to {}", source.title(*first), source.title(*last));
}

// "8,9,10,11" or names.
Expected<AttitudeColumns> named_columns(const std::string& path, const import::ColumnSource& source,
                                        const std::string& list) {
  Expected<std::vector<std::size_t>> columns = listed_columns(path, source, "--attitude-columns", list);
  if (!columns) {
    return tl::unexpected(columns.error());
  }
  AttitudeColumns chosen;
  chosen.columns = std::move(*columns);
  const std::size_t n = chosen.columns.size();
  if (n != 3 && n != 4 && n != 9) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: --attitude-columns: {} of them; 4 are a quaternion, 3 roll, pitch "
                            "and yaw, 9 a matrix",
                            path, n));
  }
  chosen.form = n == 3 ? AttitudeForm::angles : n == 4 ? AttitudeForm::quaternion : AttitudeForm::matrix;
  chosen.order_known = n != 4;
  // Names that say which is w settle the order.
  for (const AttitudeColumns& by_name : import::attitudes_by_name(source.names(), source.units())) {
    std::vector<std::size_t> asked = chosen.columns, has = by_name.columns;
    std::sort(asked.begin(), asked.end());
    std::sort(has.begin(), has.end());
    chosen = asked == has ? by_name : chosen;
  }
  return chosen;
}

std::string not_used(const import::ColumnSource& source, const AttitudeColumns& columns) {
  return columns.claim == AttitudeClaim::computed
             ? fmt::format("{}: an attitude that a filter computed, by its name: no reference, and not used",
                           titles(source, columns.columns))
             : fmt::format(
                   "{}: an attitude; no name says that something else than these sensors measured it: not used "
                   "(--attitude with this file takes it for a reference)",
                   titles(source, columns.columns));
}

// Rows that are no attitude become one that is none; an error is a row that is wrong.
struct Row {
  Quaterniond q = none;
  double size = 1.0;  // of a quaternion; of a matrix what it is off by
};

Eigen::Matrix3d matrix_at(const Values& values, std::size_t row) {
  Eigen::Matrix3d C;
  for (std::size_t k = 0; k < 9; ++k) {
    C(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)) = values[k][row];
  }
  return C;
}

bool is_lost(const Values& values, std::size_t row) {
  const auto missing = [row](const std::vector<double>& column) { return !std::isfinite(column[row]); };
  const auto zero = [row](const std::vector<double>& column) { return column[row] == 0.0; };
  return std::any_of(values.begin(), values.end(), missing) ||
         (values.size() > 3 && std::all_of(values.begin(), values.end(), zero));
}

double length_at(const Values& values, std::size_t row) {
  double square = 0.0;
  for (const auto& column : values) {
    square += column[row] * column[row];
  }
  return std::sqrt(square);
}

// Their usual length, for counts of a register; rows of another one are errors.
Expected<double> usual_length(const Values& values, const import::ColumnData& data, const std::string& what) {
  std::vector<double> lengths;
  for (std::size_t row = 0; row < values[0].size(); ++row) {
    if (!is_lost(values, row)) {
      lengths.push_back(length_at(values, row));
    }
  }
  if (lengths.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: 0 or no number throughout: no attitude", what));
  }
  const double usual = median(lengths);
  constexpr double near_one = 0.02, off = 0.02;
  const double expected = std::abs(usual - 1.0) < near_one ? 1.0 : usual;
  std::size_t wrong = 0, first = 0;
  for (std::size_t row = 0; row < values[0].size(); ++row) {
    if (!is_lost(values, row) && std::abs(length_at(values, row) / expected - 1.0) > off) {
      first = wrong++ == 0 ? row : first;
    }
  }
  if (wrong > 0) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: a quaternion of length {:.4g}, where {:.4g} is right ({} row{})", what,
                            data.place(first), length_at(values, first), expected, wrong, wrong == 1 ? "" : "s"));
  }
  return expected;
}

void add_reading(const std::string& words, std::vector<Quaterniond> q, bool inverse,
                 diagnosis::ReferenceAttitude& attitude) {
  if (inverse) {
    for (Quaterniond& one : q) {
      one = one.conjugate();
    }
  }
  attitude.readings.push_back({words + (inverse ? ", reference to body" : ", body to reference"), std::move(q)});
}

Expected<void> add_quaternions(const Values& values, const AttitudeColumns& columns, const import::ColumnData& data,
                               const std::string& what, diagnosis::ReferenceAttitude& attitude) {
  if (const auto length = usual_length(values, data, what); !length) {
    return tl::unexpected(length.error());
  }
  struct Order {
    const char* words;
    std::array<std::size_t, 4> at;  // of w x y z
  };
  std::vector<Order> orders;
  if (columns.order_known) {
    const bool w_first = columns.columns[0] < columns.columns[1];
    orders = {{w_first ? "quaternion w x y z" : "quaternion x y z w", {0, 1, 2, 3}}};
  } else {
    orders = {{"quaternion w x y z", {0, 1, 2, 3}}, {"quaternion x y z w", {3, 0, 1, 2}}};
  }
  for (const Order& order : orders) {
    for (const bool inverse : {false, true}) {
      std::vector<Quaterniond> q;
      for (std::size_t row = 0; row < data.rows; ++row) {
        q.push_back(is_lost(values, row) ? none
                                         : Quaterniond(values[order.at[0]][row], values[order.at[1]][row],
                                                       values[order.at[2]][row], values[order.at[3]][row])
                                               .normalized());
      }
      add_reading(order.words, std::move(q), inverse, attitude);
    }
  }
  return {};
}

Expected<void> add_matrices(const Values& values, const import::ColumnData& data, const std::string& what,
                            diagnosis::ReferenceAttitude& attitude) {
  constexpr double off = 0.02;
  std::vector<Quaterniond> q;
  std::size_t lost = 0;
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (is_lost(values, row)) {
      q.push_back(none);
      ++lost;
      continue;
    }
    const Eigen::Matrix3d C = matrix_at(values, row);
    if ((C * C.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > off || C.determinant() < 0.0) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: {}: no rotation matrix: determinant {:.4g}, first row of length {:.4g}", what,
                              data.place(row), C.determinant(), C.row(0).norm()));
    }
    q.emplace_back(Quaterniond(C).normalized());
  }
  if (lost == data.rows) {
    return fail(ErrorKind::bad_input, fmt::format("{}: 0 or no number throughout: no attitude", what));
  }
  add_reading("rotation matrix", q, false, attitude);
  add_reading("rotation matrix", std::move(q), true, attitude);
  return {};
}

Expected<void> add_angles(const Values& values, const AttitudeColumns& columns, const import::ColumnData& data,
                          const std::string& what, diagnosis::ReferenceAttitude& attitude) {
  double largest = 0.0;
  for (const auto& column : values) {
    for (const double v : column) {
      largest = std::isfinite(v) ? std::max(largest, std::abs(v)) : largest;
    }
  }
  if (largest == 0.0) {
    return fail(ErrorKind::bad_input, fmt::format("{}: 0 or no number throughout: no attitude", what));
  }
  constexpr double a_turn = 2.0 * std::numbers::pi * 1.001;
  std::vector<std::string> angle_units = {columns.unit};
  if (columns.unit != "deg" && columns.unit != "rad") {
    angle_units = largest > a_turn ? std::vector<std::string>{"deg"} : std::vector<std::string>{"rad", "deg"};
  }
  for (const std::string& unit : angle_units) {
    const double si = unit == "deg" ? units::degree : 1.0;
    for (const bool yaw_first : {true, false}) {
      std::vector<Quaterniond> q;
      for (std::size_t row = 0; row < data.rows; ++row) {
        const Eigen::AngleAxisd x(si * values[0][row], Eigen::Vector3d::UnitX());
        const Eigen::AngleAxisd y(si * values[1][row], Eigen::Vector3d::UnitY());
        const Eigen::AngleAxisd z(si * values[2][row], Eigen::Vector3d::UnitZ());
        q.push_back(is_lost(values, row) ? none : yaw_first ? Quaterniond(z * y * x) : Quaterniond(x * y * z));
      }
      const std::string words =
          fmt::format("{} in {}", yaw_first ? "yaw, pitch, roll" : "roll, pitch, yaw in this order", unit);
      add_reading(words, q, false, attitude);
      add_reading(words, std::move(q), true, attitude);
    }
  }
  return {};
}

Expected<void> add_readings(const AttitudeColumns& columns, const import::ColumnData& data, const std::string& what,
                            diagnosis::ReferenceAttitude& attitude) {
  switch (columns.form) {
    case AttitudeForm::quaternion: return add_quaternions(data.values, columns, data, what, attitude);
    case AttitudeForm::matrix: return add_matrices(data.values, data, what, attitude);
    case AttitudeForm::angles: return add_angles(data.values, columns, data, what, attitude);
  }
  return {};
}

// Whose time the log's begin is: seconds of both on one clock, as far as the files say.
Expected<diagnosis::ReferenceAttitude> read_columns(const std::string& path, const import::ColumnSource& source,
                                                    const AttitudeColumns& columns, const RawLog& log, bool in_log) {
  const std::vector<import::NamedColumn> named = import::read_names(source.names(), source.units());
  std::vector<std::size_t> times;
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (named[k].role == import::Role::time) {
      times.push_back(k);
    }
  }
  if (times.empty()) {
    times = {0};
  }
  if (std::find(columns.columns.begin(), columns.columns.end(), times.front()) != columns.columns.end()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: no column of a time beside the attitude", path));
  }
  import::ColumnRequest request;
  request.columns = columns.columns;
  request.tolerant = true;
  Expected<TimedRows> rows = read_with_time(source, times, request);
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  const import::ColumnData& data = rows->data;
  if (data.rows == 0) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}: no row holds a time", path, source.title(rows->time)));
  }
  if (const auto increasing = check_increasing(path, data, ""); !increasing) {
    return tl::unexpected(increasing.error());
  }
  const Expected<std::string> unit = time_unit(*rows, source, named, path, "a head that names its unit settles it");
  if (!unit) {
    return tl::unexpected(unit.error());
  }
  diagnosis::ReferenceAttitude attitude;
  attitude.in_rows_of_log = in_log;
  const auto si = static_cast<long double>(import::find_unit(*unit)->si);
  for (const long double stamp : data.stamps) {
    attitude.time_s.push_back(static_cast<double>(stamp * si - log.begin_s));
  }
  const std::string what = fmt::format("{}: {}", path, titles(source, columns.columns));
  if (const auto added = add_readings(columns, data, what, attitude); !added) {
    return tl::unexpected(added.error());
  }
  return attitude;
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return std::filesystem::equivalent(a, b, error);
}

const char* form_words(AttitudeForm form) {
  return form == AttitudeForm::quaternion ? "a quaternion"
         : form == AttitudeForm::matrix   ? "a rotation matrix"
                                          : "roll, pitch and yaw";
}

}  // namespace

Expected<ChosenAttitude> choose_attitude(const std::string& log_path, const RawLog& log, const AttitudeChoice& choice) {
  const std::string& path = choice.file.empty() ? log_path : choice.file;
  const bool asked = !choice.file.empty() || !choice.columns.empty();
  const auto source = import::open_columns(path);
  if (!source) {
    return tl::unexpected(source.error());
  }
  std::vector<AttitudeColumns> all;
  if (!choice.columns.empty()) {
    const auto named = named_columns(path, **source, choice.columns);
    if (!named) {
      return tl::unexpected(named.error());
    }
    all = {*named};
  } else {
    all = import::attitudes_by_name((*source)->names(), (*source)->units());
    // A reference first; nobody who asks means roll and pitch beside a quaternion.
    std::stable_sort(all.begin(), all.end(), [](const AttitudeColumns& a, const AttitudeColumns& b) {
      const auto rank = [](const AttitudeColumns& c) {
        return (c.claim == AttitudeClaim::reference ? 0
                : c.claim == AttitudeClaim::nothing ? 10
                                                    : 20) +
               (c.form == AttitudeForm::angles ? 1 : 0);
      };
      return rank(a) < rank(b);
    });
  }
  ChosenAttitude chosen;
  if (all.empty()) {
    return asked ? Expected<ChosenAttitude>(
                       fail(ErrorKind::bad_input,
                            fmt::format(
                                "{}: no columns that their names call an attitude (qw qx qy qz, R11 to R33, roll pitch "
                                "yaw); --attitude-columns says which, --angle-file takes a table's one angle",
                                path)))
                 : chosen;
  }
  const AttitudeColumns& first = all.front();
  if (!asked && first.claim != AttitudeClaim::reference) {
    chosen.notes = not_used(**source, first);
    return chosen;
  }
  const bool in_log = choice.file.empty() || same_file(log_path, path);
  auto attitude = read_columns(path, **source, first, log, in_log);
  if (!attitude) {
    return tl::unexpected(attitude.error());
  }
  chosen.attitude = std::move(*attitude);
  chosen.notes =
      fmt::format("{} of {}: {}, {}", titles(**source, first.columns), path, form_words(first.form),
                  asked ? first.claim == AttitudeClaim::computed
                              ? "taken for a reference as told, though its name says that a filter computed it"
                              : "taken for a reference as told"
                        : "a reference by its name");
  return chosen;
}

}  // namespace selfcal::cli
