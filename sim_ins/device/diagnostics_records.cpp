// The records of the INS: what is read and written by an identifier.
#include <algorithm>
#include <array>
#include <string_view>

#include "protocol/byte_order.hpp"
#include "protocol/profile/frame_values.hpp"
#include "protocol/profile/records.hpp"
#include "sim_ins/device/diagnostics.hpp"

namespace selfcal::sim {
namespace {

using uds::Nrc;

constexpr std::string_view software_version = "sim_ins 1.0";

uds::Bytes as_bytes(std::string_view text) { return {text.begin(), text.end()}; }

tl::unexpected<Nrc> no(Nrc nrc) { return tl::unexpected(nrc); }

}  // namespace

bool Diagnostics::knows(std::uint16_t did) const {
  const profile::Profile& p = *profile_;
  const std::array dids{
      std::optional(p.serial),    std::optional(p.software), p.state.did,    p.schedule.did, p.site.did,
      profile::told_directory(p), p.sample_format.did,       p.set_in_force, p.set_inactive, p.set_factory};
  const bool has = std::ranges::find(dids, std::optional(did)) != dids.end() || profile::field_of(p, did) != nullptr;
  return has && p.memory.find(did) == nullptr;
}

// nullopt: nothing is there yet, or the profile's fields do not hold it.
std::optional<uds::Bytes> Diagnostics::record(std::uint16_t id) {
  const profile::Profile& p = *profile_;
  const auto told = [&](const auto& content) -> std::optional<uds::Bytes> {
    auto bytes = profile::encode(p, content);
    return bytes ? std::optional(std::move(*bytes)) : std::nullopt;
  };
  const auto told_if_there = [&](const auto& content) { return content ? told(*content) : std::nullopt; };
  if (id == p.serial || id == p.software) {
    uds::Bytes text = as_bytes(id == p.serial ? std::string_view(instrument_.serial()) : software_version);
    if (const profile::Region* region = p.memory.find(id)) {
      text.resize(region->bytes, 0);
    }
    return text;
  }
  if (id == p.state.did) {
    return told(instrument_.state_record());
  }
  if (id == p.schedule.did) {
    return told_if_there(instrument_.schedule());
  }
  if (id == p.site.did) {
    return told(instrument_.site());
  }
  if (const profile::Field* field = profile::field_of(p, id)) {
    const auto set = told(instrument_.coefficients().stored());
    return set ? std::optional(uds::Bytes(set->begin() + static_cast<std::ptrdiff_t>(field->at),
                                          set->begin() + static_cast<std::ptrdiff_t>(field->end())))
               : std::nullopt;
  }
  if (id == p.set_in_force) {
    return told(p.slots ? instrument_.coefficients().in_force() : instrument_.coefficients().stored());
  }
  if (id == p.set_inactive) {
    return told_if_there(instrument_.coefficients().inactive());
  }
  if (id == p.set_factory) {
    return told_if_there(instrument_.coefficients().factory());
  }
  return id == p.directory.did ? told(instrument_.raw().directory()) : told(instrument_.sample_format());
}

Diagnostics::Reply Diagnostics::read_data(View request) {
  if (request.size() != 3) {  // one identifier in a request
    return no(Nrc::incorrect_message_length);
  }
  const auto id = ByteReader(request.subspan(1)).get<std::uint16_t>();
  if (!knows(id)) {
    return no(Nrc::request_out_of_range);
  }
  const auto content = record(id);
  return content ? Reply(uds::read_response(id, *content)) : Reply(no(Nrc::conditions_not_correct));
}

bool Diagnostics::takes(std::uint16_t id) const {
  return profile::is_written(*profile_, id) || id == profile_->site.did;
}

// ISO 14229-1, WriteDataByIdentifier: identifier, its security, total length, record, conditions.
Diagnostics::Reply Diagnostics::write_data(View request) {
  const auto id = ByteReader(request.subspan(1)).get<std::uint16_t>();
  if (!takes(id) || profile_->memory.find(id) != nullptr) {
    return no(Nrc::request_out_of_range);
  }
  if (!unlocked()) {
    return no(Nrc::security_access_denied);
  }
  return write_record(id, request.subspan(3)).map([&](const uds::Bytes&) { return uds::write_response(id); });
}

Diagnostics::Reply Diagnostics::write_record(std::uint16_t id, View record) {
  const profile::Profile& p = *profile_;
  if (p.move && id == p.move->did) {
    return move(record);
  }
  if (id == p.schedule.did) {
    return write_schedule(record);
  }
  if (id == p.site.did) {
    return write_site(record);
  }
  return p.slots ? write_coefficients(record) : write_over_set(id, record);
}

// The raw data are told in a session alone, records in every one.
Diagnostics::Reply Diagnostics::read_memory(View request) {
  const profile::RecordMemory& memory = profile_->memory;
  const auto range = uds::parse_memory_request(request, memory.format());
  const auto id = range ? memory.holding(range->address, range->bytes) : std::nullopt;
  if (range && !id) {
    const bool of_raw = profile_->raw.way == profile::Raw::Way::memory && session_ != uds::Session::standard;
    return of_raw ? upload_.memory(request) : no(Nrc::request_out_of_range);
  }
  if (!range) {
    return no(range.error());
  }
  const bool only_written = profile_->move && *id == profile_->move->did;
  if (range->bytes == 0 || range->bytes > memory.longest_read || only_written) {
    return no(Nrc::request_out_of_range);
  }
  const auto content = record(*id);
  const std::size_t at = range->address - memory.find(*id)->address;
  return content && content->size() >= at + range->bytes
             ? Reply(uds::memory_response(View(*content).subspan(at, range->bytes)))
             : Reply(no(Nrc::conditions_not_correct));
}

// ISO 14229-1, WriteMemoryByAddress: format, total length, range, its security, then record and conditions. Parts come in order from
// the record's beginning; what was begun is forgotten where another one begins.
Diagnostics::Reply Diagnostics::write_memory(View request) {
  const profile::RecordMemory& memory = profile_->memory;
  const auto write = uds::parse_write_memory_request(request, memory.format());
  if (!write) {
    return no(write.error());
  }
  const auto id = memory.holding(write->range.address, write->range.bytes);
  if (!id || !takes(*id) || write->data.empty() || write->data.size() > memory.longest_write) {
    return no(Nrc::request_out_of_range);
  }
  if (!unlocked()) {
    return no(Nrc::security_access_denied);
  }
  const profile::Region& region = *memory.find(*id);
  const std::size_t at = write->range.address - region.address;
  if (at == 0) {
    begun_ = Begun{*id, {}};
  }
  if (!begun_ || begun_->id != *id || begun_->record.size() != at) {
    return no(Nrc::conditions_not_correct);
  }
  begun_->record.insert(begun_->record.end(), write->data.begin(), write->data.end());
  if (begun_->record.size() == region.bytes) {
    const Begun whole = *std::exchange(begun_, std::nullopt);
    if (Reply written = write_record(*id, whole.record); !written) {
      return written;
    }
  }
  return uds::write_memory_response(write->range, memory.format());
}

Diagnostics::Reply Diagnostics::write_schedule(View record) {
  if (!profile::length_fits(profile_->schedule.layout, record)) {
    return no(Nrc::incorrect_message_length);
  }
  const auto schedule = profile::decode_schedule(*profile_, record);
  if (!schedule || !instrument_.check_schedule(*schedule)) {
    return no(Nrc::request_out_of_range);
  }
  if (instrument_.busy()) {
    return no(Nrc::conditions_not_correct);
  }
  instrument_.set_schedule(*schedule);
  return uds::Bytes{};
}

// By a write or by a routine: length, position, conditions.
Diagnostics::Reply Diagnostics::move(View record) {
  if (!profile::length_fits(profile_->move->layout, record)) {
    return no(Nrc::incorrect_message_length);
  }
  const auto position = profile::decode_move(*profile_, record);
  if (!position) {
    return no(Nrc::request_out_of_range);
  }
  return instrument_.move_to(*position, now_s_) ? Reply(uds::Bytes{}) : Reply(no(Nrc::conditions_not_correct));
}

Diagnostics::Reply Diagnostics::write_site(View record) {
  if (!profile::length_fits(profile_->site.layout, record)) {
    return no(Nrc::incorrect_message_length);
  }
  const auto site = profile::decode_site(*profile_, record);
  if (!site) {
    return no(Nrc::request_out_of_range);
  }
  if (instrument_.busy()) {
    return no(Nrc::conditions_not_correct);
  }
  instrument_.set_site(*site);
  return uds::Bytes{};
}

Diagnostics::Reply Diagnostics::write_coefficients(View record) {
  if (!profile::length_fits(profile_->set, record)) {
    return no(Nrc::incorrect_message_length);
  }
  const auto set = profile::decode_coefficients(*profile_, record);
  if (!set) {
    return no(Nrc::request_out_of_range);
  }
  if (instrument_.busy()) {
    return no(Nrc::conditions_not_correct);
  }
  if (!instrument_.coefficients().write_inactive(*set)) {
    return no(Nrc::general_programming_failure);  // not erased
  }
  return uds::Bytes{};
}

// Without slots: the whole set, or the field that has this identifier.
Diagnostics::Reply Diagnostics::write_over_set(std::uint16_t id, View record) {
  const profile::Field* field = profile::field_of(*profile_, id);
  const std::size_t bytes = field != nullptr ? field->end() - field->at : profile_->set.bytes;
  if (record.size() != bytes) {
    return no(Nrc::incorrect_message_length);
  }
  auto whole = profile::encode(*profile_, instrument_.coefficients().stored());
  if (!whole) {
    return no(Nrc::conditions_not_correct);
  }
  std::ranges::copy(record, whole->begin() + static_cast<std::ptrdiff_t>(field != nullptr ? field->at : 0));
  const auto set = profile::decode_coefficients(*profile_, *whole);
  if (!set) {
    return no(Nrc::request_out_of_range);
  }
  if (instrument_.busy()) {
    return no(Nrc::conditions_not_correct);
  }
  instrument_.coefficients().write_over(*set);
  return uds::Bytes{};
}

}  // namespace selfcal::sim
