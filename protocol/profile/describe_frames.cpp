#include "protocol/profile/describe_frames.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace selfcal::profile {
namespace {

constexpr double degrees_per_radian = 180.0 / 3.14159265358979323846;

std::string meaning(const Signal& signal, const RoleField* field) {
  if (signal.constant) {
    return fmt::format("always {} (0x{:X})", *signal.constant, *signal.constant);
  }
  std::string words(field->meaning);
  std::vector<std::string> codes;
  for (const auto& [ours, theirs] : signal.codes) {
    codes.push_back(fmt::format("{} {}", theirs, field->words[ours]));
  }
  return codes.empty() ? words : fmt::format("{}: {}", words, fmt::join(codes, ", "));
}

// What one count is worth, in the unit that the profile writes.
std::string scale_text(const Signal& signal, const RoleField* field) {
  if (signal.constant || !signal.codes.empty() || field->unit.empty()) {
    return "";
  }
  const Unit* own = find_unit(signal.unit.empty() ? field->unit : signal.unit);
  const double factor = own->si / find_unit(field->unit)->si;
  const std::string offset = signal.offset == 0.0 ? "" : fmt::format(", plus {:.10g}", signal.offset / factor);
  return fmt::format("{:.10g} {}{}", signal.scale / factor, own->name, offset);
}

Row row_of(const Signal& signal, const RoleField* field) {
  constexpr std::string_view kinds[] = {"unsigned", "signed", "IEEE 754"};
  return {signal.name,
          std::to_string(signal.start),
          std::to_string(signal.length),
          signal.length == 1                  ? ""
          : signal.order == ByteOrder::little ? "little"
                                              : "big",
          std::string(kinds[static_cast<std::size_t>(signal.kind)]),
          scale_text(signal, field),
          meaning(signal, field)};
}

void write_frame(Writer& out, const Frame& frame, const FrameRole& role, bool extended) {
  out.heading(fmt::format("Frame {}: {}", frame.name, role.meaning));
  out.say(fmt::format("{}, identifier 0x{:0{}X}, {} bytes. Bits that no signal has are 0.",
                      role.from_ins ? "INS to tester" : "Tester to INS", frame.id, extended ? 8 : 3, frame.bytes));
  std::vector<Row> rows;
  std::vector<Signal> signals = frame.signals;
  std::ranges::stable_sort(signals, {}, &Signal::start);
  for (const Signal& signal : signals) {
    const auto known = std::ranges::find(role.signals, signal.name, &RoleField::name);
    rows.push_back(row_of(signal, known == role.signals.end() ? nullptr : &*known));
  }
  out.table({"signal", "start bit", "bits", "order", "type", "one count is", "meaning"}, rows);
}

void say_how(Writer& out, const Profile& profile) {
  const Frames& frames = *profile.frames;
  out.heading("Bus");
  out.say(
      fmt::format("CAN{}, identifiers of {} bits. There is no ISO-TP and no UDS: a message is a frame. Bit b of a "
                  "frame is bit b % 8 of "
                  "byte b / 8, bit 0 the lowest. A signal in little-endian order starts at its lowest bit and goes on "
                  "upwards; one in "
                  "big-endian order starts at its highest bit, goes down to bit 0 of the byte, and on at bit 7 of the "
                  "next byte: as in a "
                  "DBC.",
                  profile.bus.fd ? " FD with bit rate switch" : ", classic", profile.bus.extended_ids ? 29 : 11));
  out.heading("How it is calibrated");
  out.say(fmt::format(
      "The tester waits {:g} s for an identity frame, a state frame or an answer: the INS sends identity and state "
      "again "
      "and again, several in that time. The tester commands the first position and waits until {} state frames in a "
      "row "
      "say that the gimbal rests{}. Then{} the INS streams its samples, {:g} a second, from the first one on, until "
      "the end. "
      "After the dwell, counted in samples, the next position is commanded. The INS is there when {}; it may take {:g} "
      "s. "
      "After the last dwell{}.",
      profile.timing.request_timeout_s, 2,
      frames.state.find("outer") != nullptr && frames.turning.by_angle ? " there" : "",
      frames.start ? ", upon frame start," : "", profile.sample_format.given.at("sample_rate"),
      frames.turning.by_angle
          ? fmt::format(
                "both gimbal angles of the samples are within {:g} deg of the position and stay within {:g} deg "
                "for 0.2 s, which are part of the dwell",
                frames.turning.tolerance_rad * degrees_per_radian, frames.turning.rest_rad * degrees_per_radian)
          : std::string("two state frames in a row say idle"),
      frames.turning.longest_move_s, frames.stop ? " frame stop ends the stream" : " the tester listens no more"));
  out.say(
      "Every frame of a sample has the counter of that sample; the next sample has the next counter, and after the "
      "highest "
      "comes 0. A sample of which a frame is lost ends the calibration. Coefficients are read and written one by one: "
      "the "
      "answer to read and to write is frame told with the same index. After reset the INS is away for a while; its "
      "power "
      "cycles then count one more, and the coefficients that were written are used.");
}

}  // namespace

