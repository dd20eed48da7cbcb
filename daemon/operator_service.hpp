// The operator interface on D-Bus (protocol/operator_api): turns calls into the service's, and its news into signals.
#pragma once

#include <sdbus-c++/sdbus-c++.h>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/run/calibration_run.hpp"
#include "daemon/run/imported_run.hpp"

namespace selfcal {

// A run's recording is to be estimated again, with the physics that the diagnosis names in it.
struct AmendRequest {
  RunId run = 0;
  std::vector<RunId> with;  // runs of the same INS whose recordings are looked at together with it
  bool dry_run = false;
  std::string force_reason;
  std::string user;
};

struct StartRequest {
  std::string ins;
  std::string schedule;       // empty: the configured one
  std::string schedule_toml;  // instead: the text of a schedule file, which the service keeps
  bool dry_run = false;
  bool stop_when_met = false;
  std::string force_reason;
  std::string user;
};

// What is known of an INS without asking it.
struct Standing {
  std::string bus;  // "can0: up", what is wrong with the interface, or how a run fares on it
  std::string serial;
  RunId last_calibration = 0;  // the latest run that wrote its set; 0: none
  std::string last_calibration_utc;
  std::string last_calibration_kind;  // calibration, amendment, rollback
  std::uint32_t set_version = 0;      // that it put in force
};

// Why a request was not taken up; `name` is the D-Bus error's.
struct Refusal {
  std::string name;
  std::string message;
};
template <typename T>
using Granted = tl::expected<T, Refusal>;

// What the operator interface needs of the service.
class Operations {
 public:
  virtual ~Operations() = default;
  virtual Granted<RunId> start(const StartRequest& request) = 0;
  virtual Granted<RunId> amend(const AmendRequest& request) = 0;
  virtual Granted<RunId> import_run(const ImportRequest& request) = 0;
  virtual Granted<RunId> rollback(const std::string& serial, const std::string& reason, const std::string& user) = 0;
  virtual Granted<Done> abort(const std::string& ins, const std::string& reason) = 0;
  virtual Granted<std::string> show(RunId run) = 0;
  virtual Granted<std::string> history(const std::string& serial) = 0;
  virtual Granted<std::string> check_database() = 0;
  virtual Granted<std::string> backup_database(const std::string& name) = 0;
  virtual Granted<std::string> restore_database(const std::string& name) = 0;
  virtual std::vector<std::string> instruments() const = 0;
  // Null before the first run of this daemon's life.
  virtual const RunProgress* progress(const std::string& ins) const = 0;
  virtual const RunRecord* record(const std::string& ins) const = 0;
  virtual Standing standing(const std::string& ins) const = 0;
  // Standing::bus, after an INS without a run was asked. `done` comes from the loop, or at once.
  virtual void ask_bus(const std::string& ins, std::function<void(const std::string&)> done) = 0;
};

class OperatorService {
 public:
  OperatorService(sdbus::IConnection& connection, Operations& operations);
  ~OperatorService();
  OperatorService(const OperatorService&) = delete;
  OperatorService& operator=(const OperatorService&) = delete;

  void update_instruments();  // after a reload
  void state_changed(const RunRecord& run);
  void progress_changed(const RunRecord& run);
  void warning(const RunRecord& run, const std::string& text);
  void finished(const RunRecord& run);

 private:
  class Manager;
  class Ins;
  Ins* find(const std::string& ins);

  sdbus::IConnection& connection_;
  Operations& operations_;
  std::unique_ptr<Manager> manager_;
  std::map<std::string, std::unique_ptr<Ins>> instruments_;
};

}  // namespace selfcal
