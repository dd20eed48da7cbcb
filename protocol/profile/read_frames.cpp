#include "protocol/profile/read_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "protocol/can/frame.hpp"
#include "protocol/profile/dbc_file.hpp"
#include "protocol/toml_file/nearest_word.hpp"

namespace selfcal::profile {
namespace {

constexpr std::array<std::string_view, 2> orders{"big", "little"};
constexpr std::array<std::string_view, 3> kinds{"unsigned", "signed", "float"};
constexpr std::array<std::string_view, 8> of_a_sample{"delta_theta_x", "delta_theta_y", "delta_theta_z", "delta_v_x",
                                                      "delta_v_y",     "delta_v_z",     "outer",         "inner"};

class FramesReader {
 public:
  FramesReader(Section section, const Profile& profile, ByteOrder order)
      : profile_(profile), order_(order), section_(std::move(section)) {}

  StatusFrames read_status() {
    StatusFrames frames;
    for (const auto& [name, frame] : {std::pair("state", &frames.state), std::pair("gimbal", &frames.gimbal)}) {
      Section table = section_.table(name, true);
      const FrameRole& role = frame_role(fmt::format("status.{}", name));
      frame->name = role.name;
      frame->line = table.line();
      if (table.there()) {
        read_bytes(table, *frame);
        read_signals(table, role, nullptr, *frame);
        std::ranges::stable_sort(frame->signals, {}, &Signal::start);  // a TOML table knows no order
        table.only_these();
      }
    }
    section_.only_these();
    return frames;
  }

  std::vector<Frame> read_stream() {
    const Bus& bus = profile_.bus;
    for (const auto& [path, id] :
         {std::pair("bus.request", std::optional(bus.request)), std::pair("bus.response", std::optional(bus.response)),
          std::pair("bus.functional", std::optional(bus.functional)), std::pair("bus.status", bus.status),
          std::pair("bus.status + 1", bus.status ? std::optional(*bus.status + 1) : std::nullopt)}) {
      Frame of_bus;
      of_bus.id = id.value_or(0);
      if (id) {
        taken_.emplace_back(path, true, of_bus);
      }
    }
    Frames frames;
    read_dbc();
    read_samples(frames);
    section_.only_these();
    return std::move(frames.samples);
  }

  Frames read() {
    Frames frames;
    if (!section_.there()) {
      return frames;
    }
    read_dbc();
    for (const auto& [name, frame] :
         {std::pair("identity", &frames.identity), std::pair("state", &frames.state), std::pair("told", &frames.told),
          std::pair("move", &frames.move), std::pair("read", &frames.read), std::pair("write", &frames.write),
          std::pair("reset", &frames.reset)}) {
      Section table = section_.table(name, true);
      *frame = read_frame(table, frame_role(name));
    }
    for (const auto& [name, frame] : {std::pair("start", &frames.start), std::pair("stop", &frames.stop)}) {
      Section table = section_.table(name);
      if (table.there()) {
        *frame = read_frame(table, frame_role(name));
      }
    }
    read_samples(frames);
    read_turning_table(frames);
    check_values(frames);
    section_.only_these();
    return frames;
  }

 private:
  void read_dbc() {
    const auto file = section_.text("dbc");
    if (!file) {
      return;
    }
    namespace fs = std::filesystem;
    auto dbc = load_dbc((fs::path(profile_.file).parent_path() / *file).string());
    if (!dbc) {
      return section_.fault("dbc", dbc.error().message);
    }
    dbc_ = std::move(*dbc);
  }

  const DbcMessage* message_of(Section& section) {
    const auto name = section.text("message");
    if (!name) {
      return nullptr;
    }
    const auto found = dbc_.find(*name);
    if (found == dbc_.end()) {
      section.fault("message", dbc_.empty() ? fmt::format("no DBC is named: {}", section_.path_of("dbc"))
                                            : fmt::format("the DBC has no message {}", *name));
      return nullptr;
    }
    if (found->second.extended != profile_.bus.extended_ids) {
      section.fault("message", fmt::format("{} has an identifier of {} bits, the bus of the profile {}", *name,
                                           found->second.extended ? 29 : 11, profile_.bus.extended_ids ? 29 : 11));
    }
    return &found->second;
  }