void describe_status(Writer& out, const Profile& profile) {
  if (!profile.bus.status) {
    return;
  }
  Frame state = profile.status.state, gimbal = profile.status.gimbal;
  state.id = *profile.bus.status;
  gimbal.id = *profile.bus.status + 1;
  for (const Frame* frame : {&state, &gimbal}) {
    write_frame(out, *frame, frame_role(frame->name), profile.bus.extended_ids);
  }
}

void describe_stream(Writer& out, const Profile& profile) {
  out.say(
      "While the INS rotates it streams its samples, from the first one of the rotation on, each once and as it is "
      "made. "
      "Every frame of a sample has the counter of that sample; the next sample has the next counter, and after the "
      "highest comes 0. A sample of which a frame is lost ends the calibration. The last sample is sent before the "
      "state "
      "is told as another than rotating. Bit b of a frame is bit b % 8 of byte b / 8, bit 0 the lowest. A signal in "
      "little-endian order starts at its lowest bit and goes on upwards; one in big-endian order starts at its highest "
      "bit, goes down to bit 0 of the byte, and on at bit 7 of the next byte: as in a DBC.");
  for (const Frame& frame : profile.stream) {
    write_frame(out, frame, frame_role("sample"), profile.bus.extended_ids);
  }
}

void describe_frames(Writer& out, const Profile& profile) {
  const Frames& frames = *profile.frames;
  const bool extended = profile.bus.extended_ids;
  say_how(out, profile);
  for (const auto& [name, frame] :
       {std::pair("identity", &frames.identity), std::pair("state", &frames.state), std::pair("move", &frames.move),
        std::pair("read", &frames.read), std::pair("write", &frames.write), std::pair("told", &frames.told),
        std::pair("reset", &frames.reset)}) {
    write_frame(out, *frame, frame_role(name), extended);
  }
  for (const auto& [name, frame] : {std::pair("start", &frames.start), std::pair("stop", &frames.stop)}) {
    if (*frame) {
      write_frame(out, **frame, frame_role(name), extended);
    }
  }
  for (const Frame& frame : frames.samples) {
    write_frame(out, frame, frame_role("sample"), extended);
  }
  out.say("What the counts are worth, always the same:");
  std::vector<Row> rows;
  for (const RoleField& field : record_role("sample_format").fields) {
    if (const auto given = profile.sample_format.given.find(field.name); given != profile.sample_format.given.end()) {
      rows.push_back(
          {std::string(field.name), fmt::format("{:.12g} {}", given->second, field.unit), std::string(field.meaning)});
    }
  }
  out.table({"name", "value", "meaning"}, rows);
}

}  // namespace selfcal::profile
