#include "daemon/host/state_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace selfcal {

Expected<StateLock> StateLock::take(const std::filesystem::path& state_directory) {
  // The directory itself: a lock file left by root would shut the service out.
  const int fd = ::open(state_directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) {
    return fail(ErrorKind::device, fmt::format("{}: {}", state_directory.string(), std::strerror(errno)));
  }
  StateLock lock(fd);
  if (flock(fd, LOCK_EX | LOCK_NB) == 0) {
    return lock;
  }
  return fail(ErrorKind::device, fmt::format("{}: in use by another selfcald or selfcal", state_directory.string()));
}

StateLock::StateLock(StateLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

StateLock& StateLock::operator=(StateLock&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

StateLock::~StateLock() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

}  // namespace selfcal
