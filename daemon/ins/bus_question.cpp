#include "daemon/ins/bus_question.hpp"

#include <fmt/format.h>

#include "protocol/can/link.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal {
namespace {

constexpr std::size_t longest_answer = 128;

}  // namespace

BusQuestion::BusQuestion(EventLoop& loop, const InsConfig& config, std::function<void(const std::string&)> done)
    : config_(config), listener_(config), port_(open_port(loop, config)) {
  port_->request(uds::read_request(config_.profile->serial), longest_answer,
                 [this, done = std::move(done)](const Answer<Bytes>& answer) { done(words_of(answer)); });
}

std::string BusQuestion::words_of(const Answer<Bytes>& answer) {
  const can::Link link = can::link_of(config_.interface);
  if (link != can::Link::up) {
    return can::link_text(config_.interface, link);
  }
  const std::string up = can::link_text(config_.interface, link);
  if (answer || answer.error().kind == PortError::Kind::negative) {
    return up + ", the INS answers";
  }
  if (answer.error().kind == PortError::Kind::protocol) {
    return fmt::format("{}, the INS's answer makes no sense ({})", up, answer.error().message);
  }
  if (config_.profile->frames) {
    return fmt::format("{}, the INS is silent: {}", up, answer.error().message);
  }
  const std::string why = listener_.why_silent();
  return fmt::format("{}, no answer to {:#x}: {}", up, config_.request_id, why.empty() ? answer.error().message : why);
}

}  // namespace selfcal
