#include "protocol/can/bus_time.hpp"

#include <cassert>

namespace selfcal::can {
namespace {

// Bits after the stuffed part of a classic frame: CRC delimiter, ACK, ACK delimiter, 7 EOF, 3 intermission.
constexpr std::uint32_t classic_tail = 13;
// The same of an FD frame without the CRC delimiter, which counts at the data rate.
constexpr std::uint32_t fd_tail = 12;

// Walks over the bits of a frame as they are sent, counts them and the stuff bits, and keeps the classic CRC.
class BitCounter {
 public:
  void put(bool bit) {
    if (stuff_due_) {  // held back until it is known that the stuffed part goes on
      insert_stuff_bit();
    }
    crc_ = next_crc(bit);
    count(bit);
    stuff_due_ = run_ == 5;
  }
  void put(std::uint32_t value, unsigned width) {
    for (unsigned i = width; i-- > 0;) {
      put((value >> i & 1U) != 0);
    }
  }
  void start_data_rate() { in_data_phase_ = true; }
  // A stuff bit due after the very last bit: sent in a classic frame, replaced by a fixed one in FD.
  void finish_stuffing() {
    if (stuff_due_) {
      insert_stuff_bit();
    }
  }
  std::uint16_t crc() const { return crc_; }
  std::uint32_t nominal() const { return nominal_; }
  std::uint32_t data() const { return data_; }
  std::uint32_t stuff() const { return stuff_; }

 private:
  void insert_stuff_bit() {
    stuff_due_ = false;
    ++stuff_;
    count(!last_);
  }
  void count(bool bit) {
    run_ = bit == last_ ? run_ + 1 : 1;
    last_ = bit;
    ++(in_data_phase_ ? data_ : nominal_);
  }
  // CRC-15, polynomial 0x4599 (ISO 11898-1, 10.4.2.6), over the bits without stuff bits.
  std::uint16_t next_crc(bool bit) const {
    const bool feedback = bit != ((crc_ >> 14 & 1U) != 0);
    const auto shifted = static_cast<std::uint16_t>(crc_ << 1 & 0x7FFF);
    return static_cast<std::uint16_t>(feedback ? shifted ^ 0x4599 : shifted);
  }

  bool last_ = true;  // the idle bus is recessive; run_ starts at SOF, which is dominant
  unsigned run_ = 0;
  bool stuff_due_ = false;
  bool in_data_phase_ = false;
  std::uint16_t crc_ = 0;
  std::uint32_t nominal_ = 0;
  std::uint32_t data_ = 0;
  std::uint32_t stuff_ = 0;
};

// SOF, identifier and the bits up to IDE and RTR/RRS.
void put_arbitration(const CanFrame& frame, BitCounter& bits) {
  bits.put(false);  // SOF
  if (frame.extended) {
    bits.put(frame.id >> 18, 11);
    bits.put(0b11, 2);  // SRR, IDE
    bits.put(frame.id & 0x3FFFF, 18);
    bits.put(!frame.fd && frame.remote);  // RTR or RRS
  } else {
    bits.put(frame.id, 11);
    bits.put(!frame.fd && frame.remote);
    bits.put(false);  // IDE
  }
}

void put_data(const CanFrame& frame, BitCounter& bits) {
  for (const std::uint8_t byte : frame.payload()) {
    bits.put(byte, 8);
  }
}

FrameBits classic_bits(const CanFrame& frame) {
  BitCounter bits;
  put_arbitration(frame, bits);
  bits.put(0, frame.extended ? 2 : 1);  // reserved: r1 and r0, or FDF alone
  bits.put(dlc_of_size(frame.size), 4);
  if (!frame.remote) {
    put_data(frame, bits);
  }
  bits.put(bits.crc(), 15);
  bits.finish_stuffing();
  return {bits.nominal() + classic_tail, 0, bits.stuff()};
}

FrameBits fd_bits(const CanFrame& frame) {
  BitCounter bits;
  put_arbitration(frame, bits);
  bits.put(0b10, 2);  // FDF, res
  bits.put(frame.bit_rate_switch);
  if (frame.bit_rate_switch) {
    bits.start_data_rate();
  }
  bits.put(frame.error_state);
  bits.put(dlc_of_size(frame.size), 4);
  put_data(frame, bits);
  // Stuff count with parity (4) and CRC-17 or CRC-21; a fixed stuff bit before each four of these bits.
  const std::uint32_t checked = frame.size <= 16 ? 4 + 17 : 4 + 21;
  const std::uint32_t fixed_stuff = (checked + 3) / 4;
  const std::uint32_t end = checked + fixed_stuff + 1;  // and the CRC delimiter
  FrameBits result{bits.nominal() + fd_tail, bits.data(), bits.stuff() + fixed_stuff};
  (frame.bit_rate_switch ? result.data : result.nominal) += end;
  return result;
}

}  // namespace

FrameBits frame_bits(const CanFrame& frame) {
  assert(frame.size <= max_fd_bytes);
  return frame.fd ? fd_bits(frame) : classic_bits(frame);
}

Time frame_time(const CanFrame& frame, const BitRates& rates) {
  const FrameBits bits = frame_bits(frame);
  const auto span = [](std::uint32_t count, std::uint32_t rate) {
    return (std::int64_t{count} * 1'000'000'000 + rate - 1) / rate;
  };
  return Time(span(bits.nominal, rates.nominal) + span(bits.data, rates.data));
}

}  // namespace selfcal::can
