#include "daemon/run/coefficient_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "daemon/run/ins_checks.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr auto reset_patience = 5s;  // of ours, beyond that

}  // namespace

Task<Step> CoefficientSteps::erase_inactive_slot() {
  const auto kept = store_.set(journal_.record.id, SetRole::written);
  if (!kept) {
    co_return local_trouble(kept.error());
  }
  auto wanted = *kept ? ins::decode_coefficients(**kept)
                      : Expected<ins::Coefficients>(fail(ErrorKind::internal, "the set to be written was not kept"));
  if (!wanted) {
    co_return local_trouble(wanted.error());
  }
  if (auto same = co_await connection_.confirm_identity("the inactive slot is erased"); !same) {
    co_return tl::unexpected(same.error());
  }
  if (auto taken = co_await connection_.take_stock(); !taken) {
    co_return tl::unexpected(taken.error());
  }
  if (const Complaint complaint = check_coefficients(wanted->value, "the set to be written")) {
    co_return protocol_error(*complaint);
  }
  // The INS takes the newest: a set that is put back needs a version above the one in force.
  if (data_.state.coefficients_version == std::numeric_limits<std::uint32_t>::max()) {
    co_return protocol_error(
        fmt::format("coefficients version {} is in force: none is newer", data_.state.coefficients_version));
  }
  if (wanted->version <= data_.state.coefficients_version) {
    wanted->version = data_.state.coefficients_version + 1;
  }
  auto held = client_.as_held(*wanted);
  if (!held) {
    co_return tl::unexpected(held.error());
  }
  const auto held_set = ins::decode_coefficients(*held);
  if (!held_set) {
    co_return local_trouble(held_set.error());
  }
  if (const Complaint lost = check_held(wanted->value, held_set->value, journal_.progress.tolerance)) {
    co_return protocol_error(*lost);
  }
  if (const std::string lost = words_of_loss(wanted->value, held_set->value, journal_.progress.tolerance);
      !lost.empty()) {
    journal_.remember("ins", lost);
  }
  data_.new_set = std::move(*held);
  if (auto stored = store_.store_set(journal_.record.id, SetRole::written, data_.new_set); !stored) {
    co_return local_trouble(stored.error());
  }
  const auto erased = co_await client_.erase_inactive();
  if (!erased) {
    co_return tl::unexpected(erased.error());
  }
  if (!client_.erases()) {
    co_return Event::slot_erased;
  }
  if (auto empty = co_await check_erased(); !empty) {
    co_return tl::unexpected(empty.error());
  }
  co_return Event::slot_erased;
}

// An erased slot reads as nothing (conditionsNotCorrect, requestOutOfRange) or as erased FLASH.
Task<Answer<Done>> CoefficientSteps::check_erased() {
  const auto slot = co_await client_.read_set(InsClient::SetOf::inactive);
  if (!slot) {
    const bool nothing = slot.error().kind == PortError::Kind::negative &&
                         (slot.error().nrc == static_cast<std::uint8_t>(uds::Nrc::conditions_not_correct) ||
                          slot.error().nrc == static_cast<std::uint8_t>(uds::Nrc::request_out_of_range));
    if (!nothing) {
      co_return tl::unexpected(slot.error());
    }
    co_return Done{};
  }
  if (!std::all_of(slot->begin(), slot->end(), [](std::uint8_t byte) { return byte == 0xFF; })) {
    const auto set = ins::decode_coefficients(*slot);
    co_return protocol_error(fmt::format(
        "the inactive slot was to be erased and still holds {}; {}",
        set ? fmt::format("version {}", set->version) : fmt::format("{} bytes", slot->size()), what_the_ins_holds()));
  }
  co_return Done{};
}

Task<Step> CoefficientSteps::write_set() {
  if (auto same = co_await connection_.confirm_identity("the set is written"); !same) {
    co_return tl::unexpected(same.error());
  }
  const auto written = co_await client_.write_inactive(data_.new_set);
  if (!written) {
    co_return tl::unexpected(written.error());
  }
  co_return Event::set_written;
}

Task<Step> CoefficientSteps::read_back() {
  const auto slot = co_await client_.read_set(InsClient::SetOf::inactive);
  if (!slot) {
    co_return tl::unexpected(slot.error());
  }
  if (slot->empty()) {
    co_return protocol_error("the coefficients read back are an empty record");
  }
  if (auto stored = store_.store_set(journal_.record.id, SetRole::read_back, *slot); !stored) {
    co_return local_trouble(stored.error());
  }
  if (*slot != data_.new_set) {
    co_return protocol_error("the coefficients read back are not those written");
  }
  co_return Event::set_verified;
}

