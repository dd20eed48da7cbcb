// A tester for one INS that does what a well-behaved client never does: it sends single frames at will, holds back flow control,
// and notes what came and when. Everything waits; nobody else may speak to the INS meanwhile.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "protocol/can/socket.hpp"
#include "protocol/isotp/codec.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::cli::device {

using profile::Bytes;
using profile::ByteView;

// How the tester behaves while it receives a message of several frames.
struct Receiving {
  std::uint8_t block_size = 0, st_min = 0;
  int waits = 0;              // flow controls that say WAIT before the first that lets go on
  bool overflow = false;      // the first flow control says that there is no room
  double flow_after_s = 0.0;  // the first flow control comes so late
};

// What became of a request.
struct Exchange {
  enum class Kind : std::uint8_t { positive, negative, silent, broken };
  Kind kind = Kind::silent;
  Bytes response;
  std::uint8_t nrc = 0;
  double waited_s = 0.0;             // from the request, or the last response-pending, to the answer's first frame
  bool pending = false;              // 0x78 came before it
  std::string why;                   // broken
  std::vector<Time> consecutive;     // when each consecutive frame came
  std::size_t before_next_flow = 0;  // consecutive frames that came until block_size asked for the next flow control
};

struct Frame {
  Bytes data;
  Time time{0};
};

class Tester {
 public:
  [[nodiscard]] static Expected<Tester> open(const std::string& interface, const profile::Profile& profile);

  // Sends a request that fits a single frame, and waits for nothing.
  void put_single(ByteView request, bool to_all = false);
  // Sends the request and waits for its answer, `patience_s` beyond what the profile and the INS allow.
  Exchange ask(ByteView request, const Receiving& receiving = {});
  void tell_all(ByteView request) { put_single(request, true); }
  // Frame by frame. Data are filled with `fill`, the profile's padding otherwise.
  // Behind the address byte, where frames have one; what the frame has no room for is left out.
  void put(ByteView data, std::optional<std::uint8_t> fill = std::nullopt, bool to_all = false);
  // With this address byte in the place of the INS's.
  void put_addressed(std::uint8_t address, ByteView data);
  std::optional<Frame> next(double within_s);
  // Whether the INS sends nothing for so long; what comes is dropped.
  bool quiet(double seconds);
  // The message that comes within so long.
  Exchange receive(std::uint8_t service, double within_s, const Receiving& receiving = {});
  // A request of several frames: the first one, and the flow control that answers it; none if none came.
  std::optional<isotp::FlowControl> put_first(ByteView request);
  // The rest, the frame number `wrong` (from 1) with a wrong sequence number.
  void put_rest(ByteView request, const isotp::FlowControl& flow, std::optional<std::size_t> wrong = std::nullopt);

  // P2 and P2* as the INS stated them; the profile's where they are longer.
  void take_timings(double p2_s, double p2_star_s);
  double p2_s() const { return p2_s_; }
  double p2_star_s() const { return p2_star_s_; }
  // Answers that came later than that.
  struct Late {
    Bytes request;
    double seconds = 0.0, limit_s = 0.0;
  };
  const std::vector<Late>& late() const { return late_; }
  std::size_t frames() const { return frames_; }
  const std::vector<Bytes>& bad_frames() const { return bad_frames_; }  // that are none of ISO 15765-2
  // A frame of another identifier; for status frames.
  std::optional<can::CanFrame> other(std::uint32_t id, double within_s);

  const std::string& interface() const { return socket_.interface(); }
  const std::optional<Error>& trouble() const { return trouble_; }  // of the bus: everything is silent from then on

 private:
  Tester(can::Socket socket, const profile::Profile& profile);
  bool send(const can::CanFrame& frame);
  void put_frame(std::uint32_t id, std::optional<std::uint8_t> address, ByteView data, std::uint8_t fill);
  bool is_of(const can::CanFrame& frame, std::uint32_t id, std::optional<std::uint8_t> address) const;
  bool fill(double within_s);
  std::size_t address_bytes() const { return bus_.request_byte ? 1 : 0; }
  // Of a frame, what is left behind its address byte.
  std::size_t frame_bytes() const { return (bus_.fd ? can::max_fd_bytes : can::max_classic_bytes) - address_bytes(); }
  std::size_t classic_bytes() const { return can::max_classic_bytes - address_bytes(); }
  auto decode(ByteView data) const { return isotp::decode(data, address_bytes()); }
  Exchange collect(const isotp::FirstFrame& first, const Receiving& receiving);
  void judge(Exchange& exchange, std::uint8_t service) const;

  can::Socket socket_;
  profile::Bus bus_;
  double p2_s_, p2_star_s_;
  std::deque<Frame> waiting_;
  std::deque<can::CanFrame> others_;
  std::vector<Late> late_;
  std::vector<Bytes> bad_frames_;
  std::size_t frames_ = 0;
  std::optional<Error> trouble_;
};

std::string hex(ByteView bytes);  // "22 F1 8C"; long ones are cut, seeds and keys left out

}  // namespace selfcal::cli::device
