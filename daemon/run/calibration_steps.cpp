// What the actions of the table do with the INS, up to the last page. A step answers with the event that follows, or
// with why it could not be done; calibration_run.cpp turns that into link_lost or step_failed.
#include <fmt/format.h>

#include <cmath>
#include <random>

#include "daemon/estimate/estimate_job.hpp"
#include "daemon/run/calibration_run.hpp"
#include "daemon/store/recording_store.hpp"
#include "protocol/byte_order.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr int reads_of_a_bad_page = 5;
constexpr std::uint32_t pages_per_upload = 64;  // what a lost link costs at most
constexpr double stop_limit_s = 30.0;           // of the INS's clock
constexpr auto status_silence = 1s;             // then the INS is asked
constexpr auto recovery_interval = 300ms;

tl::unexpected<PortError> senseless(std::string message) {
  return tl::unexpected<PortError>(PortError{PortError::Kind::protocol, 0, std::move(message)});
}

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

bool holds_whole_rotation(const ins::DirectoryRecord& directory) {
  return directory.complete && directory.pages_expected > 0 && directory.pages_written == directory.pages_expected;
}

}  // namespace

Task<Answer<Done>> CalibrationRun::check_serial() {
  const auto identity = co_await client_.identify();
  if (!identity) {
    co_return tl::unexpected(identity.error());
  }
  if (!record_.serial.empty() && record_.serial != identity->serial) {
    co_return senseless(fmt::format("{}: INS {} answers, but run {} belongs to INS {}", config_.interface,
                                    identity->serial, record_.id, record_.serial));
  }
  record_.serial = identity->serial;
  record_.ins_software = identity->software;
  co_return Done{};
}

