#include "protocol/import/import_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/import/units.hpp"
#include "protocol/recording/text_value.hpp"
#include "protocol/toml_file/nearest_word.hpp"
#include "protocol/toml_file/toml_text.hpp"

namespace selfcal::import {
namespace {

using Keys = std::vector<std::string_view>;

const std::map<std::string_view, Keys>& known_keys() {
  static const std::map<std::string_view, Keys> known{
      {"", {"map", "unsettled", "text", "recording", "site", "time", "gyro", "accelerometer", "gimbal", "temperature"}},
      {"text", {"separator", "decimal", "comment", "header_line", "first_line"}},
      {"recording", {"serial", "start_time_utc", "sample_rate_hz", "dwell_s", "rotation_s"}},
      {"site", {"latitude_deg", "longitude_deg", "height_m"}},
      {"time", {"column", "unit", "stamp", "interval", "origin", "resample", "leave_out_incomplete"}},
      {"gyro", {"columns", "kind", "unit", "scale", "zero", "axes"}},
      {"accelerometer", {"columns", "kind", "unit", "scale", "zero", "axes"}},
      {"gimbal", {"outer", "inner", "unit", "signs", "offsets_deg", "fixed_deg", "absent"}},
      {"temperature", {"columns", "unit"}}};
  return known;
}

// One table of the map. The first thing that is wrong is kept; what follows reads as nothing.
class Section {
 public:
  Section(const toml::table& root, std::string_view name, ImportMap& map, std::optional<Error>& fault)
      : name_(name), table_(name.empty() ? &root : root[name].as_table()), map_(map), fault_(fault) {
    if (!name.empty() && root.contains(name)) {
      note(std::string(name), root[name].node());
      if (table_ == nullptr) {
        refuse(name, "is no table");
      }
    }
    for (const auto& [key, value] : table()) {
      const Keys& known = known_keys().at(name);
      note(path(key.str()), &value);
      if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
        refuse(path(key.str()),
               fmt::format("unknown key{}", did_you_mean(key.str(), std::span<const std::string_view>(known))));
      }
    }
  }

  bool there() const { return table_ != nullptr; }
  bool has(std::string_view key) const { return table().contains(key); }

  bool is_text(std::string_view key) const { return has(key) && table().get(key)->is_string(); }

  void text(std::string_view key, std::string& to, const std::vector<std::string_view>& words = {}) {
    const toml::node* node = table().get(key);
    if (node == nullptr) {
      return;
    }
    const auto value = node->value_exact<std::string>();
    if (!value) {
      return refuse(path(key), "text between quotes is expected");
    }
    if (const auto wrong = text_fault(*value)) {
      return refuse(path(key), *wrong);
    }
    if (!words.empty() && std::find(words.begin(), words.end(), *value) == words.end()) {
      return refuse(path(key), fmt::format("\"{}\" is none of {}", one_line(*value), fmt::join(words, ", ")));
    }
    to = *value;
  }
  template <typename Number>
  void number(std::string_view key, Number& to) {
    if (const toml::node* node = table().get(key); node != nullptr) {
      if (const auto value = finite(*node, path(key))) {
        to = *value;
      }
    }
  }
  void count(std::string_view key, std::size_t& to) {
    double value = static_cast<double>(to);
    number(key, value);
    if (value < 0.0 || value > 1e6 || value != std::floor(value)) {
      return refuse(path(key), fmt::format("{} is no line number", value));
    }
    to = static_cast<std::size_t>(value);
  }
  void flag(std::string_view key, bool& to) {
    if (const toml::node* node = table().get(key); node != nullptr) {
      const auto value = node->value_exact<bool>();
      value ? void(to = *value) : refuse(path(key), "true or false is expected");
    }
  }
  // One number for all, or one for each.
  template <std::size_t N>
  void numbers(std::string_view key, std::array<double, N>& to, bool one_for_all) {
    const toml::node* node = table().get(key);
    if (node == nullptr) {
      return;
    }
    if (one_for_all && node->is_number()) {
      to.fill(finite(*node, path(key)).value_or(0.0));
      return;
    }
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != N) {
      return refuse(path(key), fmt::format("{} numbers in brackets are expected", N));
    }
    for (std::size_t k = 0; k < N; ++k) {
      to[k] = finite(*array->get(k), path(key)).value_or(0.0);
    }
  }
  std::optional<ColumnRef> column(std::string_view key) {
    const toml::node* node = table().get(key);
    return node == nullptr ? std::nullopt : reference(*node, path(key));
  }
  std::vector<ColumnRef> columns(std::string_view key, std::size_t count) {
    std::vector<ColumnRef> all;
    const toml::node* node = table().get(key);
    const toml::array* array = node == nullptr ? nullptr : node->as_array();
    if (node != nullptr && (array == nullptr || (count > 0 && array->size() != count))) {
      refuse(path(key), count > 0 ? fmt::format("{} columns in brackets are expected, names or numbers", count)
                                  : "columns in brackets are expected, names or numbers");
    }
    for (std::size_t k = 0; array != nullptr && k < array->size(); ++k) {
      all.push_back(reference(*array->get(k), path(key)).value_or(ColumnRef{}));
    }
    return all;
  }
  std::vector<std::string> words(std::string_view key) {
    std::vector<std::string> all;
    const toml::node* node = table().get(key);
    const toml::array* array = node == nullptr ? nullptr : node->as_array();
    if (node != nullptr && array == nullptr) {
      refuse(path(key), "words in brackets are expected");
    }
    for (std::size_t k = 0; array != nullptr && k < array->size(); ++k) {
      const auto value = array->get(k)->value_exact<std::string>();
      value ? all.push_back(one_line(*value)) : refuse(path(key), "words in brackets are expected");
    }
    return all;
  }
  void refuse(std::string_view key, std::string_view what) {
    if (!fault_) {
      fault_ = map_.error_at(key, what);
    }
  }
  // A doubted map may have holes: that it is doubted is said first, by who builds a recording of it.
  void miss(std::string_view key, std::string_view what) {
    if (map_.unsettled.empty()) {
      refuse(key, what);
    }
  }
  std::string path(std::string_view key) const {
    return name_.empty() ? std::string(key) : fmt::format("{}.{}", name_, key);
  }

