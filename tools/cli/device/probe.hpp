// What answers on a bus, by reading alone. Sent are TesterPresent (3E 00), the default session (10 01) and ReadDataByIdentifier;
// never another session, a seed, a key, a routine or anything that writes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/profile/profile.hpp"
#include "tools/cli/device/tester.hpp"

namespace selfcal::cli::device {

// A pair of CAN identifiers.
struct Address {
  std::uint32_t request = 0, response = 0;
  bool extended_ids = false;
  std::optional<std::uint8_t> request_byte, response_byte;  // of frames that begin with an address
};

// A frame that came without being asked for.
struct Heard {
  std::uint32_t id = 0;
  bool extended_ids = false;
  std::size_t frames = 0, bytes = 0;  // of the last one
  Bytes last;
};

struct Known {
  std::uint16_t did = 0;
  Bytes record;          // empty where it is refused for now
  std::uint8_t nrc = 0;  // of such a refusal
};

// A record that the profile has in memory.
struct KnownPlace {
  std::uint32_t address = 0;
  std::string name;      // the profile's
  Bytes record;          // empty where it is refused
  std::uint8_t nrc = 0;  // of the refusal
};

struct Found {
  Address address;
  Bytes present;  // the answer to TesterPresent
  Bytes session;  // to 10 01
  std::vector<Known> dids;
  std::vector<KnownPlace> memory;  // at the profile's own address alone
};

struct ProbePlan {
  std::string interface;
  profile::Profile profile;        // its address is asked first, with its timing and padding
  std::vector<Address> addresses;  // further ones to ask; response: any
  std::uint16_t first_did = 0, last_did = 0;
  double listen_s = 2.0;
};

struct ProbeResult {
  std::vector<Heard> heard;
  std::vector<Found> found;
};
[[nodiscard]] Expected<ProbeResult> probe(const ProbePlan& plan);

}  // namespace selfcal::cli::device
