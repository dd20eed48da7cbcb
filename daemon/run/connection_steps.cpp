// Who answers, in which state, with which set in force; and the way back to it after the link was lost.
#include <fmt/format.h>

#include "daemon/run/calibration_run.hpp"
#include "daemon/run/ins_checks.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr auto recovery_interval = 300ms;

}  // namespace

Task<Answer<Done>> CalibrationRun::check_serial() {
  const auto identity = co_await client_.identify();
  if (!identity) {
    co_return tl::unexpected(identity.error());
  }
  if (!record_.serial.empty() && record_.serial != identity->serial) {
    co_return senseless(
        fmt::format("INS {} answers, but run {} belongs to INS {}", identity->serial, record_.id, record_.serial));
  }
  record_.serial = identity->serial;
  record_.ins_software = identity->software;
  co_return Done{};
}

Task<Answer<Done>> CalibrationRun::take_stock() {
  const auto state = co_await ask_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  if (power_cycles_ && state->power_cycles < *power_cycles_) {
    co_return senseless(fmt::format("the power-cycle counter went back from {} to {}: this is not the INS that it was",
                                    *power_cycles_, state->power_cycles));
  }
  if (power_cycles_ && state->power_cycles != *power_cycles_) {
    remember("ins", fmt::format("the INS restarted: power cycle {}, {} before", state->power_cycles, *power_cycles_));
  }
  power_cycles_ = state->power_cycles;
  stock_ = *state;
  auto set = co_await client_.read_record(ins::did::coefficients_in_force);
  if (!set) {
    co_return tl::unexpected(set.error());
  }
  in_force_ = std::move(*set);
  co_return Done{};
}

// A restart that nobody noticed as such may be another unit on the same plug: nothing is written to it on trust.
Answer<Done> CalibrationRun::check_power_cycles(std::uint32_t found, std::string_view when) {
  if (!power_cycles_ || found == *power_cycles_) {
    power_cycles_ = found;
    return Done{};
  }
  return senseless(
      fmt::format("before {} the power-cycle counter is {}, it was {}: the INS was switched off meanwhile, "
                  "or it is another one; {}",
                  when, found, *power_cycles_, what_the_ins_holds()));
}

Task<Answer<Done>> CalibrationRun::confirm_identity(std::string before) {
  const auto identity = co_await client_.identify();
  if (!identity) {
    co_return tl::unexpected(identity.error());
  }
  if (identity->serial != record_.serial) {
    co_return senseless(fmt::format("before {} INS {} answers, but run {} belongs to INS {}; {}", before,
                                    identity->serial, record_.id, record_.serial, what_the_ins_holds()));
  }
  const auto state = co_await client_.read_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  co_return check_power_cycles(state->power_cycles, before);
}

Task<Answer<Done>> CalibrationRun::look_for_data() {
  const auto directory = co_await client_.read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  data_complete_ = holds_whole_rotation(*directory);
  co_return Done{};
}

Task<CalibrationRun::Step> CalibrationRun::identify() {
  if (auto known = co_await check_serial(); !known) {
    co_return tl::unexpected(known.error());
  }
  if (auto taken = co_await take_stock(); !taken) {
    co_return tl::unexpected(taken.error());
  }
  if (stock_.state == ins::State::rotating) {
    co_return senseless(fmt::format("INS {}: the gimbal turns already, and not for this run", record_.serial));
  }
  const auto set = ins::decode_coefficients(in_force_);
  if (!set) {
    co_return senseless(set.error().message);
  }
  if (const Complaint complaint = check_coefficients(set->value, "the set in force")) {
    warn(fmt::format("{}: {}: it is not kept where a new value is missing", config_.interface, *complaint));
  }
  if (auto kept = context_.store.store_set(record_.id, SetRole::previous, in_force_); !kept) {
    co_return local_trouble(kept.error());
  }
  remember("ins", fmt::format("INS {}, software {}, coefficients version {} in force", record_.serial,
                              record_.ins_software, stock_.coefficients_version));
  co_return Event::identified;
}

Task<CalibrationRun::Step> CalibrationRun::unlock() {
  const auto unlocked = co_await client_.unlock(key_);
  if (!unlocked) {
    co_return tl::unexpected(unlocked.error());
  }
  // This run has begun none: left by a service that is gone, or by another tester. The INS would refuse to rotate.
  if (stock_.state == ins::State::checking) {
    warn("the INS is in a navigation check that is not this run's: it is ended first");
  }
  if (auto ended = co_await stop_check(); !ended) {
    co_return tl::unexpected(ended.error());
  }
  co_return Event::unlocked;
}

// Until the INS answers again and is unlocked, or the time is over.
Task<CalibrationRun::Step> CalibrationRun::recover_link() {
  const auto limit = std::chrono::duration_cast<SteadyTime>(std::chrono::duration<double>(config_.lost_after_s));
  while (true) {
    context_.port.reopen();
    auto back = co_await check_serial();
    if (back) {
      back = co_await client_.unlock(key_);
    }
    if (back) {
      back = co_await take_stock();
    }
    if (back) {
      back = co_await look_for_data();
    }
    if (back) {
      if (!progress_.link_up) {
        progress_.link_up = true;
        remember("link", fmt::format("link is back; the INS is {}", ins::name(stock_.state)));
      }
      co_return Event::recovered;
    }
    if (back.error().kind != PortError::Kind::link) {
      co_return tl::unexpected(back.error());
    }
    progress_.link_trouble = back.error().message;
    if (context_.timers.now() - lost_at_ > limit) {
      fail_with(fmt::format("link lost for more than {} s while {}: {}", config_.lost_after_s, words(record_.state),
                            progress_.link_trouble));
      co_return Event::link_gone;
    }
    co_await Sleep(context_.timers, recovery_interval);
  }
}

}  // namespace selfcal
