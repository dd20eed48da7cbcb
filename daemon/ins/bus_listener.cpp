#include "daemon/ins/bus_listener.hpp"

#include <fmt/format.h>

#include "protocol/can/frame.hpp"

namespace selfcal {
namespace {

constexpr int batches_at_once = 64;  // a full bus is not listened to for longer

}  // namespace

void count(const can::CanFrame& frame, const InsConfig& config, Heard& heard) {
  const bool ours = frame.extended == config.extended_ids;
  if (ours && (frame.id == config.request_id || frame.id == config.functional_id)) {
    return;  // the daemon's own, or another tester's
  }
  if (ours && frame.id == config.response_id) {
    ++(frame.fd && !config.fd ? heard.answers_fd : heard.answers);
  } else if (ours && config.status_id && (frame.id == *config.status_id || frame.id == *config.status_id + 1)) {
    ++heard.status;
  } else {
    ++heard.others;
  }
}

std::string why_silent(const Heard& heard, const InsConfig& config) {
  if (heard.answers_fd > 0) {
    return fmt::format("the INS answers ({:#x}) as CAN FD, and fd = false is configured", config.response_id);
  }
  if (heard.answers > 0) {
    return fmt::format("frames with response_id {:#x} come, and none is the answer", config.response_id);
  }
  if (heard.status > 0) {
    return fmt::format(
        "the INS is alive, its status frames {:#x} come; it does not answer {:#x}: check request_id and "
        "response_id ({:#x}){}",
        config.status_id.value_or(0), config.request_id, config.response_id,
        config.fd ? ", and whether it takes CAN FD: fd = true is configured" : "");
  }
  if (heard.others > 0) {
    return fmt::format(
        "{} frames of others are on the bus, none of the INS ({:#x}, {:#x}): is it switched on, are its "
        "identifiers those configured?",
        heard.others, config.response_id, config.status_id.value_or(config.response_id));
  }
  return "no frame at all is on the bus: is the INS switched on and connected, is the bit rate the same?";
}

BusListener::BusListener(const InsConfig& config) : config_(config) {
  can::SocketOptions options;
  options.interface = config.interface;
  options.error_frames = false;
  for (const bool fd : {true, false}) {  // an interface of MTU 16 passes classic frames only
    options.fd = fd;
    if (auto socket = can::Socket::open(options)) {
      socket_ = std::move(*socket);
      return;
    }
  }
}

std::string BusListener::why_silent() {
  if (!socket_) {
    return {};
  }
  for (int batch = 0; batch < batches_at_once; ++batch) {
    const auto frames = socket_->receive();
    if (!frames || frames->empty()) {
      break;
    }
    for (const can::ReceivedFrame& received : *frames) {
      count(received.frame, config_, heard_);
    }
  }
  return selfcal::why_silent(heard_, config_);
}

}  // namespace selfcal
