#include "tools/cli/bus_document.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>

#include "protocol/uds/services.hpp"

namespace selfcal::cli {
namespace {

using Json = nlohmann::ordered_json;

double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

std::string_view name(uds::LogEntry::Sender sender) {
  switch (sender) {
    case uds::LogEntry::Sender::tester: return "tester";
    case uds::LogEntry::Sender::tester_to_all: return "tester to all";
    default: return "ins";
  }
}

bool refuses(const uds::LogEntry& entry) {
  return entry.message.size() == 3 && entry.message[0] == uds::service::negative_response;
}

std::string_view kind(const uds::LogEntry& entry) {
  switch (entry.kind) {
    case uds::LogEntry::Kind::broken: return "broken";
    case uds::LogEntry::Kind::status: return "status";
    default: break;
  }
  if (entry.sender != uds::LogEntry::Sender::ins) {
    return "request";
  }
  return !entry.message.empty() && entry.message[0] == uds::service::negative_response ? "refusal" : "response";
}

// Of the request, whoever speaks.
std::uint8_t service_of(const uds::LogEntry& entry) {
  if (refuses(entry)) {
    return entry.message[1];
  }
  return static_cast<std::uint8_t>(entry.message[0] & ~uds::positive_offset);
}

// Seeds and keys are not told: service and level alone.
std::span<const std::uint8_t> told_bytes(const uds::LogEntry& entry) {
  const bool secret = service_of(entry) == uds::service::security_access && !refuses(entry);
  return std::span(entry.message).first(secret ? std::min<std::size_t>(2, entry.message.size()) : entry.message.size());
}

}  // namespace

void BusDocument::add(const uds::LogEntry& entry) {
  Json item{
      {"time_s", seconds(entry.time)}, {"from", name(entry.sender)}, {"kind", kind(entry)}, {"words", entry.words}};
  if (!entry.message.empty()) {
    item["service"] = uds::service_name(service_of(entry));
    item["length"] = entry.message.size();
    item["bytes"] = fmt::format("{:02X}", fmt::join(told_bytes(entry), ""));
  }
  if (refuses(entry)) {
    item["nrc"] = {{"code", entry.message[2]}, {"name", uds::nrc_name(entry.message[2])}};
  }
  if (entry.kind == uds::LogEntry::Kind::status) {
    item["signals"] = Json::object();
    for (const auto& signal : entry.signals) {
      item["signals"][std::string(signal.name)] = signal.value;
    }
  }
  entries_.push_back(std::move(item));
}

void BusDocument::add_error_frame(Time time, std::string_view words) {
  entries_.push_back({{"time_s", seconds(time)}, {"from", "controller"}, {"kind", "error frame"}, {"words", words}});
}

std::string BusDocument::text(const document::InputFile& input, std::uint64_t malformed) const {
  return document::with_head(document::bus, {{"malformed", malformed}, {"entries", entries_}}, input).dump();
}

}  // namespace selfcal::cli
