// ISO-TP between two addresses as a state machine without I/O: frames in, frames out, deadlines, events. It sends one
// message and receives another at the same time. All buffers are allocated by the constructor.
//
// The owner's loop:  feed every received frame to on_frame(); when next_deadline() is due, on_time(); then take frames
// with pending(), hand them to the bus, and report with sent() how many it took. Each of the calls returns events.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/can/frame.hpp"
#include "protocol/isotp/codec.hpp"
#include "protocol/time.hpp"

namespace selfcal::isotp {

struct Address {
  std::uint32_t transmit_id = 0;
  std::uint32_t receive_id = 0;
  std::optional<std::uint32_t> functional_id;  // one-to-many requests: single frames only
  bool extended = false;                       // 29-bit identifiers
  // Extended and mixed addressing: the first byte of each frame. All three or none.
  std::optional<std::uint8_t> transmit_byte = std::nullopt, receive_byte = std::nullopt, functional_byte = std::nullopt;
};

struct Options {
  Address address;
  bool fd = false;
  bool bit_rate_switch = true;  // FD only
  std::size_t frame_bytes = 8;  // longest frame to send: 8, or with fd one of 12 16 20 24 32 48 64
  bool padding = true;          // short frames are filled up to 8 bytes (FD lengths are always filled)
  std::uint8_t padding_byte = 0xCC;
  std::uint8_t block_size = 0;          // told to the sender when we receive
  std::uint8_t st_min = 0;              // told to the sender, raw code
  std::size_t max_message = 65535;      // longest message to send or receive, bytes
  unsigned max_wait_frames = 16;        // N_WFTmax, as sender and as receiver
  Time n_as = std::chrono::seconds(1);  // a frame must be on its way to the bus within this (also N_Ar)
  Time n_bs = std::chrono::seconds(1);  // the peer's flow control must come within this
  Time n_cr = std::chrono::seconds(1);  // the peer's next consecutive frame must come within this
};

enum class Result : std::uint8_t {
  sent,                 // our message is out, completely
  received,             // Transport::message() is a complete message
  received_functional,  // the same, on the functional identifier
  reception_started,    // a first frame was accepted
  timeout_a,            // the bus did not take our frame in time: message given up
  timeout_ar,           // nor our flow control: reception given up
  timeout_bs,           // no flow control
  timeout_cr,           // no consecutive frame
  wrong_sequence,       // a frame was lost or doubled: reception given up
  invalid_flow_status,
  unexpected_frame,  // a new message began before the old one ended: the old one is given up
  too_many_waits,    // the peer said WAIT too often: message given up
  held_too_long,     // we did: reception given up
  overflow,          // the peer cannot take our message
  message_too_long,  // the peer's message does not fit; it was told so
};

std::string_view name(Result result);
bool is_failure(Result result);
bool concerns_sending(Result result);  // failure of our message (else of the peer's)

// What one call brought about; never more than four results.
class Events {
 public:
  void add(Result result) { results_[count_++] = result; }
  const Result* begin() const { return results_.data(); }
  const Result* end() const { return results_.data() + count_; }
  bool empty() const { return count_ == 0; }

 private:
  std::array<Result, 4> results_{};
  std::size_t count_ = 0;
};

class Transport {
 public:
  explicit Transport(const Options& options);  // aborts on options that no bus has (our own mistake)

  // False when a message is still being sent, or it is empty or longer than max_message. The bytes are copied.
  [[nodiscard]] bool send(std::span<const std::uint8_t> message, Time now);
  // To functional_id, beside everything else. False when it does not fit a single frame or one is still waiting.
  [[nodiscard]] bool send_functional(std::span<const std::uint8_t> message, Time now);
  bool sending() const { return sender_.state != SendState::idle; }
  bool receiving() const { return receiver_.active; }

  bool accepts(const can::CanFrame& frame) const;         // is addressed to us
  Events on_frame(const can::CanFrame& frame, Time now);  // other frames are ignored
  Events on_time(Time now);

  // The frames that may go out now, at most out.size(); asking does not change anything. Takes flow control first.
  std::size_t pending(std::span<can::CanFrame> out, Time now) const;
  // The bus has taken the first `count` of what pending() gave; no other call may stand between the two.
  Events sent(std::size_t count, Time now);

