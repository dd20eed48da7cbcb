#include "protocol/profile/describe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "protocol/profile/byte_picture.hpp"
#include "protocol/profile/coefficient_fields.hpp"
#include "protocol/profile/describe_frames.hpp"
#include "protocol/profile/describe_identifiers.hpp"
#include "protocol/profile/document_writer.hpp"
#include "protocol/profile/raw_file.hpp"

namespace selfcal::profile {
namespace {

std::string id_text(std::uint32_t id, bool extended) { return fmt::format("0x{:0{}X}", id, extended ? 8 : 3); }

std::string meaning(const Field& field, const RecordRole& role) {
  if (field.constant) {
    return fmt::format("always {:.10g} (0x{:X})", static_cast<double>(*field.constant),
                       static_cast<std::uint64_t>(std::max(0.0L, *field.constant)));
  }
  const auto known = std::ranges::find(role.fields, field.name, &RoleField::name);
  std::string words(known == role.fields.end() ? "" : known->meaning);
  if (field.nominal != 0.0) {
    const char sign = factor_of(field.name) == Factor::negative_slope ? '-' : '+';
    words += fmt::format("; told as {:.10g} (1 {} it)", field.nominal, sign);
  }
  if (!field.codes.empty()) {
    std::vector<std::string> codes;
    for (const auto& [ours, theirs] : field.codes) {
      codes.push_back(fmt::format("{} {}", theirs, known->words[ours]));
    }
    words += fmt::format("{}{}", words.empty() ? "" : ": ", fmt::join(codes, ", "));
  }
  return words;
}

// What one count is worth in the unit that the profile writes.
std::string scale_text(const Field& field, const RecordRole& role) {
  const auto known = std::ranges::find(role.fields, field.name, &RoleField::name);
  if (known == role.fields.end() || field.constant || !field.codes.empty() || field.type.kind == Kind::text) {
    return "";
  }
  const Unit* own = find_unit(field.unit.empty() ? known->unit : field.unit);
  const Unit* wanted = find_unit(known->unit);
  const double factor = field.unit.empty() || own == wanted ? 1.0 : own->si / wanted->si;
  if (field.nominal != 0.0) {
    return fmt::format("{:.10g}", std::abs(field.scale * field.nominal));
  }
  std::string words = fmt::format("{:.10g}{}{}", field.scale / factor, own->name.empty() ? "" : " ", own->name);
  if (field.offset != 0.0) {
    words += fmt::format(", plus {:.10g}", field.offset / factor);
  }
  return words;
}

std::vector<Row> rows_of(const std::vector<Field>& fields, const RecordRole& role) {
  std::vector<Row> rows;
  rows.reserve(fields.size());
  for (const Field& field : fields) {
    rows.push_back(
        {field.name,
         field.end() - field.at > 1 ? fmt::format("{} to {}", field.at, field.end() - 1) : std::to_string(field.at),
         fmt::format(
             "{}{}{}", field.type.name, field.count > 1 ? fmt::format(" x {}", field.count) : "",
             field.bits > 0 ? fmt::format(", bits {} to {}", field.first_bit, field.first_bit + field.bits - 1) : ""),
         field.type.bytes == 1 || field.type.kind == Kind::text ? ""
         : field.order == ByteOrder::big                        ? "big"
                                                                : "little",
         scale_text(field, role), meaning(field, role)});
  }
  std::ranges::stable_sort(rows, {}, [](const Row& row) { return std::stoul(row[1]); });
  return rows;
}

void write_record(Writer& out, const Layout& layout, const RecordRole& role) {
  const Row head{"field", "bytes", "type", "byte order", "one count is", "meaning"};
  if (layout.each && layout.bytes == 0) {
    out.say(fmt::format("{} bytes, and {} for each of {}.", layout.each->at, layout.each->stride, layout.each->count));
  } else if (layout.bytes == 0) {
    out.say("No bytes.");
    return;
  } else {
    const bool bits = std::ranges::any_of(layout.fields, [](const Field& field) { return field.bits > 0; });
    out.say(fmt::format("{} bytes. Bytes that no field has are 0x{:02X}.{}", layout.bytes, layout.fill,
                        bits ? " Bit 0 is the lowest of its integer." : ""));
  }
  out.table(head, rows_of(layout.fields, role));
  if (layout.each) {
    out.say(fmt::format("From byte {} on, every {} bytes, as often as {} says, {} times at most; bytes within one:",
                        layout.each->at, layout.each->stride, layout.each->count, layout.each->most));
    out.table(head, rows_of(layout.each->fields, role));
  }
  if (layout.checksum) {
    const Checksum& sum = *layout.checksum;
    const std::string_view words =
        sum.algorithm == "crc32c"  ? "CRC-32C (Castagnoli, reflected, initial value and final XOR 0xFFFFFFFF)"
        : sum.algorithm == "crc32" ? "CRC-32 (IEEE 802.3, reflected, initial value and final XOR 0xFFFFFFFF)"
                                   : "CRC-16 (polynomial 0x1021, not reflected, initial value 0xFFFF, no final XOR)";
    out.say(fmt::format(
        "Checksum in bytes {} to {}, {}, {}-endian: {} of bytes {} to {}; where its own bytes are among them, they "
        "count as 0.",
        sum.field.at, sum.field.end() - 1, sum.field.type.name, sum.field.order == ByteOrder::big ? "big" : "little",
        words, sum.from, sum.to - 1));
  }
  out.picture(byte_picture(layout));
}

std::string address_words(const Bus& bus) {
  if (!bus.request_byte) {
    return "There is no address byte in the data.";
  }
  return fmt::format(
      "The first byte of each frame is an address: 0x{:02X} in requests, 0x{:02X} in responses, 0x{:02X} in what is "
      "told to "
      "all. All else stands one byte later, and a frame has room for one byte less. Frames with another address are "
      "not meant.",
      *bus.request_byte, *bus.response_byte, *bus.functional_byte);
}

// What the 24 mean, with f and w the truth and fs and ws what the sensors say.
std::string form_words(SetForm form) {
  switch (form) {
    case SetForm::correction:
      return "The 24 are what the INS corrects with. With u = fs - bias: f = u + K+ max(u, 0) + K- max(-u, 0) per "
             "axis, "
             "then f_y += A_yx u_x, f_z += A_zx u_x + A_zy u_y. With v = ws - drift: w = v + K_G v per axis, then w_x "
             "+= "
             "G_xy v_y + G_xz v_z and so on. fs and ws are what the sensors say, f and w the truth.";
    case SetForm::correction_first:
      return "The 24 are what the INS corrects with, the bias last: f = fs + K+ max(fs, 0) + K- max(-fs, 0) - bias per "
             "axis, then f_y += A_yx fs_x, f_z += A_zx fs_x + A_zy fs_y; w = ws + K_G ws - drift per axis, then w_x += "
             "G_xy ws_y + G_xz ws_z and so on. fs and ws are what the sensors say, f and w the truth.";
    default:
      return "The 24 are the errors of the sensors. Sensor output = truth + error: df = bias + K+ max(f, 0) + K- "
             "max(-f, "
             "0) per axis, then df_y += A_yx f_x, df_z += A_zx f_x + A_zy f_y; dw = drift + K_G w per axis, then dw_x "
             "+= "
             "G_xy w_y + G_xz w_z and so on.";
  }
}

class Document {
 public:
  Document(const Profile& profile, Markup markup)
      : p_(profile), out_(markup, fmt::format("Interface of INS {}", profile.name)) {}

