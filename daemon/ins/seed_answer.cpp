#include "daemon/ins/seed_answer.hpp"

#include "protocol/uds/security.hpp"

namespace selfcal {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr auto between_looks = std::chrono::milliseconds(10);

}  // namespace

Task<Expected<Bytes>> answer_seed(Timers& timers, const profile::Security& security, UnlockKey key, Bytes seed) {
  if (!security.program) {
    co_return uds::answer_seed(key, seed).map([](const auto& answer) { return Bytes(answer.begin(), answer.end()); });
  }
  const auto program = RunningKeyProgram::start(*security.program, seed);
  if (!program) {
    co_return tl::unexpected(program.error());
  }
  while (true) {
    auto answer = (*program)->look();
    if (!answer) {
      co_return tl::unexpected(answer.error());
    }
    if (*answer) {
      co_return std::move(**answer);
    }
    co_await Sleep(timers, between_looks);
  }
}

}  // namespace selfcal
