// How a run stands, in three sentences, and whether its set is the one that the INS uses now.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/store/run_store.hpp"
#include "protocol/document/summary.hpp"

namespace selfcal {

// Of the set that a run wrote. A set is in force from the end of its run until another one takes its place: a later
// calibration, an amendment or a rollback of the same INS, or a set from elsewhere (a later run found another).
struct InForce {
  bool now = false;
  bool known = true;       // false: a later run broke off when it may have changed the set; `now` is then false
  std::string from_utc;    // empty: it never was
  std::string until_utc;   // empty: it still is, or it never was
  RunId ended_by_run = 0;  // 0: none; the run that wrote another set, found another one, or broke off
};

Expected<InForce> in_force(const RunStore& store, const RunRecord& run);

// The run that a rollback undid; 0 where `run` is no rollback or none is known.
Expected<RunId> rolled_back_run(const RunStore& store, const RunRecord& run);

// `result` is the run's stored result, or null.
Summary run_summary(const RunRecord& run, const InForce& in_force, RunId rolled_back,
                    const nlohmann::ordered_json& result);

// The same from the store alone; where the store cannot say, from the record.
Summary run_summary(const RunStore& store, const RunRecord& run);

}  // namespace selfcal