  std::string write() {
    out_.say(
        "What an INS has to do so that selfcal calibrates it: rotate its IMU on its own gimbal, tell the raw data, "
        "take the 24 coefficients and use them after the next power-on. Made from the profile.");
    if (p_.frames) {
      describe_frames(out_, p_);
      write_set();
    } else {
      write_bus();
      describe_status(out_, p_);
      write_services();
      describe_identifiers(out_, p_);
      write_records();
      write_moves();
      write_set();
      write_routines();
      write_upload();
    }
    write_axes();
    return out_.end();
  }

 private:
  void write_bus() {
    const Bus& b = p_.bus;
    out_.heading("Bus");
    out_.say(fmt::format("CAN{}, identifiers of {} bits, ISO 15765-2. {}",
                         b.fd ? " FD with bit rate switch" : ", classic", b.extended_ids ? 29 : 11, address_words(b)));
    std::vector<Row> rows{
        {id_text(b.request, b.extended_ids), "tester to INS", "requests"},
        {id_text(b.response, b.extended_ids), "INS to tester", "responses"},
        {id_text(b.functional, b.extended_ids), "tester to all", "TesterPresent, single frames, no response"}};
    if (b.status) {
      rows.push_back(
          {id_text(*b.status, b.extended_ids), "INS to all", "state frame, periodic; the gimbal frame has the next"});
    }
    out_.table({"identifier", "from", "what"}, rows);
    out_.say(fmt::format(
        "The tester fills short frames to 8 bytes with 0x{:02X}. Its flow control tells block size {} and STmin "
        "0x{:02X}. It waits {:g} s for an answer (P2), {:g} s after 0x78 (P2*), and longer where the answer to "
        "DiagnosticSessionControl states longer times; in a session it sends TesterPresent (3E 80) every {:g} s.",
        b.padding, b.block_size, b.st_min, p_.timing.request_timeout_s, p_.timing.p2_star_s,
        p_.timing.tester_present_s));
    const Timing& t = p_.timing;
    const std::string slots =
        p_.slots ? fmt::format("{:g} s to erase a slot, {:g} s to write a set, {:g} s to put it in force", t.erase_s,
                               t.write_s, t.commit_s)
                 : fmt::format("{:g} s to write a set", t.write_s);
    out_.say(fmt::format("The INS may take {}, {:g} s of its own clock to restart and {:g} s to stop its gimbal.",
                         slots, t.restart_s, t.stop_s));
  }

