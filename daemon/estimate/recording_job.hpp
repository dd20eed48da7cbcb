// From a recording that somebody handed over to the answer: what the estimator's thread does for an imported run.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/host/config.hpp"

namespace selfcal {

// A file that is open for reading; closed with the last owner.
class OpenFile {
 public:
  explicit OpenFile(int descriptor) : descriptor_(descriptor) {}
  ~OpenFile();
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

struct RecordingRequest {
  std::shared_ptr<const OpenFile> file;  // null: the folder holds the recording already
  std::filesystem::path folder;
  std::string serial;
  InsConfig config;  // tolerances and limits
};

// Copies the file into the folder, under its name only when it is complete and on disk; then reads, checks and calibrates it.
EstimateJob recording_job(RecordingRequest request);

}  // namespace selfcal
