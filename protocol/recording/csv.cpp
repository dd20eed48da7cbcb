#include "protocol/recording/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <new>
#include <optional>

#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/csv_attributes.hpp"

namespace selfcal {
namespace {

constexpr std::size_t most_temperature_channels = 64;
constexpr std::string_view temperature_name = "temperature_c";
constexpr const char* required_columns[] = {
    "time_s",        "delta_theta_rad_x", "delta_theta_rad_y", "delta_theta_rad_z", "delta_v_mps_x",
    "delta_v_mps_y", "delta_v_mps_z",     "gimbal_outer_rad",  "gimbal_inner_rad"};
constexpr std::size_t required_count = std::size(required_columns);

tl::unexpected<Error> bad(const std::string& name, std::size_t line, std::string_view what) {
  return fail(ErrorKind::bad_input, fmt::format("{}: line {}: {}", name, line, what));
}

// Splits off the next line (without CR), advancing `text`.
std::string_view next_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  return line;
}

std::string_view next_field(std::string_view& line, bool& more) {
  const std::size_t end = line.find(',');
  more = end != std::string_view::npos;
  std::string_view field = line.substr(0, end);
  line.remove_prefix(more ? end + 1 : line.size());
  while (field.starts_with(' ')) {
    field.remove_prefix(1);
  }
  while (field.ends_with(' ')) {
    field.remove_suffix(1);
  }
  return field;
}

// Which slot of a row (required columns, then temperature channels) each field of the file belongs to.
struct Header {
  static constexpr int ignored = -1;
  std::vector<int> slots;
  std::size_t temperature_channels = 0;
};

// "temperature_c" is channel 0; "temperature_c_<k>" channel k.
std::optional<std::size_t> temperature_channel(std::string_view column) {
  if (column == temperature_name) {
    return 0;
  }
  if (!column.starts_with(temperature_name) || column.size() < temperature_name.size() + 2 ||
      column[temperature_name.size()] != '_') {
    return std::nullopt;
  }
  const std::string_view digits = column.substr(temperature_name.size() + 1);
  std::size_t channel = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), channel);
  if (error != std::errc{} || end != digits.data() + digits.size() || channel >= most_temperature_channels) {
    return std::nullopt;
  }
  return channel;
}

int slot_of(std::string_view column) {
  for (std::size_t k = 0; k < required_count; ++k) {
    if (column == required_columns[k]) {
      return static_cast<int>(k);
    }
  }
  const auto channel = temperature_channel(column);
  return channel ? static_cast<int>(required_count + *channel) : Header::ignored;
}

Expected<Header> parse_header(std::string_view line, const std::string& name) {
  Header header;
  for (const auto& [separator, words] : {std::pair{';', "semicolons"}, std::pair{'\t', "tabs"}}) {
    if (line.find(separator) != std::string_view::npos && line.find(',') == std::string_view::npos) {
      return bad(name, 1, fmt::format("{} between the fields; commas are expected, and points in numbers", words));
    }
  }
  std::array<bool, required_count + most_temperature_channels> seen{};
  for (bool more = true; more;) {
    const std::string_view column = next_field(line, more);
    const int slot = slot_of(column);
    header.slots.push_back(slot);
    if (slot == Header::ignored) {
      continue;
    }
    const auto index = static_cast<std::size_t>(slot);
    if (seen[index]) {
      return bad(name, 1, fmt::format("column {} appears twice", column));
    }
    seen[index] = true;
    if (index >= required_count) {
      header.temperature_channels = std::max(header.temperature_channels, index - required_count + 1);
    }
  }
  for (std::size_t k = 0; k < required_count + header.temperature_channels; ++k) {
    if (!seen[k]) {
      return bad(name, 1,
                 k < required_count ? fmt::format("column {} missing", required_columns[k])
                                    : fmt::format("column {}_{} missing", temperature_name, k - required_count));
    }
  }
  return header;
}

std::string quoted_field(std::string_view field) {
  constexpr std::size_t longest = 40;
  return fmt::format("\"{}\"{}", field.substr(0, longest), field.size() > longest ? "..." : "");
}

Expected<void> parse_row(std::string_view line, const Header& header, const std::string& name, std::size_t line_number,
                         std::vector<double>& values) {
  std::size_t column = 0;
  for (bool more = true; more; ++column) {
    const std::string_view field = next_field(line, more);
    if (column >= header.slots.size()) {
      return bad(name, line_number, fmt::format("more than the {} fields of the header", header.slots.size()));
    }
    const int slot = header.slots[column];
    if (slot == Header::ignored) {
      continue;
    }
    const char* begin = field.starts_with('+') ? field.data() + 1 : field.data();
    const char* const end = field.data() + field.size();
    double& value = values[static_cast<std::size_t>(slot)];
    const auto [stopped, error] = std::from_chars(begin, end, value);
    if (error != std::errc{} || stopped != end) {
      const auto index = static_cast<std::size_t>(slot);
      const std::string_view title = index < required_count ? required_columns[index] : temperature_name;
      return bad(name, line_number, fmt::format("{}: {} is not a number", title, quoted_field(field)));
    }
  }
  if (column < header.slots.size()) {
    return bad(name, line_number, fmt::format("{} fields where the header has {}", column, header.slots.size()));
  }
  return {};
}

