// The progress of a run, as an onlooker may read it at any time, and the observer that its news are reported to.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "daemon/store/run_state.hpp"
#include "daemon/store/run_store.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/document/summary.hpp"
#include "protocol/ins_interface/status.hpp"

namespace selfcal {

struct RunProgress {
  RunId run = 0;
  State state = State::connecting;
  ins::Status ins;  // as last reported
  int positions = 0;
  std::uint32_t pages_pulled = 0;
  std::uint32_t pages_expected = 0;
  std::uint32_t pages_refetched = 0;  // for a wrong CRC
  int pass = 0;
  double pass_fraction = 0.0;
  bool estimate_known = false;
  std::array<double, sensor_parameter_count> value{}, sigma{}, tolerance{};  // in the unit of sensor_parameters
  int tolerances_met = 0;     // parameters whose sigma is below its tolerance
  bool running = false;       // the estimate is one of data that still come
  double data_s = 0.0;        // then: it is made of so much
  double met_at_s = -1.0;     // and every tolerance is foreseen to be met so far into the schedule; -1: not
  double finish_in_s = -1.0;  // until the rotation ends, on the operator's clock; -1: it does not turn
  bool link_up = true;
  std::string link_trouble;  // why the last request had no answer
  std::uint64_t lost_frames = 0;
  Summary summary;  // of the run, once it has ended; empty sentences before
};

class RunObserver {
 public:
  virtual ~RunObserver() = default;
  virtual void on_state(const RunRecord& run) = 0;
  virtual void on_progress(const RunRecord& run) = 0;
  virtual void on_warning(const RunRecord& run, const std::string& text) = 0;
  virtual void on_finished(const RunRecord& run) = 0;  // the run may be destroyed later, from the loop
};

}  // namespace selfcal
