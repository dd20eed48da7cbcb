#include "sim_ins/device/security_lock.hpp"

#include <sys/random.h>

#include <algorithm>
#include <utility>

#include "protocol/byte_order.hpp"

namespace selfcal::sim {
namespace {

using uds::Nrc;

constexpr std::uint32_t free_attempts = 3;  // wrong keys before the delay
constexpr Time delay_after_wrong_keys = std::chrono::seconds(10);

}  // namespace

void SecurityLock::power_on(Time now) {
  close();
  locked_until_ = counters_.get().key_attempts >= free_attempts ? now + delay_after_wrong_keys : Time{0};
}

void SecurityLock::close() {
  open_ = false;
  seed_.reset();
  attempt_.reset();
}

uds::Reply SecurityLock::give_seed(Time now) {
  if (now < locked_until_) {
    return tl::unexpected(Nrc::required_time_delay_not_expired);
  }
  Seed seed{};
  if (open_) {  // all zeros: nothing to answer
    return uds::seed_response(seed);
  }
  if (seed_salt_ != 0) {
    ByteWriter writer(seed);
    writer.put(seed_salt_);
    writer.put(++seeds_given_);
  } else if (::getrandom(seed.data(), seed.size(), 0) != static_cast<ssize_t>(seed.size())) {
    return tl::unexpected(Nrc::conditions_not_correct);
  }
  seed_ = seed;
  return uds::seed_response(seed);
}

void SecurityLock::begin_attempt(std::span<const std::uint8_t> key, Time now) {
  Attempt attempt;
  attempt.seed = *std::exchange(seed_, std::nullopt);  // an answer counts once: a recorded one is worth nothing
  std::ranges::copy(key, attempt.key.begin());
  attempt.asked = now;
  counters_.set(counters_.get().power_cycles, counters_.get().key_attempts + 1);
  attempt.due_s = flash_.ready_at_s();
  attempt_ = attempt;
}

// The second write: a new copy of the counters for a wrong key too.
void SecurityLock::judge(Attempt& attempt) {
  const auto expected = uds::answer_seed(key_, attempt.seed);
  attempt.right = expected && uds::equal_in_constant_time(*expected, attempt.key);
  attempt.judged = true;
  counters_.set(counters_.get().power_cycles, attempt.right ? 0 : counters_.get().key_attempts);
  attempt.due_s = flash_.ready_at_s();
}

std::optional<uds::Reply> SecurityLock::take_answer(double now_s) {
  if (!attempt_ || now_s < attempt_->due_s) {
    return std::nullopt;
  }
  if (!attempt_->judged) {
    judge(*attempt_);
    return std::nullopt;
  }
  const Attempt attempt = *std::exchange(attempt_, std::nullopt);
  if (attempt.right) {
    open_ = true;
    return uds::Bytes{uds::service::security_access + uds::positive_offset, uds::security_key_level};
  }
  if (counters_.get().key_attempts < free_attempts) {
    return uds::Reply(tl::unexpected(Nrc::invalid_key));
  }
  locked_until_ = attempt.asked + delay_after_wrong_keys;
  return uds::Reply(tl::unexpected(Nrc::exceeded_number_of_attempts));
}

}  // namespace selfcal::sim
