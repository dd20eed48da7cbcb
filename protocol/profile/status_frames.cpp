#include "protocol/profile/status_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <optional>

#include "protocol/profile/frame_values.hpp"
#include "protocol/profile/gimbal_axes.hpp"

namespace selfcal::profile {
namespace {

constexpr double full_turn_deg = 360.0;

// The nearest number that the signal can hold.
std::uint64_t nearest(const Signal& signal, double value) {
  if (const auto fits = raw_for(signal, value)) {
    return *fits;
  }
  const bool with_sign = signal.kind == Signal::Kind::with_sign;
  const std::uint64_t ones = signal.length == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << signal.length) - 1;
  const std::uint64_t highest = with_sign ? ones >> 1U : ones;
  return (value - signal.offset) / signal.scale > 0.0 ? highest : with_sign ? highest + 1 : 0;
}

double within_turn(double degrees) {
  const double turn = std::fmod(degrees, full_turn_deg);
  return turn < 0.0 ? turn + full_turn_deg : turn;
}

// As far round as the signal reaches: 359.996 deg in hundredths is 0, and 270 deg is -90 where 270 does not fit.
std::uint64_t angle(const Signal& signal, double degrees) {
  double value = within_turn(degrees);
  if (signal.kind != Signal::Kind::floating) {
    const double least = std::abs(signal.scale);
    value = std::round(value / least) * least;
    value = value > full_turn_deg - 0.5 * least ? 0.0 : value;
  }
  const auto fits = raw_for(signal, value);
  return fits ? *fits : nearest(signal, value - full_turn_deg);
}

void put(const Frame& kind, std::string_view name, double value, can::CanFrame& frame) {
  const Signal* signal = kind.find(name);
  if (signal == nullptr || signal->constant) {
    return;
  }
  std::uint64_t raw = 0;
  if (!signal->codes.empty()) {
    const auto code = signal->codes.find(static_cast<std::uint64_t>(value));
    raw = code == signal->codes.end() ? signal->codes.begin()->second : code->second;
  } else {
    raw = name.ends_with("_angle") ? angle(*signal, value) : nearest(*signal, value);
  }
  put_raw(*signal, raw, std::span(frame.data).first(frame.size));
}

can::CanFrame blank(const Frame& kind, std::uint32_t id, bool extended) {
  can::CanFrame frame;
  frame.id = id;
  frame.extended = extended;
  frame.fd = kind.bytes > can::max_classic_bytes;
  frame.size = static_cast<std::uint8_t>(kind.bytes);
  for (const Signal& signal : kind.signals) {
    if (signal.constant) {
      put_raw(signal, *signal.constant, std::span(frame.data).first(frame.size));
    }
  }
  return frame;
}

// The role's number of what the frame tells; none where it is no code of the profile.
std::optional<double> told(const Frame& kind, std::string_view name, const can::CanFrame& frame) {
  const Signal* signal = kind.find(name);
  if (signal == nullptr || signal->constant) {
    return std::nullopt;
  }
  const std::uint64_t raw = raw_of(*signal, frame.payload());
  if (signal->codes.empty()) {
    return value_of(*signal, raw);
  }
  const auto code = std::ranges::find(signal->codes, raw, [](const auto& entry) { return entry.second; });
  return code == signal->codes.end() ? std::nullopt : std::optional(static_cast<double>(code->first));
}

template <typename Number>
void take(const Frame& kind, std::string_view name, const can::CanFrame& frame, Number& into) {
  if (const auto value = told(kind, name, frame); value && std::isfinite(*value)) {
    const double most = static_cast<double>(std::numeric_limits<Number>::max());
    into = static_cast<Number>(std::clamp(*value, 0.0, most));
  }
}

void take_angle(const Frame& kind, std::string_view name, const can::CanFrame& frame, double& degrees) {
  if (const auto value = told(kind, name, frame); value && std::isfinite(*value)) {
    degrees = within_turn(*value);
  }
}

bool constants_hold(const Frame& kind, const can::CanFrame& frame) {
  return std::ranges::all_of(kind.signals, [&](const Signal& signal) {
    return !signal.constant || raw_of(signal, frame.payload()) == *signal.constant;
  });
}

}  // namespace

