#include "protocol/can/socket.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "protocol/can/raw_frame.hpp"

#ifndef SO_RXQ_OVFL
#error "needs SO_RXQ_OVFL (Linux 2.6.33)"
#endif

namespace selfcal::can {
namespace {

// Room for the two control messages: time stamp and overrun count.
constexpr std::size_t control_bytes = CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t));

}  // namespace

struct Socket::Impl {
  int fd = -1;
  std::string interface;
  std::uint64_t lost = 0;
  std::uint32_t overrun_count = 0;  // the kernel's, 32 bits
  std::vector<canfd_frame> raw;
  std::vector<iovec> vectors;
  std::vector<mmsghdr> headers;
  std::vector<std::array<char, control_bytes>> control;
  std::vector<canfd_frame> raw_out;
  std::vector<iovec> vectors_out;
  std::vector<mmsghdr> headers_out;
  std::vector<ReceivedFrame> received;

  explicit Impl(const SocketOptions& options)
      : interface(options.interface),
        raw(options.batch),
        vectors(options.batch),
        headers(options.batch),
        control(options.batch),
        raw_out(options.batch),
        vectors_out(options.batch),
        headers_out(options.batch),
        received(options.batch) {
    for (std::size_t i = 0; i < options.batch; ++i) {
      vectors[i] = {&raw[i], sizeof raw[i]};
      headers[i].msg_hdr.msg_iov = &vectors[i];
      headers[i].msg_hdr.msg_iovlen = 1;
      headers[i].msg_hdr.msg_control = control[i].data();
      headers[i].msg_hdr.msg_controllen = control_bytes;
      headers_out[i].msg_hdr.msg_iov = &vectors_out[i];
      headers_out[i].msg_hdr.msg_iovlen = 1;
    }
  }
  ~Impl() {
    if (fd >= 0) {
      ::close(fd);
    }
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  tl::unexpected<Error> failure(std::string_view what) const {
    return fail(ErrorKind::device, fmt::format("CAN interface {}: {}: {}", interface, what, std::strerror(errno)));
  }
  bool set(int level, int option, const void* value, socklen_t size) const {
    return ::setsockopt(fd, level, option, value, size) == 0;
  }
  Expected<void> configure(const SocketOptions& options);
  Expected<void> bind_to_interface(bool fd_needed);
  void take(std::size_t i);
};

Expected<void> Socket::Impl::configure(const SocketOptions& options) {
  const int on = 1;
  if (options.fd && !set(SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on)) {
    return failure("cannot enable FD frames");
  }
  std::vector<can_filter> filters;
  for (const Filter& filter : options.filters) {
    const canid_t format = filter.extended ? CAN_EFF_FLAG : 0U;
    filters.push_back({filter.id | format, filter.mask | CAN_EFF_FLAG | CAN_RTR_FLAG});
  }
  if (!filters.empty() &&
      !set(SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), static_cast<socklen_t>(filters.size() * sizeof(can_filter)))) {
    return failure("cannot set filters");
  }
  const can_err_mask_t errors = options.error_frames ? CAN_ERR_MASK : 0U;
  if (!set(SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors)) {
    return failure("cannot ask for error frames");
  }
  // SO_RCVBUFFORCE goes beyond net.core.rmem_max but needs CAP_NET_ADMIN; without it, as much as is granted.
  const int size = options.receive_buffer_bytes;
  if (!set(SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size) && !set(SOL_SOCKET, SO_RCVBUF, &size, sizeof size)) {
    return failure("cannot set the receive buffer");
  }
  if (!set(SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on)) {
    return failure("cannot ask for overruns");
  }
  if (options.kernel_time && !set(SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on)) {
    return failure("cannot ask for time stamps");
  }
  return {};
}

