// The end of a diagnostic session: DiagnosticSessionControl to the default session, which locks the INS (ISO 14229-1:
// every change of session takes the security access back).
#pragma once

#include <functional>
#include <string>

#include "daemon/host/timers.hpp"
#include "daemon/ins/ins_port.hpp"

namespace selfcal {

class SessionEnd {
 public:
  // A busy server drops a request silently, so the request is repeated. Eight times a quarter of a second cover
  // the slowest answer that sim_ins and serial NOR FLASH give (0.4 s to erase a sector), and are well below S3 (5 s),
  // which ends the session of an INS that cannot be reached.
  static constexpr int attempts = 8;
  static constexpr std::chrono::milliseconds interval{250};

  SessionEnd(Timers& timers, InsPort& port) : timers_(timers), port_(port) {}
  ~SessionEnd();
  SessionEnd(const SessionEnd&) = delete;
  SessionEnd& operator=(const SessionEnd&) = delete;

  // Ends TesterPresent at once, whatever request is under way is forgotten. `done` gets an empty text once the INS has
  // agreed, else why it did not; it comes from the loop, after 2 s at the latest.
  void begin(std::function<void(const std::string& trouble)> done);
  bool under_way() const { return done_ != nullptr; }
  void abandon();  // `done` is not called

 private:
  void ask();
  void finish(const std::string& trouble);

  Timers& timers_;
  InsPort& port_;
  std::function<void(const std::string&)> done_;
  Timers::Id timer_ = 0;
  int asked_ = 0;
  std::string trouble_;
};

}  // namespace selfcal
