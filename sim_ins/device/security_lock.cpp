#include "sim_ins/device/security_lock.hpp"

#include <sys/random.h>

#include <array>
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
  if (open_) {  // all zeros: nothing to answer
    return uds::seed_response(uds::Bytes(kind_.seed_bytes, 0));
  }
  uds::Bytes seed = new_seed();
  if (seed.empty()) {
    return tl::unexpected(Nrc::conditions_not_correct);
  }
  seed_ = seed;
  return uds::seed_response(seed);
}

// Empty: there is no entropy.
uds::Bytes SecurityLock::new_seed() {
  uds::Bytes seed(kind_.seed_bytes, 0);
  if (seed_salt_ == 0) {
    return ::getrandom(seed.data(), seed.size(), 0) == static_cast<ssize_t>(seed.size()) ? seed : uds::Bytes{};
  }
  std::array<std::uint8_t, 16> drawn{};
  ByteWriter writer(drawn);
  writer.put(seed_salt_);
  writer.put(++seeds_given_);
  for (std::size_t k = 0; k < seed.size(); ++k) {  // the end changes from one to the next
    seed[k] = drawn[drawn.size() - 1 - k % drawn.size()];
  }
  return seed;
}

Expected<uds::Bytes> SecurityLock::key_to(const uds::Bytes& seed) const {
  if (kind_.program) {
    return key_by_program(*kind_.program, seed);
  }
  return uds::answer_seed(key_, seed).map([](const auto& key) { return uds::Bytes(key.begin(), key.end()); });
}

void SecurityLock::begin_attempt(std::span<const std::uint8_t> key, Time now) {
  Attempt attempt;
  attempt.seed = *std::exchange(seed_, std::nullopt);  // an answer counts once: a recorded one is worth nothing
  attempt.key.assign(key.begin(), key.end());
  attempt.asked = now;
  counters_.set(counters_.get().power_cycles, counters_.get().key_attempts + 1);
  attempt.due_s = flash_.ready_at_s();
  attempt_ = attempt;
}

// The second write: a new copy of the counters for a wrong key too.
void SecurityLock::judge(Attempt& attempt) {
  const auto expected = key_to(attempt.seed);
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
