#include "protocol/profile/read_profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "protocol/profile/coefficient_fields.hpp"
#include "protocol/profile/read_bus.hpp"
#include "protocol/profile/read_frames.hpp"
#include "protocol/profile/read_layout.hpp"
#include "protocol/profile/read_move.hpp"
#include "protocol/profile/read_raw.hpp"
#include "protocol/profile/read_regions.hpp"
#include "protocol/profile/read_security.hpp"

namespace selfcal::profile {
namespace {

constexpr std::uint64_t most_did = 0xFFFF;
constexpr std::uint64_t longest_text = 255;      // of the identity, where it stands in memory
constexpr std::uint32_t longest_message = 4094;  // ISO-TP's 12 bits of length, less the service
constexpr std::array<std::string_view, 2> orders{"big", "little"};

// One number must not mean two things.
class Numbers {
 public:
  explicit Numbers(std::string_view what) : what_(what) {}
  void take(Section& section, std::string_view key, std::uint64_t number) {
    take(section.faults(), section.line_of(key), section.path_of(key), number);
  }
  void take(Faults& faults, std::size_t line, const std::string& path, std::uint64_t number) {
    const auto [other, fresh] = taken_.emplace(number, path);
    if (!fresh) {
      faults.add(line, path, fmt::format("{} 0x{:04X} is that of {} already", what_, number, other->second));
    }
  }

 private:
  std::string_view what_;
  std::map<std::uint64_t, std::string> taken_;
};

class ProfileReader {
 public:
  ProfileReader(const toml::table& table, const std::string& file) : faults_(file), root_(faults_, &table, "", 1) {
    profile_.file = file;
  }

  Expected<ProfilePtr> read() {
    profile_.name = root_.text("name", true).value_or("");
    order_ = root_.word("byte_order", orders).value_or("big") == "little" ? ByteOrder::little : ByteOrder::big;
    Section bus = root_.table("bus", true);
    read_bus(bus, profile_.bus) == no_uds ? read_plain_frames() : read_uds();
    read_axes();
    root_.only_these();
    if (!faults_.none()) {
      return fail(ErrorKind::bad_input, faults_.text());
    }
    return std::make_shared<const Profile>(std::move(profile_));
  }

 private:
  // Where a profile says nothing of them, they are as our own INS's.
  void read_status() {
    Section status = root_.table("status");
    if (status.there()) {
      profile_.status = read_status_frames(status, profile_, order_);
    } else if (profile_.bus.status) {
      profile_.status = built_in()->status;
    }
  }

  void read_uds() {
    read_status();
    read_timing();
    read_identity();
    read_records();
    read_set();
    read_routines();
    read_raw(root_, profile_, order_);
    regions_.check(root_, profile_.raw);
  }

  // What the service asks in the INS's place, it asks as our own INS would be asked.
  void read_plain_frames() {
    const Profile& own = *built_in();
    for (const auto member : {&Profile::state, &Profile::schedule, &Profile::directory}) {
      profile_.*member = own.*member;
    }
    profile_.serial = own.serial;
    profile_.software = own.software;
    profile_.rotate = own.rotate;
    profile_.raw.page = own.raw.page;
    profile_.raw.way = Raw::Way::memory;
    profile_.raw.by_page = false;
    profile_.raw.longest_read = longest_message;
    profile_.security.needed = false;
    Section timing = root_.table("timing");
    profile_.timing.request_timeout_s = timing.number("request_timeout_s", 0.01, 60).value_or(1.0);
    read_durations(timing);
    timing.only_these();
    read_record("sample_format", profile_.sample_format, false);
    if (profile_.sample_format.did) {
      root_.fault("sample_format", "an INS without records tells none: give the values");
    }
    Section set = root_.table("coefficients", true);
    if (set.there()) {
      profile_.slots = false;
      profile_.field_by_field = true;
      read_set_layout(set, by_index);
    }
    profile_.frames = read_frames(root_, profile_, order_);
  }

