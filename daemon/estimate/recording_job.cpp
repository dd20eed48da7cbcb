#include "daemon/estimate/recording_job.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "daemon/estimate/estimate_job.hpp"
#include "daemon/store/page_recording.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> trouble(const fs::path& path, int error) {
  return fail(ErrorKind::device, fmt::format("{}: {}", path.string(), std::strerror(error)));
}

// From the beginning, wherever the one who opened it has read to.
Expected<void> copy_bytes(int from, int to, const fs::path& path, const std::stop_token& stop) {
  std::array<char, 1 << 16> buffer{};
  for (off_t at = 0;;) {
    const ssize_t got = ::pread(from, buffer.data(), buffer.size(), at);
    if (got < 0) {
      return trouble("the recording that was handed over", errno);
    }
    if (got == 0) {
      return ::fsync(to) == 0 ? Expected<void>() : trouble(path, errno);
    }
    for (ssize_t done = 0; done < got;) {
      const ssize_t put = ::write(to, buffer.data() + done, static_cast<std::size_t>(got - done));
      if (put < 0) {
        return trouble(path, errno);
      }
      done += put;
    }
    at += got;
    if (stop.stop_requested()) {
      return fail(ErrorKind::device, "stopped");
    }
  }
}

Expected<void> take_over(const OpenFile& file, const fs::path& path, const std::stop_token& stop) {
  const fs::path part = path.string() + ".part";
  const OpenFile out(::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640));
  if (out.descriptor() < 0) {
    return trouble(part, errno);
  }
  if (const auto copied = copy_bytes(file.descriptor(), out.descriptor(), part, stop); !copied) {
    return copied;
  }
  return ::rename(part.c_str(), path.c_str()) == 0 ? Expected<void>() : trouble(path, errno);
}

Expected<Estimate> run_job(const RecordingRequest& request, const EstimateProgress& progress,
                           const std::stop_token& stop) {
  const fs::path path = recording_path(request.folder);
  if (request.file) {
    if (const auto taken = take_over(*request.file, path, stop); !taken) {
      return tl::unexpected(taken.error());
    }
  }
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    return fail(ErrorKind::device, "the service was stopped before it had all of the recording: import it again");
  }
  auto loaded = read_kept_recording(path);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  const std::string& serial = loaded->recording.serial;
  if (!serial.empty() && serial != request.serial) {
    return fail(ErrorKind::bad_input,
                fmt::format("the recording is of INS \"{}\", not of \"{}\"", serial, request.serial));
  }
  Estimate estimate;
  estimate.recording = path.string();
  return estimate_of(loaded->recording, std::move(estimate), request.config, progress, stop);
}

}  // namespace

OpenFile::~OpenFile() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
}

EstimateJob recording_job(RecordingRequest request) {
  return [request = std::move(request)](const EstimateProgress& progress, std::stop_token stop) {
    return run_job(request, progress, stop);
  };
}

}  // namespace selfcal
