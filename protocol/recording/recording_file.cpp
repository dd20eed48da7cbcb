#include "protocol/recording/recording_file.hpp"

#include "protocol/recording/csv.hpp"
#include "protocol/recording/hdf5.hpp"

namespace selfcal {

Expected<LoadedRecording> read_recording(const std::filesystem::path& path, const CheckPolicy& policy) {
  return path.extension() == ".csv" ? read_csv(path, policy) : read_hdf5(path, policy);
}

Expected<void> write_recording(const Recording& recording, const std::filesystem::path& path) {
  return path.extension() == ".csv" ? write_csv(recording, path) : write_hdf5(recording, path);
}

}  // namespace selfcal
