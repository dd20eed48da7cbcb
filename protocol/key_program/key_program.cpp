#include "protocol/key_program/key_program.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstring>
#include <thread>

#include "protocol/key_program/child_process.hpp"

namespace selfcal {
namespace {

using Bytes = RunningKeyProgram::Bytes;
constexpr std::size_t most_message = 100;
constexpr std::size_t white_space = 64;  // around the digits

std::string hexadecimal(std::span<const std::uint8_t> bytes) {
  std::string digits;
  for (const std::uint8_t byte : bytes) {
    digits += fmt::format("{:02x}", byte);
  }
  return digits;
}

// Why the file is not to be run; empty: it is.
std::string objection(const std::string& file) {
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0) {
    return std::strerror(errno);
  }
  if (!S_ISREG(found.st_mode)) {
    return "is no file";
  }
  if ((found.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    return fmt::format("its group or others may write it (mode {:04o}): who can, opens the lock",
                       found.st_mode & 07777U);
  }
  if (found.st_uid != 0 && found.st_uid != ::geteuid()) {
    return fmt::format("belongs to user {}, not to root or to user {}", found.st_uid, ::geteuid());
  }
  return {};
}

// One line, printable.
std::string first_line(const std::string& text) {
  std::string line = text.substr(0, text.find('\n'));
  std::erase_if(line, [](char c) { return c < 0x20 || c > 0x7E; });
  return line;
}

std::optional<Bytes> bytes_of(std::string_view digits) {
  Bytes bytes(digits.size() / 2);
  bool well = digits.size() % 2 == 0;
  for (std::size_t k = 0; well && k < bytes.size(); ++k) {
    const char* at = digits.data() + 2 * k;
    const auto read = std::from_chars(at, at + 2, bytes[k], 16);
    well = read.ec == std::errc() && read.ptr == at + 2;
  }
  return well ? std::optional(bytes) : std::nullopt;
}

}  // namespace

RunningKeyProgram::RunningKeyProgram(KeyProgram program, std::unique_ptr<ChildProcess> child)
    : program_(std::move(program)),
      child_(std::move(child)),
      deadline_(std::chrono::steady_clock::now() +
                std::chrono::nanoseconds(static_cast<std::int64_t>(program_.limit_s * 1e9))) {}

RunningKeyProgram::~RunningKeyProgram() = default;

Expected<std::unique_ptr<RunningKeyProgram>> RunningKeyProgram::start(const KeyProgram& program,
                                                                      std::span<const std::uint8_t> seed) {
  if (const std::string why = objection(program.file); !why.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("key program {}: {}", program.file, why));
  }
  ChildOrder order;
  order.file = program.file;
  if (program.seed_as_argument) {
    order.argument = hexadecimal(seed);
  } else {
    order.input = hexadecimal(seed) + "\n";
  }
  order.processor_s = static_cast<unsigned>(std::ceil(program.limit_s));
  order.most_output = 2 * program.key_bytes + white_space;
  order.most_message = most_message;
  auto child = ChildProcess::start(order);
  if (!child) {
    return fail(child.error().kind, fmt::format("key program {}: {}", program.file, child.error().message));
  }
  return std::unique_ptr<RunningKeyProgram>(new RunningKeyProgram(program, std::move(*child)));
}

tl::unexpected<Error> RunningKeyProgram::failed(const std::string& why) {
  child_->kill();
  const std::string said = first_line(child_->message());
  return tl::unexpected<Error>(Error{
      ErrorKind::bad_input, fmt::format("key program {}: {}{}{}", program_.file, why, said.empty() ? "" : ": ", said)});
}

Expected<std::optional<Bytes>> RunningKeyProgram::look() {
  const auto status = child_->look();
  if (!child_->not_begun().empty()) {
    return failed(fmt::format("cannot be run: {}", child_->not_begun()));
  }
  if (child_->output_too_long()) {
    return failed(fmt::format("writes more than the {} digits of a key", 2 * program_.key_bytes));
  }
  if (status) {
    return judge(*status);
  }
  if (std::chrono::steady_clock::now() >= deadline_) {
    return failed(fmt::format("no key within {:g} s", program_.limit_s));
  }
  return std::nullopt;
}

Expected<std::optional<Bytes>> RunningKeyProgram::judge(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return failed(fmt::format("died of signal {} ({})", signal, ::strsignal(signal)));
  }
  if (WEXITSTATUS(status) != 0) {
    return failed(fmt::format("ended with status {}", WEXITSTATUS(status)));
  }
  std::string digits = child_->output();
  std::erase_if(digits, [](unsigned char c) { return std::isspace(c) != 0; });
  if (digits.empty()) {
    return failed("wrote nothing");
  }
  const auto key = bytes_of(digits);
  if (!key) {
    return failed("what it wrote are not pairs of hexadecimal digits");
  }
  if (key->size() != program_.key_bytes) {
    return failed(fmt::format("wrote a key of {} bytes, {} are expected", key->size(), program_.key_bytes));
  }
  return key;
}

Expected<Bytes> key_by_program(const KeyProgram& program, std::span<const std::uint8_t> seed) {
  const auto running = RunningKeyProgram::start(program, seed);
  if (!running) {
    return tl::unexpected(running.error());
  }
  while (true) {
    auto key = (*running)->look();
    if (!key) {
      return tl::unexpected(key.error());
    }
    if (*key) {
      return std::move(**key);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

}  // namespace selfcal
