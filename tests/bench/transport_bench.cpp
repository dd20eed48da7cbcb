// How well a block transfer fills the bus, and how fast the code is without one. A tester asks for TransferData blocks
// from an INS; every frame of both, flow control and requests too, takes its true time on a simulated bus.
//
//   of_ceiling   payload per bus time against the ceiling computed for this protocol at turnaround 0 (59.8, 424, 436
//                kB/s), which supposes average stuffing; 95 % is asked for
//   times_real   payload per second of processing time, both ends on one core, against the same bus: the state machines
//                alone; socket_bench has the system calls in it
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <random>
#include <vector>

#include "protocol/can/bus_load.hpp"
#include "protocol/isotp/transport.hpp"

namespace selfcal {
namespace {

struct Case {
  const char* name;
  bool fd;
  std::size_t message_bytes;  // of a TransferData response, 2 bytes of which are service and counter
  double ceiling_bytes_per_s;
};

constexpr Case cases[] = {
    {"classic 1 Mbit/s, block 4095", false, 4095, 59.8e3},
    {"FD 1/5 Mbit/s, block 4095", true, 4095, 424e3},
    {"FD 1/5 Mbit/s, block 65535", true, 65535, 436e3},
};

isotp::Options options(const Case& c, std::uint32_t transmit, std::uint32_t receive) {
  isotp::Options o;
  o.address = {transmit, receive, std::nullopt, false};
  o.fd = c.fd;
  o.frame_bytes = c.fd ? 64 : 8;
  return o;
}

// One end's frames to the bus and the other end. True if the other end has received a message.
bool carry(isotp::Transport& from, isotp::Transport& to, can::BusClock* bus, Time& now,
           std::vector<can::CanFrame>& frames) {
  bool received = false;
  while (const std::size_t count = from.pending(frames, now)) {
    from.sent(count, now);
    for (std::size_t i = 0; i < count; ++i) {
      if (bus != nullptr) {
        now = bus->transmit(frames[i], now);
      }
      for (const isotp::Result result : to.on_frame(frames[i], now)) {
        received = received || result == isotp::Result::received;
      }
    }
  }
  return received;
}

void exchange(isotp::Transport& tester, isotp::Transport& ins, std::span<const std::uint8_t> request,
              std::span<const std::uint8_t> response, can::BusClock* bus, Time& now,
              std::vector<can::CanFrame>& frames) {
  bool asked = tester.send(request, now) && carry(tester, ins, bus, now, frames);
  asked = asked && ins.send(response, now);
  bool answered = false;
  while (asked && !answered) {
    answered = carry(ins, tester, bus, now, frames);
    carry(tester, ins, bus, now, frames);
  }
  if (!answered || tester.message().size() != response.size()) {
    std::abort();  // what is measured must also be right
  }
}

// Like samples: small counts, so runs of equal bits and more stuffing than random data.
std::vector<std::uint8_t> block(std::size_t size, bool sample_like) {
  std::mt19937 random(1);
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) {
    bytes[i] = sample_like && i % 4 < 2 ? std::uint8_t{0} : static_cast<std::uint8_t>(random());
  }
  return bytes;
}

void block_transfer(benchmark::State& state, const Case& c, bool sample_like) {
  isotp::Transport tester(options(c, 0x640, 0x648));
  isotp::Transport ins(options(c, 0x648, 0x640));
  const std::vector<std::uint8_t> request = {0x36, 1};
  const auto response = block(c.message_bytes, sample_like);
  std::vector<can::CanFrame> frames(64);
  Time now{0};
  double payload = 0.0;
  for (auto _ : state) {
    exchange(tester, ins, request, response, nullptr, now, frames);
    payload += static_cast<double>(c.message_bytes - 2);
  }
  can::BusClock bus({1'000'000, 5'000'000});
  constexpr int paced_blocks = 20;
  for (int i = 0; i < paced_blocks; ++i) {
    exchange(tester, ins, request, response, &bus, now, frames);
  }
  const double bus_seconds = std::chrono::duration<double>(bus.free_at()).count();
  const double rate = paced_blocks * static_cast<double>(c.message_bytes - 2) / bus_seconds;
  state.counters["bus_kB_per_s"] = rate / 1e3;
  state.counters["of_ceiling"] = rate / c.ceiling_bytes_per_s;
  state.counters["times_real"] = benchmark::Counter(payload / c.ceiling_bytes_per_s, benchmark::Counter::kIsRate);
}

}  // namespace
}  // namespace selfcal

int main(int argc, char** argv) {
  for (const auto& c : selfcal::cases) {
    for (const bool sample_like : {false, true}) {
      benchmark::RegisterBenchmark(
          std::string(c.name).append(sample_like ? ", sample-like" : ", random").c_str(),
          [&c, sample_like](benchmark::State& state) { selfcal::block_transfer(state, c, sample_like); });
    }
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