  void write_services() {
    out_.heading("Services");
    out_.say(
        "ISO 14229-1. A positive response begins with the service plus 0x40 and repeats the identifier; a negative one "
        "is 7F, the "
        "service, the code. Everything but reading needs the session, and what writes, starts or resets needs the lock "
        "open.");
    std::vector<Row> rows{{fmt::format("10 {:02X}", p_.session), fmt::format("50 {:02X} P2 P2*", p_.session),
                           "session; P2 in ms, P2* in 10 ms, two bytes each, big-endian; locks"},
                          {"10 01", "50 01 P2 P2*", "back to the default session; locks"}};
    if (p_.security.needed) {
      rows.push_back(
          {fmt::format("27 {:02X}", p_.security.level), fmt::format("67 {:02X} SEED", p_.security.level),
           fmt::format("{} bytes of seed, fresh each time; all zeros: open already", p_.security.seed_bytes)});
      rows.push_back({fmt::format("27 {:02X} KEY", p_.security.level + 1),
                      fmt::format("67 {:02X}", p_.security.level + 1), key_words()});
    }
    std::ranges::move(rows_of_reading(p_), std::back_inserter(rows));
    rows.push_back({"31 01 ID OPTION", "71 01 ID", "start a routine; ID has two bytes, big-endian"});
    rows.push_back({"31 02 ID", "71 02 ID", "stop it"});
    rows.push_back({"31 03 ID", "71 03 ID RESULT", "its result"});
    rows.push_back(
        {"11 01", "51 01", "restart: the sets of coefficients are read anew, the newest committed one is in force"});
    rows.push_back(
        {"3E 00", "7E 00", "keep the session; 3E 80: without response. Without any request for 5 s it ends"});
    out_.table({"request", "response", "meaning"}, rows);
  }

  std::string key_words() const {
    const auto& program = p_.security.program;
    if (!program) {
      return "KEY is AES-CMAC-128 (RFC 4493) of the seed, 16 bytes";
    }
    return fmt::format(
        "KEY has {} bytes; a program of the user's own says it, {}, which gets the seed in hexadecimal digits {} and "
        "has "
        "{:g} s",
        p_.security.key_bytes, std::filesystem::path(program->file).filename().string(),
        program->seed_as_argument ? "as its argument" : "on standard input", program->limit_s);
  }

  void write_records() {
    for (const auto& [table, record] :
         {std::pair("state", &p_.state), std::pair("schedule", &p_.schedule), std::pair("site", &p_.site),
          std::pair("directory", &p_.directory), std::pair("sample_format", &p_.sample_format)}) {
      const RecordRole& role = record_role(table);
      if ((!record->did && record->given.empty()) || record->did == kept_directory) {
        continue;
      }
      out_.heading(fmt::format("Record {}: {}", record->layout.record, role.meaning));
      if (record->did) {
        write_record(out_, record->layout, role);
      }
      for (const auto& [name, value] : record->given) {
        out_.say(fmt::format("Not told, always the same: {} {:.12g}.", name, value));
      }
    }
  }

