// Follows a run of the daemon to its end: progress on the terminal, warnings, Ctrl-C as a safe stop.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "protocol/error.hpp"
#include "tools/cli/online_client.hpp"

namespace selfcal::cli {

// SIGINT and SIGTERM ask for a safe stop of the run that is followed; SIGWINCH draws its line anew.
void catch_signals();
// One of them has come since.
bool interrupted();

struct Ending {
  int exit_status = 0;
  std::string reason;
};

// Begins to listen when it is made, so before the run is begun.
class Follower {
 public:
  Follower(ManagerClient& manager, std::string ins);
  ~Follower();
  Expected<Ending> follow(std::uint64_t run);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace selfcal::cli
