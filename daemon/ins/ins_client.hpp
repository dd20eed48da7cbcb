// The dialogues with an INS, each a coroutine that answers with what was learnt or why it was not. No state of the
// calibration lives here. Which bytes go over the bus is the profile's matter: behind this class are the service's records, sets
// of coefficients as the service keeps them (ins::encode), and pages as it keeps them (flash).
#pragma once

#include <functional>
#include <string>

#include "daemon/host/task.hpp"
#include "daemon/host/timers.hpp"
#include "daemon/ins/ins_port.hpp"
#include "daemon/ins/request_tally.hpp"
#include "daemon/ins/unlock_key.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/profile/told_as.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal {

class InsClient {
 public:
  InsClient(Timers& timers, InsPort& port, const profile::ProfilePtr& profile = profile::built_in())
      : timers_(timers), port_(port), profile_(profile::told_as(profile)), tally_(profile_) {}

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
  Task<Answer<Done>> reset();

  // A set. What the INS tells and is none (erased FLASH, a wrong checksum) comes as it is told.
  enum class SetOf : std::uint8_t { in_force, inactive };
  Task<Answer<Bytes>> read_set(SetOf which);
  // As the INS will hold it: where its record has fewer bits or fields than ours, what it reads back is not what was sent.
  Answer<Bytes> as_held(const ins::Coefficients& set) const;
  Task<Answer<Done>> erase_inactive();
  bool erases() const { return profile_->erase.id.has_value(); }
  // Without slots the inactive set is the one that is written over the set in force.
  bool has_slots() const { return profile_->slots; }
  Task<Answer<Done>> write_inactive(Bytes set);
  Task<Answer<Done>> commit(Bytes set);

  Task<Answer<Done>> write_schedule(ins::ScheduleRecord schedule);
  Task<Answer<Done>> start_rotation(std::uint32_t run_id);
  Task<Answer<Done>> stop_rotation();
  Task<Answer<ins::RunRecord>> rotation_result();
  Task<Answer<Done>> start_check(ins::NavigationCheckRequest request);
  Task<Answer<Done>> stop_check();
  Task<Answer<ins::NavigationCheckRecord>> check_result();

  Task<Answer<Bytes>> read_record(std::uint16_t did);
  Task<Answer<Done>> write_record(std::uint16_t did, Bytes record);
  Task<Answer<Bytes>> routine(uds::RoutineAction action, std::uint16_t routine, Bytes option);

  // Pages first .. first+count-1 of the latest run; `on_page(page, bytes)` gets each as soon as it is whole, or why it cannot
  // be read.
  using OnPage = std::function<void(std::uint32_t, const Expected<Bytes>&)>;
  Task<Answer<Done>> upload(std::uint32_t first, std::uint32_t count, OnPage on_page);

 private:
  Task<Answer<Bytes>> ask(Bytes payload, std::size_t longest_answer);
  Task<Answer<Bytes>> told_set(SetOf which);
  Task<Answer<Done>> read_memory(std::uint32_t first, std::uint32_t count, OnPage on_page);
  Task<Answer<Done>> upload_pages(std::uint32_t first, std::uint32_t count, OnPage on_page);
  Task<Answer<Done>> read_files(std::uint32_t first, std::uint32_t count, OnPage on_page);
  Task<Answer<Done>> take_blocks(std::uint32_t first, std::uint32_t count, std::uint32_t longest,
                                 const OnPage& on_page);
  Task<Answer<Bytes>> next_block(std::uint8_t block, std::uint32_t longest);
  Task<Answer<Done>> command(uds::RoutineAction action, std::uint16_t id, Expected<Bytes> option);

  Timers& timers_;
  InsPort& port_;
  profile::ProfilePtr profile_;
  RequestTally tally_;
  bool session_asked_for_ = false;
  std::uint32_t run_held_ = 0;  // of the directory that was read last
};

// An answer that came, but makes no sense.
tl::unexpected<PortError> protocol_error(const InsPort& port, const Error& error);

}  // namespace selfcal
