// A nonblocking CAN_RAW socket: many frames per system call, filters, kernel time stamps, error frames, lost frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/can/bus_event.hpp"
#include "protocol/can/frame.hpp"
#include "protocol/error.hpp"
#include "protocol/time.hpp"

namespace selfcal::can {

struct Filter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0x1FFFFFFF;  // a frame passes where (id & mask) agree
  bool extended = false;            // only frames of this format pass
};

struct SocketOptions {
  std::string interface;        // "can0"
  std::vector<Filter> filters;  // empty: everything
  bool fd = true;               // FD frames can be sent and received (needs MTU 72)
  bool error_frames = true;
  int receive_buffer_bytes = 4 << 20;  // asked for; the kernel grants up to net.core.rmem_max without privilege
  std::size_t batch = 256;             // frames per system call
  bool kernel_time = false;            // ReceivedFrame::kernel_time is wanted; costs a control message per frame
};

struct ReceivedFrame {
  CanFrame frame;
  Time kernel_time{0};            // since 1970, when the kernel got it; zero unless asked for
  std::optional<BusEvent> event;  // an error frame: frame then holds its raw identifier and data
};

class Socket {
 public:
  [[nodiscard]] static Expected<Socket> open(const SocketOptions& options);
  Socket(Socket&&) noexcept;
  Socket& operator=(Socket&&) noexcept;
  ~Socket();

  int fd() const;  // for poll(2); readable when receive() has something

  // Up to one batch; empty when there is nothing. Valid until the next call. Fails (device) when the interface is down
  // or gone.
  [[nodiscard]] Expected<std::span<const ReceivedFrame>> receive();

  // How many of the frames, from the first, the kernel took; fewer than all means its queue is full: try again
  // on POLLOUT or after a millisecond (ENOBUFS has no event).
  [[nodiscard]] Expected<std::size_t> send(std::span<const CanFrame> frames);

  std::uint64_t lost_frames() const;   // by receive overrun since open (SO_RXQ_OVFL)
  int receive_buffer_granted() const;  // bytes, as the kernel accounts them
  const std::string& interface() const;

 private:
  struct Impl;
  explicit Socket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace selfcal::can