  void write_moves() {
    if (!p_.move) {
      return;
    }
    const Move& move = *p_.move;
    const bool streams = !p_.stream.empty();
    constexpr double degrees_per_radian = 180.0 / 3.14159265358979323846;
    out_.heading("Moves: the gimbal is told each position by itself");
    out_.say(fmt::format(
        "The INS takes no schedule. A position is commanded by {}; the response comes at once, and the gimbal turns to "
        "it "
        "whether routine 0x{:04X} (rotate) was started or not. The tester commands the first position, waits until the "
        "gimbal is there, and starts rotate. From then on the INS {}, at rest and while it turns, and its state is "
        "rotating, until rotate is stopped. After each dwell the tester commands the next position, and after the last "
        "one it stops rotate: {}, and the state is another one, complete for example. A stop before that ends {} in "
        "the "
        "same way, and the gimbal stands. A move is not commanded while another one is under way; such a one may be "
        "refused (0x22), and "
        "a "
        "position that the gimbal cannot have is refused (0x31).",
        move.did ? fmt::format("writing {}", place_text(p_, *move.did))
                 : fmt::format("the start of routine 0x{:04X}, which is not stopped and has no result",
                               move.routine.value_or(0)),
        p_.rotate.id.value_or(0), streams ? "streams its samples" : "records raw data",
        streams ? "its last sample has then been sent"
                : "the directory is then complete with the last page, which need not be full",
        streams ? "the stream" : "the recording"));
    out_.say(fmt::format(
        "The tester reads the state up to ten times a second while it waits. The gimbal is there when {}. It may take "
        "{:g} s. How many pages there will be the INS does not know; in the result of rotate, position is 0.",
        move.turning.by_angle
            ? fmt::format(
                  "both its angles in the state are within {:g} deg of the position and stay within {:g} deg for "
                  "0.2 s, which are part of the dwell",
                  move.turning.tolerance_rad * degrees_per_radian, move.turning.rest_rad * degrees_per_radian)
            : std::string(
                  "gimbal_moving of the state is 0 twice in a row: it is 1 from the response to a move on, until "
                  "the gimbal rests, and then 0 until the next move"),
        move.turning.longest_move_s));
    out_.say(move.did ? "Record move:" : "Option of the start:");
    write_record(out_, move.layout, record_role("move"));
  }

  void write_set() {
    out_.heading("Record coefficients: a set of the 24");
    out_.say(form_words(p_.set_form));
    out_.say(
        "Of the fields, values is all 24: bias xyz, drift xyz, K+ xyz, K- xyz, A yx zx zy, K_G xyz, G xy xz yx yz zx "
        "zy. Axes are selfcal's (below).");
    if (!p_.slots) {
      out_.say(
          "There is one set: what is written stands over the one before, is told as written, and is used from the next "
          "power-on "
          "on. The factory's need not be told.");
    }
    if (p_.field_by_field) {
      write_fields_one_by_one();
    } else {
      write_record(out_, p_.set, set_role());
    }
  }

  void write_fields_one_by_one() {
    const bool by_index = p_.frames.has_value();
    out_.say(fmt::format("Each field is {}; version is written last.",
                         by_index ? "told and written by its index, its bits being those of the signal value"
                                  : "a record of its own, read and written by its identifier or at its address"));
    std::vector<Row> rows = rows_of(p_.set.fields, set_role());
    for (Row& row : rows) {
      const auto field = std::ranges::find(p_.set.fields, row[0], &Field::name);
      row[1] = by_index ? std::to_string(*field->did - first_index_did) : place_text(p_, *field->did);
    }
    out_.table({"field", by_index ? "index" : "where", "type", "byte order", "one count is", "meaning"}, rows);
  }

  void write_routine(const Routine& routine, std::string_view table, std::string_view words, bool has_result) {
    if (!routine.id) {
      return;
    }
    out_.heading(fmt::format("Routine 0x{:04X}: {}", *routine.id, words));
    out_.say("Option of the start:");
    const std::string start = fmt::format("{}.start", table);
    const auto roles = record_roles();
    const auto role = std::ranges::find(roles, start, &RecordRole::table);
    write_record(out_, routine.start, role == roles.end() ? roles[0] : *role);
    if (has_result) {
      out_.say("Result:");
      write_record(out_, routine.result, record_role(fmt::format("{}.result", table)));
    }
  }

