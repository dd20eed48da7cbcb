#include "tools/cli/device/record_access.hpp"

#include <fmt/format.h>

#include "protocol/uds/messages.hpp"

namespace selfcal::cli::device {
namespace {

std::string words_of_parts(const Bytes& first, std::size_t parts) {
  return parts > 1 ? fmt::format("{}, {} parts", hex(first), parts) : hex(first);
}

template <typename T>
Expected<T> only_positive(const Exchange& exchange, Expected<T> read) {
  return exchange.kind == Exchange::Kind::positive ? std::move(read) : fail(ErrorKind::device, words(exchange));
}

}  // namespace

bool in_memory(const profile::Profile& profile, std::uint16_t did) { return profile.memory.find(did) != nullptr; }

Bytes read_request_of(const profile::Profile& profile, std::uint16_t did) {
  const profile::Region* region = profile.memory.find(did);
  return region == nullptr ? uds::read_request(did)
                           : profile.memory.read_request(profile::parts_of(*region, profile.memory.longest_read)[0]);
}

Bytes write_request_of(const profile::Profile& profile, std::uint16_t did, ByteView record) {
  const profile::Region* region = profile.memory.find(did);
  return region == nullptr ? uds::write_request(did, record)
                           : profile.memory.write_request(profile::parts_of(*region, profile.memory.longest_write)[0],
                                                          record, *region);
}

RecordExchange read_record(Conformance& c, std::uint16_t did) {
  const profile::RecordMemory& memory = c.profile().memory;
  const profile::Region* region = memory.find(did);
  RecordExchange result;
  if (region == nullptr) {
    result.exchange = c.tester().ask(uds::read_request(did));
    result.sent = hex(uds::read_request(did));
    result.record =
        only_positive(result.exchange, uds::read_read_response(result.exchange.response, did)).map([](ByteView told) {
          return Bytes(told.begin(), told.end());
        });
    return result;
  }
  const auto parts = profile::parts_of(*region, memory.longest_read);
  result.sent = words_of_parts(memory.read_request(parts[0]), parts.size());
  Bytes record;
  for (const profile::RegionPart& part : parts) {
    result.exchange = c.tester().ask(memory.read_request(part));
    const auto data = only_positive(result.exchange, uds::read_memory_response(result.exchange.response, part.bytes));
    if (!data) {
      result.record = tl::unexpected(data.error());
      return result;
    }
    record.insert(record.end(), data->begin(), data->end());
  }
  result.record = std::move(record);
  return result;
}

RecordExchange write_record(Conformance& c, std::uint16_t did, ByteView record) {
  const profile::RecordMemory& memory = c.profile().memory;
  const profile::Region* region = memory.find(did);
  RecordExchange result;
  result.record = Bytes(record.begin(), record.end());
  if (region == nullptr) {
    const Bytes request = uds::write_request(did, record);
    result.exchange = c.tester().ask(request);
    result.sent = hex(request);
    const auto taken = only_positive(result.exchange, uds::read_write_response(result.exchange.response, did));
    if (!taken) {
      result.record = tl::unexpected(taken.error());
    }
    return result;
  }
  const auto parts = profile::parts_of(*region, memory.longest_write);
  result.sent = words_of_parts(memory.write_request(parts[0], record, *region), parts.size());
  for (const profile::RegionPart& part : parts) {
    result.exchange = c.tester().ask(memory.write_request(part, record, *region));
    const auto taken = only_positive(
        result.exchange,
        uds::read_write_memory_response(result.exchange.response, part.address, part.bytes, memory.format()));
    if (!taken) {
      result.record = tl::unexpected(taken.error());
      return result;
    }
  }
  return result;
}

std::string came(const RecordExchange& told, const std::string& fault) {
  const bool answered = told.exchange.kind == Exchange::Kind::positive;
  return fault.empty() || !answered ? words(told.exchange) : fmt::format("{}: {}", words(told.exchange), fault);
}

}  // namespace selfcal::cli::device
