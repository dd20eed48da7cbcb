#include "protocol/import/novatel.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "protocol/import/line_reader.hpp"
#include "protocol/import/text_dialect.hpp"

namespace selfcal::import {
namespace {

constexpr std::size_t lines_to_judge = 2000;

// "#NAMEA,port,...;fields*checksum" with a long header, "%NAMEA,week,seconds;fields*checksum" with a short one.
struct Line {
  std::string_view name, fields;
  bool sound = false;  // the checksum is that of the line
};

std::optional<Line> log_line(std::string_view text) {
  text = trimmed(text);
  if (text.empty() || (text.front() != '#' && text.front() != '%')) {
    return std::nullopt;
  }
  const std::string_view body = text.substr(1, text.rfind('*') - 1);
  const std::size_t comma = body.find(','), semicolon = body.find(';');
  Line line;
  line.name = body.substr(0, comma);
  const auto is_of_name = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; };
  if (semicolon == std::string_view::npos || comma > semicolon || !line.name.ends_with('A') ||
      !std::all_of(line.name.begin(), line.name.end(), is_of_name)) {
    return std::nullopt;
  }
  line.fields = body.substr(semicolon + 1);
  constexpr std::size_t digits = 8;
  const std::string_view checksum = text.substr(std::min(text.size(), body.size() + 2));
  std::uint32_t stated = 0;
  const auto [end, error] = std::from_chars(checksum.data(), checksum.data() + checksum.size(), stated, 16);
  // The polynomial is zlib's; the register begins at zero, and is not inverted at the end.
  constexpr unsigned long all = 0xFFFFFFFFUL;
  const unsigned long own =
      crc32(all, reinterpret_cast<const Bytef*>(body.data()), static_cast<unsigned int>(body.size())) ^ all;
  line.sound = checksum.size() == digits && error == std::errc{} && end == checksum.data() + digits && stated == own;
  return line;
}

// Where the week stands among the fields; the other one's first fields are what is wrong with the IMU, and its type.
std::optional<std::size_t> week_of(std::string_view name) {
  if (name == "RAWIMUA" || name == "RAWIMUSA") {
    return 0;
  }
  return name == "RAWIMUXA" || name == "RAWIMUSXA" ? std::optional<std::size_t>(2) : std::nullopt;
}

// Behind the week: seconds, status, z, -y and x of the accelerometers, and of the gyros.
constexpr std::size_t fields_from_week = 9;
struct Column {
  std::string_view name;
  std::size_t behind = 0;  // the week
  double sign = 1.0;
};
constexpr std::array<Column, 8> columns{{{"gnss_time_s", 1, 1.0},
                                         {"imu_status", 2, 1.0},
                                         {"accelerometer_increment_x", 5, 1.0},
                                         {"accelerometer_increment_y", 4, -1.0},
                                         {"accelerometer_increment_z", 3, 1.0},
                                         {"gyro_increment_x", 8, 1.0},
                                         {"gyro_increment_y", 7, -1.0},
                                         {"gyro_increment_z", 6, 1.0}}};
constexpr std::size_t time = 0, status = 1;

class NovatelSource final : public ColumnSource {
 public:
  NovatelSource(std::filesystem::path file, std::string name)
      : file_(std::move(file)), name_(std::move(name)), week_(*week_of(name_)) {
    for (const Column& column : columns) {
      names_.emplace_back(column.name);
    }
  }

  const std::vector<std::string>& names() const override { return names_; }
  const std::vector<std::string>& units() const override { return units_; }
  std::string form() const override { return fmt::format("NovAtel {}, other lines passed over", name_); }
  std::string put_together() const override {
    return fmt::format(
        "NovAtel {}: the time is GNSS week and seconds, y of both triads is the log's -y, and increments are counts "
        "whose "
        "size the maker's table of the IMU's type says",
        name_);
  }
  Expected<ColumnData> read(const ColumnRequest& request) const override;

 private:
  tl::unexpected<Error> bad(std::size_t line, std::string_view what) const {
    return fail(ErrorKind::bad_input, fmt::format("{}: line {}: {}: {}", file_.string(), line, name_, what));
  }
  // What is no number is none: a line that was cut has no more.
  long double value(const std::vector<std::string_view>& fields, std::size_t column) const {
    const TextDialect plain;
    const Column& of = columns.at(column);
    const std::size_t at = week_ + of.behind;
    const auto number = [&](std::size_t k) {
      const std::string hex = column == status && k < fields.size() ? fmt::format("0x{}", fields[k]) : std::string();
      const auto read = k < fields.size() ? long_number_of(hex.empty() ? fields[k] : hex, plain) : std::nullopt;
      return read.value_or(static_cast<long double>(NAN));
    };
    constexpr long double week_s = 604800.0L;
    return column == time ? week_s * number(week_) + number(at) : static_cast<long double>(of.sign) * number(at);
  }

