#include "tools/cli/device/tester.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "protocol/uds/services.hpp"

namespace selfcal::cli::device {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

// Beyond P2, to tell an answer that is late from none.
constexpr double patience_s = 3.0;
// ISO 15765-2, 9.8: N_Cr and N_Bs are 1 s at most.
constexpr double transport_timeout_s = 1.0;
constexpr double wait_pause_s = 0.1;
// Response-pending altogether, as the service's client has it.
constexpr double pending_limit_s = 60.0;
constexpr std::size_t bytes_told = 16;

double since(Clock::time_point begin) { return Seconds(Clock::now() - begin).count(); }
void pause(double seconds) { std::this_thread::sleep_for(Seconds(seconds)); }

}  // namespace

std::string hex(ByteView bytes) {
  const std::uint8_t service = bytes.empty() ? 0 : static_cast<std::uint8_t>(bytes[0] & ~uds::positive_offset);
  const bool secret = service == uds::service::security_access;
  const std::size_t told = std::min(bytes.size(), secret ? std::size_t{2} : bytes_told);
  std::string text = fmt::format("{:02X}", fmt::join(bytes.first(told), " "));
  if (told < bytes.size()) {
    text += fmt::format(" ... ({} bytes)", bytes.size());
  }
  return text;
}

Expected<Tester> Tester::open(const std::string& interface, const profile::Profile& profile) {
  const profile::Bus& bus = profile.bus;
  can::SocketOptions options;
  options.interface = interface;
  options.fd = bus.fd;
  options.kernel_time = true;
  const std::uint32_t whole = bus.extended_ids ? 0x1FFFFFFF : 0x7FF;
  options.filters.push_back({bus.response, whole, bus.extended_ids});
  options.filters.push_back({bus.request, whole, bus.extended_ids});  // of others: our own do not come back
  if (bus.status) {
    options.filters.push_back({*bus.status, whole, bus.extended_ids});
    options.filters.push_back({*bus.status + 1, whole, bus.extended_ids});
  }
  auto socket = can::Socket::open(options);
  if (!socket) {
    return tl::unexpected(socket.error());
  }
  return Tester(std::move(*socket), profile);
}

Tester::Tester(can::Socket socket, const profile::Profile& profile)
    : socket_(std::move(socket)),
      bus_(profile.bus),
      p2_s_(profile.timing.request_timeout_s),
      p2_star_s_(profile.timing.p2_star_s) {}

void Tester::take_timings(double p2_s, double p2_star_s) {
  p2_s_ = std::max(p2_s_, p2_s);
  p2_star_s_ = std::max(p2_star_s_, p2_star_s);
}

// Waits where the kernel's queue is full, as long as a frame may wait for the bus.
bool Tester::send(const can::CanFrame& frame) {
  const auto begin = Clock::now();
  while (!trouble_) {
    const auto taken = socket_.send({&frame, 1});
    if (!taken) {
      trouble_ = taken.error();
    } else if (*taken == 1) {
      return true;
    } else if (since(begin) > transport_timeout_s) {
      trouble_ = Error{ErrorKind::device, fmt::format("{}: the bus takes no frame", interface())};
    } else {
      pause(0.001);
    }
  }
  return false;
}

void Tester::put_frame(std::uint32_t id, std::optional<std::uint8_t> address, ByteView data, std::uint8_t fill) {
  can::CanFrame frame;
  frame.id = id;
  frame.extended = bus_.extended_ids;
  frame.fd = frame.bit_rate_switch = bus_.fd;
  frame.data.fill(fill);
  const std::size_t begin = address ? 1 : 0;
  const std::size_t held = std::min(data.size(), frame_bytes());
  frame.size = static_cast<std::uint8_t>(can::frame_size_for(std::max(begin + held, can::max_classic_bytes)));
  frame.data[0] = address.value_or(fill);
  std::ranges::copy(data.first(held), frame.data.begin() + static_cast<std::ptrdiff_t>(begin));
  send(frame);
}

void Tester::put(ByteView data, std::optional<std::uint8_t> fill, bool to_all) {
  put_frame(to_all ? bus_.functional : bus_.request, to_all ? bus_.functional_byte : bus_.request_byte, data,
            fill.value_or(bus_.padding));
}

void Tester::put_addressed(std::uint8_t address, ByteView data) {
  put_frame(bus_.request, address, data, bus_.padding);
}

bool Tester::is_of(const can::CanFrame& frame, std::uint32_t id, std::optional<std::uint8_t> address) const {
  return frame.id == id && (!address || (frame.size > 0 && frame.data[0] == *address));
}

