#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "protocol/profile/dbc_file.hpp"

namespace selfcal::profile {
namespace {

constexpr std::uint32_t extended_bit = 0x80000000;

struct Message {
  std::string name;
  bool from_ins = false;
  std::vector<const Frame*> frames;
};

const Unit& unit_of(const Signal& signal, const FrameRole& role) {
  const auto field = std::ranges::find(role.signals, signal.name, &RoleField::name);
  const bool none = field == role.signals.end();
  return *find_unit(!signal.unit.empty() ? signal.unit : none ? std::string_view() : field->unit);
}

// The value of the signal that tells apart what shares the identifier.
const Signal* multiplexor(const Message& message) {
  for (const Signal& signal : message.frames.front()->signals) {
    const bool in_all = std::ranges::all_of(message.frames, [&](const Frame* frame) {
      const Signal* other = frame->find(signal.name);
      return other != nullptr && other->constant && other->start == signal.start;
    });
    if (message.frames.size() > 1 && signal.constant && in_all) {
      return &signal;
    }
  }
  return nullptr;
}

std::string line_of(const Signal& signal, const std::string& name, const std::string& mark, const FrameRole& role,
                    bool from_ins) {
  const Unit& unit = unit_of(signal, role);
  const auto field = std::ranges::find(role.signals, signal.name, &RoleField::name);
  const Unit& own = field == role.signals.end() ? unit : *find_unit(field->unit);
  const double factor = unit.si / own.si;
  return fmt::format(" SG_ {}{} : {}|{}@{}{} ({:.10g},{:.10g}) [0|0] \"{}\" {}\n", name, mark, signal.start,
                     signal.length, signal.order == ByteOrder::little ? 1 : 0,
                     signal.kind == Signal::Kind::whole ? '+' : '-', signal.scale / factor, signal.offset / factor,
                     unit.name, from_ins ? "Tester" : "INS");
}

// A signal that is multiplexed has its frame's name before its own.
std::string name_of(const Message& message, const Frame& frame, const Signal& signal) {
  const Signal* telling = multiplexor(message);
  return telling == nullptr || telling->name == signal.name ? signal.name
                                                            : fmt::format("{}_{}", frame.name, signal.name);
}

std::string text_of(std::uint32_t id, const Message& message) {
  std::size_t bytes = 0;
  for (const Frame* frame : message.frames) {
    bytes = std::max(bytes, frame->bytes);
  }
  std::string text = fmt::format("BO_ {} {}: {} {}\n", id, message.name, bytes, message.from_ins ? "INS" : "Tester");
  const Signal* telling = multiplexor(message);
  if (telling != nullptr) {
    text += line_of(*telling, telling->name, " M", frame_role(message.frames.front()->name), message.from_ins);
  }
  for (const Frame* frame : message.frames) {
    const FrameRole& role =
        frame_role(message.from_ins && message.name.starts_with("sample_") ? "sample" : frame->name);
    for (const Signal& signal : frame->signals) {
      if (telling != nullptr && signal.name == telling->name) {
        continue;
      }
      const std::string mark = telling == nullptr ? "" : fmt::format(" m{}", *frame->find(telling->name)->constant);
      text += line_of(signal, name_of(message, *frame, signal), mark, role, message.from_ins);
    }
  }
  return text + "\n";
}

}  // namespace

std::string frames_dbc(const Profile& profile) {
  const Frames& frames = *profile.frames;
  std::map<std::uint32_t, Message> messages;
  const auto add = [&](const Frame& frame, std::string name, bool from_ins) {
    Message& message = messages[frame.id | (profile.bus.extended_ids ? extended_bit : 0U)];
    message.name += message.name.empty() ? name : "_" + name;
    message.from_ins = from_ins;
    message.frames.push_back(&frame);
  };
  for (const Frame* frame : {&frames.identity, &frames.state, &frames.told}) {
    add(*frame, frame->name, true);
  }
  for (const Frame* frame : {&frames.move, &frames.read, &frames.write, &frames.reset}) {
    add(*frame, frame->name, false);
  }
  for (const auto* frame : {&frames.start, &frames.stop}) {
    if (*frame) {
      add(**frame, (*frame)->name, false);
    }
  }
  for (const Frame& frame : frames.samples) {
    add(frame, "sample_" + frame.name, true);
  }
  std::string text = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: INS Tester\n\n";
  for (const auto& [id, message] : messages) {
    text += text_of(id, message);
  }
  for (const auto& [id, message] : messages) {
    for (const Frame* frame : message.frames) {
      for (const Signal& signal : frame->signals) {
        if (signal.kind == Signal::Kind::floating) {
          text += fmt::format("SIG_VALTYPE_ {} {} : {};\n", id, name_of(message, *frame, signal),
                              signal.length == 32 ? 1 : 2);
        }
      }
    }
  }
  return text;
}

}  // namespace selfcal::profile
