#include "daemon/run/state_budget.hpp"

#include <algorithm>

namespace selfcal {
namespace {

// The INS may make room for a whole rotation before it turns: 16 MiB in blocks of 64 KiB at 30 ms each take 8 s.
constexpr double make_room_s = 10.0;
// 4096 bytes in 586 frames of 130 bits at 125 kbit/s, the slowest bus in use, take 0.6 s. Eight times that.
constexpr double page_transfer_s = 5.0;
// The next page is due when its samples have been taken; a gimbal that is late, or a FLASH that is, delays one or two.
constexpr double pages_waited_for = 10.0;
// The INS's clock.
constexpr double check_margin_s = 60.0;
// Off the bus: one pass over an hour of data at 1000 Hz takes half a minute on a slow machine and tells of its progress
// every second.
constexpr double estimator_s = 600.0;

// Of an INS that is turned move by move the start is answered when its gimbal rests at the first position.
double first_move_s(const InsConfig& config) {
  const profile::Profile& p = *config.profile;
  return p.move ? p.move->turning.longest_move_s : p.frames ? p.frames->turning.longest_move_s : 0.0;
}

// What the state waits for, on the operator's clock, the link being up. Each request may be asked twice.
double work_s(State state, const InsConfig& config, double page_s) {
  const auto requests = [&](int count) { return 2.0 * count * config.request_timeout_s; };
  const auto ins_s = [&](double seconds) { return seconds / config.time_scale; };
  const profile::Timing& may = config.profile->timing;
  const double page_due_s = std::max(ins_s(pages_waited_for * page_s), page_transfer_s) + page_transfer_s;
  switch (state) {
    case State::connecting: return requests(5);
    case State::unlocking: return requests(8) + ins_s(may.stop_s);
    case State::scheduling: return requests(4);
    case State::starting: return requests(4) + make_room_s + ins_s(first_move_s(config));
    case State::rotating: return requests(8) + page_due_s;
    case State::draining: return requests(8) + page_transfer_s;
    case State::ending_early:
    case State::stopping:
    case State::ending_check: return requests(4) + ins_s(may.stop_s);
    case State::estimating:
    case State::judging: return estimator_s;
    case State::checking_old:
    case State::checking_new: return requests(6) + ins_s(config.drift_check_s + check_margin_s);
    case State::erasing: return requests(8) + may.erase_s;
    case State::writing: return requests(6) + may.write_s;
    case State::verifying: return requests(3);
    case State::committing: return requests(6) + may.commit_s;
    case State::resetting: return requests(8) + ins_s(may.restart_s) + may.write_s;
    case State::confirming: return requests(4);
    case State::putting_back: return requests(20) + ins_s(may.restart_s) + 2 * may.write_s;
    default: return 0.0;  // an end
  }
}

}  // namespace

double budget_s(State state, const InsConfig& config, double page_s) {
  const double work = work_s(state, config, page_s);
  const bool on_the_bus = state != State::estimating && state != State::judging;
  // One loss of the link, as long as the configuration bears with it, and finding the INS again: eight requests.
  const double loss = config.lost_after_s + 2.0 * 8 * config.request_timeout_s;
  return on_the_bus ? work + loss : work;
}

}  // namespace selfcal
