#include "daemon/ins/memory_port.hpp"

#include <fmt/format.h>

#include "daemon/ins/pass_events.hpp"
#include "protocol/profile/names.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {

MemoryPort::MemoryPort(std::shared_ptr<InsPort> ins, profile::ProfilePtr profile)
    : ins_(std::move(ins)), profile_(std::move(profile)) {
  pass_events(*ins_, *this);
}

MemoryPort::~MemoryPort() {
  if (done_) {
    ins_->cancel();
  }
  ins_->on_bus_event = {};
  ins_->on_status = {};
}

void MemoryPort::request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
                         std::function<void(Answer<Bytes>)> done) {
  const bool of_record =
      payload.size() >= 3 && (payload[0] == uds::service::read_data || payload[0] == uds::service::write_data);
  const auto number = static_cast<std::uint16_t>(of_record ? payload[1] << 8U | payload[2] : 0);
  const profile::Region* region = profile_->memory.find(number);
  if (region == nullptr) {
    return ins_->request(payload, longest_answer, std::move(done));
  }
  done_ = std::move(done);
  writes_ = payload[0] == uds::service::write_data;
  number_ = number;
  region_ = *region;
  const auto record = payload.subspan(3);
  record_.assign(record.begin(), record.end());
  const profile::RecordMemory& memory = profile_->memory;
  parts_ = profile::parts_of(region_, writes_ ? memory.longest_write : memory.longest_read);
  part_ = 0;
  ask_for_part();
}

void MemoryPort::ask_for_part() {
  const profile::RecordMemory& memory = profile_->memory;
  const profile::RegionPart& part = parts_[part_];
  const Bytes payload = writes_ ? memory.write_request(part, record_, region_) : memory.read_request(part);
  const std::size_t longest = writes_ ? 2 + memory.address_bytes + memory.size_bytes : 1 + std::size_t{part.bytes};
  ins_->request(payload, longest, [this](const Answer<Bytes>& response) { take_part(response); });
}

void MemoryPort::take_part(const Answer<Bytes>& response) {
  if (!response) {
    return answer(tl::unexpected(response.error()));
  }
  if (const auto taken = read_part(*response); !taken) {
    return answer(tl::unexpected(PortError{PortError::Kind::protocol, 0, taken.error().message}));
  }
  if (++part_ < parts_.size()) {
    return ask_for_part();
  }
  answer(writes_ ? uds::write_response(number_) : uds::read_response(number_, record_));
}

Expected<void> MemoryPort::read_part(std::span<const std::uint8_t> response) {
  const profile::RegionPart& part = parts_[part_];
  if (writes_) {
    return uds::read_write_memory_response(response, part.address, part.bytes, profile_->memory.format());
  }
  const auto data = uds::read_memory_response(response, part.bytes);
  if (!data) {
    return tl::unexpected(data.error());
  }
  record_.insert(record_.end(), data->begin(), data->end());
  return {};
}

void MemoryPort::answer(Answer<Bytes> response) {
  const auto done = std::exchange(done_, {});
  if (!response) {
    response = tl::unexpected(named(std::move(response.error())));
  }
  if (done) {
    done(std::move(response));
  }
}

// "can0: state at 0x20001000: INS refused ReadMemoryByAddress: requestOutOfRange (0x31)"
PortError MemoryPort::named(PortError error) const {
  const std::string begins = fmt::format("{}: ", interface());
  const std::string_view words = error.message;
  error.message = fmt::format("{}{} at 0x{:X}: {}", begins, profile::did_name(*profile_, number_),
                              parts_[part_].address, words.substr(words.starts_with(begins) ? begins.size() : 0));
  return error;
}

void MemoryPort::cancel() {
  done_ = {};
  ins_->cancel();
}

}  // namespace selfcal