 private:
  const toml::table& table() const {
    static const toml::table none;
    return table_ == nullptr ? none : *table_;
  }
  void note(std::string key, const toml::node* node) { map_.lines.emplace(std::move(key), node->source().begin.line); }
  std::optional<double> finite(const toml::node& node, std::string_view key) {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !std::isfinite(*value)) {
      refuse(key, "a finite number is expected");
      return std::nullopt;
    }
    return value;
  }
  std::optional<ColumnRef> reference(const toml::node& node, std::string_view key) {
    constexpr std::int64_t most = 100'000;
    if (const auto number = node.value_exact<std::int64_t>(); number && *number >= 1 && *number <= most) {
      return ColumnRef{static_cast<std::size_t>(*number), {}};
    }
    if (const auto name = node.value_exact<std::string>(); name && !name->empty()) {
      return ColumnRef{0, *name};
    }
    refuse(key, "a column is expected: its name, or its number from 1");
    return std::nullopt;
  }

  std::string_view name_;
  const toml::table* table_;
  ImportMap& map_;
  std::optional<Error>& fault_;
};

void read_axes(Section& section, TriadMap& triad) {
  constexpr std::string_view letters = "xyz";
  const std::vector<std::string> words = section.words("axes");
  if (!section.has("axes")) {
    return;
  }
  std::array<int, 3> used{};
  bool good = words.size() == triad.axes.size();
  for (std::size_t k = 0; good && k < triad.axes.size(); ++k) {
    std::string_view word = words[k];
    triad.axes[k].sign = word.starts_with('-') ? -1.0 : 1.0;
    word.remove_prefix(word.starts_with('-') || word.starts_with('+') ? 1 : 0);
    const std::size_t letter = word.size() == 1 ? letters.find(word) : std::string_view::npos;
    good = letter != std::string_view::npos && used.at(letter)++ == 0;
    triad.axes[k].column = good ? static_cast<int>(letter) : 0;
  }
  if (!good) {
    section.refuse(section.path("axes"), "three of x, y, z are expected, each once, with a sign or without");
  }
}

void read_triad(Section& section, bool gyro, TriadMap& triad) {
  if (!section.there()) {
    return section.miss(
        gyro ? "gyro" : "accelerometer",
        fmt::format("table missing: a recording holds both triads; 'selfcal poses --only {}' answers for a "
                    "log of one",
                    gyro ? "accelerometers" : "gyros"));
  }
  const std::vector<ColumnRef> columns = section.columns("columns", 3);
  std::string kind;
  section.text("kind", kind, {"rates", "increments"});
  section.text("unit", triad.unit);
  if (columns.empty() || kind.empty() || triad.unit.empty()) {
    section.miss(section.path(columns.empty() ? "columns" : kind.empty() ? "kind" : "unit"), "missing");
    return;
  }
  std::copy_n(columns.begin(), std::min(columns.size(), triad.columns.size()), triad.columns.begin());
  triad.increments = kind == "increments";
  const Quantity wanted = gyro ? (triad.increments ? Quantity::angle : Quantity::angular_rate)
                               : (triad.increments ? Quantity::velocity : Quantity::acceleration);
  const auto unit = find_unit(triad.unit);
  if (!unit || unit->quantity != wanted) {
    std::vector<std::string_view> fitting;
    for (const Unit& known : known_units()) {
      if (known.quantity == wanted) {
        fitting.push_back(known.name);
      }
    }
    section.refuse(section.path("unit"),
                   fmt::format("\"{}\" is no unit of {}: {}", one_line(triad.unit), kind, fmt::join(fitting, ", ")));
  }
  section.numbers("scale", triad.scale, true);
  section.numbers("zero", triad.zero, true);
  read_axes(section, triad);
}

