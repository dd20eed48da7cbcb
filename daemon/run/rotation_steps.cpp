#include "daemon/run/rotation_steps.hpp"

#include <fmt/format.h>

#include <cmath>
#include <random>

#include "daemon/run/ins_checks.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr auto state_interval = 1s;  // from one question how far the rotation is to the next

ins::ScheduleRecord schedule_record(const Schedule& schedule) {
  ins::ScheduleRecord record;
  record.rotation_ms = static_cast<std::uint32_t>(std::lround(schedule.rotation_s * 1e3));
  for (std::size_t i = 0; i < schedule.positions.size(); ++i) {
    record.positions.push_back({static_cast<std::int32_t>(std::lround(schedule.positions[i].outer_deg * 1e3)),
                                static_cast<std::int32_t>(std::lround(schedule.positions[i].inner_deg * 1e3)),
                                static_cast<std::uint32_t>(std::lround(schedule.dwell_s[i] * 1e3))});
  }
  return record;
}

std::string words_of_faults(std::uint8_t faults) {
  std::string words;
  for (const auto& [bit, name] : {std::pair(ins::fault::gimbal, "gimbal"), std::pair(ins::fault::sensor, "sensor"),
                                  std::pair(ins::fault::flash, "FLASH")}) {
    if ((faults & bit) != 0) {
      words += fmt::format("{}{}", words.empty() ? ", fault of " : " and ", name);
    }
  }
  return words;
}

// The daemon names each rotation, so that it knows its own again. Never 0: that means none.
std::uint32_t new_rotation_number() {
  std::random_device device;
  return std::uniform_int_distribution<std::uint32_t>(1)(device);
}

}  // namespace

Task<Step> RotationSteps::write_schedule() {
  if (auto room = co_await raw_.check_space(); !room) {
    co_return tl::unexpected(room.error());
  }
  const auto written = co_await client_.write_schedule(schedule_record(data_.schedule));
  if (!written) {
    co_return tl::unexpected(written.error());
  }
  // Known before the start is asked for, and stored with the next state.
  journal_.record.rotation = new_rotation_number();
  co_return Event::schedule_accepted;
}

Task<Step> RotationSteps::start_rotation() {
  data_.rotation_clock.start_asked(timers_.now());
  const auto started = co_await client_.start_rotation(journal_.record.rotation);
  if (!started) {
    co_return tl::unexpected(started.error());
  }
  journal_.progress.ins.state = ins::State::rotating;  // until the first status frame says more
  co_return Event::rotation_started;
}

Task<Answer<Done>> RotationSteps::poll_state() {
  auto state = co_await ask_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  const auto directory = co_await raw_.read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  if (directory->complete && state->state == ins::State::rotating) {  // it may have ended between the two answers
    state = co_await ask_state();
    if (!state) {
      co_return tl::unexpected(state.error());
    }
  }
  if (directory->complete && state->state == ins::State::rotating) {
    co_return protocol_error(
        fmt::format("directory: complete with {} of {} pages, while the INS says that it is rotating",
                    directory->pages_written, directory->pages_expected));
  }
  data_.state = *state;
  data_.data_complete = holds_whole_rotation(*directory);
  journal_.progress.ins.state = state->state;
  journal_.progress.ins.pages_written = directory->pages_written;
  journal_.report_progress();
  co_return Done{};
}

// Pages are pulled as they are written. What the INS answers says how far it is: a status frame, which anybody may send,
// only makes the daemon ask sooner.
Task<Step> RotationSteps::follow_rotation() {
  if (auto opened = co_await raw_.open(); !opened) {
    co_return tl::unexpected(opened.error());
  }
  std::optional<SteadyTime> asked;
  int position = journal_.progress.ins.position;  // the last one that it got to, for the words
  while (true) {
    const SteadyTime now = timers_.now();
    if (!asked || now - *asked >= state_interval || journal_.progress.ins.state != ins::State::rotating) {
      if (auto polled = co_await poll_state(); !polled) {
        co_return tl::unexpected(polled.error());
      }
      asked = now;
    }
    if (journal_.progress.ins.position > 0) {
      position = journal_.progress.ins.position;
    }
    if (data_.state.state != ins::State::rotating) {
      // An INS that restarted before anybody saw it complete is idle, and its FLASH has everything.
      if (data_.state.state == ins::State::complete || data_.data_complete) {
        co_return Event::rotation_ended;
      }
      co_return protocol_error(fmt::format("the rotation ended before its time, at position {} of {}: the INS is {}{}",
                                           position, journal_.progress.positions, ins::name(data_.state.state),
                                           words_of_faults(data_.state.faults)));
    }
    running_.estimate_meanwhile();
    if (running_.may_end_early()) {
      const auto confirmed = co_await running_.confirm_standing();
      if (!confirmed) {
        co_return tl::unexpected(confirmed.error());
      }
      if (*confirmed) {
        co_return Event::tolerances_met;
      }
    }
    // A status frame says that there may be more; the directory says how much there is.
    if (journal_.progress.ins.pages_written > raw_.pages_known()) {
      if (auto learnt = co_await raw_.learn_pages_written(); !learnt) {
        co_return tl::unexpected(learnt.error());
      }
    }
    if (raw_.some_missing()) {
      if (auto pulled = co_await raw_.pull(); !pulled) {
        co_return tl::unexpected(pulled.error());
      }
    } else {
      co_await Sleep(timers_, ins_time(0.5));
    }
  }
}

Task<Step> RotationSteps::end_rotation_early() {
  running_.note_early_end();
  if (auto rests = co_await bring_to_rest(); !rests) {
    co_return tl::unexpected(rests.error());
  }
  co_return Event::rotation_ended;
}

Task<Step> RotationSteps::pull_last_pages() {
  if (auto opened = co_await raw_.open(); !opened) {
    co_return tl::unexpected(opened.error());
  }
  if (auto complete = co_await raw_.await_completion(); !complete) {
    co_return tl::unexpected(complete.error());
  }
  const std::uint32_t end = raw_.pages_known();
  while (raw_.some_missing()) {
    if (auto pulled = co_await raw_.pull(); !pulled) {
      co_return tl::unexpected(pulled.error());
    }
  }
  if (end == 0) {
    co_return protocol_error("the INS stored no data");
  }
  journal_.remember("data", fmt::format("{} pages pulled, {} fetched again, {} frames lost", end,
                                        journal_.progress.pages_refetched, port_.lost_frames()));
  co_return Event::pages_complete;
}

Task<Answer<Done>> RotationSteps::bring_to_rest() {
  if (auto state = co_await ask_state(); !state) {
    co_return tl::unexpected(state.error());
  } else if (state->state == ins::State::rotating) {
    const auto stopped = co_await client_.stop_rotation();
    if (!stopped) {
      co_return tl::unexpected(stopped.error());
    }
  }
  co_return co_await await_state(ins::State::rotating, data_.config.profile->timing.stop_s, "the gimbal turns still");
}

Task<Step> RotationSteps::stop_gimbal() {
  if (!journal_.record.abort_wanted &&
      journal_.record.reason.empty()) {  // neither asked for nor failed: the INS restarted
    journal_.fail_with(fmt::format("{}: the rotation is lost: the INS is {} when it answers again",
                                   data_.config.interface, ins::name(data_.state.state)));
  }
  if (auto rests = co_await bring_to_rest(); !rests) {
    co_return tl::unexpected(rests.error());
  }
  co_return Event::gimbal_stopped;
}

}  // namespace selfcal
