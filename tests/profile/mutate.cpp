// Profiles made wrong in one place, drawn from a seed: none may be accepted, and what is told must name the line.
// usage: profile_mutate [COUNT [SEED]]
//
// Each way is wrong by construction: what it writes breaks a rule of the reader's, whatever stands around it. As the control
// that the reader does not refuse everything, changes that mean nothing (comments, blanks, order) must be accepted.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <random>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "protocol/profile/read_profile.hpp"

namespace selfcal::profile {
namespace {

using Lines = std::vector<std::string>;
// Beside the DBC that a profile names.
const std::string file_name = SELFCAL_SOURCE_DIR "/config/profiles/m.toml";
using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t count) {
  return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
}

std::string text_of(const Lines& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += line + "\n";
  }
  return text;
}

// A mutant, and the lines (from 0) of which one must be named.
struct Mutant {
  Lines lines;
  std::size_t first = 0, last = 0;
};

// A line that matches, with a part of it replaced; the replacement may be drawn.
struct Way {
  std::string name;
  std::string pattern;
  std::vector<std::string> replacements;  // of ECMAScript's $1
  bool whole_section = false;             // the fault may be told anywhere in the line's section
  std::string not_if = {};                // lines that match this are left alone
};

const std::vector<Way>& ways() {
  static const std::vector<Way> all{
      {"unknown key in a table", R"(^(\w+)( = ))", {"$1q$2", "q$1$2"}},
      {"unknown key in a field", R"(\b(type|at|unit|scale|count) = )", {"$1x = ", "x$1 = "}},
      {"unknown field", R"(fields\.(\w+) = \{ at)", {"fields.$1_no = { at", "fields.x$1 = { at"}, false, "constant"},
      {"needed line left out",
       R"(^(request|response|functional|method|serial|software|in_force|inactive|routine|did|ins_address|)"
       R"(tester_address|addressing|address|name) = .*)",
       {"# left out"},
       true},
      {"needed field left out",
       R"(^(\w+\.)*fields\.(state|power_cycles|positions|rotation|outer|inner|dwell|run_id|pages_written|)"
       R"(pages_expected|samples|complete|sequence|delta_theta|delta_v|sample_rate|version|values|)"
       R"(gyro_drift|accel_bias|latitude|elapsed|done|duration) = .*)",
       {"# left out"},
       true,
       R"(result\.fields\.pages_written)"},
      {"number as text", R"(= (0x[0-9A-F]+|\d+)\b(?!\.))", {"= \"$1\""}},
      {"number as a truth value", R"(\bat = \d+)", {"at = true"}},
      {"negative number", R"(= (0x[0-9A-F]+|\d+)\b(?!\.))", {"= -1"}, false, R"(offset|constant)"},
      {"fraction of a byte", R"(\bat = (\d+))", {"at = $1.5"}},
      {"identifier too large",
       R"(^(did|serial|software|in_force|inactive|factory|routine) = 0x[0-9A-F]+)",
       {"$1 = 0x10000"}},
      {"address too large",
       R"(^(request|response|functional|status|ins_address|tester_address) = 0x[0-9A-F]+)",
       {"$1 = 0x20000000"}},
      {"identifier twice", R"(^(did|software|in_force|inactive|factory) = 0x[0-9A-F]+)", {"$1 = @SERIAL@"}},
      {"routine twice", R"(^routine = 0x(0302|0303|0304|E010|E011|E020))", {"routine = @ROTATE@"}},
      {"unknown type", R"(type = "\w+")", {"type = \"u7\"", "type = \"float\"", "type = \"\"", "type = \"U8\""}},
      {"unit of another quantity", R"(unit = "[^"]+")", {"unit = \"K\"", "unit = \"degree\"", "unit = \"kg\""}},
      {"byte outside the record",
       R"(^((?:start\.|result\.)?fields\.\w+ = \{ )at = \d+)",
       {"$1at = 60000", "$1at = 70000"},
       false,
       R"(positions|rotation = )"},
      {"fields on each other", R"(^((?:start\.|result\.)?fields\.\w+ = \{ )at = \d+)", {"$1at = @OTHER@"}},
      {"repeated fields on each other", R"(^(each\.fields\.\w+ = \{ )at = \d+)", {"$1at = @OTHER@"}},
      {"repetition too short", R"(^each\.stride = \d+)", {"each.stride = 1"}, true},
      {"count of no field", R"(^each\.count = "\w+")", {"each.count = \"number\""}},
      {"record too short",
       R"(^((?:start\.|result\.)?bytes) = (5|6|11|12|17|19|20|24|25|33|38|204|260|1024)$)",
       {"$1 = 1", "$1 = 3"},
       true},
      {"code twice", R"(((?:starting|factory|no) = )\w+, (\w+ = )\w+)", {"$011, $021"}},
      {"unknown word", R"(\b(rotating|factory|yes) = )", {"$1g = "}},
      {"word left out", R"(\b(idle|aborted|b|yes) = \w+(?:, | (?=\})))", {""}, false, R"(^\w+ = )"},
      {"code too large", R"(\b(starting|factory|no) = \w+)", {"$1 = 65536"}},
      {"elements too few", R"(count = (3|6|24) )", {"count = 2 "}, true},
      {"unknown checksum", R"(algorithm = "\w+")", {"algorithm = \"md5\""}},
      {"checksum beyond the record", R"(\bto = \d+)", {"to = 65000", "to = 0"}},
      {"checksum of another width", R"re(^(checksum = \{ at = \d+, type = )"u\d+")re", {"$1\"u8\"", "$1\"u64\""}},
      {"unknown addressing", R"(^addressing = "[^"]+")", {"addressing = \"functional\""}},
      {"unknown security", R"(^method = "[^"]+")", {"method = \"xor\""}},
      {"level of a key", R"(^level = \w+)", {"level = 2", "level = 0x42"}},
      {"unknown byte order", R"(^byte_order = "\w+")", {"byte_order = \"middle\""}},
      {"unknown address unit", R"(^address = "\w+")", {"address = \"sample\""}},
      {"an axis twice", R"(^imu = .*)", {R"(imu = ["x", "x", "z"])", R"(imu = ["x", "y", "w"])"}},
      {"left-handed axes", R"(^imu = .*)", {R"(imu = ["y", "x", "z"])", R"(imu = ["x", "y", "-z"])"}},
      {"two axes", R"(^imu = .*)", {R"(imu = ["x", "y"])"}},
      {"a gimbal axis twice", R"(^gimbal = .*)", {R"(gimbal = ["outer", "outer"])", R"(gimbal = ["outer", "-outer"])"}},
      {"scale that is none", R"(scale = [-\w.]+)", {"scale = 0", "scale = nan", "scale = \"1\""}},
      {"constant that does not fit", R"(constant = \w+)", {"constant = 1e30", "constant = -5", "constant = 0.5"}},
      {"signed count as unsigned", R"re((delta_\w+ = \{ at = \d+, type = )"i)re", {"$1\"u"}},
      {"nominal of what is no scale factor",
       R"re(^(fields\.(?:accel_bias|gyro_drift)\w* = \{ .*)unit = "[^"]+")re",
       {"$1nominal = 1.0"}},
      {"nominal and a unit", R"re(^(fields\.gyro_scale\w* = \{ .*unit = "ppm"))re", {"$1, nominal = 1e-6"}},
      {"nominal that is none",
       R"re(^(fields\.gyro_scale\w* = \{ .*)unit = "ppm")re",
       {"$1nominal = 0.0", "$1nominal = nan", "$1nominal = \"1\""}},
      {"form that is none", R"(^(slots = false|factory = 0x\w+))", {"$1\nform = \"inverse\"", "$1\nform = 1"}, true},
      {"identifier of a field twice", R"(\{ did = 0x[0-9A-F]+)", {"{ did = @SERIAL@"}},
      {"slots, and one identifier", R"(^slots = false)", {"slots = true"}, true},
      {"field by field, and not", R"(^field_by_field = true)", {"field_by_field = false"}, true},
      {"memory in no or too many bytes", R"(^longest = \d+)", {"longest = 0", "longest = 70000"}},
      {"memory beyond its address", R"(^address = 0x\w+)", {"address = 0x180000000"}},
      {"file without a page, or with a brace that is none",
       R"(^name = "(/raw/\{run\}/)\{page:6\}\.bin")",
       {"name = \"$1.bin\"", "name = \"$1{page}{page}\"", "name = \"$1{page:0}\"", "name = \"$1{number}\"",
        "name = \"$1{page\"", "name = \"$1{page}}\"", "name = \"\"", "name = \"{page} \"", "name = 6"}},
      {"signal outside its frame", R"(^(signals\.\w+ = \{ start = )\d+)", {"$01600", "$01512", "$01511"}},
      {"signals on each other",
       R"(^(signals\.(?:index|inner|value|power_cycles|version|software) = \{ start = )\d+)",
       {"$010"}},
      {"length of a signal that is none", R"(\blength = \d+)", {"length = 0", "length = 65"}},
      {"identifier of another frame", R"(^id = 0x31[02])", {"id = 0x311"}},
      {"command like another", R"(constant = 0x(11|12|13|20) )", {"constant = 0x10 "}, true},
      {"message that the DBC has not", R"(^message = "\w+")", {"message = \"NONE\""}},
      {"signal that the message has not", R"(\bof = "\w+")", {"of = \"NONE\""}},
      {"counter left out", R"(^signals\.counter = .*)", {"# left out"}, true},
      // Told at the first frame of a sample: nobody knows in which one it was to be.
      {"part of a sample left out", R"(^signals\.delta_theta_\w = .*)", {"# left out"}, true},
      {"coefficient of another width", R"re((index = \d+, type = )"\w+")re", {"$1\"u16\"", "$1\"f64\""}},
      {"index twice", R"(\bindex = \d+, type)", {"index = 0, type"}, true},
      {"end of a move that is none", R"(^there = "\w+")", {"there = \"time\""}},
      {"no angles where a move is over by angle",
       R"(^fields\.(outer|inner) = \{ at = 1[02], type = "i16", scale.*)",
       {"# left out"},
       true},
      {"address left out", R"(^memory = 0x\w+)", {"# left out"}, true},
      {"address of more than 32 bits", R"(\bmemory = 0x\w+)", {"memory = 0x100000000", "memory = 0x1F0000000"}},
      {"record beyond the width of an address", R"(\bmemory = 0x04\w+)", {"memory = 0xFFFFFF", "memory = 0xFFFFF8"}},
      {"records on each other in memory", R"(^memory = 0x040[1-6]00)", {"memory = 0x0480C0", "memory = 0x047FFF"}},
      {"identifier and address", R"(^(memory = 0x04\w+))", {"$1\ndid = 0x4001"}},
      {"text of no length", R"(^((?:serial|software) = \{ memory = \w+), bytes = \d+)", {"$1", "$1, bytes = 0"}},
      {"record in memory of no length", R"(^bytes = 260$)", {"# left out"}, true},
      {"width of an address", R"(^address_bytes = \d)", {"address_bytes = 5", "address_bytes = 0"}},
      {"as many bytes as none tells", R"(^longest(_write)? = \d+)", {"longest$1 = 0", "longest$1 = 100000"}},
      {"bytes that are told at once left out", R"(^longest = \d+)", {"# left out"}, true},
      {"address of a field left out", R"(\{ memory = 0x700\w+, )", {"{ "}},
      {"field in the raw data", R"(\{ memory = 0x700\w+, )", {"{ memory = 0x80000010, "}},
      {"raw data of no length", R"(^(address = 0x\d+0000))", {"$1\nend = 0", "$1\nend = 0x1FFFFFFFF"}, true},
      {"unknown section", R"(^\[(\w+)\])", {"[$1s]", "[my_$1]"}},
      {"broken TOML", R"( \}$)", {""}, false, R"(^#)"},
      {"broken text", R"re(= "(\w[^"]*)")re", {"= \"$1"}, false, R"(\{)"}};
  return all;
}

