// What a set has to send to its hub, and what the hub told it: tables of the set's own SQLite database (daemon/store), which
// RunStore makes. A run enters the outbox in the transaction that ends it, by a trigger.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/store/run_store.hpp"
#include "protocol/error.hpp"

namespace selfcal::hub {

struct OutboxEntry {
  std::int64_t sequence = 0;
  RunId run = 0;
  std::string document;  // empty: not made yet
};

struct OutboxCounts {
  std::int64_t waiting = 0, sent = 0, refused = 0;
};

struct RefusedRun {
  std::int64_t sequence = 0;
  RunId run = 0;
  std::string reason;
};

// What another set measured of a unit of ours.
struct PastCertificate {
  std::int64_t arrival = 0;
  std::string set;
  RunId run = 0;
  std::string serial, utc;
  RunStore::Parameters parameters;
};

class Outbox {
 public:
  // The database must have been opened by RunStore before.
  static Expected<std::unique_ptr<Outbox>> open(const std::filesystem::path& file);
  ~Outbox();
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  Expected<std::vector<OutboxEntry>> waiting(int at_most) const;  // in order
  // What is sent is made once and kept, so that a repeat is the same to the byte. One transaction.
  Expected<void> keep_documents(const std::vector<OutboxEntry>& entries);
  // Of the hub, for each sequence: one transaction.
  Expected<void> keep_answers(const std::vector<std::pair<std::int64_t, std::string>>& answers);
  Expected<std::optional<RunStore::Parameters>> parameters(RunId run) const;  // none: it estimated nothing
  Expected<OutboxCounts> counts() const;
  Expected<std::vector<RefusedRun>> refused() const;

  // Units that this set has met, each with the last arrival that it has of it (0: none).
  Expected<std::vector<std::pair<std::string, std::int64_t>>> units() const;
  Expected<void> keep_past(const std::vector<PastCertificate>& past);

 private:
  explicit Outbox(sqlite3* database) : database_(database) {}
  sqlite3* database_;
};

}  // namespace selfcal::hub