  std::optional<std::uint16_t> did(Section& section, std::string_view key, bool needed) {
    const auto number = section.whole(key, 1, most_did, needed);
    if (!number) {
      return std::nullopt;
    }
    dids_.take(section, key, *number);
    return static_cast<std::uint16_t>(*number);
  }

  // A record has an identifier, or stands in memory: the key `did` or `memory` of its table.
  std::optional<std::uint16_t> did_or_memory(Section& section, bool needed) {
    if (!section.has("memory")) {
      if (needed && !section.has("did")) {
        section.fault("did", "missing, and there is no memory in its place");
      }
      return did(section, "did", false);
    }
    if (section.has("did")) {
      section.fault("memory", fmt::format("and did (line {}): a record is told in one way", section.line_of("did")));
      did(section, "did", false);
    }
    return in_memory(section);
  }

  std::optional<std::uint16_t> in_memory(Section& section) {
    const auto number = regions_.take(section);
    if (number) {
      dids_.take(section, "memory", *number);
    }
    return number;
  }

  // An identifier, or a table with the place in memory.
  std::optional<std::uint16_t> did_or_place(Section& section, std::string_view key, bool needed,
                                            std::optional<std::size_t> bytes = std::nullopt) {
    if (!section.has_table(key)) {
      return did(section, key, needed);
    }
    Section place = section.table(key);
    if (!place.has("memory")) {
      place.missing("memory");
    }
    const auto number = in_memory(place);
    regions_.give_length(number, bytes ? *bytes : place.whole("bytes", 1, longest_text, true).value_or(1));
    place.only_these();
    return number;
  }

  void read_durations(Section& timing) {
    constexpr double least_s = 0.1, most_s = 600.0;
    Timing& t = profile_.timing;
    for (const auto& [key, into] :
         {std::pair("erase_s", &t.erase_s), std::pair("write_s", &t.write_s), std::pair("commit_s", &t.commit_s),
          std::pair("restart_s", &t.restart_s), std::pair("stop_s", &t.stop_s)}) {
      *into = timing.number(key, least_s, most_s).value_or(*into);
    }
  }

  void read_timing() {
    Section timing = root_.table("timing");
    profile_.timing.request_timeout_s = timing.number("request_timeout_s", 0.01, 60).value_or(1.0);
    profile_.timing.p2_star_s = timing.number("p2_star_s", 0.1, 60).value_or(5.0);
    profile_.timing.tester_present_s = timing.number("tester_present_s", 0.1, 4.5).value_or(2.0);
    read_durations(timing);
    timing.only_these();
    Section session = root_.table("session");
    profile_.session = static_cast<std::uint8_t>(session.whole("calibration", 2, 0x7E).value_or(3));
    session.only_these();
    Section security = root_.table("security", true);
    if (security.there()) {
      profile_.security = read_security(security);
    }
  }

  void read_identity() {
    Section identity = root_.table("identity", true);
    if (identity.there()) {
      profile_.serial = did_or_place(identity, "serial", true).value_or(0);
      profile_.software = did_or_place(identity, "software", true).value_or(0);
      identity.only_these();
    }
  }

  void read_record(std::string_view name, Record& record, bool did_needed) {
    const RecordRole& role = record_role(name);
    Section section = root_.table(name, role.needed);
    if (!section.there()) {
      return;
    }
    record.did = did_or_memory(section, did_needed || section.has("fields"));
    read_layout(section, role, order_, record);
    give_length(section, record.did, record.layout);
    section.only_these();
  }

  void give_length(Section& section, std::optional<std::uint16_t> number, const Layout& layout) {
    if (section.has("memory") && layout.each && layout.bytes == 0) {
      section.fault("bytes", "missing: a record in memory has the same length always");
    }
    regions_.give_length(number, layout.bytes);
  }