Task<Answer<Done>> CalibrationRun::take_stock() {
  const auto state = co_await client_.read_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  stock_ = *state;
  auto set = co_await client_.read_record(ins::did::coefficients_in_force);
  if (!set) {
    co_return tl::unexpected(set.error());
  }
  in_force_ = std::move(*set);
  co_return Done{};
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
    co_return senseless(
        fmt::format("{}: INS {}: the gimbal turns already, and not for this run", config_.interface, record_.serial));
  }
  if (const auto set = ins::decode_coefficients(in_force_); !set) {
    co_return senseless(fmt::format("{}: {}", config_.interface, set.error().message));
  }
  if (auto kept = context_.store.store_set(record_.id, SetRole::previous, in_force_); !kept) {
    co_return senseless(kept.error().message);
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

// Before anything turns: a full disk must not end a run in the middle.
Task<Answer<Done>> CalibrationRun::check_space() {
  const auto format = co_await client_.read_sample_format();
  if (!format) {
    co_return tl::unexpected(format.error());
  }
  const auto samples = static_cast<std::uint64_t>(std::ceil(schedule_.duration_s() * format->sample_rate_hz));
  const std::string what_for =
      fmt::format("a run of {:.0f} s at {} Hz", schedule_.duration_s(), format->sample_rate_hz);
  if (auto room = require_space(folder_, bytes_of_a_run(samples), what_for); !room) {
    co_return senseless(room.error().message);
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
  if (format->page_bytes != flash::page_bytes) {
    co_return senseless(
        fmt::format("{}: pages of {} bytes, {} expected", config_.interface, format->page_bytes, flash::page_bytes));
  }
  const auto site = co_await client_.read_site();
  if (!site) {
    co_return tl::unexpected(site.error());
  }
  const auto directory = co_await client_.read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  if (directory->run_id != record_.rotation) {
    co_return senseless(fmt::format("{}: the INS holds data of rotation {}, not {}", config_.interface,
                                    directory->run_id, record_.rotation));
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
    co_return senseless(kept.error().message);
  }
  if (!pages_) {
    auto pages = PageFile::open(page_path(folder_), record_.rotation);
    if (!pages) {
      co_return senseless(pages.error().message);
    }
    pages_ = std::move(*pages);
    const std::uint64_t samples = std::uint64_t{directory->pages_expected} * format->samples_per_page;
    if (auto kept = pages_->reserve(bytes_of_a_run(samples)); !kept) {
      co_return senseless(kept.error().message);
    }
  }
  if (const auto wanted = pages_->missing(directory->pages_written, 1);
      wanted.count > 0 && wanted.first < directory->first_page) {
    co_return senseless(fmt::format("{}: page {} is lost: the ring of the INS holds pages {} to {}", config_.interface,
                                    wanted.first, directory->first_page, directory->pages_written - 1));
  }
  progress_.pages_pulled = pages_->count();
  page_s_ = format->samples_per_page / format->sample_rate_hz;
  co_return Done{};
}

Task<Answer<Done>> CalibrationRun::poll_state() {
  const auto state = co_await client_.read_state();
  if (!state) {
    co_return tl::unexpected(state.error());
  }
  const auto directory = co_await client_.read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  stock_ = *state;
  data_complete_ = directory->run_id == record_.rotation && holds_whole_rotation(*directory);
  progress_.ins.state = state->state;
  progress_.ins.pages_written = directory->pages_written;
  report_progress();
  co_return Done{};
}

// Pages are pulled as they are written; between two pulls the last status says how far the INS is.
Task<CalibrationRun::Step> CalibrationRun::follow_rotation() {
  if (auto opened = co_await open_pages(); !opened) {
    co_return tl::unexpected(opened.error());
  }
  // Status frames from before the start are stale: the first look is a question.
  SteadyTime asked = context_.timers.now() - 2 * status_silence;
  const SteadyTime began = context_.timers.now();
  int position = progress_.ins.position;  // the last one that it got to
  while (true) {
    const SteadyTime now = context_.timers.now();
    const bool heard = status_at_ > began && now - status_at_ < status_silence;
    if (!heard && now - asked > status_silence) {
      if (auto polled = co_await poll_state(); !polled) {
        co_return tl::unexpected(polled.error());
      }
      asked = now;
    }
    if (progress_.ins.state == ins::State::rotating) {
      if (progress_.ins.position > 0) {
        position = progress_.ins.position;
      }
    } else if (auto polled = co_await poll_state(); !polled) {  // what a status frame says is not enough to end a run
      co_return tl::unexpected(polled.error());
    }
    if (progress_.ins.state != ins::State::rotating) {
      // An INS that restarted before anybody saw it complete is idle, and its FLASH has everything.
      if (progress_.ins.state == ins::State::complete || data_complete_) {
        co_return Event::rotation_ended;
      }
      co_return senseless(fmt::format("{}: the rotation ended before its time, at position {} of {}: the INS is {}{}",
                                      config_.interface, position, progress_.positions, ins::name(progress_.ins.state),
                                      words_of_faults(stock_.faults)));
    }
    estimate_meanwhile();
    if (may_end_early()) {
      co_return Event::tolerances_met;
    }
    if (pages_->missing(progress_.ins.pages_written, 1).count > 0) {
      if (auto pulled = co_await pull(progress_.ins.pages_written); !pulled) {
        co_return tl::unexpected(pulled.error());
      }
    } else {
      co_await Sleep(context_.timers, ins_time(0.5));
    }
  }
}

Task<CalibrationRun::Step> CalibrationRun::pull_last_pages() {
  if (auto opened = co_await open_pages(); !opened) {
    co_return tl::unexpected(opened.error());
  }
  const std::uint32_t end = progress_.ins.pages_written;
  while (pages_->missing(end, 1).count > 0) {
    if (auto pulled = co_await pull(end); !pulled) {
      co_return tl::unexpected(pulled.error());
    }
  }
  if (end == 0) {
    co_return senseless(fmt::format("{}: the INS stored no data", config_.interface));
  }
  remember("data", fmt::format("{} pages pulled, {} fetched again for a wrong CRC, {} frames lost", end,
                               progress_.pages_refetched, context_.port.lost_frames()));
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
                                        progress_.pages_pulled = pages_->count();
                                        report_progress();
                                      });
  if (!done) {
    co_return tl::unexpected(done.error());
  }
  if (storage_error_) {
    co_return senseless(storage_error_->message);
  }
  for (const auto& [page, times] : bad_pages_) {
    if (times >= reads_of_a_bad_page && !pages_->has(page)) {
      co_return senseless(fmt::format("{}: page {}: wrong CRC in {} readings: the data are incomplete",
                                      config_.interface, page, times));
    }
  }
  co_return Done{};
}

void CalibrationRun::note_bad_page(std::uint32_t page, const std::string& why) {
  if (++bad_pages_[page] == 1) {
    warn(fmt::format("page {}: {}: fetched again", page, why));
  }
  ++progress_.pages_refetched;
}

Task<Answer<Done>> CalibrationRun::await_state(ins::State unwanted, double limit_s, std::string what) {
  const SteadyTime end = context_.timers.now() + ins_time(limit_s) + 1s;
  while (true) {
    const auto state = co_await client_.read_state();
    if (!state) {
      co_return tl::unexpected(state.error());
    }
    stock_ = *state;
    if (state->state != unwanted) {
      co_return Done{};
    }
    if (context_.timers.now() > end) {
      co_return senseless(fmt::format("{}: {} after {:.0f} s", config_.interface, what, limit_s));
    }
    co_await Sleep(context_.timers, ins_time(0.5));
  }
}

Task<Answer<Done>> CalibrationRun::bring_to_rest() {
  if (auto state = co_await client_.read_state(); !state) {
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
    link_trouble_ = back.error().message;
    if (context_.timers.now() - lost_at_ > limit) {
      fail_with(fmt::format("link lost for more than {} s while {}: {}", config_.lost_after_s, words(record_.state),
                            link_trouble_));
      co_return Event::link_gone;
    }
    co_await Sleep(context_.timers, recovery_interval);
  }
}

}  // namespace selfcal
