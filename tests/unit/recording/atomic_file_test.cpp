#include "protocol/recording/atomic_file.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>

#include "protocol/recording/hdf5.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal {
namespace {

// While one lives no file of this process can grow beyond `bytes`: what a full disk does, without one.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limited{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limited);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

std::size_t files_in(const std::filesystem::path& folder) {
  const std::filesystem::directory_iterator entries(folder);
  return static_cast<std::size_t>(std::distance(begin(entries), end(entries)));
}

TEST(AtomicFile, ReplacesAWholeFile) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_file_atomically(folder / "f", "before"));
  ASSERT_TRUE(write_file_atomically(folder / "f", "after"));
  EXPECT_EQ(read_text_file(folder / "f", 100).value(), "after");
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(AtomicFile, FullDiskLeavesTheOldFileAndNoPart) {
  const test::TemporaryFolder folder;
  Recording recording = test::sample_recording();
  ASSERT_TRUE(write_hdf5(recording, folder / "r.h5"));
  const std::string before = read_text_file(folder / "r.h5", 1 << 24).value();
  recording.serial = "OTHER";
  Expected<void> written;
  {
    const FileSizeLimit limit(before.size() / 2);
    written = write_hdf5(recording, folder / "r.h5");
  }
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, ::testing::HasSubstr("r.h5: cannot write: File too large"));
  EXPECT_EQ(read_text_file(folder / "r.h5", 1 << 24).value(), before);
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(AtomicFile, UnwritablePlacesAreNamed) {
  const test::TemporaryFolder folder;
  const auto written = write_file_atomically(folder / "absent/f", "x");
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, ::testing::HasSubstr("absent/f: cannot create: No such file"));
  EXPECT_THAT(write_file_atomically("/dev/null", "x").error().message, ::testing::HasSubstr("not a regular file"));
}

TEST(AtomicFile, ReadLimit) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_file_atomically(folder / "f", "12345"));
  EXPECT_EQ(read_text_file(folder / "f", 5).value(), "12345");
  EXPECT_THAT(read_text_file(folder / "f", 4).error().message, ::testing::HasSubstr("longer than 4 bytes"));
}

}  // namespace
}  // namespace selfcal
