// What the actions of the table do with the INS, up to the last page. A step answers with the event that follows, or
// with why it could not be done; calibration_run.cpp turns that into link_lost or step_failed.
#include <fmt/format.h>

#include <cmath>
#include <random>

#include "daemon/estimate/estimate_job.hpp"
#include "daemon/run/calibration_run.hpp"
#include "daemon/run/ins_checks.hpp"
#include "daemon/store/recording_store.hpp"
#include "protocol/byte_order.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr int reads_of_a_bad_page = 5;
constexpr std::uint32_t pages_per_upload = 64;  // what a lost link costs at most
constexpr double stop_limit_s = 30.0;           // of the INS's clock
constexpr auto state_interval = 1s;             // from one question how far the rotation is to the next
constexpr auto completion_interval = 200ms;
constexpr int completion_looks = 25;  // the last page is programmed in far less than 5 s

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

// Of this run's rotation, and in agreement with format and schedule.
Task<Answer<ins::DirectoryRecord>> CalibrationRun::read_checked_directory() {
  const auto directory = co_await client_.read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  if (directory->run_id != record_.rotation) {
    co_return senseless(fmt::format("the INS holds data of rotation {}, not {}", directory->run_id, record_.rotation));
  }
  if (const Complaint complaint = check_directory(*directory, format_, schedule_)) {
    co_return senseless(*complaint);
  }
  if (auto all_there = check_ring(*directory); !all_there) {
    co_return tl::unexpected(all_there.error());
  }
  pages_known_ = directory->pages_written;
  if (pages_) {
    pages_->learn_samples(directory->samples);
  }
  co_return *directory;
}

// The ring of the INS may have lost what was not pulled yet.
Answer<Done> CalibrationRun::check_ring(const ins::DirectoryRecord& directory) {
  if (!pages_) {
    return Done{};
  }
  const auto wanted = pages_->missing(directory.pages_written, 1);
  if (wanted.count > 0 && wanted.first < directory.first_page) {
    return senseless(fmt::format("page {} is lost: the ring of the INS holds pages {} to {}", wanted.first,
                                 directory.first_page, directory.pages_written - 1));
  }
  return Done{};
}

Task<Answer<Done>> CalibrationRun::learn_pages_written() {
  const auto directory = co_await read_checked_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  co_return Done{};
}

// Before anything turns: a full disk must not end a run in the middle.
Task<Answer<Done>> CalibrationRun::check_space() {
  const auto format = co_await client_.read_sample_format();
  if (!format) {
    co_return tl::unexpected(format.error());
  }
  format_ = *format;
  const auto samples = static_cast<std::uint64_t>(std::ceil(schedule_.duration_s() * format->sample_rate_hz));
  const std::string what_for =
      fmt::format("a run of {:.0f} s at {} Hz", schedule_.duration_s(), format->sample_rate_hz);
  if (auto room = require_space(folder_, bytes_of_a_run(samples), what_for); !room) {
    co_return local_trouble(room.error());
  }
  co_return Done{};
}

Task<CalibrationRun::Step> CalibrationRun::write_schedule() {
  if (auto room = co_await check_space(); !room) {
    co_return tl::unexpected(room.error());
  }
  const auto written = co_await client_.write_record(ins::did::schedule, ins::encode(schedule_record(schedule_)));
  if (!written) {
    co_return tl::unexpected(written.error());
  }
  // Known before the start is asked for, and stored with the next state.
  record_.rotation = new_rotation_number();
  co_return Event::schedule_accepted;
}

Task<CalibrationRun::Step> CalibrationRun::start_rotation() {
  Bytes number(4);
  ByteWriter(number).put(record_.rotation);
  rotation_clock_.start_asked(context_.timers.now());
  const auto started =
      co_await client_.routine(uds::RoutineAction::start, ins::routine::self_calibration, std::move(number));
  if (!started) {
    co_return tl::unexpected(started.error());
  }
  progress_.ins.state = ins::State::rotating;  // until the first status frame says more
  co_return Event::rotation_started;
}