  void read_bytes(Section& section, Frame& frame) const {
    frame.bytes = section.whole("bytes", 1, profile_.bus.fd ? 64 : 8, true).value_or(8);
    check_bytes(section, frame);
  }

  static void check_bytes(Section& section, const Frame& frame) {
    if (can::frame_size_for(frame.bytes) != frame.bytes) {
      section.fault("bytes", fmt::format("no CAN frame has {}", frame.bytes));
    }
  }

  Frame read_frame(Section& section, const FrameRole& role) {
    Frame frame;
    if (!section.there()) {
      return frame;
    }
    frame.name = role.name;
    frame.line = section.line();
    const bool by_name = section.has("message");
    const DbcMessage* message = message_of(section);
    if (message != nullptr) {
      frame.id = message->id;
      frame.bytes = message->bytes;
      check_bytes(section, frame);
    } else if (!by_name) {
      frame.id = static_cast<std::uint32_t>(
          section.whole("id", 0, profile_.bus.extended_ids ? 0x1FFFFFFF : 0x7FF, true).value_or(0));
      read_bytes(section, frame);
    }
    read_signals(section, role, message, frame);
    check_id(section, role, frame);
    section.only_these();
    return frame;
  }

  // Commands may share an identifier where a constant tells them apart.
  static bool told_apart(const Frame& a, const Frame& b) {
    return std::ranges::any_of(a.signals, [&](const Signal& signal) {
      const Signal* other = b.find(signal.name);
      return signal.constant && other != nullptr && other->constant && other->start == signal.start &&
             other->length == signal.length && other->order == signal.order && *other->constant != *signal.constant;
    });
  }

  void check_id(Section& section, const FrameRole& role, const Frame& frame) {
    for (const auto& [path, from_ins, other] : taken_) {
      const bool commands = !role.from_ins && !from_ins;
      if (other.id == frame.id && !(commands && told_apart(frame, other))) {
        section.fault(section.has("id") ? "id" : "", fmt::format("0x{:X} is that of {} already{}", frame.id, path,
                                                                 commands ? ", and no constant tells them apart" : ""));
      }
    }
    taken_.emplace_back(section.path(), role.from_ins, frame);
  }

  void read_signals(Section& section, const FrameRole& role, const DbcMessage* message, Frame& frame) {
    Section signals = section.table("signals", std::ranges::any_of(role.signals, &RoleField::needed));
    for (const std::string& name : signals.keys()) {
      Section table = signals.table(name);
      if (!table.there()) {
        continue;
      }
      const auto known = std::ranges::find(role.signals, name, &RoleField::name);
      const RoleField* field = known == role.signals.end() ? nullptr : &*known;
      if (field == nullptr && !table.has("constant")) {
        table.fault("", unknown_words(role, name));
      }
      Signal signal = read_signal(table, field, message);
      signal.name = name;
      signal.line = table.line();
      check_place(table, signal, frame);
      frame.signals.push_back(std::move(signal));
    }
    for (const RoleField& field : role.signals) {
      if (field.needed && signals.there() && frame.find(field.name) == nullptr) {
        signals.missing(field.name);
      }
    }
  }

  static std::string unknown_words(const FrameRole& role, std::string_view name) {
    std::vector<std::string_view> names;
    for (const RoleField& field : role.signals) {
      names.push_back(field.name);
    }
    return fmt::format("no such signal{}; known are {}, and any name with a constant",
                       did_you_mean(name, std::span<const std::string_view>(names)), fmt::join(names, ", "));
  }

  Signal read_signal(Section& section, const RoleField* role, const DbcMessage* message) {
    Signal signal;
    if (const auto of = section.text("of")) {
      if (message == nullptr) {
        section.fault("of", "the frame names no message of a DBC");
      } else if (const auto found = message->signals.find(*of); found == message->signals.end()) {
        section.fault("of", fmt::format("the message has no signal {}", *of));
      } else {
        signal = found->second;
      }
    } else {
      read_place(section, signal);
    }
    if (role == nullptr || section.has("constant")) {
      read_constant(section, role, signal);
    } else if (!role->words.empty()) {
      read_codes(section, *role, signal);
    } else {
      read_value(section, *role, signal);
    }
    section.only_these();
    return signal;
  }

