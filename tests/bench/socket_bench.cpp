// Block transfer over real sockets on an unpaced interface, both ends in this one thread:
//   socket_bench vcan0 [MEGABYTES]
// Prints payload per second against the real 1/5 Mbit/s FD bus, and fails (1) where it is less than 5 times that, or a
// byte is wrong, or a frame was lost.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "protocol/can/socket.hpp"
#include "protocol/isotp/transport.hpp"

namespace selfcal {
namespace {

constexpr double real_fd_bus_bytes_per_s = 436e3;   // ceiling of FD 1/5 Mbit/s with blocks of 65535
constexpr double asked_for = 5.0;

Time now() { return std::chrono::steady_clock::now().time_since_epoch(); }

struct End {
  End(can::Socket s, const isotp::Options& options) : socket(std::move(s)), transport(options) {}

  // True when a message has come in.
  Expected<bool> turn() {
    bool received = false;
    const auto frames = socket.receive();
    if (!frames) {
      return tl::unexpected(frames.error());
    }
    for (const auto& f : *frames) {
      for (const isotp::Result result : transport.on_frame(f.frame, now())) {
        received = received || result == isotp::Result::received;
        if (isotp::is_failure(result)) {
          return fail(ErrorKind::device, std::string(name(result)));
        }
      }
    }
    const Time t = now();
    const auto taken = socket.send(std::span(out).first(transport.pending(out, t)));
    if (!taken) {
      return tl::unexpected(taken.error());
    }
    transport.sent(*taken, t);
    return received;
  }

  can::Socket socket;
  isotp::Transport transport;
  std::vector<can::CanFrame> out = std::vector<can::CanFrame>(64);
};

Expected<End> open_end(const char* interface, bool fd, std::uint32_t transmit, std::uint32_t receive) {
  isotp::Options options;
  options.address = {transmit, receive, std::nullopt, false};
  options.fd = fd;
  options.frame_bytes = fd ? 64 : 8;
  can::SocketOptions socket;
  socket.interface = interface;
  socket.filters = {{receive, 0x7FF, false}};
  return can::Socket::open(socket).map([&](can::Socket&& s) { return End(std::move(s), options); });
}

// Seconds of processing that the transfer took; the process has one thread.
Expected<double> transfer(End& tester, End& ins, std::size_t block, std::size_t blocks) {
  const std::vector<std::uint8_t> request = {0x36, 1};
  std::vector<std::uint8_t> response(block);
  for (std::size_t i = 0; i < block; ++i) {
    response[i] = static_cast<std::uint8_t>(i * 31 + i / 256);
  }
  const std::clock_t start = std::clock();
  for (std::size_t i = 0; i < blocks; ++i) {
    response[1] = static_cast<std::uint8_t>(i);
    if (!tester.transport.send(request, now())) {
      return fail(ErrorKind::internal, "the tester is still sending");
    }
    bool answered = false;
    while (!answered) {
      const auto at_tester = tester.turn();
      const auto at_ins = at_tester ? ins.turn() : at_tester;
      if (!at_ins) {
        return tl::unexpected(at_ins.error());
      }
      answered = *at_tester;
      if (*at_ins && !ins.transport.send(response, now())) {
        return fail(ErrorKind::internal, "the INS is still sending");
      }
    }
    if (!std::ranges::equal(tester.transport.message(), response)) {
      return fail(ErrorKind::internal, fmt::format("block {} came out wrong", i));
    }
  }
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

Expected<bool> measure(const char* interface, const char* name, bool fd, std::size_t block, double megabytes) {
  auto tester = open_end(interface, fd, 0x640, 0x648);
  auto ins = open_end(interface, fd, 0x648, 0x640);
  if (!tester || !ins) {
    return tl::unexpected(tester ? ins.error() : tester.error());
  }
  const std::size_t payload = block - 2;
  const auto blocks = static_cast<std::size_t>(megabytes * 1e6 / static_cast<double>(payload)) + 1;
  const auto seconds = transfer(*tester, *ins, block, blocks);
  if (!seconds) {
    return tl::unexpected(seconds.error());
  }
  const double rate = static_cast<double>(blocks * payload) / *seconds;
  const std::uint64_t lost = tester->socket.lost_frames() + ins->socket.lost_frames();
  fmt::print("{:<20} {:8.0f} kB/s  {:5.1f} times the real FD bus, {} frames lost\n", name, rate / 1e3,
             rate / real_fd_bus_bytes_per_s, lost);
  return lost == 0 && (!fd || rate >= asked_for * real_fd_bus_bytes_per_s);
}

int run(const char* interface, double megabytes) {
  bool good = true;
  for (const auto& [name, fd, block] : {std::tuple{"classic, block 4095", false, std::size_t{4095}},
                                        std::tuple{"FD, block 4095", true, std::size_t{4095}},
                                        std::tuple{"FD, block 65535", true, std::size_t{65535}}}) {
    const auto result = measure(interface, name, fd, block, megabytes);
    if (!result) {
      fmt::print(stderr, "{}: {}\n", name, result.error().message);
      return static_cast<int>(result.error().kind);
    }
    good = good && *result;
  }
  return good ? 0 : 1;
}

}  // namespace
}  // namespace selfcal

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: socket_bench INTERFACE [MEGABYTES]\n");
    return 2;
  }
  return selfcal::run(argv[1], argc > 2 ? std::atof(argv[2]) : 16.46);
}