  // A schedule, or a move in its place.
  void read_positions() {
    const bool both = root_.has("schedule") && root_.has("move");
    read_record("schedule", profile_.schedule, true);
    Section move = root_.table("move");
    if (!move.there()) {
      if (!root_.has("schedule")) {
        root_.fault("schedule", "missing, and there is no move in its place");
      }
      return;
    }
    if (both) {
      move.fault("", fmt::format("and a schedule (line {}): positions are told in one way", root_.line_of("schedule")));
    }
    profile_.move = read_move(move, root_, profile_, order_, did_or_memory(move, false));
    give_length(move, profile_.move->did, profile_.move->layout);
    if (profile_.move->routine) {
      routines_.take(move, "routine", *profile_.move->routine);
    }
  }

  void read_records() {
    read_record("state", profile_.state, true);
    read_positions();
    read_record("site", profile_.site, true);
    root_.has("stream") ? keep_directory() : read_record("directory", profile_.directory, true);
    const bool expects = profile_.directory.layout.find("pages_expected") != nullptr ||
                         profile_.directory.given.contains("pages_expected");
    if (root_.has("directory") && !profile_.move && !expects) {
      faults_.add(root_.line_of("directory"), "directory.fields.pages_expected", "missing");
    }
    read_record("sample_format", profile_.sample_format, false);
  }

  // Samples that are streamed are kept here, as our own INS keeps them.
  void keep_directory() {
    profile_.directory.did = kept_directory;
    dids_.take(faults_, root_.line_of("stream"), "stream", kept_directory);
    profile_.directory.layout = built_in()->directory.layout;
    Section told = root_.table("directory");
    if (told.there()) {
      root_.fault("directory", "the samples are streamed: the INS tells none");
    }
  }

  void read_set() {
    Section section = root_.table("coefficients", true);
    if (!section.there()) {
      return;
    }
    profile_.slots = section.flag("slots").value_or(true);
    profile_.field_by_field = section.flag("field_by_field").value_or(false);
    if (profile_.field_by_field && profile_.slots) {
      section.fault("field_by_field", "each field has one identifier: an INS with slots needs two");
    }
    if (!profile_.field_by_field) {
      profile_.set_in_force = did_or_place(section, "in_force", true, 0);
    }
    if (profile_.slots) {
      profile_.set_inactive = did_or_place(section, "inactive", true, 0);
      profile_.set_factory = did_or_place(section, "factory", false, 0);
    }
    read_set_layout(section, profile_.field_by_field ? by_did : std::string_view());
    for (const auto& set : {profile_.set_in_force, profile_.set_inactive, profile_.set_factory}) {
      regions_.give_length(set, profile_.set.bytes);
    }
  }

  void read_set_layout(Section& section, std::string_view numbered_by) {
    if (const auto form = section.word("form", set_forms)) {
      profile_.set_form = static_cast<SetForm>(std::ranges::find(set_forms, *form) - set_forms.begin());
    }
    Record record;
    read_layout(section, set_role(), order_, record, numbered_by);
    for (Field& field : record.layout.fields) {
      const std::string path =
          fmt::format("coefficients.fields.{}.{}", field.name, field.memory ? "memory" : numbered_by);
      if (field.memory) {
        field.did = regions_.take(field.line, path, *field.memory);
        regions_.give_length(field.did, field.end() - field.at);
      }
      if (field.did) {
        dids_.take(faults_, field.line, path, *field.did);
      }
    }
    section.only_these();
    if (!record.given.empty()) {
      section.fault("given", "a set has no such values");
    }
    for (const std::string& complaint : coefficient_complaints(record.layout)) {
      section.fault("fields", complaint);
    }
    profile_.set = std::move(record.layout);
  }

  void read_routine(std::string_view name, Routine& routine, bool needed, bool start_needed, bool result_needed) {
    Section section = root_.table(name, needed);
    if (!section.there()) {
      return;
    }
    if (const auto id = section.whole("routine", 1, most_did, true)) {
      routines_.take(section, "routine", *id);
      routine.id = static_cast<std::uint16_t>(*id);
    }
    for (const auto& [part, layout, part_needed] :
         {std::tuple("start", &routine.start, start_needed), std::tuple("result", &routine.result, result_needed)}) {
      const std::string role = fmt::format("{}.{}", name, part);
      const auto roles = record_roles();
      if (std::ranges::find(roles, role, &RecordRole::table) == roles.end()) {
        continue;
      }
      Section of_part = section.table(part, part_needed);
      if (of_part.there()) {
        Record record;
        read_layout(of_part, record_role(role), order_, record);
        of_part.only_these();
        *layout = std::move(record.layout);
      }
    }
    section.only_these();
  }

