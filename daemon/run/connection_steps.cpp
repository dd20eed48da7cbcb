#include "daemon/run/connection_steps.hpp"

#include <fmt/format.h>

#include "daemon/run/ins_checks.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr auto recovery_interval = 300ms;

}  // namespace

Task<Answer<Done>> ConnectionSteps::check_serial() {
  const auto identity = co_await client_.identify();
  if (!identity) {
    co_return tl::unexpected(identity.error());
  }
  if (!journal_.record.serial.empty() && journal_.record.serial != identity->serial) {
    co_return protocol_error(fmt::format("INS {} answers, but run {} belongs to INS {}", identity->serial,
                                         journal_.record.id, journal_.record.serial));
  }
  journal_.record.serial = identity->serial;
  journal_.record.ins_software = identity->software;
  co_return Done{};
}

Task<Answer<Done>> ConnectionSteps::take_stock() {
  const auto state = co_await ask_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  if (data_.power_cycles && state->power_cycles < *data_.power_cycles) {
    co_return protocol_error(
        fmt::format("the power-cycle counter went back from {} to {}: this is not the INS that it was",
                    *data_.power_cycles, state->power_cycles));
  }
  if (data_.power_cycles && state->power_cycles != *data_.power_cycles) {
    journal_.remember(
        "ins", fmt::format("the INS restarted: power cycle {}, {} before", state->power_cycles, *data_.power_cycles));
  }
  data_.power_cycles = state->power_cycles;
  data_.state = *state;
  auto set = co_await client_.read_set(InsClient::SetOf::in_force);
  if (!set) {
    co_return tl::unexpected(set.error());
  }
  data_.in_force = std::move(*set);
  co_return Done{};
}

// A restart that nobody noticed may be another unit on the same plug: nothing is written to it on trust. One power cycle
// more, with the set that was in force and the rotation that was pulled, is the same INS: it is unlocked again, as after a
// link that was away. More than one at a time, or too many in a run, is no accident.
Task<Answer<Done>> ConnectionSteps::check_power_cycles(ins::StateRecord found, std::string when) {
  constexpr int at_most = 5;
  if (!data_.power_cycles || found.power_cycles == *data_.power_cycles) {
    data_.power_cycles = found.power_cycles;
    co_return Done{};
  }
  const auto refused = [&](std::string_view why) {
    return protocol_error(
        fmt::format("before {} the power-cycle counter is {}, it was {}: the INS was switched off meanwhile, "
                    "or it is another one ({}); {}",
                    when, found.power_cycles, *data_.power_cycles, why, what_the_ins_holds()));
  };
  if (found.power_cycles != *data_.power_cycles + 1) {
    co_return refused("one restart counts one");
  }
  if (++data_.restarts_taken_up > at_most) {
    co_return refused(fmt::format("the restart number {} of this run", data_.restarts_taken_up));
  }
  const auto in_force = co_await client_.read_set(InsClient::SetOf::in_force);
  if (!in_force) {
    co_return tl::unexpected(in_force.error());
  }
  if (*in_force != data_.in_force) {
    co_return refused("its set in force is not the one that was read before");
  }
  if (journal_.record.rotation != 0 && found.run_id != journal_.record.rotation) {
    co_return refused(
        fmt::format("its FLASH holds rotation {}, this run's is {}", found.run_id, journal_.record.rotation));
  }
  co_return tl::unexpected<PortError>(
      PortError{PortError::Kind::link, 0,
                fmt::format("{}: the INS restarted before {}: power cycle {}, {} before", data_.config.interface, when,
                            found.power_cycles, *data_.power_cycles)});
}

Task<Answer<Done>> ConnectionSteps::confirm_identity(std::string before) {
  const auto identity = co_await client_.identify();
  if (!identity) {
    co_return tl::unexpected(identity.error());
  }
  if (identity->serial != journal_.record.serial) {
    co_return protocol_error(fmt::format("before {} INS {} answers, but run {} belongs to INS {}; {}", before,
                                         identity->serial, journal_.record.id, journal_.record.serial,
                                         what_the_ins_holds()));
  }
  const auto state = co_await client_.read_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  co_return co_await check_power_cycles(*state, before);
}

Task<Answer<Done>> ConnectionSteps::look_for_data() {
  const auto directory = co_await client_.read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  data_.data_complete = holds_whole_rotation(*directory);
  co_return Done{};
}

Task<Step> ConnectionSteps::identify() {
  if (auto known = co_await check_serial(); !known) {
    co_return tl::unexpected(known.error());
  }
  if (auto taken = co_await take_stock(); !taken) {
    co_return tl::unexpected(taken.error());
  }
  if (data_.state.state == ins::State::rotating) {
    co_return protocol_error(
        fmt::format("INS {}: the gimbal turns already, and not for this run", journal_.record.serial));
  }
  const auto set = ins::decode_coefficients(data_.in_force);
  if (!set) {
    co_return protocol_error(set.error().message);
  }
  if (const Complaint complaint = check_coefficients(set->value, "the set in force")) {
    journal_.warn(
        fmt::format("{}: {}: it is not kept where a new value is missing", data_.config.interface, *complaint));
  }
  if (auto kept = store_.store_set(journal_.record.id, SetRole::previous, data_.in_force); !kept) {
    co_return local_trouble(kept.error());
  }
  journal_.remember("ins", fmt::format("INS {}, software {}, coefficients version {} in force", journal_.record.serial,
                                       journal_.record.ins_software, data_.state.coefficients_version));
  co_return Event::identified;
}

Task<Step> ConnectionSteps::unlock() {
  const auto unlocked = co_await client_.unlock(data_.key);
  if (!unlocked) {
    co_return tl::unexpected(unlocked.error());
  }
  // This run has begun none: left by a service that is gone, or by another tester. The INS would refuse to rotate.
  if (data_.state.state == ins::State::checking) {
    journal_.warn("the INS is in a navigation check that is not this run's: it is ended first");
  }
  if (auto ended = co_await navigation_.stop_check(); !ended) {
    co_return tl::unexpected(ended.error());
  }
  co_return Event::unlocked;
}

// Until the INS answers again and is unlocked, or the time is over.
Task<Step> ConnectionSteps::recover_link(SteadyTime lost_at) {
  const auto limit = std::chrono::duration_cast<SteadyTime>(std::chrono::duration<double>(data_.config.lost_after_s));
  while (true) {
    port_.reopen();
    auto back = co_await check_serial();
    if (back) {
      back = co_await client_.unlock(data_.key);
    }
    if (back) {
      back = co_await take_stock();
    }
    if (back) {
      back = co_await look_for_data();
    }
    if (back) {
      if (!journal_.progress.link_up) {
        journal_.progress.link_up = true;
        journal_.remember("link", fmt::format("link is back; the INS is {}", ins::name(data_.state.state)));
      }
      co_return Event::recovered;
    }
    if (back.error().kind != PortError::Kind::link) {
      co_return tl::unexpected(back.error());
    }
    journal_.progress.link_trouble = back.error().message;
    if (timers_.now() - lost_at > limit) {
      journal_.fail_with(fmt::format("link lost for more than {} s while {}: {}", data_.config.lost_after_s,
                                     words(journal_.record.state), journal_.progress.link_trouble));
      co_return Event::link_gone;
    }
    co_await Sleep(timers_, recovery_interval);
  }
}

}  // namespace selfcal
