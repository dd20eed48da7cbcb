#include "protocol/recording/csv_attributes.hpp"

#include <fmt/format.h>

#include "protocol/recording/text_value.hpp"
#include "protocol/toml_file/toml_file.hpp"

namespace selfcal {
namespace {

Expected<void> check_format(const TomlFile& file) {
  const Expected<std::string> format = file.text("format");
  if (!format) {
    return tl::unexpected(format.error());
  }
  if (*format != recording_format) {
    return tl::unexpected(file.error_at("format", fmt::format("\"{}\", \"{}\" expected", *format, recording_format)));
  }
  const Expected<double> version = file.number("version");
  if (!version) {
    return tl::unexpected(version.error());
  }
  if (*version != recording_version) {
    return tl::unexpected(file.error_at("version", fmt::format("{}, {} expected", *version, recording_version)));
  }
  return {};
}

Expected<std::string> sound_text(const TomlFile& file, std::string_view key) {
  Expected<std::string> text = file.text(key);
  if (text) {
    if (const auto fault = text_fault(*text)) {
      return tl::unexpected(file.error_at(key, *fault));
    }
  }
  return text;
}

// A TOML basic string. text_fault() keeps control characters out of what we write.
std::string toml_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
    }
    out += c;
  }
  return out + '"';
}

// A TOML float needs a point or an exponent; "{}" gives the shortest text that reads back to the same bits.
std::string number_text(double value) { return fmt::format("{}", value); }

}  // namespace

Expected<Recording> parse_attributes(std::string_view toml, const std::string& name) {
  const Expected<TomlFile> file = TomlFile::parse(toml, name);
  if (!file) {
    return tl::unexpected(file.error());
  }
  if (const auto format = check_format(*file); !format) {
    return tl::unexpected(format.error());
  }
  Recording recording;
  const auto keep = [](auto&& from, auto& to) -> Expected<void> {
    if (!from) {
      return tl::unexpected(from.error());
    }
    to = std::move(*from);
    return {};
  };
  Expected<void> read = keep(sound_text(*file, "serial"), recording.serial);
  if (read) {
    read = keep(file->number("sample_rate_hz"), recording.sample_rate_hz);
  }
  if (read) {
    read = keep(file->number("latitude_deg"), recording.latitude_deg);
  }
  if (read) {
    read = keep(file->number("longitude_deg"), recording.longitude_deg);
  }
  if (read) {
    read = keep(file->number("height_m"), recording.height_m);
  }
  if (read) {
    read = keep(file->optional_number("dwell_s"), recording.dwell_s);
  }
  if (read) {
    read = keep(file->optional_number("rotation_s"), recording.rotation_s);
  }
  if (read && file->has("start_time_utc")) {
    read = keep(sound_text(*file, "start_time_utc"), recording.start_time_utc);
  }
  std::string gimbal;
  if (read && file->has("gimbal")) {
    read = keep(sound_text(*file, "gimbal"), gimbal);
  }
  recording.gimbal_absent = gimbal == gimbal_absent_word;
  if (read && file->has("schedule_deg")) {
    read = keep(file->pairs("schedule_deg"), recording.schedule_deg);
  }
  if (!read) {
    return tl::unexpected(read.error());
  }
  return recording;
}

std::string format_attributes(const Recording& recording) {
  std::string text = fmt::format("format = {}\nversion = {}\nserial = {}\n", toml_string(recording_format),
                                 recording_version, toml_string(recording.serial));
  const auto add = [&text](std::string_view key, double value) {
    text += fmt::format("{} = {}\n", key, number_text(value));
  };
  add("sample_rate_hz", recording.sample_rate_hz);
  add("latitude_deg", recording.latitude_deg);
  add("longitude_deg", recording.longitude_deg);
  add("height_m", recording.height_m);
  if (recording.dwell_s) {
    add("dwell_s", *recording.dwell_s);
  }
  if (recording.rotation_s) {
    add("rotation_s", *recording.rotation_s);
  }
  if (!recording.start_time_utc.empty()) {
    text += fmt::format("start_time_utc = {}\n", toml_string(recording.start_time_utc));
  }
  if (recording.gimbal_absent) {
    text += fmt::format("gimbal = {}\n", toml_string(gimbal_absent_word));
  }
  if (!recording.schedule_deg.empty()) {
    text += "# outer, inner\nschedule_deg = [\n";
    for (const auto& [outer, inner] : recording.schedule_deg) {
      text += fmt::format("  [{}, {}],\n", number_text(outer), number_text(inner));
    }
    text += "]\n";
  }
  return text;
}

}  // namespace selfcal
