#include "daemon/run/transition_table.hpp"

#include <fmt/format.h>

#include <array>

namespace selfcal {
namespace {

using A = Action;
using E = Event;
using G = Guard;
using S = State;

// The main path first, then recovery, then the ways to end.
constexpr auto table = std::to_array<Transition>({
    {S::connecting, E::begin, G::always, A::identify, S::connecting},
    {S::connecting, E::identified, G::always, A::unlock, S::unlocking},
    {S::unlocking, E::unlocked, G::rollback, A::erase_inactive_slot, S::erasing},
    {S::unlocking, E::unlocked, G::amendment, A::estimate, S::estimating},
    {S::unlocking, E::unlocked, G::always, A::write_schedule, S::scheduling},
    {S::scheduling, E::schedule_accepted, G::always, A::start_rotation, S::starting},
    {S::starting, E::rotation_started, G::always, A::follow_rotation, S::rotating},
    {S::rotating, E::rotation_ended, G::always, A::pull_last_pages, S::draining},
    {S::rotating, E::tolerances_met, G::always, A::end_rotation_early, S::ending_early},
    {S::ending_early, E::rotation_ended, G::always, A::pull_last_pages, S::draining},
    {S::draining, E::pages_complete, G::always, A::estimate, S::estimating},
    {S::estimating, E::estimate_ready, G::always, A::judge, S::judging},
    {S::judging, E::judged, G::gate_refused, A::conclude, S::refused},
    {S::judging, E::judged, G::dry_run, A::conclude, S::completed},
    {S::judging, E::judged, G::drift_check_wanted, A::measure_drift_old, S::checking_old},
    {S::judging, E::judged, G::always, A::erase_inactive_slot, S::erasing},
    {S::checking_old, E::drift_measured, G::always, A::erase_inactive_slot, S::erasing},
    {S::erasing, E::slot_erased, G::always, A::write_set, S::writing},
    {S::writing, E::set_written, G::always, A::read_back, S::verifying},
    {S::verifying, E::set_verified, G::always, A::commit, S::committing},
    {S::committing, E::set_committed, G::always, A::reset_ins, S::resetting},
    {S::resetting, E::ins_restarted, G::always, A::read_in_force, S::confirming},
    {S::confirming, E::set_confirmed, G::drift_check_wanted, A::measure_drift_new, S::checking_new},
    {S::confirming, E::set_confirmed, G::always, A::conclude, S::completed},
    {S::checking_new, E::drift_measured, G::always, A::conclude, S::completed},

    {S::connecting, E::link_lost, G::always, A::recover_link, S::connecting},
    {S::unlocking, E::link_lost, G::always, A::recover_link, S::unlocking},
    {S::scheduling, E::link_lost, G::always, A::recover_link, S::scheduling},
    {S::starting, E::link_lost, G::always, A::recover_link, S::starting},
    {S::rotating, E::link_lost, G::always, A::recover_link, S::rotating},
    {S::ending_early, E::link_lost, G::always, A::recover_link, S::ending_early},
    {S::draining, E::link_lost, G::always, A::recover_link, S::draining},
    {S::checking_old, E::link_lost, G::always, A::recover_link, S::checking_old},
    {S::erasing, E::link_lost, G::always, A::recover_link, S::erasing},
    {S::writing, E::link_lost, G::always, A::recover_link, S::writing},
    {S::verifying, E::link_lost, G::always, A::recover_link, S::verifying},
    {S::committing, E::link_lost, G::always, A::recover_link, S::committing},
    {S::resetting, E::link_lost, G::always, A::recover_link, S::resetting},
    {S::confirming, E::link_lost, G::always, A::recover_link, S::confirming},
    {S::checking_new, E::link_lost, G::always, A::recover_link, S::checking_new},
    {S::ending_check, E::link_lost, G::always, A::recover_link, S::ending_check},
    {S::stopping, E::link_lost, G::always, A::recover_link, S::stopping},
    {S::putting_back, E::link_lost, G::always, A::recover_link, S::putting_back},

    {S::connecting, E::recovered, G::always, A::identify, S::connecting},
    {S::unlocking, E::recovered, G::always, A::unlock, S::unlocking},
    {S::scheduling, E::recovered, G::always, A::write_schedule, S::scheduling},
    // A command that was sent may have arrived: never a second rotation on top of a first.
    {S::starting, E::recovered, G::gimbal_turning, A::follow_rotation, S::rotating},
    {S::starting, E::recovered, G::rotation_complete, A::pull_last_pages, S::draining},
    {S::starting, E::recovered, G::always, A::write_schedule, S::scheduling},
    {S::rotating, E::recovered, G::gimbal_turning, A::follow_rotation, S::rotating},
    {S::rotating, E::recovered, G::rotation_complete, A::pull_last_pages, S::draining},
    {S::rotating, E::recovered, G::always, A::stop_gimbal, S::stopping},
    {S::ending_early, E::recovered, G::always, A::end_rotation_early, S::ending_early},
    {S::draining, E::recovered, G::always, A::pull_last_pages, S::draining},
    {S::estimating, E::recovered, G::always, A::estimate, S::estimating},
    {S::judging, E::recovered, G::always, A::judge, S::judging},
    {S::checking_old, E::recovered, G::always, A::measure_drift_old, S::checking_old},
    {S::erasing, E::recovered, G::always, A::erase_inactive_slot, S::erasing},
    // Half of the new set may stand over the old one.
    {S::writing, E::recovered, G::no_slots, A::put_back, S::putting_back},
    {S::writing, E::recovered, G::always, A::erase_inactive_slot, S::erasing},
    {S::verifying, E::recovered, G::always, A::read_back, S::verifying},
    {S::committing, E::recovered, G::new_set_in_force, A::reset_ins, S::resetting},
    {S::committing, E::recovered, G::always, A::read_back, S::verifying},
    {S::resetting, E::recovered, G::always, A::reset_ins, S::resetting},
    {S::confirming, E::recovered, G::always, A::read_in_force, S::confirming},
    {S::checking_new, E::recovered, G::always, A::measure_drift_new, S::checking_new},
    {S::ending_check, E::recovered, G::always, A::end_check, S::ending_check},
    {S::ending_check, E::check_ended, G::failure_pending, A::conclude, S::failed},
    {S::ending_check, E::check_ended, G::new_set_in_force, A::conclude, S::completed},
    {S::ending_check, E::check_ended, G::always, A::conclude, S::aborted},
    {S::stopping, E::recovered, G::always, A::stop_gimbal, S::stopping},
    {S::stopping, E::gimbal_stopped, G::abort_pending, A::conclude, S::aborted},
    {S::stopping, E::gimbal_stopped, G::always, A::conclude, S::failed},
    {S::putting_back, E::recovered, G::always, A::put_back, S::putting_back},
    {S::putting_back, E::set_put_back, G::abort_pending, A::conclude, S::aborted},
    {S::putting_back, E::set_put_back, G::always, A::conclude, S::failed},

    {S::connecting, E::abort_requested, G::always, A::conclude, S::aborted},
    {S::unlocking, E::abort_requested, G::always, A::conclude, S::aborted},
    {S::scheduling, E::abort_requested, G::always, A::conclude, S::aborted},
    {S::starting, E::abort_requested, G::always, A::stop_gimbal, S::stopping},
    {S::rotating, E::abort_requested, G::always, A::stop_gimbal, S::stopping},
    {S::ending_early, E::abort_requested, G::always, A::stop_gimbal, S::stopping},
    {S::draining, E::abort_requested, G::always, A::conclude, S::aborted},
    {S::estimating, E::abort_requested, G::always, A::conclude, S::aborted},
    {S::judging, E::abort_requested, G::always, A::conclude, S::aborted},
    // An INS that goes on checking would refuse the next run.
    {S::checking_old, E::abort_requested, G::always, A::end_check, S::ending_check},
    {S::erasing, E::abort_requested, G::always, A::conclude, S::aborted},
    {S::writing, E::abort_requested, G::no_slots, A::put_back, S::putting_back},
    {S::writing, E::abort_requested, G::always, A::conclude, S::aborted},
    {S::verifying, E::abort_requested, G::no_slots, A::put_back, S::putting_back},
    {S::verifying, E::abort_requested, G::always, A::conclude, S::aborted},
    // From the commit on there is no old state to go back to half-way: the last steps run to their end.
    {S::committing, E::abort_requested, G::always, A::decline_abort, S::committing},
    {S::resetting, E::abort_requested, G::always, A::decline_abort, S::resetting},
    {S::confirming, E::abort_requested, G::always, A::decline_abort, S::confirming},
    {S::checking_new, E::abort_requested, G::always, A::end_check, S::ending_check},
    {S::ending_check, E::abort_requested, G::always, A::decline_abort, S::ending_check},
    {S::stopping, E::abort_requested, G::always, A::decline_abort, S::stopping},
    {S::putting_back, E::abort_requested, G::always, A::decline_abort, S::putting_back},

    {S::connecting, E::step_failed, G::always, A::conclude, S::failed},
    {S::unlocking, E::step_failed, G::always, A::conclude, S::failed},
    {S::scheduling, E::step_failed, G::always, A::conclude, S::failed},
    {S::starting, E::step_failed, G::always, A::stop_gimbal, S::stopping},
    {S::rotating, E::step_failed, G::always, A::stop_gimbal, S::stopping},
    {S::ending_early, E::step_failed, G::always, A::stop_gimbal, S::stopping},
    {S::draining, E::step_failed, G::always, A::conclude, S::failed},
    {S::estimating, E::step_failed, G::always, A::conclude, S::failed},
    {S::judging, E::step_failed, G::always, A::conclude, S::failed},
    {S::checking_old, E::step_failed, G::always, A::end_check, S::ending_check},
    {S::erasing, E::step_failed, G::always, A::conclude, S::failed},
    {S::writing, E::step_failed, G::no_slots, A::put_back, S::putting_back},
    {S::writing, E::step_failed, G::always, A::conclude, S::failed},
    {S::verifying, E::step_failed, G::no_slots, A::put_back, S::putting_back},
    {S::verifying, E::step_failed, G::always, A::conclude, S::failed},
    {S::committing, E::step_failed, G::no_slots, A::put_back, S::putting_back},
    {S::committing, E::step_failed, G::always, A::conclude, S::failed},
    {S::resetting, E::step_failed, G::no_slots, A::put_back, S::putting_back},
    {S::resetting, E::step_failed, G::always, A::conclude, S::failed},
    {S::confirming, E::step_failed, G::no_slots, A::put_back, S::putting_back},
    {S::confirming, E::step_failed, G::always, A::conclude, S::failed},
    {S::checking_new, E::step_failed, G::always, A::end_check, S::ending_check},
    {S::ending_check, E::step_failed, G::always, A::conclude, S::failed},
    {S::stopping, E::step_failed, G::always, A::conclude, S::failed},
    {S::putting_back, E::step_failed, G::always, A::conclude, S::failed},

    {S::connecting, E::link_gone, G::always, A::conclude, S::failed},
    {S::unlocking, E::link_gone, G::always, A::conclude, S::failed},
    {S::scheduling, E::link_gone, G::always, A::conclude, S::failed},
    {S::starting, E::link_gone, G::always, A::conclude, S::failed},
    {S::rotating, E::link_gone, G::always, A::conclude, S::failed},
    {S::ending_early, E::link_gone, G::always, A::conclude, S::failed},
    {S::draining, E::link_gone, G::always, A::conclude, S::failed},
    {S::checking_old, E::link_gone, G::always, A::conclude, S::failed},
    {S::erasing, E::link_gone, G::always, A::conclude, S::failed},
    {S::writing, E::link_gone, G::always, A::conclude, S::failed},
    {S::verifying, E::link_gone, G::always, A::conclude, S::failed},
    {S::committing, E::link_gone, G::always, A::conclude, S::failed},
    {S::resetting, E::link_gone, G::always, A::conclude, S::failed},
    {S::confirming, E::link_gone, G::always, A::conclude, S::failed},
    {S::checking_new, E::link_gone, G::always, A::conclude, S::failed},
    {S::ending_check, E::link_gone, G::always, A::conclude, S::failed},
    {S::stopping, E::link_gone, G::always, A::conclude, S::failed},
    {S::putting_back, E::link_gone, G::always, A::conclude, S::failed},
});

constexpr std::array event_names{
    "begin",          "identified",     "unlocked",       "schedule_accepted", "rotation_started",
    "tolerances_met", "rotation_ended", "pages_complete", "estimate_ready",    "judged",
    "drift_measured", "slot_erased",    "set_written",    "set_verified",      "set_committed",
    "ins_restarted",  "set_confirmed",  "gimbal_stopped", "check_ended",       "set_put_back",
    "link_lost",      "recovered",      "link_gone",      "step_failed",       "abort_requested"};
constexpr std::array guard_names{
    "always",  "rollback",           "amendment",        "gimbal_turning", "rotation_complete", "gate_refused",
    "dry_run", "drift_check_wanted", "new_set_in_force", "abort_pending",  "failure_pending",   "no_slots"};
constexpr std::array action_names{"none",
                                  "identify",
                                  "unlock",
                                  "write_schedule",
                                  "start_rotation",
                                  "follow_rotation",
                                  "end_rotation_early",
                                  "pull_last_pages",
                                  "estimate",
                                  "judge",
                                  "measure_drift_old",
                                  "erase_inactive_slot",
                                  "write_set",
                                  "read_back",
                                  "commit",
                                  "reset_ins",
                                  "read_in_force",
                                  "measure_drift_new",
                                  "end_check",
                                  "stop_gimbal",
                                  "put_back",
                                  "recover_link",
                                  "decline_abort",
                                  "conclude"};

static_assert(event_names.size() == static_cast<std::size_t>(Event::abort_requested) + 1);
static_assert(guard_names.size() == static_cast<std::size_t>(Guard::no_slots) + 1);
static_assert(action_names.size() == static_cast<std::size_t>(Action::conclude) + 1);

}  // namespace

std::span<const Transition> transition_table() { return table; }

std::string_view name(Event event) { return event_names.at(static_cast<std::size_t>(event)); }
std::string_view name(Guard guard) { return guard_names.at(static_cast<std::size_t>(guard)); }
std::string_view name(Action action) { return action_names.at(static_cast<std::size_t>(action)); }

std::string transition_table_markdown() {
  std::string text = "| state | event | guard | action | next |\n|---|---|---|---|---|\n";
  for (const Transition& row : table) {
    text += fmt::format("| {} | {} | {} | {} | {} |\n", name(row.state), name(row.event),
                        row.guard == Guard::always ? "" : name(row.guard), name(row.action), name(row.next));
  }
  return text;
}

}  // namespace selfcal
