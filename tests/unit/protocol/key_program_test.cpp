// What a key program may do to its caller: nothing but say the key, or be told of in one line.
#include "protocol/key_program/key_program.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

namespace selfcal {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;
constexpr double limit_s = 0.5;
// A limit that is kept is kept within the time that a loaded machine takes to look.
constexpr double patience_s = 5.0;
const Bytes seed{0x01, 0xAB, 0xFF, 0x00};

class KeyProgramTest : public testing::Test {
 protected:
  KeyProgramTest() {
    std::string name = (fs::temp_directory_path() / "key_program.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    ::chmod(folder_.c_str(), 0755);  // run by root, it is nobody who opens it
    program_.limit_s = limit_s;
    program_.key_bytes = seed.size();
  }
  ~KeyProgramTest() override { fs::remove_all(folder_); }

  void write(const std::string& text, mode_t mode = 0755) {
    program_.file = (folder_ / "key").string();
    std::ofstream(program_.file) << text;
    ::chmod(program_.file.c_str(), mode);
  }
  Expected<Bytes> key() {
    const auto begin = std::chrono::steady_clock::now();
    auto answer = key_by_program(program_, seed);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    EXPECT_LT(taken.count(), limit_s + patience_s);
    EXPECT_TRUE(ends()) << "outlives its caller";
    return answer;
  }
  // Whether any process has the file in its command line.
  bool alive() const {
    for (const auto& entry : fs::directory_iterator("/proc")) {
      std::ifstream file(entry.path() / "cmdline");
      const std::string line{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
      if (line.find(program_.file) != std::string::npos) {
        return true;
      }
    }
    return false;
  }
  // It has been told to end: on a loaded machine that takes until it is its turn.
  bool ends() const {
    const auto begin = std::chrono::steady_clock::now();
    while (alive()) {
      if (std::chrono::steady_clock::now() - begin > std::chrono::duration<double>(patience_s)) {
        return false;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  void fails_with(const std::string& cause) {
    const auto answer = key();
    ASSERT_FALSE(answer);
    const std::string& message = answer.error().message;
    EXPECT_TRUE(message.starts_with("key program " + program_.file + ": ")) << message;
    EXPECT_NE(message.find(cause), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_LT(message.size(), program_.file.size() + 250) << message;
  }

  fs::path folder_;
  KeyProgram program_;
};

TEST_F(KeyProgramTest, GetsTheSeedOnStandardInput) {
  write("#!/bin/sh\nread seed\necho \"  $seed \"\n");
  const auto answer = key();
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(*answer, seed);
}

TEST_F(KeyProgramTest, GetsTheSeedAsItsArgument) {
  program_.seed_as_argument = true;
  write("#!/bin/sh\nread nothing && exit 9\nprintf %s \"$1\"\n");
  const auto answer = key();
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(*answer, seed);
}

// Descriptors, variables, groups, user: what it says are their numbers.
TEST_F(KeyProgramTest, HasNothingOfItsCallers) {
  program_.key_bytes = 6;
  program_.limit_s = 10.0;
  ::setenv("SELFCAL_SECRET", "1", 1);
  const int kept = ::dup(0);
  write(R"(#!/usr/bin/python3 -IS
import os
fds = [fd for fd in range(0, 4096) if os.path.exists(f"/proc/self/fd/{fd}")]
secrets = sum("SELFCAL" in name for name in os.environ)
privileges = [line for line in open("/proc/self/status") if line.startswith("NoNewPrivs")][0].split()[1]
print("%02x%02x%02x%02x%04x" % (len(fds), secrets, len(os.getgroups()), int(privileges), os.getuid()))
)");
  const auto answer = key();
  ::close(kept);
  ASSERT_TRUE(answer) << answer.error().message;
  const bool root = ::geteuid() == 0;
  EXPECT_EQ((*answer)[0], 3);
  EXPECT_EQ((*answer)[1], 0);
  EXPECT_EQ((*answer)[3], 1);
  if (root) {
    EXPECT_EQ((*answer)[2], 0);
    EXPECT_EQ((*answer)[4] << 8 | (*answer)[5], 65534);
  }
}

TEST_F(KeyProgramTest, ThatIsNotThere) {
  program_.file = (folder_ / "absent").string();
  fails_with("No such file");
}

TEST_F(KeyProgramTest, ThatIsAFolder) {
  program_.file = folder_.string();
  fails_with("is no file");
}

TEST_F(KeyProgramTest, ThatIsNotExecutable) {
  write("#!/bin/sh\necho 00\n", 0644);
  fails_with("cannot be run: Permission denied");
}

TEST_F(KeyProgramTest, ThatIsNoProgram) {
  write("echo 00\n");
  fails_with("cannot be run: Exec format error");
}

TEST_F(KeyProgramTest, ThatOthersMayWrite) {
  write("#!/bin/sh\nread seed\necho $seed\n", 0757);
  fails_with("others may write it (mode 0757)");
  write("#!/bin/sh\nread seed\necho $seed\n", 0775);
  fails_with("others may write it (mode 0775)");
}

TEST_F(KeyProgramTest, ThatFails) {
  write("#!/bin/sh\necho 01020304\necho 'no such\tunit' >&2\necho more >&2\nexit 3\n");
  fails_with("ended with status 3: no suchunit");
}

TEST_F(KeyProgramTest, ThatWritesNothing) {
  write("#!/bin/sh\nexit 0\n");
  fails_with("wrote nothing");
}

// Nor is what it wrote in the message: it may be the key.
TEST_F(KeyProgramTest, ThatWritesNoDigits) {
  for (const char* words : {"0x010203", "0102030", "key: 01"}) {
    write(std::string("#!/bin/sh\necho '") + words + "'\n");
    fails_with("are not pairs of hexadecimal digits");
    EXPECT_EQ(key().error().message.find(words), std::string::npos);
  }
}

TEST_F(KeyProgramTest, ThatWritesAnotherLength) {
  write("#!/bin/sh\necho 010203\n");
  fails_with("wrote a key of 3 bytes, 4 are expected");
}

TEST_F(KeyProgramTest, ThatWritesForEver) {
  write("#!/bin/sh\nwhile :; do echo 01020304; done\n");
  fails_with("writes more than the 8 digits of a key");
  write("#!/bin/sh\nwhile :; do echo 01020304 >&2; done\n");
  fails_with("no key within 0.5 s: 01020304");
}

TEST_F(KeyProgramTest, ThatIgnoresSignals) {
  write("#!/bin/sh\ntrap '' TERM INT HUP QUIT PIPE ALRM XCPU\nwhile :; do :; done\n");
  fails_with("no key within 0.5 s");
}

TEST_F(KeyProgramTest, ThatClosesItsOutputAndStays) {
  write("#!/bin/sh\nexec >&- 2>&-\nwhile :; do :; done\n");
  fails_with("no key within 0.5 s");
}

// A process that it leaves behind would outlive its end.
TEST_F(KeyProgramTest, ThatForks) {
  program_.limit_s = 10.0;
  write(R"(#!/usr/bin/python3 -IS
import os, time
if os.fork() == 0:
    os.setsid()
    time.sleep(60)
print("01020304")
)");
  fails_with("ended with status 1");
}

TEST_F(KeyProgramTest, ThatDies) {
  write("#!/bin/sh\nkill -SEGV $$\n");
  fails_with("died of signal 11");
}

TEST_F(KeyProgramTest, ThatWritesAFile) {
  write("#!/bin/sh\necho x > " + (folder_ / "left").string() + " || exit 4\necho 01020304\n");
  static_cast<void>(key());
  std::error_code none;
  EXPECT_EQ(fs::exists(folder_ / "left") ? fs::file_size(folder_ / "left", none) : 0, 0);
}

TEST_F(KeyProgramTest, EndsWithItsOwner) {
  program_.limit_s = 60.0;
  write("#!/bin/sh\nwhile :; do :; done\n");
  {
    auto running = RunningKeyProgram::start(program_, seed);
    ASSERT_TRUE(running) << running.error().message;
    const auto begin = std::chrono::steady_clock::now();
    ASSERT_TRUE((*running)->look());
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(100));
  }
  EXPECT_FALSE(alive());
}

}  // namespace
}  // namespace selfcal
