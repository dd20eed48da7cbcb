// Brings a set's outbox to its hub, in order, and what other sets measured of its units back. No thread and no clock of its
// own: whoever owns it calls step() again and again, and waits between.
//
// Exactly once in effect: the hub knows a run by (set, run) and by its content; what it has it answers with "present". A
// connection that breaks anywhere leaves entries that were stored and not marked; they are sent again and change nothing.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/host/hub_config.hpp"
#include "daemon/hub/hub_connection.hpp"
#include "daemon/hub/outbox.hpp"
#include "daemon/store/run_store.hpp"

namespace selfcal::hub {

struct StepResult {
  int sent = 0;                     // entries that the hub answered
  std::vector<RefusedRun> refused;  // of these
  int past = 0;                     // certificates of other sets that came
  bool more = false;                // a further step would send at once
};

class Replicator {
 public:
  // `types`: profile of each [ins.NAME]. Store and outbox outlive it.
  Replicator(HubConfig config, std::map<std::string, std::string> types, RunStore& store, Outbox& outbox);

  // Connects where it has to, sends up to 50 entries in one statement, fetches. An error (device: the hub, its
  // network, this set's disk; bad_input: the connection string) leaves everything to be tried again.
  Expected<StepResult> step();
  void disconnect() { connection_.reset(); }

 private:
  Expected<void> connect();
  Expected<void> make_document(OutboxEntry& entry);
  Expected<void> make_documents(std::vector<OutboxEntry>& entries);  // those that are not made yet
  using Answers = std::vector<std::pair<std::int64_t, std::string>>;
  Expected<Answers> submit(const std::vector<OutboxEntry>& entries);
  Expected<Answers> submit_alone(const OutboxEntry& entry);
  Expected<int> fetch_past();

  HubConfig config_;
  std::map<std::string, std::string> types_;
  RunStore& store_;
  Outbox& outbox_;
  std::unique_ptr<Connection> connection_;
};

}  // namespace selfcal::hub