Task<Answer<Done>> CalibrationRun::open_pages() {
  PageContext context;
  const auto format = co_await client_.read_sample_format();
  if (!format) {
    co_return tl::unexpected(format.error());
  }
  format_ = *format;
  page_s_ = format->samples_per_page / format->sample_rate_hz;
  budget_.learn_page(page_s_);
  const auto site = co_await client_.read_site();
  if (!site) {
    co_return tl::unexpected(site.error());
  }
  const auto directory = co_await read_checked_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  progress_.pages_expected = directory->pages_expected;
  if (record_.early_end_s >= 0) {
    record_.early_end_s = static_cast<double>(directory->samples) / format->sample_rate_hz;
  }
  progress_.ins.pages_written = directory->pages_written;
  context.format = *format;
  context.site = *site;
  context.pages = directory->complete ? directory->pages_written : directory->pages_expected;
  if (auto kept = write_page_context(folder_, context); !kept) {
    co_return local_trouble(kept.error());
  }
  if (!pages_) {
    auto pages = PageFile::open(page_path(folder_), {record_.rotation, format->samples_per_page, directory->samples});
    if (!pages) {
      co_return local_trouble(pages.error());
    }
    pages_ = std::move(*pages);
    const std::uint64_t samples = std::uint64_t{directory->pages_expected} * format->samples_per_page;
    if (auto kept = pages_->reserve(bytes_of_a_run(samples)); !kept) {
      co_return local_trouble(kept.error());
    }
  }
  if (auto all_there = check_ring(*directory); !all_there) {
    co_return tl::unexpected(all_there.error());
  }
  progress_.pages_pulled = pages_->count();
  co_return Done{};
}

Task<Answer<ins::StateRecord>> CalibrationRun::ask_state() {
  const SteadyTime asked = context_.timers.now();
  const auto state = co_await client_.read_state();
  if (state) {
    rotation_clock_.state_told(state->state == ins::State::rotating, asked, context_.timers.now());
  }
  co_return state;
}

Task<Answer<Done>> CalibrationRun::poll_state() {
  auto state = co_await ask_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  const auto directory = co_await read_checked_directory();
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
    co_return senseless(fmt::format("directory: complete with {} of {} pages, while the INS says that it is rotating",
                                    directory->pages_written, directory->pages_expected));
  }
  stock_ = *state;
  data_complete_ = holds_whole_rotation(*directory);
  progress_.ins.state = state->state;
  progress_.ins.pages_written = directory->pages_written;
  report_progress();
  co_return Done{};
}

// Pages are pulled as they are written. What the INS answers says how far it is: a status frame, which anybody may send,
// only makes the daemon ask sooner.
Task<CalibrationRun::Step> CalibrationRun::follow_rotation() {
  if (auto opened = co_await open_pages(); !opened) {
    co_return tl::unexpected(opened.error());
  }
  std::optional<SteadyTime> asked;
  int position = progress_.ins.position;  // the last one that it got to, for the words
  while (true) {
    const SteadyTime now = context_.timers.now();
    if (!asked || now - *asked >= state_interval || progress_.ins.state != ins::State::rotating) {
      if (auto polled = co_await poll_state(); !polled) {
        co_return tl::unexpected(polled.error());
      }
      asked = now;
    }
    if (progress_.ins.position > 0) {
      position = progress_.ins.position;
    }
    if (stock_.state != ins::State::rotating) {
      // An INS that restarted before anybody saw it complete is idle, and its FLASH has everything.
      if (stock_.state == ins::State::complete || data_complete_) {
        co_return Event::rotation_ended;
      }
      co_return senseless(fmt::format("the rotation ended before its time, at position {} of {}: the INS is {}{}",
                                      position, progress_.positions, ins::name(stock_.state),
                                      words_of_faults(stock_.faults)));
    }
    estimate_meanwhile();
    if (may_end_early()) {
      const auto confirmed = co_await confirm_standing();
      if (!confirmed) {
        co_return tl::unexpected(confirmed.error());
      }
      if (*confirmed) {
        co_return Event::tolerances_met;
      }
    }
    // A status frame says that there may be more; the directory says how much there is.
    if (progress_.ins.pages_written > pages_known_) {
      if (auto learnt = co_await learn_pages_written(); !learnt) {
        co_return tl::unexpected(learnt.error());
      }
    }
    if (pages_->missing(pages_known_, 1).count > 0) {
      if (auto pulled = co_await pull(pages_known_); !pulled) {
        co_return tl::unexpected(pulled.error());
      }
    } else {
      co_await Sleep(context_.timers, ins_time(0.5));
    }
  }
}