  void read_place(Section& section, Signal& signal) {
    signal.start = section.whole("start", 0, 511, true).value_or(0);
    signal.length = section.whole("length", 1, 64, true).value_or(1);
    signal.order = order_;
    if (const auto word = section.word("byte_order", orders)) {
      signal.order = *word == "little" ? ByteOrder::little : ByteOrder::big;
    }
    const std::string kind = section.word("type", kinds).value_or("unsigned");
    signal.kind = kind == "float"    ? Signal::Kind::floating
                  : kind == "signed" ? Signal::Kind::with_sign
                                     : Signal::Kind::whole;
    if (kind == "float" && signal.length != 32 && signal.length != 64) {
      section.fault("length", fmt::format("a float has 32 or 64 bits, not {}", signal.length));
      signal.kind = Signal::Kind::whole;
    }
  }

  static std::uint64_t largest(const Signal& signal) {
    return signal.length >= 63 ? (std::uint64_t{1} << 63U) - 1 : (std::uint64_t{1} << signal.length) - 1;
  }

  static void read_constant(Section& section, const RoleField* role, Signal& signal) {
    if (role != nullptr && role->needed) {
      section.fault("constant", fmt::format("{} tells something: a constant does not", role->name));
    }
    if (const auto bits = section.whole("constant", 0, largest(signal), true)) {
      signal.constant = *bits;
    }
  }

  static void read_codes(Section& section, const RoleField& role, Signal& signal) {
    Section codes = section.table("codes", true);
    std::map<std::uint64_t, std::string_view> taken;
    for (std::size_t k = 0; codes.there() && k < role.words.size(); ++k) {
      if (const auto code = codes.whole(role.words[k], 0, largest(signal), true)) {
        if (const auto [other, fresh] = taken.emplace(*code, role.words[k]); !fresh) {
          codes.fault(role.words[k], fmt::format("{} is the code of {} already", *code, other->second));
        }
        signal.codes.emplace(k, *code);
      }
    }
    codes.only_these();
    if (signal.kind != Signal::Kind::whole) {
      section.fault("type", "codes are unsigned");
    }
  }

  // What the profile says comes before what its DBC says.
  static void read_value(Section& section, const RoleField& role, Signal& signal) {
    const auto scale = section.number("scale", -1e30, 1e30);
    const auto offset = section.number("offset", -1e30, 1e30);
    const auto name = section.text("unit");
    if (scale == 0.0) {
      section.fault("scale", "is 0");
    }
    const Unit* wanted = find_unit(role.unit);
    const Unit* given = find_unit(name.value_or(signal.unit));
    double factor = 1.0;
    if (given != nullptr && given->quantity == wanted->quantity) {
      factor = given == wanted ? 1.0 : given->si / wanted->si;
      signal.unit = given->name;
    } else if (name || (!signal.unit.empty() && !role.unit.empty())) {
      section.fault(name ? "unit" : "of",
                    fmt::format("no unit of {}: {}", wanted->quantity, name.value_or(signal.unit)));
    }
    signal.scale = scale.value_or(signal.scale) * factor;
    signal.offset = offset.value_or(signal.offset) * factor;
  }

  static void check_place(Section& section, const Signal& signal, const Frame& frame) {
    const auto bits = bits_of(signal, frame.bytes);
    if (bits.size() < signal.length) {
      section.fault("",
                    fmt::format("{} bits from {} on are not in {} bytes", signal.length, signal.start, frame.bytes));
      return;
    }
    for (const Signal& other : frame.signals) {
      const auto taken = bits_of(other, frame.bytes);
      const auto shared = std::ranges::find_first_of(bits, taken);
      if (shared != bits.end()) {
        // Told at both, for nobody knows which of them is wrong.
        section.fault("", fmt::format("overlaps {} (line {}) in bit {}", other.name, other.line, *shared));
        const std::string path = section.path();
        section.faults().add(
            other.line, path.substr(0, path.rfind('.') + 1) + other.name,
            fmt::format("overlaps {} (line {}) in bit {}", path.substr(path.rfind('.') + 1), section.line(), *shared));
      }
    }
  }