  // When on_time() or pending() is next needed. A frame that may go out at once has its time in the past.
  std::optional<Time> next_deadline() const;
  // Like next_deadline, but without the time-out of frames that wait for the bus: when pending() will have something.
  std::optional<Time> next_transmission() const;

  // The last message received; valid until the next on_frame(). After message_too_long: its first bytes.
  std::span<const std::uint8_t> message() const { return message_; }
  // The message that is being received, or was refused as too long: its first bytes and its length as announced.
  std::span<const std::uint8_t> incoming() const { return std::span(receiver_.buffer).first(receiver_.done); }
  std::uint32_t announced() const { return announced_; }
  // Right after reception_started: the sender is told that there is no room (overflow), and nothing is received.
  void refuse_incoming(Time now);

  // While held, a peer that wants to send gets WAIT (repeated each n_bs/2, at most max_wait_frames times).
  void hold_reception(bool hold, Time now);

  void reset();  // drop everything under way, on both sides

  const Options& options() const { return options_; }

 private:
  enum class SendState : std::uint8_t { idle, single, first, wait_flow, consecutive };
  struct Sender {
    SendState state = SendState::idle;
    std::vector<std::uint8_t> buffer;
    std::size_t length = 0;
    std::size_t done = 0;       // bytes the bus has taken
    std::uint8_t sequence = 0;  // of the next consecutive frame
    unsigned block_left = 0;    // frames until flow control; 0: no limit
    Time separation{0};
    Time due{0};       // the next frame may go out
    Time deadline{0};  // wait_flow: N_Bs
    unsigned waits = 0;
  };
  struct Receiver {
    bool active = false;
    std::vector<std::uint8_t> buffer;
    std::size_t length = 0;
    std::size_t done = 0;
    std::size_t frame_payload = 0;  // of every consecutive frame but the last: as long as the first frame
    std::uint8_t sequence = 0;      // expected next
    unsigned block_left = 0;        // frames until we owe flow control; 0: no limit
    Time deadline{0};               // N_Cr
    bool awaiting_hold = false;     // WAIT was said, CTS is owed
    unsigned waits = 0;
    Time next_wait{0};
  };
  struct Owed {  // a frame that waits for the bus
    bool waiting = false;
    Time since{0};
    can::CanFrame frame;
  };

  can::CanFrame blank_frame(std::uint32_t id, const std::optional<std::uint8_t>& address_byte) const;
  std::span<std::uint8_t> room(can::CanFrame& frame) const;
  void finish_frame(can::CanFrame& frame, std::size_t used) const;
  can::CanFrame single_frame(std::span<const std::uint8_t> message, std::uint32_t id,
                             const std::optional<std::uint8_t>& address_byte) const;
  void owe_flow_control(FlowStatus status, Time now);
  void grant_or_wait(Time now, Events& events);
  void end_reception();
  void end_reception_for_new_message(Events& events);
  can::CanFrame opening_frame() const;
  can::CanFrame consecutive_frame(std::size_t at, std::size_t part, std::uint8_t sequence) const;
  std::size_t consecutive_payload() const;
  bool is_ours(std::uint32_t id, const std::optional<std::uint8_t>& address_byte, const can::CanFrame& frame) const;
  void on_single(const SingleFrame& single, Events& events);
  void on_first(const FirstFrame& first, Time now, Events& events);
  void on_consecutive(const ConsecutiveFrame& consecutive, Time now, Events& events);
  void on_flow_control(const FlowControl& flow, Time now, Events& events);
  void sent_one(Time now, Events& events);
  void advance_sender(Time now, Events& events);
  void give_up_sending(Result why, Events& events);

  Options options_;
  std::size_t address_bytes_ = 0;  // before all else in each frame: 0 or 1
  Sender sender_;
  Receiver receiver_;
  std::uint32_t announced_ = 0;  // by the last first frame
  Owed flow_;
  Owed functional_;
  bool held_ = false;
  std::vector<std::uint8_t> functional_message_;
  std::span<const std::uint8_t> message_;
};

}  // namespace selfcal::isotp
