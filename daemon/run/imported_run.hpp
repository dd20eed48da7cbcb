// A recording of somebody else's that enters the history as a run: estimated and judged like any other, and nothing is asked
// of an INS or written to it.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/estimate/recording_job.hpp"
#include "daemon/store/run_store.hpp"

namespace selfcal {

struct ImportRequest {
  std::shared_ptr<const OpenFile> file;
  std::string serial;
  std::string source;        // who recorded it, and which file it is
  std::string ins;           // whose tolerances and limits are meant; empty: the ones built in
  std::string measured_utc;  // when the recording begins; empty: not known, so now
  std::string user;
};

class ImportedRun {
 public:
  // `store` outlives it. `ended` comes once, from the loop, when the record is final.
  ImportedRun(EventLoop& loop, RunStore& store, RunRecord record, InsConfig config,
              std::function<void(const RunRecord&)> ended);

  // With the file that was handed over; without one, the folder's own is taken up again.
  void begin(std::shared_ptr<const OpenFile> file, const std::filesystem::path& folder);
  const RunRecord& record() const { return record_; }
  bool over() const { return is_final(record_.state); }

 private:
  void on_estimate(Expected<Estimate> answer);
  Expected<void> keep(const Estimate& estimate);
  void remember(const std::string& kind, const std::string& text);
  void end(State state, int exit_status, const std::string& reason);

  RunStore& store_;
  RunRecord record_;
  InsConfig config_;
  std::function<void(const RunRecord&)> ended_;
  EstimateWorker worker_;
};

}  // namespace selfcal
