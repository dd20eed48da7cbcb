// Runs `selfcal` and keeps what it says.
#pragma once

#include <string>
#include <vector>

namespace selfcal::test {

struct Finished {
  int status = -1;  // exit status; 128 + signal where it died of one
  std::string out;
  std::string error;
};

Finished run_selfcal(const std::vector<std::string>& arguments);

// What the command line promises of a failure: the status, exactly one line on standard error, nothing on standard
// output. Returns what is wrong with it, empty where nothing is.
std::string failure_fault(const Finished& finished, int status);

}  // namespace selfcal::test
