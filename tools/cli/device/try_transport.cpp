// ISO 15765-2: frames, sequence numbers, flow control, time-outs.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "protocol/uds/messages.hpp"
#include "tools/cli/device/record_access.hpp"

namespace selfcal::cli::device {
namespace {

constexpr double silence_s = 0.25;
// N_Bs and N_Cr are 1 s; after this long the INS has given up.
constexpr double given_up_s = 1.6;
// No service has this number (ISO 14229-1, table 2: reserved), so that a message of any length may begin with it.
constexpr std::uint8_t no_service = 0xA5;

Bytes long_request() {
  Bytes request(24, 0x11);
  request[0] = no_service;
  return request;
}

// The INS is asked afterwards whether it still listens: what was sent must not have left it waiting.
std::string then_present(Conformance& c) {
  const Exchange exchange = c.tester().ask(uds::tester_present_request(false));
  return exchange.kind == Exchange::Kind::positive ? "" : fmt::format("; then to 3E 00: {}", words(exchange));
}

void ignored(Conformance& c, const Requirement& requirement, ByteView frame) {
  if (!c.ready(requirement)) {
    return;
  }
  c.tester().put(frame);
  const auto came = c.tester().next(silence_s);
  const std::string after = then_present(c);
  c.judged(requirement, "frame " + hex(frame), "nothing", (came ? "frame " + hex(came->data) : "nothing") + after,
           !came && after.empty());
}

void try_frames(Conformance& c) {
  constexpr Requirement padding{"isotp.padding", "ISO 15765-2, 10.4", "The value of padding bytes means nothing."};
  if (c.ready(padding)) {
    std::string failed;
    for (const std::uint8_t fill : std::array<std::uint8_t, 5>{0x00, 0x55, 0xAA, 0xCC, 0xFF}) {
      const std::array<std::uint8_t, 3> frame{2, uds::service::tester_present, 0};
      c.tester().put(frame, fill);
      const Exchange exchange = c.tester().receive(frame[1], c.tester().p2_s());
      if (exchange.kind != Exchange::Kind::positive) {
        failed += fmt::format("{}filled with {:02X}: {}", failed.empty() ? "" : "; ", fill, words(exchange));
      }
    }
    c.judged(padding, "3E 00 filled with 00, 55, AA, CC, FF", "7E 00", failed.empty() ? "7E 00" : failed,
             failed.empty());
  }
  ignored(c, {"isotp.single_length", "ISO 15765-2, 9.6.2", "A single frame of length 0 is ignored."},
          std::array<std::uint8_t, 2>{0x00, 0x3E});
  ignored(
      c,
      {"isotp.first_length", "ISO 15765-2, 9.6.3", "A first frame of a message that a single frame holds is ignored."},
      std::array<std::uint8_t, 8>{0x10, 0x05, 0x3E, 0, 0, 0, 0, 0});
  ignored(c, {"isotp.stray_consecutive", "ISO 15765-2, 9.8.3", "A consecutive frame without a first one is ignored."},
          std::array<std::uint8_t, 8>{0x21, 0x3E, 0, 0, 0, 0, 0, 0});
  ignored(c, {"isotp.stray_flow", "ISO 15765-2, 9.8.3", "Flow control that nobody waits for is ignored."},
          std::array<std::uint8_t, 3>{0x30, 0, 0});
}

// Where frames have an address byte: one that begins with another is somebody else's.
void try_address(Conformance& c) {
  const auto& byte = c.profile().bus.request_byte;
  constexpr Requirement other{"isotp.address", "ISO 15765-2, 10.3", "A frame with another address byte is ignored."};
  if (!byte || !c.ready(other)) {
    return;
  }
  const std::array<std::uint8_t, 3> present{2, uds::service::tester_present, 0};
  const auto wrong = static_cast<std::uint8_t>(*byte ^ 0x41U);
  c.tester().put_addressed(wrong, present);
  const auto came = c.tester().next(silence_s);
  const std::string after = then_present(c);
  c.judged(other, fmt::format("3E 00 behind address {:02X}", wrong), "nothing",
           (came ? "frame " + hex(came->data) : "nothing") + after, !came && after.empty());
}

void try_long_requests(Conformance& c) {
  const Bytes request = long_request();
  const std::string told = fmt::format("a request of {} bytes, service {:02X}", request.size(), no_service);
  constexpr Requirement whole{"isotp.request", "ISO 15765-2, 9.6.5", "A request of several frames is taken."};
  if (c.ready(whole)) {
    const Exchange exchange = c.tester().ask(request);
    c.judged(whole, told, "flow control, then an answer", words(exchange), exchange.kind == Exchange::Kind::negative);
  }
  constexpr Requirement sequence{"isotp.wrong_sequence", "ISO 15765-2, 9.6.4",
                                 "A request with a frame out of sequence is dropped."};
  if (c.ready(sequence)) {
    const auto flow = c.tester().put_first(request);
    c.tester().put_rest(request, flow.value_or(isotp::FlowControl{}), 2);
    const Exchange exchange = c.tester().receive(no_service, silence_s);
    const std::string after = then_present(c);
    c.judged(sequence, told + ", the second consecutive frame numbered as the third", "nothing",
             words(exchange) + after, exchange.kind == Exchange::Kind::silent && after.empty());
  }
  constexpr Requirement abandoned{"isotp.n_cr", "ISO 15765-2, 9.8, N_Cr",
                                  "A request whose frames stay away for more than 1 s is dropped."};
  if (c.ready(abandoned)) {
    const auto flow = c.tester().put_first(request);
    c.tester().quiet(given_up_s);
    c.tester().put_rest(request, flow.value_or(isotp::FlowControl{}));
    const Exchange exchange = c.tester().receive(no_service, silence_s);
    const std::string after = then_present(c);
    c.judged(abandoned, fmt::format("{}, {:g} s after its first frame the rest", told, given_up_s), "nothing",
             words(exchange) + after, exchange.kind == Exchange::Kind::silent && after.empty());
  }
  constexpr Requirement displaced{"isotp.new_request", "ISO 15765-2, 9.8.3",
                                  "A new request takes the place of one that is being received."};
  if (c.ready(displaced)) {
    c.tester().put_first(request);
    const Exchange exchange = c.tester().ask(uds::tester_present_request(false));
    c.judged(displaced, "the first frame of a long request, then 3E 00", "7E 00", words(exchange),
             exchange.kind == Exchange::Kind::positive);
  }
}

// A record that takes several frames to tell, read only.
std::optional<Bytes> long_read(Conformance& c) {
  const profile::Profile& p = c.profile();
  for (const auto& did : {p.set_in_force, p.sample_format.did, profile::told_directory(p), p.site.did, p.state.did,
                          std::optional(p.serial)}) {
    const Bytes request = did ? read_request_of(p, *did) : Bytes{};
    const Exchange told = did ? c.tester().ask(request) : Exchange{};
    if (told.kind == Exchange::Kind::broken || told.response.size() > 2 * can::max_classic_bytes) {
      return request;
    }
  }
  return std::nullopt;
}

void try_flow_control(Conformance& c, ByteView request) {
  constexpr std::uint8_t separation_ms = 20;
  constexpr double clock_s = 0.005;  // of time stamps, over the whole message
  const auto whole = [](const Exchange& e) { return e.kind == Exchange::Kind::positive; };
  const auto come = [&](const Requirement& r, const Receiving& receiving, const std::string& sent,
                        const std::string& expected, const auto& holds, const auto& told) {
    if (c.ready(r)) {
      const Exchange exchange = c.tester().ask(request, receiving);
      c.judged(r, hex(request) + ", then " + sent, expected, told(exchange), holds(exchange));
    }
  };
  come({"isotp.sequence", "ISO 15765-2, 9.6.4", "Consecutive frames are numbered 1 to 15, 0, 1 and so on."}, {},
       "flow control 30 00 00", "the whole record", whole, [](const Exchange& e) { return words(e); });
  come(
      {"isotp.block_size", "ISO 15765-2, 9.6.5", "After as many consecutive frames as the block size the INS waits."},
      {.block_size = 2}, "flow control with block size 2", "2 frames, and after flow control the rest",
      [&](const Exchange& e) { return whole(e) && e.before_next_flow <= 2; },
      [](const Exchange& e) {
        return fmt::format("{} frames before the next flow control; {}", e.before_next_flow, words(e));
      });
  const auto mean_gap_s = [](const Exchange& e) {
    return e.consecutive.size() < 2
               ? 0.0
               : std::chrono::duration<double>(e.consecutive.back() - e.consecutive.front()).count() /
                     static_cast<double>(e.consecutive.size() - 1);
  };
  come(
      {"isotp.separation", "ISO 15765-2, 9.6.5", "Between consecutive frames there is STmin at least."},
      {.st_min = separation_ms}, fmt::format("flow control with STmin {} ms", separation_ms),
      fmt::format("{} ms and more between frames", separation_ms),
      [&](const Exchange& e) {
        const auto gaps = static_cast<double>(std::max<std::size_t>(e.consecutive.size(), 2) - 1);
        return whole(e) && (e.consecutive.size() < 2 || mean_gap_s(e) >= separation_ms * 1e-3 - clock_s / gaps);
      },
      [&](const Exchange& e) { return fmt::format("{:.1f} ms on average; {}", 1e3 * mean_gap_s(e), words(e)); });
  come({"isotp.wait", "ISO 15765-2, 9.6.5", "Flow control that says WAIT is waited for."}, {.waits = 2},
       "flow control WAIT twice, 0.1 s each, then clear to send", "the whole record", whole,
       [](const Exchange& e) { return words(e); });
  const auto nothing_more = [](const Exchange& e) { return e.kind == Exchange::Kind::broken && e.consecutive.empty(); };
  come({"isotp.overflow", "ISO 15765-2, 9.6.5", "After flow control that says overflow nothing more comes."},
       {.overflow = true}, "flow control that says overflow", "no consecutive frame", nothing_more,
       [](const Exchange& e) { return words(e); });
  come(
      {"isotp.n_bs", "ISO 15765-2, 9.8, N_Bs", "A message whose flow control stays away for more than 1 s is dropped."},
      {.flow_after_s = given_up_s}, fmt::format("flow control after {:g} s", given_up_s), "no consecutive frame",
      nothing_more, [](const Exchange& e) { return words(e); });
}

}  // namespace

void try_transport(Conformance& c) {
  try_frames(c);
  try_address(c);
  try_long_requests(c);
  if (const auto request = long_read(c)) {
    try_flow_control(c, *request);
  } else {
    c.not_tried({"isotp.flow_control", "ISO 15765-2, 9.6.5", "A record of several frames follows flow control."},
                "no record of the profile was told in more than two frames");
  }
}

}  // namespace selfcal::cli::device