std::string value_of(const Lines& lines, const std::string& key) {
  const std::regex pattern("^" + key + " = (0x[0-9A-F]+)");
  std::smatch match;
  for (const std::string& line : lines) {
    if (std::regex_search(line, match, pattern)) {
      return match[1];
    }
  }
  return "0";  // nothing of that profile is replaced by it
}

std::pair<std::size_t, std::size_t> section_of(const Lines& lines, std::size_t at) {
  std::size_t first = at, last = at;
  while (first > 0 && !lines[first].starts_with('[')) {
    --first;
  }
  while (last + 1 < lines.size() && !lines[last + 1].starts_with('[')) {
    ++last;
  }
  return {first, last};
}

// Where another field of the same table begins.
std::optional<std::string> other_place(const Lines& lines, std::size_t at, Random& random) {
  static const std::regex place(R"(^((?:start\.|result\.|each\.)?)fields\.\w+ = \{ at = (\d+))");
  std::smatch own, other;
  if (!std::regex_search(lines[at], own, place)) {
    return std::nullopt;
  }
  const auto [first, last] = section_of(lines, at);
  std::vector<std::string> places;
  for (std::size_t k = first; k <= last; ++k) {
    if (k != at && std::regex_search(lines[k], other, place) && other[1] == own[1] && other[2] != own[2]) {
      places.push_back(other[2]);
    }
  }
  return places.empty() ? std::nullopt : std::optional(places[below(random, places.size())]);
}