Expected<void> Socket::Impl::bind_to_interface(bool fd_needed) {
  if (interface.empty() || interface.size() >= IFNAMSIZ) {
    return fail(ErrorKind::device, fmt::format("CAN interface '{}': not an interface name", interface));
  }
  ifreq request{};
  std::ranges::copy(interface, request.ifr_name);
  if (::ioctl(fd, SIOCGIFINDEX, &request) < 0) {
    return failure("not found");
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = request.ifr_ifindex;
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0) {
    return failure("cannot bind");
  }
  if (::ioctl(fd, SIOCGIFFLAGS, &request) < 0) {
    return failure("cannot read its flags");
  }
  if ((request.ifr_flags & IFF_UP) == 0) {
    return fail(ErrorKind::device, fmt::format("CAN interface {}: is down", interface));
  }
  if (::ioctl(fd, SIOCGIFMTU, &request) < 0) {
    return failure("cannot read its MTU");
  }
  if (fd_needed && request.ifr_mtu < static_cast<int>(CANFD_MTU)) {
    return fail(ErrorKind::device, fmt::format("CAN interface {}: MTU {} does not pass FD frames (needs {})", interface,
                                               request.ifr_mtu, CANFD_MTU));
  }
  return {};
}

void Socket::Impl::take(std::size_t i) {
  ReceivedFrame& out = received[i];
  out.frame = from_kernel(raw[i], headers[i].msg_len);
  out.event.reset();
  if ((raw[i].can_id & CAN_ERR_FLAG) != 0) {
    out.event = decode_error_frame(raw[i].can_id & CAN_ERR_MASK, out.frame.payload());
  }
  msghdr& header = headers[i].msg_hdr;
  for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
    if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SCM_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
      out.kernel_time = std::chrono::seconds(stamp.tv_sec) + std::chrono::nanoseconds(stamp.tv_nsec);
    } else if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t count = 0;
      std::memcpy(&count, CMSG_DATA(c), sizeof count);
      lost += count - overrun_count;  // modulo 2^32: the counter may wrap
      overrun_count = count;
    }
  }
  header.msg_controllen = control_bytes;  // the kernel wrote what it used
}

Socket::Socket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Socket::Socket(Socket&&) noexcept = default;
Socket& Socket::operator=(Socket&&) noexcept = default;
Socket::~Socket() = default;

Expected<Socket> Socket::open(const SocketOptions& options) {
  auto impl = std::make_unique<Impl>(options);
  impl->fd = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (impl->fd < 0) {
    return impl->failure("no CAN sockets here");
  }
  if (const auto configured = impl->configure(options); !configured) {
    return tl::unexpected(configured.error());
  }
  if (const auto bound = impl->bind_to_interface(options.fd); !bound) {
    return tl::unexpected(bound.error());
  }
  return Socket(std::move(impl));
}

int Socket::fd() const { return impl_->fd; }
std::uint64_t Socket::lost_frames() const { return impl_->lost; }
const std::string& Socket::interface() const { return impl_->interface; }

Expected<std::span<const ReceivedFrame>> Socket::receive() {
  Impl& s = *impl_;
  const int count = ::recvmmsg(s.fd, s.headers.data(), static_cast<unsigned>(s.headers.size()), MSG_DONTWAIT, nullptr);
  if (count < 0) {
    if (errno == EAGAIN || errno == EINTR) {
      return std::span<const ReceivedFrame>{};
    }
    return s.failure("cannot receive");
  }
  const auto frames = static_cast<std::size_t>(count);
  for (std::size_t i = 0; i < frames; ++i) {
    s.take(i);
  }
  return std::span<const ReceivedFrame>(s.received.data(), frames);
}

int Socket::receive_buffer_granted() const {
  int size = 0;
  socklen_t length = sizeof size;
  ::getsockopt(impl_->fd, SOL_SOCKET, SO_RCVBUF, &size, &length);
  return size;
}

Expected<std::size_t> Socket::send(std::span<const CanFrame> frames) {
  Impl& s = *impl_;
  const std::size_t wanted = std::min(frames.size(), s.headers_out.size());
  for (std::size_t i = 0; i < wanted; ++i) {
    s.vectors_out[i] = {&s.raw_out[i], to_kernel(frames[i], s.raw_out[i])};
  }
  if (wanted == 0) {
    return std::size_t{0};
  }
  const int count = ::sendmmsg(s.fd, s.headers_out.data(), static_cast<unsigned>(wanted), MSG_DONTWAIT);
  if (count < 0) {
    if (errno == EAGAIN || errno == ENOBUFS || errno == EINTR) {
      return std::size_t{0};
    }
    return s.failure("cannot send");
  }
  return static_cast<std::size_t>(count);
}

}  // namespace selfcal::can
