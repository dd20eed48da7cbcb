#include "protocol/uds/decode.hpp"

#include <fmt/format.h>

#include "protocol/isotp/codec.hpp"

namespace selfcal::uds {
namespace {

constexpr std::uint32_t longest_message = 65535;  // what is announced as longer is broken or not ours

std::string stamp(Time time) {
  const auto micros = std::chrono::duration_cast<std::chrono::microseconds>(time).count();
  return fmt::format("({}.{:06})", micros / 1'000'000, micros % 1'000'000);
}

std::optional<LogEntry> status_entry(std::vector<LogEntry::Signal> signals, Time time) {
  if (signals.empty()) {
    return std::nullopt;
  }
  LogEntry entry;
  entry.time = time;
  entry.kind = LogEntry::Kind::status;
  entry.sender = LogEntry::Sender::ins;
  for (const LogEntry::Signal& signal : signals) {
    entry.words += fmt::format("{}{}={}", entry.words.empty() ? "" : " ", signal.name, signal.text);
  }
  entry.signals = std::move(signals);
  return entry;
}

std::string_view label(const LogEntry& entry) {
  if (entry.kind == LogEntry::Kind::status) {
    return "status  ";
  }
  switch (entry.sender) {
    case LogEntry::Sender::tester: return "tester ";
    case LogEntry::Sender::tester_to_all: return "tester*";
    default: return "INS    ";
  }
}

}  // namespace

std::string line(const LogEntry& entry) {
  return fmt::format("{} {} {}{}", stamp(entry.time), label(entry),
                     entry.kind == LogEntry::Kind::broken ? "broken: " : "", entry.words);
}

LogDecoder::LogDecoder(const DecoderOptions& options)
    : options_(options),
      streams_{Stream{options.request_id, options.request_byte, LogEntry::Sender::tester, {}, 0, 0},
               Stream{options.response_id, options.response_byte, LogEntry::Sender::ins, {}, 0, 0},
               Stream{options.functional_id, options.functional_byte, LogEntry::Sender::tester_to_all, {}, 0, 0}} {}

std::optional<LogEntry> LogDecoder::on_frame(const can::CanFrame& frame, Time time) {
  if (frame.remote) {
    return std::nullopt;
  }
  for (Stream& stream : streams_) {
    const bool meant = !stream.address || (frame.size > 0 && frame.data[0] == *stream.address);
    if (frame.id == stream.id && frame.extended == options_.extended && meant) {
      return on_stream(stream, frame.payload().subspan(stream.address ? 1 : 0), time);
    }
  }
  return options_.status ? status_entry(options_.status(frame), time) : std::nullopt;
}

std::optional<LogEntry> LogDecoder::on_stream(Stream& stream, std::span<const std::uint8_t> data, Time time) {
  const auto pdu = isotp::decode(data);
  if (!pdu) {
    return broken(stream, "malformed frame", time);
  }
  if (std::holds_alternative<isotp::FlowControl>(*pdu)) {
    return std::nullopt;
  }
  if (const auto* next = std::get_if<isotp::ConsecutiveFrame>(&*pdu)) {
    if (stream.length == 0) {
      return broken(stream, "consecutive frame without a first one", time);
    }
    if (next->sequence != stream.sequence) {
      stream.length = 0;
      return broken(stream, "frame lost or doubled", time);
    }
    stream.sequence = static_cast<std::uint8_t>((stream.sequence + 1) & 0x0F);
    const std::size_t part = std::min(next->payload.size(), stream.length - stream.bytes.size());
    stream.bytes.insert(stream.bytes.end(), next->payload.begin(), next->payload.begin() + static_cast<long>(part));
    if (stream.bytes.size() < stream.length) {
      return std::nullopt;
    }
    stream.length = 0;
    return whole(stream, stream.bytes, time);
  }
  const bool interrupted = stream.length != 0;
  stream.length = 0;
  malformed_ += interrupted ? 1 : 0;
  if (const auto* first = std::get_if<isotp::FirstFrame>(&*pdu)) {
    if (first->length > longest_message) {
      return broken(stream, "announced length beyond 65535", time);
    }
    stream.bytes.assign(first->payload.begin(), first->payload.end());
    stream.length = first->length;
    stream.sequence = 1;
    return std::nullopt;
  }
  return whole(stream, std::get<isotp::SingleFrame>(*pdu).payload, time);
}

LogEntry LogDecoder::whole(const Stream& stream, std::span<const std::uint8_t> message, Time time) {
  ++messages_;
  return {time,
          LogEntry::Kind::message,
          stream.sender,
          {message.begin(), message.end()},
          {},
          describe_message(message, options_.names)};
}

LogEntry LogDecoder::broken(const Stream& stream, std::string_view why, Time time) {
  ++malformed_;
  return {time, LogEntry::Kind::broken, stream.sender, {}, {}, std::string(why)};
}

}  // namespace selfcal::uds
