// Our UDS client on a CAN interface, driven by requests in hexadecimal digits, for tests against servers of others:
//   uds_tester INTERFACE PATIENCE REQUEST...
// One line for each request: the response in hexadecimal digits, "negative conditionsNotCorrect (0x22)", or what
// happened instead. PATIENCE stretches every time-out of ISO-TP and UDS: interpreters and user-mode Linux are slow.
#include <fmt/format.h>
#include <poll.h>

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "protocol/can/socket.hpp"
#include "protocol/uds/client.hpp"
#include "tests/own_ins/identifiers.hpp"

namespace selfcal {
namespace {

Time now() { return std::chrono::steady_clock::now().time_since_epoch(); }

Time stretched(Time time, double factor) { return std::chrono::duration_cast<Time>(time * factor); }

std::vector<std::uint8_t> bytes_of(std::string_view digits) {
  std::vector<std::uint8_t> bytes(digits.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char* at = digits.data() + 2 * i;
    if (std::from_chars(at, at + 2, bytes[i], 16).ptr != at + 2) {
      return {};
    }
  }
  return digits.size() % 2 == 0 ? bytes : std::vector<std::uint8_t>{};
}

std::string text_of(const uds::Outcome& outcome) {
  switch (outcome.kind) {
    case uds::Outcome::Kind::positive: {
      std::string digits;
      for (const std::uint8_t byte : outcome.response) {
        digits += fmt::format("{:02x}", byte);
      }
      return digits;
    }
    case uds::Outcome::Kind::negative: return "negative " + uds::describe_nrc(outcome.nrc);
    case uds::Outcome::Kind::timeout: return "no answer in time";
    case uds::Outcome::Kind::transport: return fmt::format("transport: {}", isotp::name(outcome.why));
    case uds::Outcome::Kind::too_long: return fmt::format("an answer of {} bytes is announced", outcome.announced);
    case uds::Outcome::Kind::malformed: return "malformed answer";
  }
  return "unknown";
}

Expected<std::string> exchange(can::Socket& socket, uds::Client& client, std::span<const std::uint8_t> request) {
  if (!client.request(request, now())) {
    return fail(ErrorKind::usage, fmt::format("a request of {} bytes cannot be sent", request.size()));
  }
  std::vector<can::CanFrame> out(64);
  while (true) {
    const auto frames = socket.receive();
    if (!frames) {
      return tl::unexpected(frames.error());
    }
    for (const can::ReceivedFrame& received : *frames) {
      if (const auto outcome = client.on_frame(received.frame, now())) {
        return text_of(*outcome);
      }
    }
    if (const auto outcome = client.on_time(now())) {
      return text_of(*outcome);
    }
    const Time t = now();
    const auto taken = socket.send(std::span(out).first(client.pending(out, t)));
    if (!taken) {
      return tl::unexpected(taken.error());
    }
    if (const auto outcome = client.sent(*taken, t)) {
      return text_of(*outcome);
    }
    pollfd waiting{socket.fd(), POLLIN, 0};
    ::poll(&waiting, 1, 1);
  }
}

Expected<void> run(const char* interface, double patience, std::span<char*> requests) {
  isotp::Options options;
  options.address = {ins::can_id::request, ins::can_id::response, std::nullopt, false};
  for (Time* time : {&options.n_as, &options.n_bs, &options.n_cr}) {
    *time = stretched(*time, patience);
  }
  uds::ClientTimings timings;
  timings.p2 = stretched(timings.p2, patience);
  timings.p2_star = stretched(timings.p2_star, patience);
  uds::Client client(options, timings);
  can::SocketOptions socket_options;
  socket_options.interface = interface;
  socket_options.filters = {{ins::can_id::response, 0x7FF, false}};
  auto socket = can::Socket::open(socket_options);
  if (!socket) {
    return tl::unexpected(socket.error());
  }
  for (const char* digits : requests) {
    const auto request = bytes_of(digits);
    if (request.empty()) {
      return fail(ErrorKind::usage, fmt::format("request '{}': hexadecimal digits expected", digits));
    }
    const auto line = exchange(*socket, client, request);
    if (!line) {
      return tl::unexpected(line.error());
    }
    fmt::print("{}\n", *line);
  }
  return {};
}

}  // namespace
}  // namespace selfcal

int main(int argc, char** argv) {
  const double patience = argc > 2 ? std::atof(argv[2]) : 0.0;
  if (argc < 4 || patience <= 0.0) {
    fmt::print(stderr, "usage: uds_tester INTERFACE PATIENCE REQUEST...\n");
    return 2;
  }
  const auto done = selfcal::run(argv[1], patience, std::span(argv + 3, static_cast<std::size_t>(argc - 3)));
  if (!done) {
    fmt::print(stderr, "uds_tester: {}\n", done.error().message);
    return static_cast<int>(done.error().kind);
  }
  return 0;
}
