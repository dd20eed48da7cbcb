#include "daemon/ins/request_tally.hpp"

#include <fmt/format.h>

#include "protocol/byte_order.hpp"
#include "protocol/profile/names.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {
namespace {

std::string_view action_name(std::uint8_t action) {
  switch (static_cast<uds::RoutineAction>(action)) {
    case uds::RoutineAction::start: return "start";
    case uds::RoutineAction::stop: return "stop";
    default: return "result";
  }
}

}  // namespace

std::string request_name(const profile::Profile& profile, std::span<const std::uint8_t> request) {
  std::string service(uds::service_name(request.front()));
  ByteReader in(request.subspan(1));
  switch (request.front()) {
    case uds::service::read_data:
    case uds::service::write_data: {
      const auto did = in.get<std::uint16_t>();
      if (profile.memory.find(did) != nullptr) {
        service = uds::service_name(request.front() == uds::service::read_data ? uds::service::read_memory
                                                                               : uds::service::write_memory);
      }
      return fmt::format("{} {}", service, profile::did_name(profile, did));
    }
    case uds::service::routine_control: {
      const auto action = in.get<std::uint8_t>();
      return fmt::format("{} {} {}", service, action_name(action),
                         profile::routine_name(profile, in.get<std::uint16_t>()));
    }
    default: return service;
  }
}

void RequestTally::asked(std::span<const std::uint8_t> request) {
  last_ = request_name(*profile_, request);
  ++requests_[last_].asked;
}

void RequestTally::failed(std::span<const std::uint8_t> request, const std::string& why) {
  Entry& entry = requests_[request_name(*profile_, request)];
  ++entry.failed;
  entry.why = why;
}

void RequestTally::forget() {
  requests_.clear();
  last_.clear();
}

std::string RequestTally::words() const {
  auto worst = requests_.find(last_);
  if (worst == requests_.end()) {
    return {};
  }
  for (auto entry = requests_.begin(); entry != requests_.end(); ++entry) {
    if (entry->second.failed > worst->second.failed) {
      worst = entry;
    }
  }
  const auto& [name, entry] = *worst;
  std::string text =
      fmt::format("{}, asked {}", name, entry.asked == 1 ? "once" : fmt::format("{} times", entry.asked));
  return entry.why.empty() ? text : fmt::format("{} ({})", text, entry.why);
}

}  // namespace selfcal