  std::filesystem::path file_;
  std::string name_;
  std::size_t week_;
  std::vector<std::string> names_, units_;
};

Expected<ColumnData> NovatelSource::read(const ColumnRequest& request) const {
  Expected<LineReader> reader = LineReader::open(file_);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  ColumnData data;
  data.values.resize(request.columns.size());
  std::string_view text;
  std::vector<std::string_view> fields;
  for (;;) {
    const Expected<bool> more = reader->next(text);
    if (!more) {
      return tl::unexpected(more.error());
    }
    if (!*more) {
      break;
    }
    const std::optional<Line> line = log_line(text);
    if (!line || line->name != name_) {
      continue;
    }
    if (data.rows == request.most_rows) {
      if (!request.tolerant) {
        return bad(reader->number(), fmt::format("more than {} lines of it", request.most_rows));
      }
      data.left_out = true;
      break;
    }
    split_fields(line->sound ? line->fields : std::string_view{}, ',', fields);
    if (!request.tolerant && !line->sound) {
      return bad(reader->number(), "the checksum is another than the line's");
    }
    const auto take = [&](std::size_t column) { return value(fields, column); };
    for (std::size_t k = 0; k < request.columns.size(); ++k) {
      const long double v = take(request.columns[k]);
      if (!request.tolerant && !std::isfinite(v)) {
        return bad(reader->number(), fmt::format("{} is no number", title(request.columns[k])));
      }
      data.values[k].push_back(static_cast<double>(v));
    }
    if (request.stamp) {
      const long double v = request.stamp_is_date ? static_cast<long double>(NAN) : take(*request.stamp);
      if (!request.tolerant && !std::isfinite(v)) {
        return bad(reader->number(),
                   fmt::format("{} is no {}", title(*request.stamp), request.stamp_is_date ? "date" : "number"));
      }
      data.stamps.push_back(v);
    }
    const std::size_t ahead = reader->number() - data.rows;
    if (data.skipped.empty() || data.skipped.back().second != ahead) {
      data.skipped.emplace_back(data.rows, ahead);
    }
    ++data.rows;
  }
  data.first_line = data.skipped.empty() ? 0 : data.skipped.front().second;
  return data;
}

}  // namespace

Expected<std::unique_ptr<ColumnSource>> open_novatel(const std::filesystem::path& file) {
  Expected<LineReader> reader = LineReader::open(file);
  std::string_view text;
  std::string damaged, corrected, other;
  std::vector<std::string_view> fields;
  while (reader && reader->number() < lines_to_judge) {
    const Expected<bool> more = reader->next(text);
    if (!more || !*more) {
      break;
    }
    const std::optional<Line> line = log_line(text);
    if (!line) {
      continue;
    }
    if (const auto week = week_of(line->name)) {
      split_fields(line->fields, ',', fields);
      if (line->sound && fields.size() == *week + fields_from_week) {
        return std::make_unique<NovatelSource>(file, std::string(line->name));
      }
      damaged = damaged.empty() ? fmt::format("line {}: {}", reader->number(), line->name) : damaged;
    } else if (line->sound) {
      (line->name.find("CORRIMU") != std::string_view::npos ? corrected : other) = line->name;
    }
  }
  if (!damaged.empty()) {
    return fail(
        ErrorKind::bad_input,
        fmt::format("{}: {}: the checksum is another than the line's, or fields lack, and no line of such logs is "
                    "sound",
                    file.string(), damaged));
  }
  if (!corrected.empty()) {
    return fail(
        ErrorKind::bad_input,
        fmt::format("{}: NovAtel {}: the receiver has taken gravity, the Earth's rate and the biases out; RAWIMU "
                    "or RAWIMUX holds what the sensors read",
                    file.string(), corrected));
  }
  if (!other.empty()) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: a NovAtel log ({}) without lines of RAWIMU or RAWIMUX", file.string(), other));
  }
  return std::unique_ptr<ColumnSource>();
}

}  // namespace selfcal::import
