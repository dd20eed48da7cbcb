// What the daemon remembers: runs, their events, their results, and the coefficient sets that were in force. SQLite,
// WAL, synchronous FULL: when a call returns, what it stored survives a power cut.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/store/run_state.hpp"
#include "protocol/error.hpp"

struct sqlite3;

namespace selfcal {

using RunId = std::int64_t;  // 1, 2, ...

struct RunRecord {
  RunId id = 0;
  std::string ins;     // section in selfcald.toml
  std::string serial;  // empty until identified
  std::string ins_software;
  State state = State::connecting;
  std::string user;
  std::string schedule;            // as asked for: name or file
  bool dry_run = false;            // writes no set; an imported recording never does
  std::string force_reason;        // empty: not forced
  bool rollback = false;           // writes a former set instead of calibrating
  RunId amends = 0;                // estimates this run's recording again, with the physics named in it; 0: none
  std::vector<RunId> amends_with;  // further runs of the same INS whose recordings are looked at together with it
  bool stop_when_met = false;      // the rotation may end as soon as every tolerance is met
  std::string source;              // of a recording that was imported as a run: nothing was asked of an INS, or written
  std::string started_utc, ended_utc;
  std::string software;  // of the daemon
  int exit_status = -1;  // -1: not ended
  std::string reason;    // one line, why it ended as it did
  bool abort_wanted = false;
  std::uint32_t rotation = 0;                     // the INS's own number of the rotation, 0: none yet
  std::string recording;                          // path, empty: none (yet, or pruned)
  std::string result_json;                        // selfcal estimate --json of the recording
  double drift_old_m = -1.0, drift_new_m = -1.0;  // free-inertial, horizontal; -1: not measured
  double early_end_s = -1.0;  // of data, where the rotation was ended before its schedule; -1: it was not
};

// Its coefficients went into force.
inline bool wrote_its_set(const RunRecord& run) { return run.state == State::completed && !run.dry_run; }
// "calibration", "amendment", "rollback" or "recording".
std::string_view run_kind(const RunRecord& run);

struct EventRecord {
  std::string utc;
  std::string kind;  // transition, warning, operator, ...
  std::string text;
};

struct ParameterRecord {
  RunId run = 0;
  std::string utc;
  double value = 0.0, sigma = 0.0;  // in the unit of sensor_parameters
  bool determined = false;
};

// Found in force before the run; written by it; what the INS then gave back, before the commit.
enum class SetRole { previous, written, read_back };

class RunStore {
 public:
  // Creates the database where there is none; refuses one that fails SQLite's integrity check or has a newer schema.
  static Expected<std::unique_ptr<RunStore>> open(const std::filesystem::path& file);
  ~RunStore();
  RunStore(const RunStore&) = delete;
  RunStore& operator=(const RunStore&) = delete;

  Expected<RunId> create_run(const RunRecord& run);  // id is given by the database
  Expected<void> update_run(const RunRecord& run);   // all but id, ins, user, started
  Expected<void> add_event(RunId run, const EventRecord& event);
  Expected<void> store_set(RunId run, SetRole role, const std::vector<std::uint8_t>& bytes);
  // In the unit of sensor_parameters, their order.
  struct Parameters {
    std::array<double, 24> value{}, sigma{};
    std::array<bool, 24> determined{};
  };
  Expected<void> store_parameters(RunId run, const Parameters& parameters);

  Expected<std::optional<RunRecord>> run(RunId id) const;
  Expected<std::vector<RunRecord>> unfinished_runs() const;
  Expected<std::vector<RunRecord>> runs_of_serial(const std::string& serial) const;  // empty serial: of all
  Expected<std::vector<EventRecord>> events(RunId run) const;
  Expected<std::optional<std::vector<std::uint8_t>>> set(RunId run, SetRole role) const;
  // Oldest first; completed runs that wrote their set, and recordings that were imported as runs.
  Expected<std::vector<ParameterRecord>> parameter_history(const std::string& serial, int index) const;
  Expected<std::vector<RunRecord>> runs_with_recordings() const;  // oldest first

  static Expected<void> check(const std::filesystem::path& file);  // integrity and orphan states
  static Expected<void> copy(const std::filesystem::path& from, const std::filesystem::path& to);  // backup, restore

 private:
  explicit RunStore(sqlite3* database) : database_(database) {}
  sqlite3* database_;
};

}  // namespace selfcal
