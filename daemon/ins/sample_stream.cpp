#include "daemon/ins/sample_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace selfcal {
namespace {

constexpr double turn = 2.0 * 3.14159265358979323846;

std::uint16_t counts_of(double radians) {
  const double turns = radians / turn;
  return static_cast<std::uint16_t>(std::llround((turns - std::floor(turns)) * flash::counts_per_turn) & 0xFFFF);
}

std::uint64_t next(std::uint64_t counter, std::size_t bits) { return (counter + 1) & ((std::uint64_t{1} << bits) - 1); }

}  // namespace

std::uint32_t pages_of(const ins::ScheduleRecord& schedule, double sample_rate_hz) {
  double duration_s = schedule.rotation_ms * 1e-3 * static_cast<double>(schedule.positions.size() - 1);
  for (const auto& position : schedule.positions) {
    duration_s += position.dwell_ms * 1e-3;
  }
  return static_cast<std::uint32_t>(std::ceil(duration_s * sample_rate_hz / flash::samples_per_page));
}

void SampleStream::begin() {
  taking_ = true;
  samples_.clear();
  temperatures_.clear();
  parts_.assign(profile::sample_frames(*profile_).size(), false);
  counter_.reset();
  trouble_.clear();
}

void SampleStream::break_off(std::string why) {
  trouble_ = std::move(why);
  taking_ = false;
}

bool SampleStream::take(const can::CanFrame& frame) {
  const auto& kinds = profile::sample_frames(*profile_);
  const auto kind = std::ranges::find(kinds, frame.id, &profile::Frame::id);
  if (!taking_ || kind == kinds.end()) {
    return false;
  }
  const auto which = static_cast<std::size_t>(kind - kinds.begin());
  if (frame.size < kind->bytes) {
    break_off(fmt::format("frame {} ({:#x}) of sample {} has {} bytes, {} expected", kind->name, kind->id,
                          samples_.size(), frame.size, kind->bytes));
    return false;
  }
  const std::uint64_t counter = profile::raw_of(*kind->find("counter"), frame.payload());
  if (!fits(which, frame, counter)) {
    return false;
  }
  parts_[which] = true;
  take_part(which, frame);
  if (std::ranges::find(parts_, false) != parts_.end()) {
    return false;
  }
  sample_.outer = counts_of(told_[0]);
  sample_.inner = counts_of(told_[1]);
  gimbal_ = told_;
  if (samples_.size() % flash::samples_per_page == 0) {
    temperatures_.push_back(temperature_);
  }
  samples_.push_back(sample_);
  parts_.assign(parts_.size(), false);
  counter_ = next(counter, kind->find("counter")->length);
  return true;
}

// Whether the frame belongs to the sample that is being told, or begins the next one.
bool SampleStream::fits(std::size_t which, const can::CanFrame& frame, std::uint64_t counter) {
  const bool begun = std::ranges::find(parts_, true) != parts_.end();
  if (counter_ && counter == *counter_) {
    if (parts_[which]) {
      break_off(fmt::format("frame {:#x} of sample {} came twice (counter {})", frame.id, samples_.size(), counter));
      return false;
    }
    return true;
  }
  if (samples_.empty()) {  // the stream was joined in the middle of a sample
    parts_.assign(parts_.size(), false);
    counter_ = counter;
    return true;
  }
  if (begun) {
    const auto missing = static_cast<std::size_t>(std::ranges::find(parts_, false) - parts_.begin());
    break_off(fmt::format("frame {:#x} of sample {} did not come (counter {}, then {})",
                          profile::sample_frames(*profile_)[missing].id, samples_.size(), *counter_, counter));
  } else {
    break_off(fmt::format("samples are missing behind sample {}: counter {} came, {} was to come", samples_.size() - 1,
                          counter, *counter_));
  }
  return false;
}

void SampleStream::take_part(std::size_t which, const can::CanFrame& frame) {
  for (const profile::Signal& signal : profile::sample_frames(*profile_)[which].signals) {
    const std::uint64_t raw = profile::raw_of(signal, frame.payload());
    const auto axis = static_cast<std::size_t>(signal.name.back() - 'x');
    if (signal.name.starts_with("delta_theta_")) {
      sample_.delta_theta[axis] = static_cast<std::int32_t>(profile::whole_of(signal, raw));
    } else if (signal.name.starts_with("delta_v_")) {
      sample_.delta_v[axis] = static_cast<std::int32_t>(profile::whole_of(signal, raw));
    } else if (signal.name == "outer" || signal.name == "inner") {
      told_[signal.name == "outer" ? 0 : 1] = profile::value_of(signal, raw);
    } else if (signal.name == "temperature") {
      temperature_ = static_cast<float>(profile::value_of(signal, raw));
    }
  }
}

std::uint32_t SampleStream::pages_begun() const {
  return static_cast<std::uint32_t>((samples_.size() + flash::samples_per_page - 1) / flash::samples_per_page);
}

std::vector<std::uint8_t> SampleStream::page(std::uint32_t number, std::uint32_t run_id, bool last) const {
  flash::Page page;
  page.run_id = run_id;
  page.sequence = number;
  page.first_sample = std::uint64_t{number} * flash::samples_per_page;
  page.temperature_c = temperatures_[number];
  page.flags = last && number + 1 == pages_begun() ? flash::page_flag::last_of_run : std::uint16_t{0};
  const auto begin = samples_.begin() + static_cast<std::ptrdiff_t>(page.first_sample);
  const auto count = std::min<std::ptrdiff_t>(flash::samples_per_page, samples_.end() - begin);
  page.samples.assign(begin, begin + count);
  std::vector<std::uint8_t> bytes(flash::page_bytes);
  flash::encode_page(page, std::span<std::uint8_t, flash::page_bytes>(bytes));
  return bytes;
}

uds::Reply SampleStream::memory(uds::ByteView request, std::uint32_t pages, std::uint32_t run_id, bool whole) const {
  const auto range = uds::parse_memory_request(request, {profile_->raw.address_bytes, profile_->raw.size_bytes});
  if (!range) {
    return tl::unexpected(range.error());
  }
  const std::uint64_t begin = range->address, end = begin + range->bytes;
  if (begin == end || end > std::uint64_t{pages} * flash::page_bytes) {
    return tl::unexpected(uds::Nrc::request_out_of_range);
  }
  std::vector<std::uint8_t> data;
  for (std::uint64_t at = begin; at < end; at = (at / flash::page_bytes + 1) * flash::page_bytes) {
    const auto bytes = page(static_cast<std::uint32_t>(at / flash::page_bytes), run_id, whole);
    const std::size_t from = at % flash::page_bytes;
    const std::size_t count = std::min<std::size_t>(bytes.size() - from, end - at);
    data.insert(data.end(), bytes.begin() + static_cast<std::ptrdiff_t>(from),
                bytes.begin() + static_cast<std::ptrdiff_t>(from + count));
  }
  return uds::memory_response(data);
}

}  // namespace selfcal