void read_text(Section& section, ImportMap& map) {
  if (!section.there()) {
    return;
  }
  TextDialect dialect;
  std::string separator;
  std::string decimal;
  section.text("separator", separator, {",", ";", "tab", "blank"});
  section.text("decimal", decimal, {".", ","});
  section.text("comment", dialect.comment);
  section.count("header_line", dialect.header_line);
  section.count("first_line", dialect.first_line);
  if (separator.empty()) {
    return section.refuse("text.separator", "missing");
  }
  dialect.separator = separator == "tab" ? '\t' : separator == "blank" ? ' ' : separator.front();
  dialect.decimal = decimal == "," ? ',' : '.';
  if (dialect.first_line == 0 || dialect.header_line >= dialect.first_line) {
    section.refuse("text.first_line", "the numbers begin after the names, in line 1 at the earliest");
  }
  map.dialect = dialect;
}

void read_time(Section& section, ImportMap& map) {
  TimeMap& time = map.time;
  time.column = section.column("column");
  section.text("unit", time.unit, {"s", "ms", "100us", "us", "ns", "min", "h", "d", "date"});
  section.text("stamp", time.stamp, {"begin", "middle", "end"});
  section.text("interval", time.interval, {"nominal", "stamps"});
  section.flag("resample", time.resample);
  section.flag("leave_out_incomplete", time.leave_out_incomplete);
  if (std::string word; section.is_text("origin")) {
    section.text("origin", word, {"first"});
    time.origin_first = true;
  } else {
    section.number("origin", time.origin);
  }
  if (!time.column && !map.sample_rate_hz) {
    section.miss("time", "neither a column nor recording.sample_rate_hz");
  }
  if (!time.column && time.leave_out_incomplete) {
    section.refuse("time.leave_out_incomplete", "without a column nothing says how long a row that is left out was");
  }
  if (!time.column && (time.resample || time.interval == "stamps")) {
    section.refuse(time.resample ? "time.resample" : "time.interval", "without a column there are no stamps");
  }
}

void read_gimbal(Section& section, GimbalMap& gimbal) {
  gimbal.outer = section.column("outer");
  gimbal.inner = section.column("inner");
  section.text("unit", gimbal.unit, {"deg", "rad", "arcsec", "mrad", "arcmin", "deg/s", "rad/s", "rpm", "rev/s"});
  section.numbers("signs", gimbal.signs, false);
  section.numbers("offsets_deg", gimbal.offsets_deg, false);
  if (section.has("fixed_deg")) {
    section.numbers("fixed_deg", gimbal.fixed_deg.emplace(), false);
  }
  section.flag("absent", gimbal.absent);
  const int ways = (gimbal.outer || gimbal.inner ? 1 : 0) + (gimbal.fixed_deg ? 1 : 0) + (gimbal.absent ? 1 : 0);
  if (ways != 1) {
    section.miss("gimbal",
                 "one of these is expected: outer and inner or one of them, fixed_deg = [outer, inner], absent = true");
  }
  for (const double sign : gimbal.signs) {
    if (std::abs(sign) != 1.0) {
      section.refuse("gimbal.signs", fmt::format("{} is neither 1 nor -1", sign));
    }
  }
}

}  // namespace

Error ImportMap::error_at(std::string_view key, std::string_view what) const {
  const auto line = lines.find(key);
  return {ErrorKind::bad_input, line == lines.end()
                                    ? fmt::format("{}: {}: {}", name, one_line(key), what)
                                    : fmt::format("{}:{}: {}: {}", name, line->second, one_line(key), what)};
}

Expected<ImportMap> parse_import_map(std::string_view toml, const std::string& name) {
  const Expected<toml::table> table = parse_toml(toml, name);
  if (!table) {
    return tl::unexpected(table.error());
  }
  ImportMap map;
  map.name = name;
  std::optional<Error> fault;
  const auto section = [&](std::string_view key) { return Section(*table, key, map, fault); };
  Section root = section("");
  double version = 0.0;
  root.number("map", version);
  if (version != 1.0) {
    root.refuse("map", "map = 1 is expected in a map of columns");
  }
  map.unsettled = root.words("unsettled");
  Section text = section("text");
  read_text(text, map);
  Section recording = section("recording");
  recording.text("serial", map.serial);
  recording.text("start_time_utc", map.start_time_utc);
  recording.number("sample_rate_hz", map.sample_rate_hz);
  recording.number("dwell_s", map.dwell_s);
  recording.number("rotation_s", map.rotation_s);
  Section site = section("site");
  site.number("latitude_deg", map.latitude_deg);
  site.number("longitude_deg", map.longitude_deg);
  site.number("height_m", map.height_m);
  Section time = section("time");
  read_time(time, map);
  Section gyro = section("gyro");
  read_triad(gyro, true, map.gyro);
  Section accelerometer = section("accelerometer");
  read_triad(accelerometer, false, map.accelerometer);
  Section gimbal = section("gimbal");
  read_gimbal(gimbal, map.gimbal);
  Section temperature = section("temperature");
  map.temperature = temperature.columns("columns", 0);
  temperature.text("unit", map.temperature_unit, {"C", "K", "F"});
  if (fault) {
    return tl::unexpected(*fault);
  }
  return map;
}

}  // namespace selfcal::import
