#include "daemon/run/raw_data.hpp"

#include <fmt/format.h>

#include <cmath>

#include "daemon/run/ins_checks.hpp"
#include "daemon/store/page_recording.hpp"
#include "daemon/store/recording_store.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;

constexpr int reads_of_a_bad_page = 5;
constexpr std::uint32_t pages_per_upload = 64;  // what a lost link costs at most
constexpr auto completion_interval = 200ms;
constexpr int completion_looks = 25;  // the last page is programmed in far less than 5 s

}  // namespace

// Of this run's rotation, and in agreement with format and schedule.
Task<Answer<ins::DirectoryRecord>> RawData::read_directory() {
  auto directory = co_await client_.read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  if (data_.config.profile->move && directory->pages_expected == 0) {
    directory->pages_expected = pages_due(*directory);
  }
  if (directory->run_id != journal_.record.rotation) {
    co_return protocol_error(
        fmt::format("the INS holds data of rotation {}, not {}", directory->run_id, journal_.record.rotation));
  }
  const auto& move = data_.config.profile->move;
  const double longer_s =
      move ? static_cast<double>(data_.schedule.positions.size()) * move->turning.longest_move_s : 0.0;
  if (const Complaint complaint = check_directory(*directory, data_.format, data_.schedule, longer_s)) {
    co_return protocol_error(*complaint);
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

// An INS that is turned move by move knows no schedule. In this state its rotation is known to be over, and whole if it was not to
// end early.
std::uint32_t RawData::pages_due(const ins::DirectoryRecord& directory) const {
  const bool whole = journal_.record.state == State::draining && directory.complete && journal_.record.early_end_s < 0;
  return whole ? directory.pages_written : static_cast<std::uint32_t>(pages_of(data_.schedule, data_.format));
}

// The ring of the INS may have lost what was not pulled yet.
Answer<Done> RawData::check_ring(const ins::DirectoryRecord& directory) {
  if (!pages_) {
    return Done{};
  }
  const auto wanted = pages_->missing(directory.pages_written, 1);
  if (wanted.count > 0 && wanted.first < directory.first_page) {
    return protocol_error(fmt::format("page {} is lost: the ring of the INS holds pages {} to {}", wanted.first,
                                      directory.first_page, directory.pages_written - 1));
  }
  return Done{};
}

Task<Answer<Done>> RawData::learn_pages_written() {
  const auto directory = co_await read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  co_return Done{};
}

// Before anything turns: a full disk must not end a run in the middle.
Task<Answer<Done>> RawData::check_space() {
  const auto format = co_await client_.read_sample_format();
  if (!format) {
    co_return tl::unexpected(format.error());
  }
  data_.format = *format;
  const auto samples = static_cast<std::uint64_t>(std::ceil(data_.schedule.duration_s() * format->sample_rate_hz));
  const std::string what_for =
      fmt::format("a run of {:.0f} s at {} Hz", data_.schedule.duration_s(), format->sample_rate_hz);
  if (auto room = require_space(data_.folder, bytes_of_a_run(samples), what_for); !room) {
    co_return local_trouble(room.error());
  }
  co_return Done{};
}

Task<Answer<Done>> RawData::open() {
  PageContext context;
  const auto format = co_await client_.read_sample_format();
  if (!format) {
    co_return tl::unexpected(format.error());
  }
  data_.format = *format;
  page_s_ = format->samples_per_page / format->sample_rate_hz;
  budget_.learn_page(page_s_);
  const auto site = co_await client_.read_site();
  if (!site) {
    co_return tl::unexpected(site.error());
  }
  const auto directory = co_await read_directory();
  if (!directory) {
    co_return tl::unexpected(directory.error());
  }
  journal_.progress.pages_expected = directory->pages_expected;
  if (journal_.record.early_end_s >= 0) {
    journal_.record.early_end_s = static_cast<double>(directory->samples) / format->sample_rate_hz;
  }
  journal_.progress.ins.pages_written = directory->pages_written;
  context.format = *format;
  context.site = *site;
  context.pages = directory->complete ? directory->pages_written : directory->pages_expected;
  if (auto kept = write_page_context(data_.folder, context); !kept) {
    co_return local_trouble(kept.error());
  }
  if (!pages_) {
    auto pages = PageFile::open(page_path(data_.folder),
                                {journal_.record.rotation, format->samples_per_page, directory->samples});
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
  journal_.progress.pages_pulled = pages_->count();
  co_return Done{};
}

// The gimbal is at rest: the directory must say that no more pages come and, unless the end was early, that all are there.
Task<Answer<Done>> RawData::await_completion() {
  for (int look = 1;; ++look) {
    const auto directory = co_await read_directory();
    if (!directory) {
      co_return tl::unexpected(directory.error());
    }
    const bool all = journal_.record.early_end_s >= 0 || directory->pages_written >= directory->pages_expected;
    if (directory->complete && all) {
      if (const Complaint complaint =
              check_rotation_time(*directory, data_.format, data_.rotation_clock.time(), data_.config)) {
        co_return protocol_error(*complaint);
      }
      co_return Done{};
    }
    if (look == completion_looks) {
      co_return protocol_error(fmt::format("directory: {} with {} of {} pages, though the rotation is over",
                                           directory->complete ? "complete" : "not complete", directory->pages_written,
                                           directory->pages_expected));
    }
    co_await Sleep(timers_, completion_interval);
  }
}

Task<Answer<Done>> RawData::pull() {
  const PageFile::Range range = pages_->missing(pages_known_, pages_per_upload);
  auto done =
      co_await client_.upload(range.first, range.count, [this](std::uint32_t page, const Expected<Bytes>& bytes) {
        const auto stored = bytes ? pages_->store(page, *bytes) : Expected<std::string>(bytes.error().message);
        if (!stored) {
          storage_error_ = stored.error();
        }
        if (stored && !stored->empty()) {
          note_bad_page(page, *stored);
        }
        if (pages_->count() > journal_.progress.pages_pulled) {
          progressed();
        }
        journal_.progress.pages_pulled = pages_->count();
        journal_.report_progress();
      });
  if (!done) {
    co_return tl::unexpected(done.error());
  }
  if (storage_error_) {
    co_return local_trouble(*storage_error_);
  }
  for (const auto& [page, bad] : bad_pages_) {
    if (bad.times >= reads_of_a_bad_page && !pages_->has(page)) {
      co_return protocol_error(
          fmt::format("page {}: {} ({} readings): the data are incomplete", page, bad.why, bad.times));
    }
  }
  co_return Done{};
}

void RawData::note_bad_page(std::uint32_t page, const std::string& why) {
  BadPage& bad = bad_pages_[page];
  bad.why = why;
  if (++bad.times == 1) {
    journal_.warn(fmt::format("page {}: {}: fetched again", page, why));
  }
  ++journal_.progress.pages_refetched;
}

bool RawData::some_missing() { return pages_->missing(pages_known_, 1).count > 0; }

std::uint32_t RawData::without_gap() { return pages_->missing(journal_.progress.pages_expected, 1).first; }

void RawData::close() { pages_.reset(); }

}  // namespace selfcal
