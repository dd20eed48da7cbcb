#include "tools/cli/device/new_profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <utility>

#include "protocol/profile/built_in_text.hpp"
#include "protocol/profile/read_profile.hpp"
#include "tools/cli/device/profile_draft.hpp"

namespace selfcal::cli::device {
namespace {

constexpr std::string_view head =
    "# What an INS speaks. It begins as selfcal's own INS; change what yours has otherwise, and delete what it does "
    "not tell.\n"
    "#\n"
    "# A field: at (byte, from 0), type (u8 u16 u24 u32 u64 i8 i16 i24 i32 i64 f32 f64, ascii with length), count "
    "(elements),\n"
    "# byte_order, first_bit and bits (of an unsigned integer), scale, offset, unit, codes (words to numbers), "
    "constant.\n"
    "# A field that is no role's needs a constant: magic numbers, versions, reserved bytes.\n"
    "#\n"
    "#   selfcal device lint FILE        every fault, with its line\n"
    "#   selfcal device describe FILE    what it says, with pictures of the bytes\n"
    "#   sim_ins --profile FILE          a virtual INS that speaks so\n";

std::string bus_of(const NewProfile& a) {
  std::string text = fmt::format("addressing = \"{}\"\n", a.addressing);
  if (a.addressing == "normal-fixed") {
    text += fmt::format("ins_address = 0x{:02X}\ntester_address = 0x{:02X}\n", a.ins_address, a.tester_address);
  } else {
    text += fmt::format("request = 0x{:03X}\nresponse = 0x{:03X}\nfunctional = 0x{:03X}\n", a.request, a.response,
                        a.functional);
  }
  const profile::Bus& own = profile::built_in()->bus;
  return text + fmt::format("{}status = 0x{:03X}             # the gimbal frame has the next one\npadding = 0x{:02X}\n",
                            a.addressing == "normal" ? "" : "# ", own.status.value_or(0), own.padding);
}

// What the INS may take, as where the profile says nothing.
constexpr std::string_view durations =
    "# erase_s = 8.0            # the longest that the INS takes to erase a slot; the others: to write a set, to put "
    "it in\n"
    "# write_s = 4.0            # force, to restart, to stop its gimbal\n"
    "# commit_s = 4.0\n"
    "# restart_s = 60.0\n"
    "# stop_s = 30.0";

void use_program(ProfileDraft& draft) {
  draft.add_line(
      "security",
      "program = \"key\"            # gets the seed in hexadecimal digits, tells the key; from this file's folder on\n"
      "seed_bytes = 16\n"
      "key_bytes = 16\n"
      "# seed = \"argument\"        # where it is not to be on standard input\n"
      "# limit_s = 5.0");
}

// Far enough from each other for twice what they have.
constexpr std::uint32_t first_address = 0x20000000, between = 0x400, raw_address = 0x80000000;

std::string memory_table(bool of_raw) {
  return fmt::format(
      "[memory]\n{}address_bytes = 4\nsize_bytes = 2\nlongest = 1024             # bytes that are told at once\n{}\n",
      of_raw ? fmt::format("address = 0x{:08X}       # of the first page of a run\n", raw_address) : "",
      "longest_write = 256        # and taken\n");
}

void put_into_memory(ProfileDraft& draft, const NewProfile& a) {
  std::uint32_t address = first_address;
  const auto next = [&] { return std::exchange(address, address + between); };
  for (const std::string_view key : {"serial", "software"}) {
    draft.set_line("identity", key, fmt::format("{{ memory = 0x{:08X}, bytes = 32 }}", next()));
  }
  const auto place = [&](std::string_view table) {
    draft.set_line(table, "did", fmt::format("0x{:08X}", next()), "memory");
  };
  place("state");
  if (a.rotation == "schedule") {
    place("schedule");
    draft.add_line("schedule", "bytes = 485                # 40 positions");
  } else {
    draft.set_line("move", "routine", fmt::format("0x{:08X}", next()), "memory");
  }
  place("site");
  if (a.raw_data != "stream") {
    place("directory");
  }
  place("sample_format");
  for (const std::string_view key : {"in_force", "inactive", "factory"}) {
    if (key == "in_force" || a.sets == "two") {
      draft.set_line("coefficients", key, fmt::format("{{ memory = 0x{:08X} }}", next()));
    }
  }
}

constexpr std::string_view move_table =
    "[move]                     # in place of a schedule: each position is told by itself\n"
    "routine = 0x0310           # or did, which is written\n"
    "there = \"angle\"            # or state, by fields.gimbal_moving of the state\n"
    "tolerance_deg = 1.0\n"
    "rest_deg = 0.05\n"
    "longest_s = 60.0\n"
    "bytes = 8\n"
    "fields.outer = { at = 0, type = \"i32\", unit = \"mdeg\" }\n"
    "fields.inner = { at = 4, type = \"i32\", unit = \"mdeg\" }\n\n";

void turn_by_moves(ProfileDraft& draft) {
  draft.erase_table("schedule");
  draft.insert_before("site", move_table);
  draft.set_line("state", "bytes", "28");
  draft.add_line("state",
                 "fields.gimbal_moving = { at = 19, type = \"u8\" }\n"
                 "fields.outer = { at = 20, type = \"f32\", unit = \"deg\" }\n"
                 "fields.inner = { at = 24, type = \"f32\", unit = \"deg\" }");
}

// Each part of a sample has its counter.
std::string stream_tables(const NewProfile& a) {
  const std::uint32_t first = a.addressing == "normal" ? 0x660 : 0x18FF1000;
  std::string text;
  const auto frame = [&](std::string_view name, std::uint32_t id, std::string_view signals) {
    text += fmt::format(
        "[stream.sample.{}]\nid = 0x{:03X}\nbytes = 8\nsignals.counter = {{ start = 0, length = 8, byte_order = "
        "\"little\" }}\n{}\n",
        name, id, signals);
  };
  const auto signal = [](std::string_view name, int start, std::string_view more = {}) {
    return fmt::format("signals.{} = {{ start = {}, length = 24, byte_order = \"little\", type = \"signed\"{} }}\n",
                       name, start, more);
  };
  constexpr std::string_view angle = ", scale = 1e-4, unit = \"deg\"";
  frame("angles", first, signal("delta_theta_x", 8) + signal("delta_theta_y", 32));
  frame("mixed", first + 1, signal("delta_theta_z", 8) + signal("delta_v_x", 32));
  frame("velocities", first + 2, signal("delta_v_y", 8) + signal("delta_v_z", 32));
  frame("gimbal", first + 3, signal("outer", 8, angle) + signal("inner", 32, angle));
  return text;
}

void take_raw_data(ProfileDraft& draft, const NewProfile& a) {
  const bool of_raw = a.raw_data == "memory";
  if (of_raw || a.records == "memory") {
    draft.insert_before("identity", memory_table(of_raw));
  }
  if (a.raw_data == "upload") {
    return;
  }
  if (a.raw_data == "file") {
    draft.insert_before("upload",
                        "[file]                     # each page of raw data is one\n"
                        "name = \"/raw/{run}/{page:6}.bin\"\n\n");
  } else if (a.raw_data == "stream") {
    draft.insert_before("upload", stream_tables(a));
    draft.erase_table("page");
    draft.erase_table("directory");
    draft.set_line("sample_format", "bytes", "24");
    for (const std::string_view field : {"gimbal_per_count", "page_bytes", "samples_per_page"}) {
      draft.erase_line("sample_format", fmt::format("fields.{}", field));
    }
  }
  draft.erase_table("upload");
}

void keep_one_set(ProfileDraft& draft) {
  draft.erase_line("coefficients", "inactive");
  draft.erase_line("coefficients", "factory");
  draft.add_line("coefficients", "slots = false              # written over, and used from the next power-on on");
  draft.erase_table("erase");
  draft.erase_table("commit");
}

// Nothing at the end of the input.
bool answer(std::string_view question, const std::string& kept, std::string& text) {
  std::fputs(fmt::format("{} [{}]: ", question, kept).c_str(), stderr);
  std::fflush(stderr);
  return static_cast<bool>(std::getline(std::cin, text));
}

bool ask_word(std::string_view question, std::initializer_list<std::string_view> known, std::string& value) {
  std::string text;
  while (answer(question, value, text)) {
    if (text.empty()) {
      return true;
    }
    if (known.size() == 0 || std::ranges::find(known, text) != known.end()) {
      value = text;
      return true;
    }
    std::fputs(fmt::format("{}: one of those words\n", text).c_str(), stderr);
  }
  return false;
}

bool ask_number(std::string_view question, std::uint32_t most, std::uint32_t& value) {
  std::string text;
  while (answer(question, fmt::format("0x{:X}", value), text)) {
    if (text.empty()) {
      return true;
    }
    char* end = nullptr;
    const unsigned long number = std::strtoul(text.c_str(), &end, 16);
    if (*end == '\0' && text[0] != '-' && number <= most) {
      value = static_cast<std::uint32_t>(number);
      return true;
    }
    std::fputs(fmt::format("{}: hexadecimal, 0 to {:X}\n", text, most).c_str(), stderr);
  }
  return false;
}

}  // namespace

void ask(NewProfile& a) {
  if (!ask_word("Name of the INS", {}, a.name) || !ask_word("Addressing: normal (11 bits), normal-29, normal-fixed",
                                                            {"normal", "normal-29", "normal-fixed"}, a.addressing)) {
    return;
  }
  const std::uint32_t most = a.addressing == "normal" ? 0x7FF : 0x1FFFFFFF;
  const bool fixed = a.addressing == "normal-fixed";
  const bool told = fixed ? ask_number("Address of the INS", 0xFF, a.ins_address) &&
                                ask_number("Address of the tester", 0xFF, a.tester_address)
                          : ask_number("Identifier of requests", most, a.request) &&
                                ask_number("Identifier of responses", most, a.response) &&
                                ask_number("Identifier of requests to all", most, a.functional);
  static_cast<void>(
      told && ask_word("Byte order of its numbers: big, little", {"big", "little"}, a.byte_order) &&
      ask_word("What opens its lock: aes-cmac, program (of yours), none", {"aes-cmac", "program", "none"},
               a.security) &&
      ask_word("Its records have an: identifier, or stand in: memory", {"identifier", "memory"}, a.records) &&
      ask_word("Its gimbal is told a: schedule, or each position: moves", {"schedule", "moves"}, a.rotation) &&
      ask_word("Its raw data come by: upload, memory (ReadMemoryByAddress), file, stream (CAN frames)",
               {"upload", "memory", "file", "stream"}, a.raw_data) &&
      ask_word("Sets of coefficients that it keeps beside the factory's: two, one", {"two", "one"}, a.sets) &&
      ask_word("What the 24 mean: errors, correction, correction-first", {"errors", "correction", "correction-first"},
               a.form));
}

Expected<std::string> new_profile(const NewProfile& answers) {
  ProfileDraft draft{std::string(profile::built_in_text())};
  draft.set_table("bus", bus_of(answers));
  draft.add_line("timing", durations);
  draft.set_line("security", "method", fmt::format("\"{}\"", answers.security));
  if (answers.security == "program") {
    use_program(draft);
  }
  draft.set_line("", "byte_order", fmt::format("\"{}\"", answers.byte_order));
  draft.set_line("", "name", fmt::format("\"{}\"", answers.name));
  if (answers.rotation == "moves") {
    turn_by_moves(draft);
  }
  if (answers.sets == "one") {
    keep_one_set(draft);
  }
  if (answers.form != "errors") {
    draft.add_line("coefficients", fmt::format("form = \"{}\"", answers.form));
  }
  take_raw_data(draft, answers);
  if (answers.records == "memory") {
    put_into_memory(draft, answers);
  }
  draft.set_head(head);
  const std::string& text = draft.text();
  if (const auto read = profile::parse_profile(text, "new profile"); !read) {
    const std::string& faults = read.error().message;
    return fail(ErrorKind::usage, faults.substr(0, faults.find('\n')));
  }
  return text;
}

}  // namespace selfcal::cli::device