// Takes what the socket has, waiting for it.
bool Tester::fill(double within_s) {
  pollfd descriptor{socket_.fd(), POLLIN, 0};
  if (trouble_ || ::poll(&descriptor, 1, std::max(0, static_cast<int>(within_s * 1e3 + 0.999))) <= 0) {
    return false;
  }
  const auto received = socket_.receive();
  if (!received) {
    trouble_ = received.error();
    return false;
  }
  for (const can::ReceivedFrame& one : *received) {
    if (one.event) {
      continue;
    }
    if (is_of(one.frame, bus_.request, bus_.request_byte)) {
      trouble_ = Error{ErrorKind::device,
                       fmt::format("{}: somebody else speaks to the INS (frame 0x{:X}): end the service, or the other "
                                   "tester, first",
                                   interface(), one.frame.id)};
      return false;
    }
    if (!is_of(one.frame, bus_.response, bus_.response_byte)) {
      others_.push_back(one.frame);
      continue;
    }
    ++frames_;
    const auto payload = one.frame.payload().subspan(address_bytes());
    Frame frame{Bytes(payload.begin(), payload.end()), one.kernel_time};
    if (!decode(frame.data)) {
      bad_frames_.push_back(frame.data);
    }
    waiting_.push_back(std::move(frame));
  }
  return true;
}

std::optional<Frame> Tester::next(double within_s) {
  const auto begin = Clock::now();
  while (waiting_.empty()) {
    const double left = within_s - since(begin);
    if (left <= 0.0 || trouble_) {
      return std::nullopt;
    }
    fill(left);
  }
  Frame frame = std::move(waiting_.front());
  waiting_.pop_front();
  return frame;
}

std::optional<can::CanFrame> Tester::other(std::uint32_t id, double within_s) {
  const auto begin = Clock::now();
  others_.clear();
  while (since(begin) < within_s && !trouble_) {
    const auto found = std::ranges::find(others_, id, &can::CanFrame::id);
    if (found != others_.end()) {
      return *found;
    }
    fill(within_s - since(begin));
  }
  return std::nullopt;
}

bool Tester::quiet(double seconds) {
  bool nothing = true;
  const auto begin = Clock::now();
  while (since(begin) < seconds && !trouble_) {
    nothing = !next(seconds - since(begin)) && nothing;
  }
  return nothing;
}

void Tester::put_single(ByteView request, bool to_all) {
  std::array<std::uint8_t, can::max_fd_bytes> data{};
  const bool classic = request.size() <= isotp::max_single_payload(classic_bytes());
  const auto room = std::span(data).first(classic ? classic_bytes() : frame_bytes());
  put(room.first(isotp::encode_single(request, room, address_bytes())), std::nullopt, to_all);
}

std::optional<isotp::FlowControl> Tester::put_first(ByteView request) {
  std::array<std::uint8_t, can::max_fd_bytes> data{};
  const auto frame = std::span(data).first(frame_bytes());
  isotp::encode_first(static_cast<std::uint32_t>(request.size()), request, frame);
  put(frame);
  while (const auto answer = next(transport_timeout_s)) {
    const auto pdu = decode(answer->data);
    if (pdu && std::holds_alternative<isotp::FlowControl>(*pdu)) {
      return std::get<isotp::FlowControl>(*pdu);
    }
  }
  return std::nullopt;
}

void Tester::put_rest(ByteView request, const isotp::FlowControl& first_flow, std::optional<std::size_t> wrong) {
  isotp::FlowControl flow = first_flow;
  std::size_t at = isotp::first_frame_payload(static_cast<std::uint32_t>(request.size()), frame_bytes());
  std::size_t in_block = 0;
  for (std::size_t number = 1; at < request.size(); ++number) {
    if (flow.block_size != 0 && in_block == flow.block_size) {
      const auto answer = next(transport_timeout_s);
      const auto pdu = answer ? decode(answer->data) : tl::unexpected(isotp::CodecError::empty);
      if (!pdu || !std::holds_alternative<isotp::FlowControl>(*pdu)) {
        return;
      }
      flow = std::get<isotp::FlowControl>(*pdu);
      in_block = 0;
    }
    std::array<std::uint8_t, can::max_fd_bytes> data{};
    const std::size_t part = std::min(frame_bytes() - 1, request.size() - at);
    const auto sequence = static_cast<std::uint8_t>((number + (number == wrong ? 1 : 0)) % 16);
    const auto frame = std::span(data).first(frame_bytes());
    put(frame.first(isotp::encode_consecutive(sequence, request.subspan(at, part), frame)));
    pause(Seconds(isotp::separation_time(flow.st_min)).count());
    at += part;
    ++in_block;
  }
}

