#include "tools/cli/device/probe.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <set>
#include <thread>

#include "protocol/profile/names.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal::cli::device {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;
// P2_Server of ISO 14229-2 is 50 ms; the bus and a slow node beside it.
constexpr double answer_s = 0.1;

// All frames of the bus that come within so long.
Expected<std::vector<can::CanFrame>> listen(can::Socket& socket, double seconds) {
  std::vector<can::CanFrame> frames;
  const auto end = Clock::now() + Seconds(seconds);
  while (Clock::now() < end) {
    pollfd descriptor{socket.fd(), POLLIN, 0};
    if (::poll(&descriptor, 1, static_cast<int>(Seconds(end - Clock::now()).count() * 1e3) + 1) <= 0) {
      continue;
    }
    const auto received = socket.receive();
    if (!received) {
      return tl::unexpected(received.error());
    }
    for (const can::ReceivedFrame& one : *received) {
      if (!one.event) {
        frames.push_back(one.frame);
      }
    }
  }
  return frames;
}

std::vector<Heard> sorted(const std::vector<can::CanFrame>& frames) {
  std::map<std::pair<bool, std::uint32_t>, Heard> by_id;
  for (const can::CanFrame& frame : frames) {
    Heard& heard = by_id[{frame.extended, frame.id}];
    heard.id = frame.id;
    heard.extended_ids = frame.extended;
    ++heard.frames;
    heard.bytes = frame.size;
    heard.last.assign(frame.payload().begin(), frame.payload().end());
  }
  std::vector<Heard> list;
  list.reserve(by_id.size());
  for (const auto& [id, heard] : by_id) {
    list.push_back(heard);
  }
  return list;
}

// An answer to TesterPresent, positive or not, in a single frame.
bool answers(const can::CanFrame& frame) {
  const auto pdu = isotp::decode(frame.payload());
  const auto* single = pdu ? std::get_if<isotp::SingleFrame>(&*pdu) : nullptr;
  if (single == nullptr || single->payload.size() < 2) {
    return false;
  }
  const auto p = single->payload;
  return p[0] == uds::service::tester_present + uds::positive_offset ||
         (p[0] == uds::service::negative_response && p[1] == uds::service::tester_present);
}

// Who answers 3E 00 on each of these identifiers.
Expected<std::vector<Address>> ask_around(can::Socket& socket, const ProbePlan& plan,
                                          const std::set<std::pair<bool, std::uint32_t>>& talkative) {
  std::vector<Address> found;
  for (const Address& asked : plan.addresses) {
    can::CanFrame frame;
    frame.id = asked.request;
    frame.extended = asked.extended_ids;
    frame.size = can::max_classic_bytes;
    frame.data.fill(plan.profile.bus.padding);
    frame.data[0] = 2;
    frame.data[1] = uds::service::tester_present;
    frame.data[2] = 0;
    auto taken = socket.send({&frame, 1});
    for (int k = 0; taken && *taken == 0 && k < 100; ++k) {
      std::this_thread::sleep_for(Seconds(0.01));
      taken = socket.send({&frame, 1});
    }
    if (!taken || *taken == 0) {
      return taken ? fail(ErrorKind::device, fmt::format("{}: the bus takes no frame", plan.interface))
                   : tl::unexpected(taken.error());
    }
    const auto came = listen(socket, answer_s);
    if (!came) {
      return tl::unexpected(came.error());
    }
    for (const can::CanFrame& one : *came) {
      if (answers(one) && !talkative.contains({one.extended, one.id})) {
        found.push_back({asked.request, one.id, asked.extended_ids, {}, {}});
      }
    }
  }
  return found;
}

