#include "protocol/recording/recording_bytes.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <type_traits>

namespace selfcal {
namespace {

// One description of the fields for both directions. `Stream` offers value(T&) and sequence(container&).
template <typename Stream, typename RecordingType>
void fields(Stream& stream, RecordingType& r) {
  stream.sequence(r.serial);
  stream.sequence(r.start_time_utc);
  stream.value(r.sample_rate_hz);
  stream.value(r.latitude_deg);
  stream.value(r.longitude_deg);
  stream.value(r.height_m);
  stream.value(r.gimbal_absent);
  stream.value(r.dwell_s);
  stream.value(r.rotation_s);
  stream.value(r.temperature_channels);
  stream.sequence(r.time_s);
  stream.sequence(r.delta_theta_rad);
  stream.sequence(r.delta_v_mps);
  stream.sequence(r.gimbal_outer_rad);
  stream.sequence(r.gimbal_inner_rad);
  stream.sequence(r.temperature_c);
  stream.sequence(r.schedule_deg);
}

class Writer {
 public:
  explicit Writer(int descriptor) : descriptor_(descriptor) {}
  bool good() const { return good_; }

  template <typename T>
  void value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes(&value, sizeof value);
  }
  template <typename Container>
  void sequence(const Container& container) {
    value(container.size());
    bytes(container.data(), container.size() * sizeof(typename Container::value_type));
  }

 private:
  void bytes(const void* data, std::size_t size) {
    const char* from = static_cast<const char*>(data);
    while (good_ && size > 0) {
      const ssize_t written = ::write(descriptor_, from, size);
      if (written <= 0) {
        good_ = written < 0 && errno == EINTR;
        continue;
      }
      from += written;
      size -= static_cast<std::size_t>(written);
    }
  }
  int descriptor_;
  bool good_ = true;
};

class Reader {
 public:
  Reader(int descriptor, std::size_t size) : descriptor_(descriptor), left_(size) {}
  bool good() const { return good_; }
  bool at_end() const { return left_ == 0; }

  template <typename T>
  void value(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes(&value, sizeof value);
  }
  template <typename Container>
  void sequence(Container& container) {
    constexpr std::size_t each = sizeof(typename Container::value_type);
    std::size_t size = 0;
    value(size);
    good_ = good_ && size <= left_ / each;
    if (good_) {
      container.resize(size);
      bytes(container.data(), size * each);
    }
  }

 private:
  void bytes(void* data, std::size_t size) {
    good_ = good_ && size <= left_;
    char* to = static_cast<char*>(data);
    while (good_ && size > 0) {
      const ssize_t count = ::read(descriptor_, to, size);
      if (count <= 0) {
        good_ = count < 0 && errno == EINTR;
        continue;
      }
      to += count;
      size -= static_cast<std::size_t>(count);
      left_ -= static_cast<std::size_t>(count);
    }
  }
  int descriptor_;
  std::size_t left_;
  bool good_ = true;
};

constexpr int no_error = 0;  // ErrorKind starts at 2

}  // namespace

bool write_bytes(int descriptor, const Expected<Recording>& recording) {
  Writer writer(descriptor);
  if (recording) {
    writer.value(no_error);
    fields(writer, *recording);
  } else {
    writer.value(static_cast<int>(recording.error().kind));
    writer.sequence(recording.error().message);
  }
  return writer.good();
}

Expected<Recording> read_bytes(int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) {
    return fail(ErrorKind::internal, "cannot read back what was parsed");
  }
  Reader reader(descriptor, static_cast<std::size_t>(status.st_size));
  int kind = no_error;
  reader.value(kind);
  Recording recording;
  std::string message;
  if (kind == no_error) {
    fields(reader, recording);
  } else {
    reader.sequence(message);
  }
  if (!reader.good() || !reader.at_end()) {
    return fail(ErrorKind::internal, "cannot read back what was parsed");
  }
  if (kind != no_error) {
    return fail(kind == static_cast<int>(ErrorKind::bad_input) ? ErrorKind::bad_input : ErrorKind::internal,
                std::move(message));
  }
  return recording;
}

}  // namespace selfcal