std::optional<Mutant> mutate(const Lines& lines, const Way& way, Random& random) {
  const std::regex pattern(way.pattern);
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const bool excluded = !way.not_if.empty() && std::regex_search(lines[k], std::regex(way.not_if));
    if (!lines[k].starts_with('#') && std::regex_search(lines[k], pattern) && !excluded) {
      places.push_back(k);
    }
  }
  if (places.empty()) {
    return std::nullopt;
  }
  Mutant mutant{lines, places[below(random, places.size())], 0};
  mutant.last = mutant.first;
  std::string replacement = way.replacements[below(random, way.replacements.size())];
  if (replacement.find("@OTHER@") != std::string::npos) {
    const auto other = other_place(lines, mutant.first, random);
    if (!other) {
      return std::nullopt;
    }
    replacement = std::regex_replace(replacement, std::regex("@OTHER@"), *other);
  }
  replacement = std::regex_replace(replacement, std::regex("@SERIAL@"), value_of(lines, "serial"));
  replacement = std::regex_replace(replacement, std::regex("@ROTATE@"), value_of(lines, "routine"));
  std::string& line = mutant.lines[mutant.first];
  const std::string changed = std::regex_replace(line, pattern, replacement, std::regex_constants::format_first_only);
  if (changed == line) {
    return std::nullopt;
  }
  line = changed;
  if (way.whole_section) {
    std::tie(mutant.first, mutant.last) = section_of(lines, mutant.first);
  }
  if (way.name.starts_with("broken")) {
    mutant.last = mutant.first + 1;  // where the parser runs into the end
  }
  return mutant;
}