  void read_routines() {
    read_routine("rotate", profile_.rotate, true, true, true);
    read_routine("erase", profile_.erase, false, false, false);
    read_routine("commit", profile_.commit, false, false, false);
    read_routine("navigation_check", profile_.navigation_check, false, true, true);
    for (const auto& [name, routine] : {std::pair("erase", &profile_.erase), std::pair("commit", &profile_.commit)}) {
      if (routine->id && !profile_.slots) {
        root_.fault(name, "an INS without slots has none to erase or to commit");
      }
    }
    Section commit(faults_, nullptr, "commit.start", root_.line_of("commit"));
    if (profile_.commit.start.find("checksum") != nullptr && !profile_.set.checksum) {
      commit.fault("fields.checksum", "the record of coefficients has none");
    }
    for (const auto* routine : {&profile_.state.layout, &profile_.rotate.result}) {
      const Field* state = routine->find("state");
      const bool knows = state != nullptr && state->codes.size() == 7;
      if (profile_.navigation_check.id && state != nullptr && !knows) {
        faults_.add(state->line, fmt::format("{}.fields.state.codes.checking", routine->record),
                    "missing, and there is a navigation check");
      }
    }
  }

  // "-x": the other way round.
  template <std::size_t N>
  void read_turned(Section& axes, std::string_view key, const std::array<std::string_view, N>& names,
                   std::array<std::size_t, N>& index, std::array<int, N>& sign) {
    const auto words = axes.texts(key, N);
    if (!words) {
      return;
    }
    std::array<bool, N> taken{};
    for (std::size_t k = 0; k < N; ++k) {
      const std::string& word = (*words)[k];
      const bool turned = word.starts_with('-');
      const auto found = std::ranges::find(names, word.substr(turned ? 1 : 0));
      const auto which = static_cast<std::size_t>(found - names.begin());
      if (found == names.end() || taken[which]) {
        return axes.fault(key, fmt::format("{}: each of {} once, with or without -", word, fmt::join(names, ", ")));
      }
      taken[which] = true;
      index[k] = which;
      sign[k] = turned ? -1 : 1;
    }
  }

  void read_axes() {
    Section axes = root_.table("axes");
    Raw& raw = profile_.raw;
    read_turned<3>(axes, "imu", {"x", "y", "z"}, raw.axis, raw.sign);
    read_turned<2>(axes, "gimbal", {"outer", "inner"}, raw.gimbal, raw.gimbal_sign);
    const bool even = (raw.axis[1] + 3 - raw.axis[0]) % 3 == 1;
    if (even != (raw.sign[0] * raw.sign[1] * raw.sign[2] > 0)) {
      axes.fault("imu", "left-handed: an odd number of signs and swaps");
    }
    axes.only_these();
  }

  Faults faults_;
  Section root_;
  ByteOrder order_ = ByteOrder::big;
  Profile profile_;
  Numbers dids_{"data identifier"}, routines_{"routine"};
  RegionReader regions_{faults_, profile_.memory};
};

}  // namespace

Expected<ProfilePtr> parse_profile(std::string_view text, const std::string& file) {
  const Expected<toml::table> table = parse_toml(text, file);
  if (!table) {
    return tl::unexpected(table.error());
  }
  return ProfileReader(*table, file).read();
}

Expected<ProfilePtr> load_profile(const std::string& file) {
  std::ifstream in(file);
  if (!in) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot be opened", file));
  }
  std::stringstream content;
  content << in.rdbuf();
  return parse_profile(content.str(), file);
}

}  // namespace selfcal::profile
