#include "sim_ins/device/scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/geometry/units.hpp"
#include "sim_ins/toml_reader.hpp"

namespace selfcal::sim {
namespace {

constexpr std::array<std::string_view, fault_kinds> names{"drop",
                                                          "duplicate",
                                                          "reorder",
                                                          "corrupt",
                                                          "delay",
                                                          "bus_off",
                                                          "babble",
                                                          "reset",
                                                          "stuck_gimbal",
                                                          "overshoot",
                                                          "wrong_direction",
                                                          "saturated_gyro",
                                                          "saturated_accel",
                                                          "frozen_gyro",
                                                          "frozen_accel",
                                                          "late_status",
                                                          "wrong_status",
                                                          "second_tester",
                                                          "nrc",
                                                          "spoilt_page"};

std::optional<FaultKind> kind_of(std::string_view name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? std::nullopt : std::optional(static_cast<FaultKind>(found - names.begin()));
}

std::optional<ins::State> state_of(std::string_view name) {
  for (int value = 0; value <= static_cast<int>(ins::State::checking); ++value) {
    const auto state = static_cast<ins::State>(value);
    if (ins::name(state) == name) {
      return state;
    }
  }
  return std::nullopt;
}

// These count from the start of the rotation, or not by time at all.
bool by_rotation(FaultKind kind) {
  return (kind >= FaultKind::stuck_gimbal && kind <= FaultKind::frozen_accel) || kind == FaultKind::spoilt_page;
}

// A gimbal that sticks from a time on, not from a move on.
bool by_time(const Fault& fault) { return fault.kind == FaultKind::stuck_gimbal && fault.value <= 0.0; }

std::size_t first_move_after(const Schedule& schedule, double at_s) {
  double begin = schedule.dwell_s[0];
  std::size_t k = 0;
  while (k + 1 < schedule.positions.size() && begin < at_s) {
    ++k;
    begin += schedule.rotation_s + schedule.dwell_s[k];
  }
  return k;
}

}  // namespace

void Scenario::note_state(ins::State state, double t) {
  for (Fault& fault : faults) {
    if (fault.state == state) {
      fault.at_s += t;
      fault.state.reset();
    }
  }
}

const Fault* Scenario::active(FaultKind kind, double t) const {
  for (const Fault& fault : faults) {
    if (fault.kind == kind && !fault.state && t >= fault.at_s && t < fault.at_s + fault.for_s) {
      return &fault;
    }
  }
  return nullptr;
}

Expected<Scenario> read_scenario(const std::string& path) {
  const auto text = read_text(path);
  if (!text) {
    return tl::unexpected(text.error());
  }
  Scenario scenario;
  const auto read = read_toml(*text, path, [&](TomlTable& root) {
    root.integer("seed", scenario.seed, 0, 1ULL << 62);
    root.tables("fault", [&](TomlTable& table) {
      std::string name;
      Fault fault;
      table.text("kind", name);
      table.number("at_s", fault.at_s, 0.0, 1e9);
      table.number("for_s", fault.for_s, 0.0, 1e12);
      table.number("probability", fault.probability, 0.0, 1.0);
      table.number("value", fault.value, 0.0, 1e9);
      table.number("amount", fault.amount, -1e9, 1e9);
      table.boolean("detected", fault.detected);
      const auto kind = kind_of(name);
      if (!kind) {
        table.refuse("kind", fmt::format("no fault is called '{}'; known are {}", name, fmt::join(names, ", ")));
        return;
      }
      fault.kind = *kind;
      if (std::string state; table.has("state")) {
        table.text("state", state);
        fault.state = state_of(state);
        if (!fault.state) {
          table.refuse("state", fmt::format("'{}' is no state of the INS", state));
        } else if (by_rotation(*kind)) {
          table.refuse("state", fmt::format("{} counts from the start of the rotation already", name));
        }
      }
      scenario.faults.push_back(fault);
    });
  });
  return read.map([&] { return scenario; });
}

GimbalMotion spoil_gimbal(const Scenario& scenario, const GimbalMotion& planned) {
  std::vector<GimbalMove> moves = planned.moves();
  for (const Fault& fault : scenario.faults) {
    auto k = static_cast<std::size_t>(fault.value) - 1;
    if (by_time(fault)) {
      const auto first = std::ranges::find_if(moves, [&](const GimbalMove& m) { return m.start_s >= fault.at_s; });
      k = static_cast<std::size_t>(first - moves.begin());
    }
    if (k >= moves.size()) {
      continue;
    }
    if (fault.kind == FaultKind::stuck_gimbal) {
      moves.resize(k);
      continue;
    }
    GimbalMove& move = moves[k];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double way = move.to[axis] - move.from[axis];
      if (fault.kind == FaultKind::overshoot && std::abs(way) > 5.0 * units::degree) {
        move.to[axis] += std::copysign(fault.amount * units::degree, way);
      } else if (fault.kind == FaultKind::wrong_direction) {
        move.to[axis] = move.from[axis] - way;
      }
    }
    if (k + 1 < moves.size()) {
      moves[k + 1].from = move.to;
    }
  }
  constexpr double before_everything = -1.0;
  return {planned.at(before_everything).angle, std::move(moves)};
}