  void read_samples(Frames& frames) {
    Section samples = section_.table("sample", true);
    std::map<std::string, std::string> told;
    for (const std::string& name : samples.keys()) {
      Section table = samples.table(name);
      Frame frame = read_frame(table, frame_role("sample"));
      frame.name = name;
      for (const Signal& signal : frame.signals) {
        if (signal.name == "counter" || signal.constant) {
          continue;
        }
        if (const auto [other, fresh] = told.emplace(signal.name, name); !fresh) {
          table.fault("signals", fmt::format("{} is told by {} already", signal.name, other->second));
        }
        check_counts(samples.faults(), signal, fmt::format("{}.signals.{}", table.path(), signal.name));
      }
      check_counter(table, frame, frames);
      frames.samples.push_back(std::move(frame));
    }
    for (const std::string_view name : of_a_sample) {
      if (samples.there() && !told.contains(std::string(name))) {
        samples.fault("", fmt::format("{} is told by no frame", name));
      }
    }
  }

  static void check_counts(Faults& faults, const Signal& signal, const std::string& path) {
    if (signal.name.starts_with("delta_") &&
        (signal.kind != Signal::Kind::with_sign || signal.length > 32 || signal.scale != 1.0 || signal.offset != 0.0)) {
      faults.add(signal.line, path,
                 "counts are signed, 32 bits at most, without scale: sample_format says their worth");
    }
  }

  static void check_counter(Section& table, const Frame& frame, const Frames& frames) {
    const Signal* counter = frame.find("counter");
    if (counter == nullptr) {
      return;
    }
    if (counter->kind != Signal::Kind::whole || counter->length < 4 || counter->length > 32 || counter->scale != 1.0) {
      table.fault("signals", "the counter is unsigned, 4 to 32 bits, without scale");
    }
    const Signal* first = frames.samples.empty() ? nullptr : frames.samples.front().find("counter");
    if (first != nullptr && first->length != counter->length) {
      table.fault("signals", fmt::format("its counter has {} bits, that of {} {}", counter->length,
                                         frames.samples.front().name, first->length));
    }
  }

  void read_turning_table(Frames& frames) {
    Section turning = section_.table("turning", true);
    frames.turning = read_turning(turning);
    turning.only_these();
  }

  // Each coefficient is one number of as many bits as the value, and its index fits the index.
  void check_values(const Frames& frames) {
    for (const Field& field : profile_.set.fields) {
      const auto fault = [&](std::string_view key, std::string_view what) {
        section_.faults().add(field.line, fmt::format("coefficients.fields.{}.{}", field.name, key), what);
      };
      if (field.count != 1 || field.type.kind == Kind::text) {
        fault("type", "a coefficient that is told by index is one number");
        continue;
      }
      for (const Frame* frame : {&frames.told, &frames.write, &frames.read}) {
        const Signal* index = frame->find("index");
        const Signal* value = frame->find("value");
        const std::uint64_t number = field.did.value_or(first_index_did) - first_index_did;
        if (value != nullptr && 8 * field.type.bytes != value->length) {
          fault("type", fmt::format("{} has {} bits, the value of frames.{} {}", field.type.name, 8 * field.type.bytes,
                                    frame->name, value->length));
        }
        if (index != nullptr && number > largest(*index)) {
          fault("index", fmt::format("{} does not fit the index of frames.{}", number, frame->name));
        }
      }
    }
  }

  const Profile& profile_;
  ByteOrder order_;
  Section section_;
  Dbc dbc_;
  std::vector<std::tuple<std::string, bool, Frame>> taken_;  // path, whether from the INS
};

}  // namespace

Frames read_frames(Section& root, const Profile& profile, ByteOrder order) {
  return FramesReader(root.table("frames", true), profile, order).read();
}

std::vector<Frame> read_stream(Section& stream, const Profile& profile, ByteOrder order) {
  return FramesReader(stream, profile, order).read_stream();
}

StatusFrames read_status_frames(Section& status, const Profile& profile, ByteOrder order) {
  return FramesReader(status, profile, order).read_status();
}

}  // namespace selfcal::profile