bool names_a_line(const std::string& message, const Mutant& mutant) {
  static const std::regex where(R"(m\.toml:(\d+): )");
  for (auto found = std::sregex_iterator(message.begin(), message.end(), where); found != std::sregex_iterator();
       ++found) {
    const std::size_t line = std::stoul((*found)[1]) - 1;
    if (line >= mutant.first && line <= mutant.last) {
      return true;
    }
  }
  return false;
}

// Means the same as before.
Lines harmless(Lines lines, Random& random) {
  const std::size_t at = below(random, lines.size());
  if (lines[at].starts_with('#') || lines[at].empty()) {
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(at), "# another remark");
  } else {
    lines[at] += "   # a remark";
  }
  static const std::regex field(R"(^(start\.|result\.|each\.)?fields\.\w+ = )");
  const std::size_t k = below(random, lines.size() - 1);
  if (std::regex_search(lines[k], field) && std::regex_search(lines[k + 1], field)) {
    std::swap(lines[k], lines[k + 1]);
  }
  return lines;
}

Lines read(const std::string& path) {
  std::ifstream in(path);
  Lines lines;
  for (std::string line; std::getline(in, line);) {
    lines.push_back(line);
  }
  return lines;
}

// example.toml with its raw data as files.
Lines with_files(Lines lines) {
  const auto upload = std::ranges::find(lines, "[upload]");
  const auto end = std::ranges::find(upload, lines.end(), "");
  const auto at = lines.erase(upload, end);
  lines.insert(at, {"[file]", "name = \"/raw/{run}/{page:6}.bin\""});
  return lines;
}

// memory.toml, each coefficient at an address in the place of an identifier.
Lines with_addresses(Lines lines) {
  for (std::string& line : lines) {
    line = std::regex_replace(line, std::regex(R"(\{ did = 0x41(\w\w))"), "{ memory = 0x70000$010");
  }
  return lines;
}