std::array<can::CanFrame, 2> encode_status(const Profile& profile, const ins::Status& status, std::uint8_t alive,
                                           std::uint32_t state_id, bool extended) {
  const auto& [state, gimbal] = profile.status;
  std::array frames{blank(state, state_id, extended), blank(gimbal, state_id + 1, extended)};
  for (const auto& [name, value] :
       {std::pair("state", static_cast<double>(status.state)), std::pair("gimbal_moving", status.moving ? 1.0 : 0.0),
        std::pair("unlocked", status.unlocked ? 1.0 : 0.0), std::pair("session", double(status.session)),
        std::pair("faults", double(status.faults)), std::pair("position", double(status.position)),
        std::pair("pages_written", double(status.pages_written)), std::pair("state_alive", double(alive))}) {
    put(state, name, value, frames[0]);
  }
  const auto angles = in_their_axes<double>(profile, {status.outer_deg, status.inner_deg});
  for (const auto& [name, value] :
       {std::pair("outer_angle", angles[0]), std::pair("inner_angle", angles[1]),
        std::pair("time_left", status.time_left_s), std::pair("gimbal_alive", double(alive))}) {
    put(gimbal, name, value, frames[1]);
  }
  return frames;
}

bool apply_status(const Profile& profile, const can::CanFrame& frame, std::uint32_t state_id, bool extended,
                  ins::Status& status) {
  const bool is_state = frame.id == state_id;
  const Frame& kind = is_state ? profile.status.state : profile.status.gimbal;
  if (frame.extended != extended || frame.remote || (!is_state && frame.id != state_id + 1) ||
      frame.size != kind.bytes || !constants_hold(kind, frame)) {
    return false;
  }
  if (!is_state) {
    auto angles = in_their_axes<double>(profile, {status.outer_deg, status.inner_deg});
    take_angle(kind, "outer_angle", frame, angles[0]);
    take_angle(kind, "inner_angle", frame, angles[1]);
    const auto ours = in_our_axes<double>(profile, angles);
    status.outer_deg = within_turn(ours[0]);
    status.inner_deg = within_turn(ours[1]);
    take(kind, "time_left", frame, status.time_left_s);
    return true;
  }
  const auto state = told(kind, "state", frame);
  if (!state) {
    return false;
  }
  status.state = static_cast<ins::State>(*state);
  take(kind, "gimbal_moving", frame, status.moving);
  take(kind, "unlocked", frame, status.unlocked);
  take(kind, "session", frame, status.session);
  take(kind, "faults", frame, status.faults);
  take(kind, "position", frame, status.position);
  take(kind, "pages_written", frame, status.pages_written);
  return true;
}

std::vector<NamedValue> status_values(const Profile& profile, const can::CanFrame& frame) {
  const Bus& bus = profile.bus;
  if (!bus.status || frame.extended != bus.extended_ids || frame.remote ||
      (frame.id != *bus.status && frame.id != *bus.status + 1)) {
    return {};
  }
  const bool is_state = frame.id == *bus.status;
  const Frame& kind = is_state ? profile.status.state : profile.status.gimbal;
  const FrameRole& role = frame_role(kind.name);
  if (frame.size != kind.bytes) {
    return {};
  }
  std::vector<NamedValue> values;
  for (const Signal& signal : kind.signals) {
    const auto field = std::ranges::find(role.signals, signal.name, &RoleField::name);
    if (signal.constant || field == role.signals.end()) {
      continue;
    }
    const std::uint64_t raw = raw_of(signal, frame.payload());
    const double number = signal.codes.empty() ? value_of(signal, raw) : static_cast<double>(raw);
    const auto code = std::ranges::find(signal.codes, raw, [](const auto& entry) { return entry.second; });
    std::string text = code != signal.codes.end()
                           ? std::string(field->words[code->first])
                           : fmt::format("{:.10g}{}{}", number, field->unit.empty() ? "" : " ", field->unit);
    values.push_back({dbc_name(signal.name), number, std::move(text)});
  }
  return values;
}

std::string dbc_name(std::string_view signal) {
  std::string name;
  bool begins = true;
  for (const char c : signal) {
    if (c == '_') {
      begins = true;
    } else {
      name += begins ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
      begins = false;
    }
  }
  return name;
}

}  // namespace selfcal::profile