void read_identifiers(Tester& tester, const ProbePlan& plan, std::vector<Known>& found) {
  for (std::uint32_t did = plan.first_did; did <= plan.last_did && !tester.trouble(); ++did) {
    const Exchange told = tester.ask(uds::read_request(static_cast<std::uint16_t>(did)));
    const auto record = uds::read_read_response(told.response, static_cast<std::uint16_t>(did));
    const bool refused_now =
        told.kind == Exchange::Kind::negative && told.nrc != static_cast<std::uint8_t>(uds::Nrc::request_out_of_range);
    if (told.kind == Exchange::Kind::silent) {
      break;  // it fell silent: what is asked further only takes time
    }
    const bool no_service =
        told.kind == Exchange::Kind::negative && told.nrc == static_cast<std::uint8_t>(uds::Nrc::service_not_supported);
    if (record || refused_now) {
      found.push_back(
          {static_cast<std::uint16_t>(did), record ? Bytes(record->begin(), record->end()) : Bytes{}, told.nrc});
    }
    if (no_service) {
      break;  // it has no identifiers at all
    }
  }
}

// Not at other addresses: what memory another node has, and what reading it does, nobody here knows.
void read_memory(Tester& tester, const profile::Profile& profile, std::vector<KnownPlace>& found) {
  for (const auto& [number, region] : profile.memory.regions) {
    if (profile.move && number == profile.move->did) {  // only written
      continue;
    }
    KnownPlace place{region.address, profile::did_name(profile, number), {}, 0};
    for (const profile::RegionPart& part : profile::parts_of(region, profile.memory.longest_read)) {
      const Exchange told = tester.ask(profile.memory.read_request(part));
      const auto data = uds::read_memory_response(told.response, part.bytes);
      if (!data) {
        if (told.kind == Exchange::Kind::silent) {
          return;
        }
        place.record.clear();
        place.nrc = told.nrc;
        break;
      }
      place.record.insert(place.record.end(), data->begin(), data->end());
    }
    found.push_back(std::move(place));
  }
}

Expected<Found> read_all(const ProbePlan& plan, const Address& address) {
  profile::Profile profile = plan.profile;
  profile.bus.request = address.request;
  profile.bus.response = address.response;
  profile.bus.extended_ids = address.extended_ids;
  profile.bus.request_byte = address.request_byte;
  profile.bus.response_byte = address.response_byte;
  auto tester = Tester::open(plan.interface, profile);
  if (!tester) {
    return tl::unexpected(tester.error());
  }
  Found found{address, {}, {}, {}, {}};
  found.present = tester->ask(uds::tester_present_request(false)).response;
  if (!found.present.empty()) {
    found.session = tester->ask(uds::session_request(uds::Session::standard)).response;
    read_identifiers(*tester, plan, found.dids);
    const profile::Bus& own = plan.profile.bus;
    if (address.request == own.request && address.response == own.response &&
        address.extended_ids == own.extended_ids) {
      read_memory(*tester, plan.profile, found.memory);
    }
  }
  return tester->trouble() ? Expected<Found>(tl::unexpected(*tester->trouble())) : found;
}

}  // namespace

Expected<ProbeResult> probe(const ProbePlan& plan) {
  can::SocketOptions options;
  options.interface = plan.interface;
  options.fd = plan.profile.bus.fd;
  auto socket = can::Socket::open(options);
  if (!socket) {
    return tl::unexpected(socket.error());
  }
  const auto frames = listen(*socket, plan.listen_s);
  if (!frames) {
    return tl::unexpected(frames.error());
  }
  ProbeResult result;
  result.heard = sorted(*frames);
  std::set<std::pair<bool, std::uint32_t>> talkative;
  for (const Heard& heard : result.heard) {
    talkative.emplace(heard.extended_ids, heard.id);
  }
  const profile::Bus& bus = plan.profile.bus;
  std::vector<Address> addresses{{bus.request, bus.response, bus.extended_ids, bus.request_byte, bus.response_byte}};
  const auto others = ask_around(*socket, plan, talkative);
  if (!others) {
    return tl::unexpected(others.error());
  }
  for (const Address& other : *others) {
    const bool there = std::ranges::any_of(addresses, [&](const Address& a) {
      return a.request == other.request && a.response == other.response && a.extended_ids == other.extended_ids;
    });
    if (!there) {
      addresses.push_back(other);
    }
  }
  for (const Address& address : addresses) {
    auto found = read_all(plan, address);
    if (!found) {
      return tl::unexpected(found.error());
    }
    if (!found->present.empty()) {
      result.found.push_back(std::move(*found));
    }
  }
  return result;
}

}  // namespace selfcal::cli::device
