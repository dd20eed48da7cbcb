// The record of a run in the database, its progress for onlookers, and its story: events, warnings, the reason of its end.
#pragma once

#include <map>
#include <string>

#include "daemon/host/timers.hpp"
#include "daemon/ins/ins_port.hpp"
#include "daemon/run/run_progress.hpp"
#include "estimator/models/sensor_model.hpp"
#include "protocol/error.hpp"

namespace selfcal {

class RunJournal {
 public:
  // All of these outlive it. `interface` begins what is reported of the bus.
  RunJournal(Timers& timers, RunStore& store, const InsPort& port, RunObserver& observer, RunRecord record);

  RunRecord record;
  RunProgress progress;

  // Stores the record. An error is returned once; from then on nothing is stored (storage_lost).
  Expected<void> store_record();
  void remember(const std::string& kind, const std::string& text);
  void warn(const std::string& text);
  // The first reason is the one that counts: what follows is its consequence.
  void fail_with(const std::string& reason, ErrorKind kind = ErrorKind::device);
  void report_progress(bool at_once = false);
  void report_state();

  void show_estimate(const ParameterVector& value, const ParameterVector& sigma);
  // An error frame of the CAN controller: each kind is reported at most every ten seconds.
  void on_bus_event(can::BusEvent event);
  // The record is final and stored: sums up, and reports to journal and observer.
  void conclude();

  bool storage_lost() const { return storage_lost_; }
  int failure_status() const { return failure_status_; }
  int last_nrc = -1;  // of the last request, where the INS refused it

 private:
  void sum_up_bus_events();

  struct BusEventCount {
    std::uint64_t count = 0;
    SteadyTime said_at{};
  };

  Timers& timers_;
  RunStore& store_;
  const InsPort& port_;
  RunObserver& observer_;
  std::map<can::BusEvent, BusEventCount> bus_events_;
  SteadyTime reported_at_{};
  int failure_status_ = static_cast<int>(ErrorKind::device);
  bool failed_ = false;
  bool storage_lost_ = false;
};

}  // namespace selfcal
