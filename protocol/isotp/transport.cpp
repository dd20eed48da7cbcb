#include "protocol/isotp/transport.hpp"

#include <algorithm>
#include <cassert>

namespace selfcal::isotp {
namespace {

constexpr std::uint8_t next_sequence(unsigned sequence) { return static_cast<std::uint8_t>((sequence + 1) & 0x0F); }

void keep_earliest(std::optional<Time>& earliest, Time candidate) {
  if (!earliest || candidate < *earliest) {
    earliest = candidate;
  }
}

}  // namespace

std::string_view name(Result result) {
  switch (result) {
    case Result::sent: return "sent";
    case Result::received: return "received";
    case Result::received_functional: return "received on the functional identifier";
    case Result::reception_started: return "reception started";
    case Result::timeout_a: return "the bus did not take a frame in time (N_As)";
    case Result::timeout_ar: return "the bus did not take flow control in time (N_Ar)";
    case Result::timeout_bs: return "no flow control in time (N_Bs)";
    case Result::timeout_cr: return "no consecutive frame in time (N_Cr)";
    case Result::wrong_sequence: return "a frame was lost or doubled (wrong sequence number)";
    case Result::invalid_flow_status: return "invalid flow status";
    case Result::unexpected_frame: return "a new message began before the old one ended";
    case Result::too_many_waits: return "too many wait frames";
    case Result::held_too_long: return "reception was held too long";
    case Result::overflow: return "the receiver has no room for the message";
    case Result::message_too_long: return "the message is longer than there is room for";
  }
  return "unknown";
}

bool is_failure(Result result) {
  return result != Result::sent && result != Result::received && result != Result::received_functional &&
         result != Result::reception_started;
}

bool concerns_sending(Result result) {
  return result == Result::sent || result == Result::timeout_a || result == Result::timeout_bs ||
         result == Result::invalid_flow_status || result == Result::too_many_waits || result == Result::overflow;
}

Transport::Transport(const Options& options)
    : options_(options), address_bytes_(options.address.transmit_byte ? 1 : 0) {
  assert(options.frame_bytes >= 8 && options.frame_bytes <= (options.fd ? can::max_fd_bytes : 8));
  assert(can::frame_size_for(options.frame_bytes) == options.frame_bytes);
  assert(options.max_message > 0);
  sender_.buffer.resize(options.max_message);
  receiver_.buffer.resize(options.max_message);
  functional_message_.resize(can::max_fd_bytes);
}

can::CanFrame Transport::blank_frame(std::uint32_t id, const std::optional<std::uint8_t>& address_byte) const {
  can::CanFrame frame;
  if (address_bytes_ != 0) {
    frame.data[0] = *address_byte;
  }
  frame.id = id;
  frame.extended = options_.address.extended;
  frame.fd = options_.fd;
  frame.bit_rate_switch = options_.fd && options_.bit_rate_switch;
  return frame;
}

std::span<std::uint8_t> Transport::room(can::CanFrame& frame) const {
  return std::span(frame.data).first(options_.frame_bytes).subspan(address_bytes_);
}

// `used` of its room.
void Transport::finish_frame(can::CanFrame& frame, std::size_t used) const {
  used += address_bytes_;
  const std::size_t wanted = options_.padding ? std::max<std::size_t>(used, 8) : used;
  frame.size = static_cast<std::uint8_t>(can::frame_size_for(wanted));
  std::fill(frame.data.begin() + static_cast<std::ptrdiff_t>(used), frame.data.begin() + frame.size,
            options_.padding_byte);
}

can::CanFrame Transport::single_frame(std::span<const std::uint8_t> message, std::uint32_t id,
                                      const std::optional<std::uint8_t>& address_byte) const {
  can::CanFrame frame = blank_frame(id, address_byte);
  finish_frame(frame, encode_single(message, room(frame), address_bytes_));
  return frame;
}

bool Transport::send(std::span<const std::uint8_t> message, Time now) {
  if (sending() || message.empty() || message.size() > options_.max_message) {
    return false;
  }
  std::ranges::copy(message, sender_.buffer.begin());
  sender_.length = message.size();
  sender_.done = 0;
  sender_.due = now;
  sender_.waits = 0;
  sender_.state = message.size() <= max_single_payload(options_.frame_bytes - address_bytes_) ? SendState::single
                                                                                              : SendState::first;
  return true;
}

bool Transport::send_functional(std::span<const std::uint8_t> message, Time now) {
  if (functional_.waiting || !options_.address.functional_id || message.empty() ||
      message.size() > max_single_payload(options_.frame_bytes - address_bytes_)) {
    return false;
  }
  functional_ = {true, now, single_frame(message, *options_.address.functional_id, options_.address.functional_byte)};
  return true;
}

bool Transport::is_ours(std::uint32_t id, const std::optional<std::uint8_t>& address_byte,
                        const can::CanFrame& frame) const {
  return frame.id == id && frame.extended == options_.address.extended && !frame.remote && (options_.fd || !frame.fd) &&
         (address_bytes_ == 0 || (frame.size > 0 && frame.data[0] == *address_byte));
}

bool Transport::accepts(const can::CanFrame& frame) const {
  const Address& address = options_.address;
  return is_ours(address.receive_id, address.receive_byte, frame) ||
         (address.functional_id && is_ours(*address.functional_id, address.functional_byte, frame));
}

Events Transport::on_frame(const can::CanFrame& frame, Time now) {
  Events events;
  if (!accepts(frame)) {
    return events;
  }
  const auto pdu = decode(frame.payload().subspan(address_bytes_), address_bytes_);
  if (options_.address.functional_id &&
      is_ours(*options_.address.functional_id, options_.address.functional_byte, frame)) {
    if (const auto* single = pdu ? std::get_if<SingleFrame>(&*pdu) : nullptr) {
      std::ranges::copy(single->payload, functional_message_.begin());
      message_ = std::span(functional_message_).first(single->payload.size());
      events.add(Result::received_functional);
    }
    return events;
  }
  if (!pdu) {  // 9.6.5.2: an invalid flow status ends the transmission; anything else malformed is ignored
    if (pdu.error() == CodecError::bad_flow_status && sender_.state == SendState::wait_flow) {
      give_up_sending(Result::invalid_flow_status, events);
    }
    return events;
  }
  if (const auto* single = std::get_if<SingleFrame>(&*pdu)) {
    on_single(*single, events);
  } else if (const auto* first = std::get_if<FirstFrame>(&*pdu)) {
    on_first(*first, now, events);
  } else if (const auto* consecutive = std::get_if<ConsecutiveFrame>(&*pdu)) {
    on_consecutive(*consecutive, now, events);
  } else {
    on_flow_control(std::get<FlowControl>(*pdu), now, events);
  }
  return events;
}

void Transport::on_single(const SingleFrame& single, Events& events) {
  end_reception_for_new_message(events);
  if (single.payload.size() > options_.max_message) {
    events.add(Result::message_too_long);
    return;
  }
  std::ranges::copy(single.payload, receiver_.buffer.begin());
  message_ = std::span(receiver_.buffer).first(single.payload.size());
  events.add(Result::received);
}

void Transport::end_reception_for_new_message(Events& events) {
  if (receiver_.active) {
    end_reception();
    events.add(Result::unexpected_frame);
  }
}

// A flow control still waiting for the bus belongs to the message that is given up.
void Transport::end_reception() {
  receiver_.active = false;
  receiver_.awaiting_hold = false;
  flow_.waiting = false;
}

void Transport::on_first(const FirstFrame& first, Time now, Events& events) {
  end_reception_for_new_message(events);
  announced_ = first.length;
  if (first.length > options_.max_message) {
    const std::size_t kept = std::min(first.payload.size(), receiver_.buffer.size());
    std::ranges::copy(first.payload.first(kept), receiver_.buffer.begin());
    receiver_.done = kept;
    message_ = incoming();
    owe_flow_control(FlowStatus::overflow, now);
    events.add(Result::message_too_long);
    return;
  }
  std::ranges::copy(first.payload, receiver_.buffer.begin());
  receiver_.active = true;
  receiver_.length = first.length;
  receiver_.done = first.payload.size();
  receiver_.frame_payload = first.frame_bytes - 1;
  receiver_.sequence = 1;
  receiver_.waits = 0;
  events.add(Result::reception_started);
  grant_or_wait(now, events);
}

void Transport::refuse_incoming(Time now) {
  if (receiver_.active) {
    end_reception();
    owe_flow_control(FlowStatus::overflow, now);
  }
}

void Transport::grant_or_wait(Time now, Events& events) {
  receiver_.awaiting_hold = held_;
  if (!held_) {
    receiver_.block_left = options_.block_size;
    receiver_.waits = 0;
    owe_flow_control(FlowStatus::clear_to_send, now);
    return;
  }
  if (++receiver_.waits > options_.max_wait_frames) {
    end_reception();
    events.add(Result::held_too_long);
    return;
  }
  receiver_.next_wait = now + options_.n_bs / 2;
  owe_flow_control(FlowStatus::wait, now);
}

void Transport::owe_flow_control(FlowStatus status, Time now) {
  flow_ = {true, now, blank_frame(options_.address.transmit_id, options_.address.transmit_byte)};
  finish_frame(flow_.frame, encode_flow_control({status, options_.block_size, options_.st_min}, room(flow_.frame)));
}

void Transport::on_consecutive(const ConsecutiveFrame& consecutive, Time now, Events& events) {
  // Outside a reception, or before our flow control is out, nobody may send one: left over from a message given up.
  if (!receiver_.active || flow_.waiting || receiver_.awaiting_hold) {
    return;
  }
  if (consecutive.sequence != receiver_.sequence) {
    end_reception();
    events.add(Result::wrong_sequence);
    return;
  }
  const std::size_t wanted = std::min(receiver_.length - receiver_.done, receiver_.frame_payload);
  if (consecutive.payload.size() < wanted) {
    return;  // too short for its place: ignored, and so missed by the next one's sequence number
  }
  std::ranges::copy(consecutive.payload.first(wanted),
                    receiver_.buffer.begin() + static_cast<std::ptrdiff_t>(receiver_.done));
  receiver_.done += wanted;
  receiver_.sequence = next_sequence(receiver_.sequence);
  receiver_.deadline = now + options_.n_cr;
  if (receiver_.done == receiver_.length) {
    end_reception();
    message_ = std::span(receiver_.buffer).first(receiver_.length);
    events.add(Result::received);
  } else if (receiver_.block_left > 0 && --receiver_.block_left == 0) {
    grant_or_wait(now, events);
  }
}

void Transport::on_flow_control(const FlowControl& flow, Time now, Events& events) {
  if (sender_.state != SendState::wait_flow) {
    return;  // 9.6.5.1: a flow control that nobody waits for is ignored
  }
  switch (flow.status) {
    case FlowStatus::overflow: give_up_sending(Result::overflow, events); return;
    case FlowStatus::wait:
      sender_.deadline = now + options_.n_bs;
      if (++sender_.waits > options_.max_wait_frames) {
        give_up_sending(Result::too_many_waits, events);
      }
      return;
    case FlowStatus::clear_to_send:
      sender_.state = SendState::consecutive;
      sender_.block_left = flow.block_size;
      sender_.separation = separation_time(flow.st_min);
      sender_.due = now;
      sender_.waits = 0;
      return;
  }
}

void Transport::give_up_sending(Result why, Events& events) {
  sender_.state = SendState::idle;
  events.add(why);
}

std::size_t Transport::pending(std::span<can::CanFrame> out, Time now) const {
  std::size_t count = 0;
  for (const Owed* owed : {&flow_, &functional_}) {
    if (owed->waiting && count < out.size()) {
      out[count++] = owed->frame;
    }
  }
  if (sender_.state == SendState::idle || sender_.state == SendState::wait_flow || now < sender_.due) {
    return count;
  }
  if (sender_.state != SendState::consecutive) {
    if (count < out.size()) {
      out[count++] = opening_frame();
    }
    return count;
  }
  std::size_t most = sender_.separation > Time{0} ? 1 : out.size();
  if (sender_.block_left > 0) {
    most = std::min<std::size_t>(most, sender_.block_left);
  }
  std::size_t done = sender_.done;
  std::uint8_t sequence = sender_.sequence;
  for (; most > 0 && count < out.size() && done < sender_.length; --most) {
    const std::size_t part = std::min(consecutive_payload(), sender_.length - done);
    out[count++] = consecutive_frame(done, part, sequence);
    done += part;
    sequence = next_sequence(sequence);
  }
  return count;
}

can::CanFrame Transport::opening_frame() const {
  const auto message = std::span(sender_.buffer).first(sender_.length);
  if (sender_.state == SendState::single) {
    return single_frame(message, options_.address.transmit_id, options_.address.transmit_byte);
  }
  can::CanFrame frame = blank_frame(options_.address.transmit_id, options_.address.transmit_byte);
  encode_first(static_cast<std::uint32_t>(message.size()), message, room(frame));
  finish_frame(frame, options_.frame_bytes - address_bytes_);
  return frame;
}

can::CanFrame Transport::consecutive_frame(std::size_t at, std::size_t part, std::uint8_t sequence) const {
  can::CanFrame frame = blank_frame(options_.address.transmit_id, options_.address.transmit_byte);
  finish_frame(frame, encode_consecutive(sequence, std::span(sender_.buffer).subspan(at, part), room(frame)));
  return frame;
}

std::size_t Transport::consecutive_payload() const { return options_.frame_bytes - address_bytes_ - 1; }

Events Transport::sent(std::size_t count, Time now) {
  Events events;
  for (; count > 0; --count) {
    sent_one(now, events);
  }
  return events;
}

void Transport::sent_one(Time now, Events& events) {
  if (flow_.waiting) {
    flow_.waiting = false;
    receiver_.deadline = now + options_.n_cr;
  } else if (functional_.waiting) {
    functional_.waiting = false;
  } else {
    advance_sender(now, events);
  }
}

void Transport::advance_sender(Time now, Events& events) {
  switch (sender_.state) {
    case SendState::idle:
    case SendState::wait_flow: assert(false && "sent() without pending()"); return;
    case SendState::single: sender_.done = sender_.length; break;
    case SendState::first:
      sender_.done =
          first_frame_payload(static_cast<std::uint32_t>(sender_.length), options_.frame_bytes - address_bytes_);
      sender_.sequence = 1;
      sender_.state = SendState::wait_flow;
      sender_.deadline = now + options_.n_bs;
      return;
    case SendState::consecutive:
      sender_.done += std::min(consecutive_payload(), sender_.length - sender_.done);
      sender_.sequence = next_sequence(sender_.sequence);
      sender_.due = now + sender_.separation;
      break;
  }
  if (sender_.done == sender_.length) {
    sender_.state = SendState::idle;
    events.add(Result::sent);
  } else if (sender_.block_left > 0 && --sender_.block_left == 0) {
    sender_.state = SendState::wait_flow;
    sender_.deadline = now + options_.n_bs;
  }
}

Events Transport::on_time(Time now) {
  Events events;
  if (flow_.waiting) {
    if (now >= flow_.since + options_.n_as) {
      end_reception();
      events.add(Result::timeout_ar);
    }
  } else if (receiver_.active && receiver_.awaiting_hold) {
    if (now >= receiver_.next_wait) {
      grant_or_wait(now, events);
    }
  } else if (receiver_.active && now >= receiver_.deadline) {
    end_reception();
    events.add(Result::timeout_cr);
  }
  if (functional_.waiting && now >= functional_.since + options_.n_as) {
    functional_.waiting = false;  // nobody waits for it; the next one is due soon
  }
  if (sender_.state == SendState::wait_flow) {
    if (now >= sender_.deadline) {
      give_up_sending(Result::timeout_bs, events);
    }
  } else if (sending() && now >= sender_.due + options_.n_as) {
    give_up_sending(Result::timeout_a, events);
  }
  return events;
}

std::optional<Time> Transport::next_transmission() const {
  std::optional<Time> earliest;
  for (const Owed* owed : {&flow_, &functional_}) {
    if (owed->waiting) {
      keep_earliest(earliest, owed->since);
    }
  }
  if (sending() && sender_.state != SendState::wait_flow) {
    keep_earliest(earliest, sender_.due);
  }
  return earliest;
}

std::optional<Time> Transport::next_deadline() const {
  std::optional<Time> earliest = next_transmission();  // always before the time-out of the same frame
  if (sender_.state == SendState::wait_flow) {
    keep_earliest(earliest, sender_.deadline);
  }
  if (receiver_.active && !flow_.waiting) {
    keep_earliest(earliest, receiver_.awaiting_hold ? receiver_.next_wait : receiver_.deadline);
  }
  return earliest;
}

void Transport::hold_reception(bool hold, Time now) {
  held_ = hold;
  if (!hold && receiver_.active && receiver_.awaiting_hold) {
    Events none;  // granting yields no event
    grant_or_wait(now, none);
  }
}

void Transport::reset() {
  sender_.state = SendState::idle;
  functional_.waiting = false;
  end_reception();
}

}  // namespace selfcal::isotp
