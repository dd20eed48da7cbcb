// Samples of the IMU as an INS streams them in CAN frames: each in one frame or in several, all with its counter. A frame that is
// lost is noticed by the counter, and ends the stream: nothing that came behind it is used.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/can/frame.hpp"
#include "protocol/flash/page.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/profile/profile.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal {

// Pages of a rotation by the schedule, the last one perhaps not full.
std::uint32_t pages_of(const ins::ScheduleRecord& schedule, double sample_rate_hz);

class SampleStream {
 public:
  explicit SampleStream(profile::ProfilePtr profile) : profile_(std::move(profile)) {}

  void begin();  // what came before is forgotten
  void end() { taking_ = false; }

  // Takes a frame of the stream. True where a sample became whole.
  bool take(const can::CanFrame& frame);

  std::uint64_t samples() const { return samples_.size(); }
  // Why the stream is broken; empty: it is not.
  const std::string& trouble() const { return trouble_; }
  // Of the last sample, in the INS's words, radians.
  std::array<double, 2> gimbal() const { return gimbal_; }
  // A page of them, as our own INS has pages; the INS's axes.
  std::vector<std::uint8_t> page(std::uint32_t number, std::uint32_t run_id, bool last) const;
  std::uint32_t pages_begun() const;
  // ReadMemoryByAddress of the first `pages`, one behind the other; they are begun.
  uds::Reply memory(uds::ByteView request, std::uint32_t pages, std::uint32_t run_id, bool whole) const;

 private:
  void take_part(std::size_t which, const can::CanFrame& frame);
  bool fits(std::size_t which, const can::CanFrame& frame, std::uint64_t counter);
  void break_off(std::string why);

  profile::ProfilePtr profile_;
  bool taking_ = false;
  std::vector<flash::SampleCounts> samples_;
  std::vector<float> temperatures_;       // one a page
  std::vector<bool> parts_;               // of the sample that is being told: which frames came
  std::optional<std::uint64_t> counter_;  // its counter; none before the first
  flash::SampleCounts sample_;
  float temperature_ = 0.0F;
  std::array<double, 2> gimbal_{}, told_{};
  std::string trouble_;
};

}  // namespace selfcal
