#include "daemon/ins/open_port.hpp"

#include "daemon/ins/can_port.hpp"
#include "daemon/ins/frame_port.hpp"
#include "daemon/ins/memory_port.hpp"
#include "daemon/ins/move_port.hpp"
#include "daemon/ins/stream_port.hpp"

namespace selfcal {

std::unique_ptr<InsPort> open_port(EventLoop& loop, const InsConfig& config) {
  if (config.profile->frames) {
    return std::make_unique<FramePort>(loop, config);
  }
  std::unique_ptr<InsPort> port = std::make_unique<CanPort>(loop, config);
  if (!config.profile->memory.regions.empty()) {
    port = std::make_unique<MemoryPort>(std::move(port), config.profile);
  }
  if (!config.profile->stream.empty()) {
    port = std::make_unique<StreamPort>(loop, std::move(port), config);
  }
  if (config.profile->move) {
    port = std::make_unique<MovePort>(loop, std::move(port), config);
  }
  return port;
}

}  // namespace selfcal
