// The numbers of a serialised ROS message, in order. Two encodings: CDR (OMG DDSI-RTPS 2.5, 10.2, of ROS 2) aligns each
// number to its size, counted from behind the four bytes that say how it is encoded; ROS 1 packs them, little-endian.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace selfcal::import {

enum class Encoding { cdr, ros1 };

// What reads beyond the end gives zeros and makes fault(): look at it once, at the end.
class MessageReader {
 public:
  MessageReader(std::string_view bytes, Encoding encoding);

  std::uint32_t u32();
  double f64();
  std::string_view text();
  // Length of a sequence whose elements take at least ELEMENT bytes: no more than the bytes hold.
  std::uint32_t count(std::size_t element);
  void skip_f64(std::size_t numbers);
  // Nothing may be left: CDR pads to four bytes.
  void end();

  // Empty: none so far.
  const std::string& fault() const { return fault_; }

 private:
  // Takes the encapsulation; whether what follows is little-endian.
  bool begins_little();
  const char* take(std::size_t size, std::size_t alignment);
  template <typename Number>
  Number number();
  void fail_with(std::string words);

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::size_t begin_ = 0;  // alignment is counted from here
  bool aligned_;
  bool swap_ = false;
  std::string fault_;
};

}  // namespace selfcal::import