// moves.toml, its samples streamed: no pages, and no directory of them.
Lines with_stream(const Lines& lines) {
  Lines kept;
  bool left_out = false;
  for (const std::string& line : lines) {
    if (line.starts_with('[')) {
      left_out = line == "[memory]" || line == "[page]" || line == "[directory]";
    }
    if (!left_out) {
      kept.push_back(line);
    }
  }
  const std::vector<std::vector<std::string_view>> parts{
      {"delta_theta_x", "delta_theta_y", "delta_theta_z"}, {"delta_v_x", "delta_v_y", "delta_v_z"}, {"outer", "inner"}};
  for (std::size_t k = 0; k < parts.size(); ++k) {
    for (const std::string& line :
         {std::string(), fmt::format("[stream.sample.part{}]", k), fmt::format("id = 0x{:08X}", 0x18FF1001 + k),
          std::string("bytes = 7"), std::string("signals.counter = { start = 0, length = 8 }")}) {
      kept.push_back(line);
    }
    for (std::size_t i = 0; i < parts[k].size(); ++i) {
      kept.push_back(fmt::format("signals.{} = {{ start = {}, length = 16, type = \"signed\"{} }}", parts[k][i],
                                 8 + 16 * i, parts[k].size() == 2 ? ", scale = 0.01, unit = \"deg\"" : ""));
    }
  }
  return kept;
}

int trial(std::size_t count, std::uint64_t seed) {
  const std::vector<Lines> profiles{read(SELFCAL_SOURCE_DIR "/config/profiles/selfcal.toml"),
                                    read(SELFCAL_SOURCE_DIR "/config/profiles/example.toml"),
                                    read(SELFCAL_SOURCE_DIR "/config/profiles/memory.toml"),
                                    read(SELFCAL_SOURCE_DIR "/config/profiles/frames.toml"),
                                    read(SELFCAL_SOURCE_DIR "/config/profiles/moves.toml"),
                                    read(SELFCAL_SOURCE_DIR "/config/profiles/addresses.toml"),
                                    with_addresses(read(SELFCAL_SOURCE_DIR "/config/profiles/memory.toml")),
                                    with_stream(read(SELFCAL_SOURCE_DIR "/config/profiles/moves.toml")),
                                    with_files(read(SELFCAL_SOURCE_DIR "/config/profiles/example.toml"))};
  Random random(seed);
  std::set<std::string> seen;
  std::map<std::string, int> by_way;
  int accepted = 0, unnamed = 0, refused = 0;
  for (std::size_t tries = 0; seen.size() < count && tries < 100 * count; ++tries) {
    const Way& way = ways()[tries % ways().size()];
    const auto mutant = mutate(profiles[below(random, profiles.size())], way, random);
    if (!mutant || !seen.insert(text_of(mutant->lines)).second) {
      continue;
    }
    ++by_way[way.name];
    const auto profile = parse_profile(text_of(mutant->lines), file_name);
    if (profile) {
      ++accepted;
      fmt::print("accepted: {}: line {}: {}\n", way.name, mutant->first + 1, mutant->lines[mutant->first]);
    } else if (!names_a_line(profile.error().message, *mutant)) {
      ++unnamed;
      fmt::print("line {} not named: {}:\n{}\n", mutant->first + 1, way.name, profile.error().message);
    }
  }
  constexpr int controls = 100;
  for (int k = 0; k < controls; ++k) {
    const auto profile = parse_profile(text_of(harmless(profiles[below(random, profiles.size())], random)), file_name);
    if (!profile) {
      ++refused;
      fmt::print("refused though nothing changed:\n{}\n", profile.error().message);
    }
  }
  fmt::print(
      "{} profiles made wrong in {} ways, all different, seed {}: {} accepted, {} without the line; {} of {} harmless "
      "changes "
      "refused\n",
      seen.size(), by_way.size(), seed, accepted, unnamed, refused, controls);
  return seen.size() == count && accepted + unnamed + refused == 0 ? 0 : 1;
}

}  // namespace
}  // namespace selfcal::profile

int main(int argc, char** argv) {
  return selfcal::profile::trial(argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 500,
                                 argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 1);
}
