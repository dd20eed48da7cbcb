// The key to a SecurityAccess seed by a program of the user's own: what it gets, what it may do, and why there is no key.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal {

struct KeyProgram {
  std::string file;
  bool seed_as_argument = false;  // else on standard input
  double limit_s = 5.0;
  std::size_t key_bytes = 16;
};

class ChildProcess;

// Ended with its owner: the program does not outlive this.
class RunningKeyProgram {
 public:
  using Bytes = std::vector<std::uint8_t>;
  // Fails (bad_input) where the file is not there, is none, or may be written by others.
  [[nodiscard]] static Expected<std::unique_ptr<RunningKeyProgram>> start(const KeyProgram& program,
                                                                          std::span<const std::uint8_t> seed);
  ~RunningKeyProgram();
  RunningKeyProgram(const RunningKeyProgram&) = delete;
  RunningKeyProgram& operator=(const RunningKeyProgram&) = delete;

  // The key once the program has ended well; none yet; or, in one line that names the program, why there will be none.
  // Never waits.
  [[nodiscard]] Expected<std::optional<Bytes>> look();

 private:
  RunningKeyProgram(KeyProgram program, std::unique_ptr<ChildProcess> child);
  tl::unexpected<Error> failed(const std::string& why);
  Expected<std::optional<Bytes>> judge(int status);

  KeyProgram program_;
  std::unique_ptr<ChildProcess> child_;
  std::chrono::steady_clock::time_point deadline_;
};

// The same for who has nothing else to do: waits until the program has ended or its time is over.
[[nodiscard]] Expected<std::vector<std::uint8_t>> key_by_program(const KeyProgram& program,
                                                                 std::span<const std::uint8_t> seed);

}  // namespace selfcal