void append_row(const std::vector<double>& v, Recording& recording) {
  recording.time_s.push_back(v[0]);
  recording.delta_theta_rad.push_back({v[1], v[2], v[3]});
  recording.delta_v_mps.push_back({v[4], v[5], v[6]});
  recording.gimbal_outer_rad.push_back(v[7]);
  recording.gimbal_inner_rad.push_back(v[8]);
  recording.temperature_c.insert(recording.temperature_c.end(), v.begin() + required_count, v.end());
}

Expected<void> parse_samples(std::string_view csv, const std::string& name, Recording& recording) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";  // spreadsheets begin their UTF-8 with it
  if (csv.starts_with(byte_order_mark)) {
    csv.remove_prefix(byte_order_mark.size());
  }
  const Expected<Header> header = parse_header(next_line(csv), name);
  if (!header) {
    return tl::unexpected(header.error());
  }
  recording.temperature_channels = header->temperature_channels;
  std::vector<double> values(required_count + header->temperature_channels);
  for (std::size_t line_number = 2; !csv.empty(); ++line_number) {
    const std::string_view line = next_line(csv);
    if (line.empty() && csv.empty()) {
      break;
    }
    if (auto row = parse_row(line, *header, name, line_number, values); !row) {
      return row;
    }
    append_row(values, recording);
  }
  return {};
}

std::filesystem::path attributes_path(std::filesystem::path path) { return path.replace_extension(".toml"); }

std::string header_line(const Recording& recording) {
  std::string line = fmt::format("{}", fmt::join(required_columns, ","));
  for (std::size_t k = 0; k < recording.temperature_channels; ++k) {
    line += recording.temperature_channels == 1 ? fmt::format(",{}", temperature_name)
                                                : fmt::format(",{}_{}", temperature_name, k);
  }
  return line + "\n";
}

std::string format_samples(const Recording& recording) {
  constexpr std::size_t typical_line = 180;
  std::string text = header_line(recording);
  text.reserve(recording.size() * typical_line);
  const auto out = std::back_inserter(text);
  for (std::size_t k = 0; k < recording.size(); ++k) {
    const auto& theta = recording.delta_theta_rad[k];
    const auto& velocity = recording.delta_v_mps[k];
    fmt::format_to(out, "{},{},{},{},{},{},{},{},{}", recording.time_s[k], theta[0], theta[1], theta[2], velocity[0],
                   velocity[1], velocity[2], recording.gimbal_outer_rad[k], recording.gimbal_inner_rad[k]);
    for (std::size_t channel = 0; channel < recording.temperature_channels; ++channel) {
      fmt::format_to(out, ",{}", recording.temperature_c[k * recording.temperature_channels + channel]);
    }
    text.push_back('\n');
  }
  return text;
}

}  // namespace

Expected<LoadedRecording> parse_csv(std::string_view csv, std::string_view attributes_toml, const std::string& name,
                                    const CheckPolicy& policy) {
  try {
    Expected<Recording> recording = parse_attributes(attributes_toml, attributes_path(name).string());
    if (!recording) {
      return tl::unexpected(recording.error());
    }
    if (const auto samples = parse_samples(csv, name, *recording); !samples) {
      return tl::unexpected(samples.error());
    }
    auto warnings = check_recording(*recording, policy);
    if (!warnings) {
      return fail(warnings.error().kind, name + ": " + warnings.error().message);
    }
    return LoadedRecording{std::move(*recording), std::move(*warnings)};
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::bad_input, name + ": does not fit into memory");
  }
}

Expected<LoadedRecording> read_csv(const std::filesystem::path& path, const CheckPolicy& policy) {
  constexpr std::size_t longest_attributes = std::size_t{1} << 20;
  constexpr std::size_t longest_csv = std::size_t{1} << 36;
  const Expected<std::string> attributes = read_text_file(attributes_path(path), longest_attributes);
  if (!attributes) {
    return tl::unexpected(attributes.error());
  }
  const Expected<std::string> csv = read_text_file(path, longest_csv);
  if (!csv) {
    return tl::unexpected(csv.error());
  }
  return parse_csv(*csv, *attributes, path.string(), policy);
}

Expected<void> write_csv(const Recording& recording, const std::filesystem::path& path) {
  if (auto attributes = write_file_atomically(attributes_path(path), format_attributes(recording)); !attributes) {
    return attributes;
  }
  return write_file_atomically(path, format_samples(recording));
}

}  // namespace selfcal
