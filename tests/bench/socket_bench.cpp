// Block transfer over real sockets on an unpaced interface, both ends in this one thread:
//   socket_bench vcan0 [MEGABYTES] [alone]
// and beside it the bare ceiling: as many frames of the same kind through sendmmsg and recvmmsg on sockets without
// options, nobody looking at their content. The two take turns, 64 KiB each, so that whatever else the machine does
// hits both alike. Prints payload per second of processor time against the real 1/5 Mbit/s FD bus, and the share of the
// ceiling; status 1 where FD is below 5 times the bus, a byte is wrong, or a frame was lost. `alone` leaves the bare
// sockets out and tells only where each case begins and ends, for socket_cpu.py, which takes the host's processor time.
#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string_view>
#include <vector>

#include "protocol/can/socket.hpp"
#include "protocol/isotp/transport.hpp"

namespace selfcal {
namespace {

constexpr double real_fd_bus_bytes_per_s = 436e3;  // ceiling of FD 1/5 Mbit/s with blocks of 65535
constexpr double asked_for = 5.0;
constexpr std::size_t batch = 256;  // below the 278 frames of a default receive buffer

Time now() { return std::chrono::steady_clock::now().time_since_epoch(); }

double seconds_since(std::clock_t start) { return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC; }

struct End {
  End(can::Socket s, const isotp::Options& options) : socket(std::move(s)), transport(options) {}

  // True when a message has come in.
  Expected<bool> turn(Time t) {
    bool received = false;
    const auto frames = socket.receive();
    if (!frames) {
      return tl::unexpected(frames.error());
    }
    for (const auto& f : *frames) {
      for (const isotp::Result result : transport.on_frame(f.frame, t)) {
        received = received || result == isotp::Result::received;
        if (isotp::is_failure(result)) {
          return fail(ErrorKind::device, std::string(name(result)));
        }
      }
    }
    if (const auto done = transmit(t); !done) {
      return tl::unexpected(done.error());
    }
    return received;
  }

  Expected<void> transmit(Time t) {
    const std::size_t count = transport.pending(out, t);
    const auto taken = count > 0 ? socket.send(std::span(out).first(count)) : Expected<std::size_t>(0);
    if (!taken) {
      return tl::unexpected(taken.error());
    }
    transport.sent(*taken, t);
    return {};
  }

  can::Socket socket;
  isotp::Transport transport;
  std::vector<can::CanFrame> out = std::vector<can::CanFrame>(batch);
};

Expected<End> open_end(const char* interface, bool fd, std::uint32_t transmit, std::uint32_t receive) {
  isotp::Options options;
  options.address = {transmit, receive, std::nullopt, false};
  options.fd = fd;
  options.frame_bytes = fd ? 64 : 8;
  can::SocketOptions socket;
  socket.interface = interface;
  socket.filters = {{receive, 0x7FF, false}};
  socket.batch = batch;
  return can::Socket::open(socket).map([&](can::Socket&& s) { return End(std::move(s), options); });
}

// One block asked for and answered. The clock is read once a turn, as an event loop does: it can be a system call.
Expected<void> exchange(End& tester, End& ins, std::span<const std::uint8_t> response) {
  static constexpr std::array<std::uint8_t, 2> request{0x36, 1};
  Time t = now();
  if (!tester.transport.send(request, t)) {
    return fail(ErrorKind::internal, "the tester is still sending");
  }
  if (auto asked = tester.transmit(t); !asked) {
    return asked;
  }
  for (;; t = now()) {
    const auto asked = ins.turn(t);
    if (!asked) {
      return tl::unexpected(asked.error());
    }
    if (*asked) {
      if (!ins.transport.send(response, t)) {
        return fail(ErrorKind::internal, "the INS is still sending");
      }
      if (auto begun = ins.transmit(t); !begun) {
        return begun;
      }
    }
    const auto answered = tester.turn(t);
    if (!answered) {
      return tl::unexpected(answered.error());
    }
    if (*answered) {
      if (!std::ranges::equal(tester.transport.message(), response)) {
        return fail(ErrorKind::internal, "a block came out wrong");
      }
      return {};
    }
  }
}

// Two raw sockets and nothing else.
class Bare {
 public:
  Bare(const char* interface, bool fd) : bytes_(fd ? CANFD_MTU : CAN_MTU) {
    for (int& s : sockets_) {
      s = open(interface);
    }
    for (std::size_t i = 0; i < batch; ++i) {
      frames_[i].can_id = 0x700;  // past the filters of the others
      frames_[i].len = fd ? 64 : 8;
      vectors_[i] = {&frames_[i], bytes_};
      headers_[i].msg_hdr.msg_iov = &vectors_[i];
      headers_[i].msg_hdr.msg_iovlen = 1;
    }
  }
  ~Bare() {
    for (const int s : sockets_) {
      ::close(s);
    }
  }
  Bare(const Bare&) = delete;
  Bare& operator=(const Bare&) = delete;

