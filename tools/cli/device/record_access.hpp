// A record of the profile read and written by the tester, wherever it stands: by its identifier, or in memory part by part.
#pragma once

#include <string>

#include "tools/cli/device/conformance.hpp"

namespace selfcal::cli::device {

struct RecordExchange {
  Exchange exchange;       // of the part that was not answered as it must be, else of the last one
  std::string sent;        // "22 40 01", "23 24 20 00 10 00 00 0E, 2 parts"
  Expected<Bytes> record;  // that was read, or written; or why it was not
};

RecordExchange read_record(Conformance& c, std::uint16_t did);
RecordExchange write_record(Conformance& c, std::uint16_t did, ByteView record);

// The only request that does so, or the first one.
Bytes read_request_of(const profile::Profile& profile, std::uint16_t did);
Bytes write_request_of(const profile::Profile& profile, std::uint16_t did, ByteView record);

bool in_memory(const profile::Profile& profile, std::uint16_t did);

// "62 40 01 0A", and what is wrong with it.
std::string came(const RecordExchange& told, const std::string& fault);

}  // namespace selfcal::cli::device
