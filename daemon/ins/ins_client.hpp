// The dialogues with an INS, each a coroutine that answers with what was learnt or why it was not. No state of the
// calibration lives here.
#pragma once

#include <functional>
#include <string>

#include "daemon/host/task.hpp"
#include "daemon/host/timers.hpp"
#include "daemon/ins/ins_port.hpp"
#include "daemon/ins/request_tally.hpp"
#include "daemon/ins/unlock_key.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/ins_interface/identifiers.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {

class InsClient {
 public:
  InsClient(Timers& timers, InsPort& port) : timers_(timers), port_(port) {}

  // Whether a session other than the default one was asked for: it is to be ended (session_end.hpp).
  bool session_asked_for() const { return session_asked_for_; }
  RequestTally& tally() { return tally_; }

  struct Identity {
    std::string serial;
    std::string software;
  };
  Task<Answer<Identity>> identify();
  Task<Answer<Done>> unlock(UnlockKey key);  // extended session, kept by TesterPresent, then SecurityAccess
  Task<Answer<ins::StateRecord>> read_state();
  Task<Answer<ins::DirectoryRecord>> read_directory();
  Task<Answer<ins::SampleFormatRecord>> read_sample_format();
  Task<Answer<ins::SiteRecord>> read_site();
  Task<Answer<Bytes>> read_record(std::uint16_t did);
  Task<Answer<Done>> write_record(std::uint16_t did, Bytes record);
  Task<Answer<Bytes>> routine(uds::RoutineAction action, std::uint16_t routine, Bytes option);
  Task<Answer<Done>> reset();

  // Pages first .. first+count-1 of the latest run; `on_page(page, bytes)` gets each as soon as it is whole.
  using OnPage = std::function<void(std::uint32_t, std::span<const std::uint8_t>)>;
  Task<Answer<Done>> upload(std::uint32_t first, std::uint32_t count, OnPage on_page);

 private:
  Task<Answer<Bytes>> ask(Bytes payload, std::size_t longest_answer);
  Task<Answer<Bytes>> next_block(std::uint8_t block, std::uint32_t longest);

  Timers& timers_;
  InsPort& port_;
  RequestTally tally_;
  bool session_asked_for_ = false;
};

}  // namespace selfcal
