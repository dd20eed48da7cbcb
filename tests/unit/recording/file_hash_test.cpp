#include "protocol/recording/file_hash.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace selfcal {
namespace {

// Digests of FIPS 180-4 (NIST, examples of SHA-256): "abc" and a million "a"; and of the empty message.
TEST(FileHash, AgreesWithTheStandard) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "file_hash_test";
  const auto hash_of = [&](const std::string& contents) {
    std::ofstream(file, std::ios::binary) << contents;
    return sha256_of_file(file).value_or("error");
  };
  EXPECT_EQ(hash_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  // Longer than one piece of the reader.
  EXPECT_EQ(hash_of(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  std::filesystem::remove(file);
}

TEST(FileHash, NamesAFileThatCannotBeRead) {
  for (const char* path : {"/nonexistent/recording.h5", "/"}) {  // missing; a folder opens and does not read
    const auto hash = sha256_of_file(path);
    ASSERT_FALSE(hash) << path;
    EXPECT_EQ(hash.error().kind, ErrorKind::bad_input);
    EXPECT_TRUE(hash.error().message.starts_with(std::string(path) + ": cannot read: ")) << hash.error().message;
  }
}

}  // namespace
}  // namespace selfcal
