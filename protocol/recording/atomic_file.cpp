#include "protocol/recording/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace selfcal {
namespace {

class FileDescriptor {
 public:
  explicit FileDescriptor(int descriptor) : descriptor_(descriptor) {}
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor() { close(); }
  int get() const { return descriptor_; }
  // Some file systems report a failed write only here.
  bool close() {
    const int descriptor = std::exchange(descriptor_, -1);
    return descriptor < 0 || ::close(descriptor) == 0;
  }

 private:
  int descriptor_;
};

tl::unexpected<Error> io_error(const std::filesystem::path& path, std::string_view doing, ErrorKind kind) {
  return fail(kind, fmt::format("{}: {}: {}", path.string(), doing, std::strerror(errno)));
}

Expected<void> write_all(int descriptor, std::string_view contents, const std::filesystem::path& path) {
  while (!contents.empty()) {
    const ssize_t written = ::write(descriptor, contents.data(), contents.size());
    if (written < 0) {
      if (errno == EINTR) {
        continue;
      }
      return io_error(path, "cannot write", ErrorKind::internal);
    }
    contents.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

// So that the rename itself survives a power cut. Some file systems cannot sync a folder (EINVAL): theirs to keep.
Expected<void> sync_folder(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  FileDescriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.get() < 0) {
    return io_error(folder, "cannot open the folder", ErrorKind::internal);
  }
  if (::fsync(descriptor.get()) != 0 && errno != EINVAL) {
    return io_error(folder, "cannot sync the folder", ErrorKind::internal);
  }
  return {};
}

}  // namespace

std::filesystem::path temporary_beside(const std::filesystem::path& path) {
  std::filesystem::path temporary = path;
  temporary.replace_filename(fmt::format(".{}.{}.part", path.filename().string(), ::getpid()));
  return temporary;
}

Expected<void> commit_file(const std::filesystem::path& temporary, const std::filesystem::path& path) {
  const auto commit = [&]() -> Expected<void> {
    FileDescriptor descriptor(::open(temporary.c_str(), O_RDONLY | O_CLOEXEC));
    if (descriptor.get() < 0 || ::fsync(descriptor.get()) != 0 || !descriptor.close()) {
      return io_error(path, "cannot sync", ErrorKind::internal);
    }
    if (::rename(temporary.c_str(), path.c_str()) != 0) {
      return io_error(path, "cannot rename the finished file into place", ErrorKind::internal);
    }
    return sync_folder(path);
  };
  Expected<void> done = commit();
  if (!done) {
    ::unlink(temporary.c_str());
  }
  return done;
}

Expected<void> write_file_atomically(const std::filesystem::path& path, std::string_view contents) {
  // A rename would replace a device or a pipe by a file.
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored)) {
    return fail(ErrorKind::usage, fmt::format("{}: exists and is not a regular file", path.string()));
  }
  const std::filesystem::path temporary = temporary_beside(path);
  constexpr mode_t mode = 0644;
  FileDescriptor descriptor(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, mode));
  if (descriptor.get() < 0) {
    return io_error(path, "cannot create", ErrorKind::bad_input);
  }
  Expected<void> written = write_all(descriptor.get(), contents, path);
  if (written && !descriptor.close()) {
    written = io_error(path, "cannot write", ErrorKind::internal);
  }
  if (!written) {
    ::unlink(temporary.c_str());
    return written;
  }
  return commit_file(temporary, path);
}

Expected<std::string> read_text_file(const std::filesystem::path& path, std::size_t limit) {
  FileDescriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (descriptor.get() < 0 || ::fstat(descriptor.get(), &status) != 0) {
    return io_error(path, "cannot open", ErrorKind::bad_input);
  }
  std::string text;
  if (S_ISREG(status.st_mode)) {
    text.reserve(static_cast<std::size_t>(status.st_size));
  }
  std::array<char, 65536> block{};
  for (;;) {
    const ssize_t count = ::read(descriptor.get(), block.data(), block.size());
    if (count < 0) {
      return io_error(path, "cannot read", ErrorKind::bad_input);
    }
    if (count == 0) {
      return text;
    }
    if (text.size() + static_cast<std::size_t>(count) > limit) {
      return fail(ErrorKind::bad_input, fmt::format("{}: longer than {} bytes", path.string(), limit));
    }
    text.append(block.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace selfcal