Task<Step> CoefficientSteps::commit() {
  if (auto same = co_await connection_.confirm_identity("the set is committed"); !same) {
    co_return tl::unexpected(same.error());
  }
  data_.commit_asked = true;
  const auto done = co_await client_.commit(data_.new_set);
  if (!done) {
    co_return tl::unexpected(done.error());
  }
  co_return Event::set_committed;
}

// The INS is away for a while; that it does not answer then is no lost link.
Task<Step> CoefficientSteps::reset_ins() {
  const auto before = co_await client_.read_state();
  if (!before) {
    co_return tl::unexpected(before.error());
  }
  if (auto asked = co_await client_.reset(); !asked) {
    co_return tl::unexpected(asked.error());
  }
  std::uint32_t after = 0;
  const double limit_s = data_.config.profile->timing.restart_s;
  const SteadyTime end = timers_.now() + ins_time(limit_s) + reset_patience;
  while (true) {
    co_await Sleep(timers_, 20ms);
    const auto state = co_await client_.read_state();
    const bool up = state && state->state != ins::State::starting && state->power_cycles != before->power_cycles;
    if (up) {
      after = state->power_cycles;
      break;
    }
    if (timers_.now() < end) {
      continue;
    }
    if (!state) {
      co_return tl::unexpected(state.error());
    }
    co_return protocol_error(fmt::format("the INS did not restart within {} s", limit_s));
  }
  if (auto known = co_await connection_.check_serial(); !known) {
    co_return tl::unexpected(known.error());
  }
  if (auto unlocked = co_await client_.unlock(data_.key); !unlocked) {
    co_return tl::unexpected(unlocked.error());
  }
  const std::uint32_t restarts = after - before->power_cycles;
  if (after < before->power_cycles) {
    co_return protocol_error(fmt::format("the power-cycle counter went back from {} to {} upon a reset; {}",
                                         before->power_cycles, after, what_the_ins_holds()));
  }
  if (restarts > 1) {
    journal_.warn(fmt::format("{}: one reset counted as {} power cycles, {} to {}", data_.config.interface, restarts,
                              before->power_cycles, after));
  }
  data_.power_cycles = after;
  co_return Event::ins_restarted;
}

Task<Step> CoefficientSteps::read_in_force() {
  if (auto taken = co_await connection_.take_stock(); !taken) {
    co_return tl::unexpected(taken.error());
  }
  if (data_.in_force != data_.new_set) {
    co_return protocol_error(
        fmt::format("after the power cycle the INS uses version {} (CRC {:08X}), not the set written",
                    data_.state.coefficients_version, data_.state.coefficients_crc));
  }
  journal_.remember(
      "ins", fmt::format("coefficients version {} in force after the power cycle", data_.state.coefficients_version));
  co_return Event::set_confirmed;
}

Task<Step> CoefficientSteps::put_back() {
  if (journal_.record.reason.empty()) {
    journal_.fail_with(fmt::format("{}: the INS was away while its coefficients were written: they are not trusted",
                                   data_.config.interface));
  }
  const auto kept = store_.set(journal_.record.id, SetRole::previous);
  if (!kept || !*kept) {
    co_return local_trouble(kept ? Error{ErrorKind::internal, "the old set was not kept"} : kept.error());
  }
  const Bytes old = **kept;
  if (auto same = co_await connection_.check_serial(); !same) {
    co_return tl::unexpected(same.error());
  }
  if (auto written = co_await client_.write_inactive(old); !written) {
    co_return tl::unexpected(written.error());
  }
  const auto told = co_await client_.read_set(InsClient::SetOf::inactive);
  if (!told) {
    co_return tl::unexpected(told.error());
  }
  if (*told != old) {
    co_return protocol_error("the old coefficients were put back, and those read back are others");
  }
  if (auto restarted = co_await reset_ins(); !restarted) {
    co_return restarted;
  }
  if (auto taken = co_await connection_.take_stock(); !taken) {
    co_return tl::unexpected(taken.error());
  }
  if (data_.in_force != old) {
    co_return protocol_error("the old coefficients were put back, and others are in force after the restart");
  }
  data_.old_set_put_back = true;
  journal_.remember("ins", "the old coefficients were put back, and are in force after a restart");
  co_return Event::set_put_back;
}

}  // namespace selfcal
