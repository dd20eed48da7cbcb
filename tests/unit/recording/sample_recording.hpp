// A small sound recording for tests, made from its gimbal's motion: 50 Hz, three dwells of 6 s, two moves of 3 s.
#pragma once

#include <filesystem>
#include <string>

#include "protocol/recording/recording.hpp"

namespace selfcal::test {

inline constexpr double sample_rate_hz = 50.0;

Recording sample_recording();

// A fresh folder of this process, removed with all it holds at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// The recordings of another program, where this machine has them: in $SELFCAL_SHARED/recordings, or beside the
// source tree; empty where it has not.
std::filesystem::path shared_recordings();

}  // namespace selfcal::test