// The consecutive frames of a message whose first frame came.
Exchange Tester::collect(const isotp::FirstFrame& first, const Receiving& receiving) {
  Exchange exchange;
  exchange.response.assign(first.payload.begin(), first.payload.end());
  const std::uint32_t length = first.length;
  const auto flow = [&](isotp::FlowStatus status) {
    std::array<std::uint8_t, 3> data{};
    isotp::encode_flow_control({status, receiving.block_size, receiving.st_min}, data);
    put(data);
  };
  pause(receiving.flow_after_s);
  for (int k = 0; k < receiving.waits; ++k) {
    flow(isotp::FlowStatus::wait);
    pause(wait_pause_s);
  }
  flow(receiving.overflow ? isotp::FlowStatus::overflow : isotp::FlowStatus::clear_to_send);
  unsigned sequence = 1;
  std::size_t in_block = 0;
  while (exchange.response.size() < length) {
    if (receiving.block_size != 0 && in_block == receiving.block_size) {
      if (exchange.before_next_flow == 0) {  // the first time it is seen whether the INS waits
        fill(wait_pause_s);
        exchange.before_next_flow = in_block + waiting_.size();
      }
      flow(isotp::FlowStatus::clear_to_send);
      in_block = 0;
    }
    const auto frame = next(transport_timeout_s);
    const auto pdu = frame ? decode(frame->data) : tl::unexpected(isotp::CodecError::empty);
    const auto* part = pdu ? std::get_if<isotp::ConsecutiveFrame>(&*pdu) : nullptr;
    if (part == nullptr || part->sequence != sequence % 16) {
      exchange.kind = Exchange::Kind::broken;
      exchange.why = !frame ? fmt::format("{} of {} bytes, then nothing", exchange.response.size(), length)
                     : part == nullptr
                         ? fmt::format("frame {} amid a message", hex(frame->data))
                         : fmt::format("consecutive frame {}, {} expected", part->sequence, sequence % 16);
      return exchange;
    }
    exchange.consecutive.push_back(frame->time);
    const std::size_t more = std::min<std::size_t>(part->payload.size(), length - exchange.response.size());
    exchange.response.insert(exchange.response.end(), part->payload.begin(),
                             part->payload.begin() + static_cast<std::ptrdiff_t>(more));
    ++sequence;
    ++in_block;
  }
  return exchange;
}

void Tester::judge(Exchange& exchange, std::uint8_t service) const {
  const Bytes& r = exchange.response;
  if (r[0] == service + uds::positive_offset) {
    exchange.kind = Exchange::Kind::positive;
  } else if (r.size() == 3 && r[0] == uds::service::negative_response && r[1] == service) {
    exchange.kind = Exchange::Kind::negative;
    exchange.nrc = r[2];
  } else {
    exchange.kind = Exchange::Kind::broken;
    exchange.why = fmt::format("{}, which answers something else", hex(r));
  }
}

Exchange Tester::receive(std::uint8_t service, double within_s, const Receiving& receiving) {
  const auto begin = Clock::now();
  while (const auto frame = next(within_s - since(begin))) {
    const double waited_s = since(begin);
    const auto pdu = decode(frame->data);
    if (!pdu) {
      continue;  // noted among the bad frames
    }
    Exchange exchange;
    if (const auto* single = std::get_if<isotp::SingleFrame>(&*pdu)) {
      exchange.response.assign(single->payload.begin(), single->payload.end());
    } else if (const auto* first = std::get_if<isotp::FirstFrame>(&*pdu)) {
      exchange = collect(*first, receiving);
    } else {
      continue;
    }
    if (exchange.kind != Exchange::Kind::broken) {
      judge(exchange, service);
    }
    exchange.waited_s = waited_s;
    return exchange;
  }
  return {};
}

Exchange Tester::ask(ByteView request, const Receiving& receiving) {
  while (fill(0.0)) {  // what came late for an earlier request
  }
  waiting_.clear();
  if (request.size() <= isotp::max_single_payload(frame_bytes())) {
    put_single(request);
  } else {
    const auto flow = put_first(request);
    if (!flow || flow->status != isotp::FlowStatus::clear_to_send) {
      Exchange exchange;
      exchange.kind = trouble_ ? Exchange::Kind::silent : Exchange::Kind::broken;
      exchange.why = flow ? "flow control that does not let go on" : "no flow control";
      return exchange;
    }
    put_rest(request, *flow);
  }
  double limit_s = p2_s_;
  bool pending = false;
  const auto begin = Clock::now();
  while (true) {
    Exchange exchange = receive(request[0], limit_s + patience_s, receiving);
    exchange.pending = pending;
    if (exchange.kind != Exchange::Kind::silent && exchange.waited_s > limit_s) {
      late_.push_back({Bytes(request.begin(), request.end()), exchange.waited_s, limit_s});
    }
    if (exchange.kind != Exchange::Kind::negative ||
        exchange.nrc != static_cast<std::uint8_t>(uds::Nrc::response_pending) || since(begin) > pending_limit_s) {
      return exchange;
    }
    pending = true;
    limit_s = p2_star_s_;
  }
}

}  // namespace selfcal::cli::device
