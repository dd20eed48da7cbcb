// Any frames at any times into a transport that is also sending: no crash, no endless sending, message within bounds.
// Input: per frame one byte of pause (ms), one of length, then the frame.
#include <cstdlib>
#include <vector>

#include "protocol/isotp/transport.hpp"

using namespace selfcal;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  isotp::Options options;
  options.address = {0x640, 0x648, 0x7DF, false};
  options.fd = true;
  options.frame_bytes = 64;
  options.max_message = 5000;
  isotp::Transport transport(options);
  const std::vector<std::uint8_t> message(300, 0x55);
  std::vector<can::CanFrame> out(16);
  Time now{0};
  while (size >= 2) {
    now += std::chrono::milliseconds(data[0]);
    can::CanFrame frame;
    frame.id = (data[1] & 0x80U) != 0 ? 0x7DF : 0x648;
    frame.fd = true;
    frame.size = static_cast<std::uint8_t>(std::min<std::size_t>(data[1] % 65U, size - 2));
    std::copy_n(data + 2, frame.size, frame.data.begin());
    data += 2 + frame.size;
    size -= 2U + frame.size;
    transport.on_time(now);
    for (const isotp::Result result : transport.on_frame(frame, now)) {
      if (result == isotp::Result::received && transport.message().size() > options.max_message) {
        std::abort();
      }
    }
    if (!transport.sending() && !transport.send(message, now)) {
      std::abort();
    }
    const std::size_t count = transport.pending(out, now);
    transport.sent(count, now);
  }
  return 0;
}