  bool good() const {
    return std::ranges::none_of(sockets_, [](int s) { return s < 0; });
  }

  // False where a frame does not get through.
  bool carry(std::size_t frames) {
    while (frames > 0) {
      const auto part = static_cast<unsigned>(std::min(frames, batch));
      const int sent = ::sendmmsg(sockets_[0], headers_.data(), part, MSG_DONTWAIT);
      if (sent <= 0 || ::recvmmsg(sockets_[1], headers_.data(), batch, MSG_DONTWAIT, nullptr) != sent) {
        return false;
      }
      frames -= static_cast<std::size_t>(sent);
    }
    return true;
  }

 private:
  int open(const char* interface) const {
    const int s = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    const int on = 1;
    const can_filter filter{0x700, 0x7FF};
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(interface));
    const bool good = ::setsockopt(s, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) == 0 &&
                      ::setsockopt(s, SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof filter) == 0 &&
                      ::bind(s, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    return good ? s : -1;
  }

  std::size_t bytes_;
  std::array<int, 2> sockets_{-1, -1};
  std::vector<canfd_frame> frames_ = std::vector<canfd_frame>(batch);
  std::vector<iovec> vectors_ = std::vector<iovec>(batch);
  std::vector<mmsghdr> headers_ = std::vector<mmsghdr>(batch);
};

struct Case {
  const char* name;
  bool fd;
  std::size_t block;
};

void mark(const char* what, const Case& c, double bytes) {
  fmt::print("{} {:.0f} {}\n", what, bytes, c.name);
  std::fflush(stdout);
  ::sleep(1);  // while who reads it looks at the clock
}

Expected<bool> measure(const char* interface, const Case& c, double megabytes, bool alone) {
  auto tester = open_end(interface, c.fd, 0x640, 0x648);
  auto ins = open_end(interface, c.fd, 0x648, 0x640);
  Bare bare(interface, c.fd);
  if (!tester || !ins) {
    return tl::unexpected(tester ? ins.error() : tester.error());
  }
  if (!bare.good()) {
    return fail(ErrorKind::device, "no bare socket");
  }
  std::vector<std::uint8_t> response(c.block);
  for (std::size_t i = 0; i < c.block; ++i) {
    response[i] = static_cast<std::uint8_t>(i * 31 + i / 256);
  }
  const double payload = static_cast<double>(c.block - 2);
  std::size_t blocks = static_cast<std::size_t>(megabytes * 1e6 / payload) + 1;
  const std::size_t frames = c.block / (c.fd ? 63 : 7) + 3;  // request and flow control too
  double ours_s = 0.0;
  double bare_s = 0.0;
  const std::size_t slice = 65535 / c.block;
  blocks = (blocks + slice - 1) / slice * slice;
  const double bytes = static_cast<double>(blocks) * payload;
  if (alone) {
    mark("begin", c, bytes);
  }
  for (std::size_t done = 0; done < blocks; done += slice) {
    const std::clock_t start = std::clock();
    for (std::size_t i = 0; i < slice; ++i) {
      response[1] = static_cast<std::uint8_t>(done + i);
      if (const auto exchanged = exchange(*tester, *ins, response); !exchanged) {
        return tl::unexpected(exchanged.error());
      }
    }
    ours_s += seconds_since(start);
    const std::clock_t bare_start = std::clock();
    for (std::size_t i = 0; i < slice && !alone; ++i) {
      if (!bare.carry(frames)) {
        return fail(ErrorKind::device, "a bare frame was lost");
      }
    }
    bare_s += seconds_since(bare_start);
  }
  const std::uint64_t lost = tester->socket.lost_frames() + ins->socket.lost_frames();
  if (alone) {
    mark("end", c, bytes);
    return lost == 0;
  }
  const double times_real = bytes / ours_s / real_fd_bus_bytes_per_s;
  fmt::print(
      "{:<20} {:8.0f} kB/s {:6.1f} times the real FD bus; {:.0f} % of the bare system calls' {:.1f} times; {} "
      "lost\n",
      c.name, bytes / ours_s / 1e3, times_real, 100.0 * bare_s / ours_s, bytes / bare_s / real_fd_bus_bytes_per_s,
      lost);
  return lost == 0 && (!c.fd || times_real >= asked_for);
}

int run(const char* interface, double megabytes, bool alone) {
  bool good = true;
  for (const Case& c : {Case{"classic, block 4095", false, 4095}, Case{"FD, block 4095", true, 4095},
                        Case{"FD, block 65535", true, 65535}}) {
    const auto result = measure(interface, c, megabytes, alone);
    if (!result) {
      fmt::print(stderr, "{}: {}\n", c.name, result.error().message);
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
    fmt::print(stderr, "usage: socket_bench INTERFACE [MEGABYTES] [alone]\n");
    return 2;
  }
  return selfcal::run(argv[1], argc > 2 ? std::atof(argv[2]) : 16.46, argc > 3 && std::string_view(argv[3]) == "alone");
}