  void write_routines() {
    write_routine(p_.rotate, "rotate",
                  p_.move && p_.stream.empty() ? "store raw data until it is stopped"
                  : p_.move                    ? "stream the samples until it is stopped"
                  : p_.stream.empty()
                      ? "rotate by the schedule and store raw data; it can be stopped, the state is then aborted"
                      : "rotate by the schedule and stream the samples; it can be stopped, the state is then aborted",
                  true);
    write_routine(p_.erase, "erase", "erase the inactive slot", false);
    write_routine(p_.commit, "commit", "make the inactive set the one in force from the next power-on on", false);
    write_routine(p_.navigation_check, "navigation_check", "navigate free-inertially at rest; it can be stopped", true);
  }

  void write_upload() {
    const Raw& raw = p_.raw;
    out_.heading("Raw data");
    if (raw.way == Raw::Way::stream) {
      return describe_stream(out_, p_);
    }
    if (raw.way == Raw::Way::memory) {
      out_.say(
          fmt::format("23 {:X}{:X} ADDRESS SIZE, big-endian, {} and {} bytes, in the session: the response is 63 and "
                      "SIZE bytes of the memory "
                      "from ADDRESS on, {} at most. Page p of the latest run begins at 0x{:X} + p * {}. What is not in "
                      "pages that are "
                      "written is refused (0x31). Pages are told while the gimbal still turns.",
                      raw.size_bytes, raw.address_bytes, raw.address_bytes, raw.size_bytes, raw.longest_read,
                      raw.first_address, raw.page.bytes));
    } else {
      raw.way == Raw::Way::file ? write_file_service() : write_upload_service();
      out_.say(
          "Then 36 BLOCK, BLOCK from 1 on, after FF comes 00: the response is 76 BLOCK DATA; the same BLOCK again: the "
          "same data. 37 ends it: 77. Pages are told while the gimbal still turns.");
    }
    out_.heading("Record page: samples of the IMU");
    out_.say(
        "Every page but the last of a run is full. Sample i of the run ends i + 1 sample intervals after its start.");
    write_record(out_, raw.page, record_role("page"));
  }

  void write_upload_service() {
    const Raw& raw = p_.raw;
    out_.say(
        fmt::format("35 00 {:X}{:X} ADDRESS SIZE, big-endian, {} and {} bytes. ADDRESS is {}, SIZE a multiple of {} in "
                    "bytes. The response is 75 40 and four bytes, big-endian: the longest response to TransferData.",
                    raw.size_bytes, raw.address_bytes, raw.address_bytes, raw.size_bytes,
                    raw.by_page ? "the number of a page of the run"
                                : fmt::format("{} times the number of a page of the run", raw.page.bytes),
                    raw.page.bytes));
  }

  void write_file_service() {
    const Raw& raw = p_.raw;
    out_.say(fmt::format(
        "Each page is a file. 38 04 LENGTH NAME 00: RequestFileTransfer, ReadFile, LENGTH of NAME in two bytes, "
        "big-endian, NAME in ASCII, no compression. NAME of page 7 in run 3 is {}; pages count from 0. The response is "
        "78 04 04 BLOCK 00 00 04 SIZE SIZE, four bytes each, big-endian: the longest response to TransferData, and "
        "twice the size of the file, {}. A file that is not there is refused (0x31).",
        file_name(raw.file, 3, 7), raw.page.bytes));
  }

  void write_axes() {
    out_.heading("Axes");
    out_.say(
        "selfcal's IMU axes x y z are right-handed; with both gimbal angles 0 they are front, up, right of the host. "
        "The outer gimbal "
        "turns about z, the inner one about y of what the outer one carries, right-handed.");
    std::vector<Row> rows;
    constexpr std::string_view imu[] = {"x", "y", "z"}, gimbal[] = {"outer", "inner"};
    for (std::size_t k = 0; k < 3; ++k) {
      rows.push_back({std::string(imu[k]), fmt::format("{}{}", p_.raw.sign[k] < 0 ? "-" : "", imu[p_.raw.axis[k]])});
    }
    for (std::size_t k = 0; k < 2; ++k) {
      rows.push_back({std::string(gimbal[k]),
                      fmt::format("{}{}", p_.raw.gimbal_sign[k] < 0 ? "-" : "", gimbal[p_.raw.gimbal[k]])});
    }
    out_.table({"selfcal's", "is the INS's"}, rows);
  }

  const Profile& p_;
  Writer out_;
};

}  // namespace

std::string describe(const Profile& profile, Markup markup) { return Document(profile, markup).write(); }

}  // namespace selfcal::profile
