// SecurityAccess (ISO 14229-1, 9.4): seeds, keys, and a count of attempts that no power switch gets round.
//
// An attempt is counted in FLASH before its key is looked at, and the answer comes after a second write of the same
// length, whether the key was right (the count goes back to 0) or wrong (it stays). So a power cut at any moment either
// leaves the attempt counted or comes before anything depends on the key; and a right and a wrong key take the same time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "protocol/profile/profile.hpp"
#include "protocol/time.hpp"
#include "protocol/uds/messages.hpp"
#include "protocol/uds/security.hpp"
#include "sim_ins/device/stores.hpp"

namespace selfcal::sim {

class SecurityLock {
 public:
  // `seed_salt` 0: seeds from the system's entropy; else reproducible (tests).
  SecurityLock(FlashMemory& flash, CounterStore& counters, const profile::Security& kind, const uds::SecurityKey& key,
               std::uint64_t seed_salt)
      : flash_(flash), counters_(counters), kind_(kind), key_(key), seed_salt_(seed_salt) {}

  // Locked. The delay after wrong keys begins anew: else a reset would be the way round it.
  void power_on(Time now);
  // Any change of session: locked, and a seed that was given out opens nothing any more.
  void close();
  bool open() const { return open_; }

  [[nodiscard]] uds::Reply give_seed(Time now);
  bool seed_given() const { return seed_.has_value(); }

  // Counts the attempt; the answer comes from take_answer(). A seed must have been given; the key has its length.
  void begin_attempt(std::span<const std::uint8_t> key, Time now);
  bool busy() const { return attempt_.has_value(); }
  // The answer to an attempt, once the FLASH has done both writes.
  std::optional<uds::Reply> take_answer(double now_s);

 private:
  struct Attempt {
    uds::Bytes seed, key;
    Time asked{0};
    double due_s = 0.0;  // INS time at which the write under way is done
    bool judged = false;
    bool right = false;
  };
  uds::Bytes new_seed();
  Expected<uds::Bytes> key_to(const uds::Bytes& seed) const;
  void judge(Attempt& attempt);

  FlashMemory& flash_;
  CounterStore& counters_;
  profile::Security kind_;
  uds::SecurityKey key_;
  std::uint64_t seed_salt_;
  std::uint64_t seeds_given_ = 0;
  std::optional<uds::Bytes> seed_;  // given out, not yet answered: used once
  std::optional<Attempt> attempt_;
  bool open_ = false;
  Time locked_until_{0};
};

}  // namespace selfcal::sim
