// A process without privileges: its standard streams as pipes that are never waited for, and its end.
#pragma once

#include <sys/types.h>

#include <memory>
#include <optional>
#include <string>

#include "protocol/error.hpp"

namespace selfcal {

struct ChildOrder {
  std::string file;
  std::optional<std::string> argument;
  std::string input;             // on its standard input
  unsigned processor_s = 1;      // that it may use
  std::size_t most_output = 0;   // bytes that are kept of its standard output
  std::size_t most_message = 0;  // and of its standard error; what comes behind is dropped
};

class ChildProcess {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<ChildProcess>> start(const ChildOrder& order);
  ~ChildProcess();  // kills it
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  // Takes what has come. Its wait status once it has ended.
  std::optional<int> look();
  void kill();

  // Why it could not be begun: known only after the start, when it is to become the program.
  const std::string& not_begun() const { return not_begun_; }
  const std::string& output() const { return output_; }
  bool output_too_long() const { return output_too_long_; }
  const std::string& message() const { return message_; }

 private:
  ChildProcess() = default;
  void take_streams();

  ChildOrder order_;
  pid_t pid_ = -1;
  int begun_ = -1, from_output_ = -1, from_error_ = -1;
  std::optional<int> status_;
  std::string not_begun_, output_, message_;
  bool output_too_long_ = false;
};

}  // namespace selfcal