// The gimbal is at rest: the directory must say that no more pages come and, unless the end was early, that all are there.
Task<Answer<Done>> CalibrationRun::await_completion() {
  for (int look = 1;; ++look) {
    const auto directory = co_await read_checked_directory();
    if (!directory) {
      co_return tl::unexpected(directory.error());
    }
    const bool all = record_.early_end_s >= 0 || directory->pages_written >= directory->pages_expected;
    if (directory->complete && all) {
      if (const Complaint complaint = check_rotation_time(*directory, format_, rotation_clock_.time(), config_)) {
        co_return senseless(*complaint);
      }
      co_return Done{};
    }
    if (look == completion_looks) {
      co_return senseless(fmt::format("directory: {} with {} of {} pages, though the rotation is over",
                                      directory->complete ? "complete" : "not complete", directory->pages_written,
                                      directory->pages_expected));
    }
    co_await Sleep(context_.timers, completion_interval);
  }
}

Task<CalibrationRun::Step> CalibrationRun::pull_last_pages() {
  if (auto opened = co_await open_pages(); !opened) {
    co_return tl::unexpected(opened.error());
  }
  if (auto complete = co_await await_completion(); !complete) {
    co_return tl::unexpected(complete.error());
  }
  const std::uint32_t end = pages_known_;
  while (pages_->missing(end, 1).count > 0) {
    if (auto pulled = co_await pull(end); !pulled) {
      co_return tl::unexpected(pulled.error());
    }
  }
  if (end == 0) {
    co_return senseless("the INS stored no data");
  }
  remember("data", fmt::format("{} pages pulled, {} fetched again, {} frames lost", end, progress_.pages_refetched,
                               context_.port.lost_frames()));
  co_return Event::pages_complete;
}

Task<Answer<Done>> CalibrationRun::pull(std::uint32_t end) {
  const PageFile::Range range = pages_->missing(end, pages_per_upload);
  auto done = co_await client_.upload(range.first, range.count,
                                      [this](std::uint32_t page, std::span<const std::uint8_t> bytes) {
                                        const auto stored = pages_->store(page, bytes);
                                        if (!stored) {
                                          storage_error_ = stored.error();
                                        }
                                        if (stored && !stored->empty()) {
                                          note_bad_page(page, *stored);
                                        }
                                        if (pages_->count() > progress_.pages_pulled) {
                                          progressed();
                                        }
                                        progress_.pages_pulled = pages_->count();
                                        report_progress();
                                      });
  if (!done) {
    co_return tl::unexpected(done.error());
  }
  if (storage_error_) {
    co_return local_trouble(*storage_error_);
  }
  for (const auto& [page, bad] : bad_pages_) {
    if (bad.times >= reads_of_a_bad_page && !pages_->has(page)) {
      co_return senseless(fmt::format("page {}: {} ({} readings): the data are incomplete", page, bad.why, bad.times));
    }
  }
  co_return Done{};
}

void CalibrationRun::note_bad_page(std::uint32_t page, const std::string& why) {
  BadPage& bad = bad_pages_[page];
  bad.why = why;
  if (++bad.times == 1) {
    warn(fmt::format("page {}: {}: fetched again", page, why));
  }
  ++progress_.pages_refetched;
}

Task<Answer<Done>> CalibrationRun::await_state(ins::State unwanted, double limit_s, std::string what) {
  const SteadyTime end = context_.timers.now() + ins_time(limit_s) + 1s;
  while (true) {
    const auto state = co_await ask_state();
    if (!state) {
      co_return tl::unexpected(state.error());
    }
    stock_ = *state;
    if (state->state != unwanted) {
      co_return Done{};
    }
    if (context_.timers.now() > end) {
      co_return senseless(fmt::format("{} after {:.0f} s", what, limit_s));
    }
    co_await Sleep(context_.timers, ins_time(0.5));
  }
}

Task<Answer<Done>> CalibrationRun::bring_to_rest() {
  if (auto state = co_await ask_state(); !state) {
    co_return tl::unexpected(state.error());
  } else if (state->state == ins::State::rotating) {
    const auto stopped = co_await client_.routine(uds::RoutineAction::stop, ins::routine::self_calibration, {});
    if (!stopped) {
      co_return tl::unexpected(stopped.error());
    }
  }
  co_return co_await await_state(ins::State::rotating, stop_limit_s, "the gimbal turns still");
}

Task<CalibrationRun::Step> CalibrationRun::stop_gimbal() {
  if (!record_.abort_wanted && record_.reason.empty()) {  // neither asked for nor failed: the INS restarted
    fail_with(fmt::format("{}: the rotation is lost: the INS is {} when it answers again", config_.interface,
                          ins::name(stock_.state)));
  }
  if (auto rests = co_await bring_to_rest(); !rests) {
    co_return tl::unexpected(rests.error());
  }
  co_return Event::gimbal_stopped;
}

}  // namespace selfcal