std::optional<double> gimbal_failure_time(const Scenario& scenario, const Schedule& schedule) {
  constexpr double notice_s = 2.0;
  std::optional<double> first;
  for (const Fault& fault : scenario.faults) {
    const bool of_gimbal = fault.kind == FaultKind::stuck_gimbal || fault.kind == FaultKind::overshoot ||
                           fault.kind == FaultKind::wrong_direction;
    const auto k = by_time(fault) ? first_move_after(schedule, fault.at_s) : static_cast<std::size_t>(fault.value) - 1;
    if (of_gimbal && fault.detected && k + 1 < schedule.positions.size()) {
      double t = notice_s;
      for (std::size_t i = 0; i <= k; ++i) {
        t += schedule.dwell_s[i] + schedule.rotation_s;
      }
      first = std::min(first.value_or(t), t);
    }
  }
  return first;
}

bool spoil_sample(const Scenario& scenario, double t, const ImuSample& before, ImuSample& sample) {
  bool saturated = false;
  for (const Fault& fault : scenario.faults) {
    const auto axis = static_cast<std::size_t>(fault.value);
    if (t < fault.at_s || t >= fault.at_s + fault.for_s || axis > 2) {
      continue;
    }
    const auto limit = static_cast<std::int32_t>(std::min(std::abs(fault.amount), 2e9));
    const bool gyro = fault.kind == FaultKind::saturated_gyro || fault.kind == FaultKind::frozen_gyro;
    std::int32_t& count = gyro ? sample.delta_theta[axis] : sample.delta_v[axis];
    if (fault.kind == FaultKind::saturated_gyro || fault.kind == FaultKind::saturated_accel) {
      saturated |= std::abs(count) > limit;
      count = std::clamp(count, -limit, limit);
    } else if (fault.kind == FaultKind::frozen_gyro || fault.kind == FaultKind::frozen_accel) {
      count = gyro ? before.delta_theta[axis] : before.delta_v[axis];
    }
  }
  return saturated;
}

bool FaultyBus::hits(FaultKind kind, double t, const Fault** fault) {
  const Fault* active = scenario_.active(kind, t);
  if (fault != nullptr) {
    *fault = active;
  }
  if (active == nullptr || random_.uniform() >= active->probability) {
    return false;
  }
  count(kind);
  return true;
}

std::string FaultyBus::tally() const {
  std::string text;
  for (std::size_t kind = 0; kind < acted_.size(); ++kind) {
    if (acted_[kind] > 0) {
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", names[kind], acted_[kind]);
    }
  }
  return text;
}

void FaultyBus::pass(const can::CanFrame& frame, double t, std::vector<can::CanFrame>& out) {
  if (scenario_.faults.empty()) {
    out.push_back(frame);
    return;
  }
  if (scenario_.active(FaultKind::bus_off, t) != nullptr) {
    count(FaultKind::bus_off);
    return;
  }
  if (hits(FaultKind::drop, t)) {
    return;
  }
  can::CanFrame spoilt = frame;
  if (hits(FaultKind::corrupt, t) && spoilt.size > 0) {
    spoilt.data[random_.bits() % spoilt.size] ^= static_cast<std::uint8_t>(1U << (random_.bits() % 8));
  }
  const Fault* delay = nullptr;
  if (hits(FaultKind::delay, t, &delay)) {
    held_.push_back({t + delay->amount, spoilt});
    return;
  }
  if (!overtaken_ && hits(FaultKind::reorder, t)) {
    overtaken_ = spoilt;
    return;
  }
  out.push_back(spoilt);
  if (hits(FaultKind::duplicate, t)) {
    out.push_back(spoilt);
  }
  if (overtaken_) {
    out.push_back(*overtaken_);
    overtaken_.reset();
  }
}

void FaultyBus::flush(double t, std::vector<can::CanFrame>& out) {
  while (!held_.empty() && held_.front().until <= t) {
    out.push_back(held_.front().frame);
    held_.pop_front();
  }
  const Fault* babble = scenario_.active(FaultKind::babble, t);
  if (babble == nullptr || babble->value <= 0.0) {
    babbled_until_ = t;
    return;
  }
  constexpr std::size_t at_most = 64;  // a call; what a slow host misses is not made up for
  for (std::size_t k = 0; k < at_most && babbled_until_ < t; ++k) {
    can::CanFrame noise;
    noise.id = 0x100;
    noise.size = 8;
    out.push_back(noise);
    count(FaultKind::babble);
    babbled_until_ += 1.0 / babble->value;
  }
  babbled_until_ = std::max(babbled_until_, t - 1.0);
}

}  // namespace selfcal::sim
