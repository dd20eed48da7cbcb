#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "protocol/import/import_map.hpp"

namespace selfcal::import {
namespace {

using Remarks = std::multimap<std::string, std::string>;

// A TOML basic string (column names come from the file: any letter may be in them).
std::string toml_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) {
      out += fmt::format("\\u{:04X}", byte);
      continue;
    }
    if (c == '"' || c == '\\') {
      out += '\\';
    }
    out += c;
  }
  return out + '"';
}

// "{}" gives the shortest text that reads back to the same bits; TOML wants no sign of plus in an exponent's place.
std::string number(double value) { return fmt::format("{}", value); }

std::string column(const ColumnRef& ref) {
  return ref.number > 0 ? fmt::format("{}", ref.number) : toml_text(ref.name);
}

template <typename Range, typename Write>
std::string list(const Range& values, Write write) {
  std::string out = "[";
  for (const auto& value : values) {
    out += out.size() > 1 ? ", " : "";
    out += write(value);
  }
  return out + "]";
}

class Writer {
 public:
  explicit Writer(const Remarks& remarks) : remarks_(remarks) {}

  void remark(const std::string& key) {
    const auto [first, last] = remarks_.equal_range(key);
    for (auto it = first; it != last; ++it) {
      out_ += "# " + it->second + "\n";
    }
  }
  void table(const std::string& name) {
    out_ += "\n";
    remark(name);
    out_ += "[" + name + "]\n";
    table_ = name;
  }
  void line(const std::string& key, const std::string& value) {
    remark(table_.empty() ? key : table_ + "." + key);
    out_ += key;
    out_ += " = ";
    out_ += value;
    out_ += "\n";
  }
  // What somebody is to fill in.
  void open(const std::string& key, const std::string& hint) {
    remark(table_ + "." + key);
    out_ += "# " + key + " = " + hint + "\n";
  }
  void raw(std::string_view text) { out_ += text; }
  std::string take() { return std::move(out_); }

 private:
  const Remarks& remarks_;
  std::string table_;
  std::string out_;
};

void write_triad(Writer& out, const std::string& name, const TriadMap& triad) {
  constexpr std::string_view letters = "xyz";
  out.table(name);
  const bool known = triad.columns[0].number > 0 || !triad.columns[0].name.empty();
  known ? out.line("columns", list(triad.columns, column)) : out.open("columns", "[2, 3, 4]   # names or numbers");
  out.line("kind", triad.increments ? "\"increments\"" : "\"rates\"");
  triad.unit.empty() ? out.open("unit", name == "gyro" ? "\"rad/s\"" : "\"m/s^2\"")
                     : out.line("unit", toml_text(triad.unit));
  if (triad.scale != std::array<double, 3>{1.0, 1.0, 1.0}) {
    out.line("scale", list(triad.scale, number));
  }
  if (triad.zero != std::array<double, 3>{}) {
    out.line("zero", list(triad.zero, number));
  }
  out.line("axes", list(triad.axes, [&](const AxisSource& axis) {
             return fmt::format("\"{}{}\"", axis.sign < 0.0 ? "-" : "", letters[static_cast<std::size_t>(axis.column)]);
           }));
}

void write_optional(Writer& out, const char* key, const std::optional<double>& value, const char* hint) {
  value ? out.line(key, number(*value)) : out.open(key, hint);
}

void write_file(Writer& out, const ImportMap& map) {
  if (map.dialect) {
    const TextDialect& d = *map.dialect;
    out.table("text");
    out.line("separator", d.separator == '\t'  ? "\"tab\""
                          : d.separator == ' ' ? "\"blank\""
                                               : toml_text(std::string_view(&d.separator, 1)));
    out.line("decimal", toml_text(std::string_view(&d.decimal, 1)));
    out.line("comment", toml_text(d.comment));
    out.line("header_line", fmt::format("{}", d.header_line));
    out.line("first_line", fmt::format("{}", d.first_line));
  }
  out.table("recording");
  out.line("serial", toml_text(map.serial));
  if (!map.start_time_utc.empty()) {
    out.line("start_time_utc", toml_text(map.start_time_utc));
  }
  write_optional(out, "sample_rate_hz", map.sample_rate_hz, "100.0");
  out.table("site");
  write_optional(out, "latitude_deg", map.latitude_deg, "48.0      # WGS-84, north positive");
  write_optional(out, "longitude_deg", map.longitude_deg, "11.0     # east positive");
  write_optional(out, "height_m", map.height_m, "500.0         # above the ellipsoid");
}

void write_time(Writer& out, const TimeMap& time) {
  out.table("time");
  if (!time.column) {
    out.raw("# No column: rows follow each other at recording.sample_rate_hz.\n");
    return;
  }
  out.line("column", column(*time.column));
  out.line("unit", toml_text(time.unit));
  if (time.origin_first) {
    out.line("origin", "\"first\"");
  } else if (time.origin) {
    out.line("origin", number(*time.origin));
  }
  out.line("stamp", toml_text(time.stamp));
  out.line("interval", toml_text(time.interval));
  out.line("resample", time.resample ? "true" : "false");
  if (time.leave_out_incomplete) {
    out.line("leave_out_incomplete", "true");
  }
}

void write_gimbal(Writer& out, const GimbalMap& gimbal) {
  out.table("gimbal");
  if (gimbal.absent) {
    return out.line("absent", "true");
  }
  if (gimbal.fixed_deg) {
    return out.line("fixed_deg", list(*gimbal.fixed_deg, number));
  }
  if (!gimbal.outer && !gimbal.inner) {
    out.open("outer", "8            # and inner = 9, or one of them; or fixed_deg = [0, 0]; or absent = true");
    return;
  }
  if (gimbal.outer) {
    out.line("outer", column(*gimbal.outer));
  }
  if (gimbal.inner) {
    out.line("inner", column(*gimbal.inner));
  }
  out.line("unit", toml_text(gimbal.unit));
  out.line("signs", list(gimbal.signs, number));
  if (gimbal.offsets_deg != std::array<double, 2>{}) {
    out.line("offsets_deg", list(gimbal.offsets_deg, number));
  }
}

}  // namespace

std::string format_import_map(const ImportMap& map, const Remarks& remarks, std::string_view heading) {
  Writer out(remarks);
  out.raw(heading);
  out.raw("map = 1\n");
  if (!map.unsettled.empty()) {
    out.raw(
        "\n# Only who knows the instrument can say these. Write below what is right and take the word off this list;\n"
        "# `selfcal import` writes no recording while a word stands here.\n");
  }
  out.line("unsettled", list(map.unsettled, toml_text));
  write_file(out, map);
  write_time(out, map.time);
  write_triad(out, "gyro", map.gyro);
  write_triad(out, "accelerometer", map.accelerometer);
  write_gimbal(out, map.gimbal);
  if (!map.temperature.empty()) {
    out.table("temperature");
    out.line("columns", list(map.temperature, column));
    out.line("unit", toml_text(map.temperature_unit));
  }
  return out.take();
}

}  // namespace selfcal::import
