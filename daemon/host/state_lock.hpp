// One process at a time works on a state directory: the daemon, or the command line with the daemon stopped.
#pragma once

#include <filesystem>

#include "protocol/error.hpp"

namespace selfcal {

// Held as long as the object lives; the kernel takes it from a process that dies.
class StateLock {
 public:
  static Expected<StateLock> take(const std::filesystem::path& state_directory);
  StateLock(StateLock&& other) noexcept;
  StateLock& operator=(StateLock&& other) noexcept;
  ~StateLock();

 private:
  explicit StateLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace selfcal
