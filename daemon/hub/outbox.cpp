#include "daemon/hub/outbox.hpp"

#include <fmt/format.h>

#include "daemon/store/sqlite.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::hub {
namespace {

using sqlite::database_error;
using sqlite::Statement;

constexpr int busy_ms = 10'000;  // the service's own transactions take milliseconds

// All of `body` or nothing. Immediate, so that it waits for the service here and not in the middle.
template <typename Body>
Expected<void> transaction(sqlite3* database, Body body) {
  Statement begin(database, "BEGIN IMMEDIATE");
  if (auto ok = begin.run(); !ok) {
    return ok;
  }
  Expected<void> done = body();
  Statement end(database, done ? "COMMIT" : "ROLLBACK");
  auto ended = end.run();
  return done ? ended : done;
}

}  // namespace

Expected<std::unique_ptr<Outbox>> Outbox::open(const std::filesystem::path& file) {
  sqlite3* raw = nullptr;
  const int result = sqlite3_open_v2(file.c_str(), &raw, SQLITE_OPEN_READWRITE, nullptr);
  std::unique_ptr<Outbox> outbox(new Outbox(raw));
  if (result != SQLITE_OK) {
    return database_error(raw, "open");
  }
  sqlite3_busy_timeout(raw, busy_ms);
  for (const char* pragma : {"PRAGMA synchronous=FULL", "PRAGMA foreign_keys=ON"}) {
    if (auto ok = Statement(raw, pragma).run(); !ok) {
      return tl::unexpected(ok.error());
    }
  }
  return outbox;
}

Outbox::~Outbox() { sqlite3_close(database_); }

Expected<std::vector<OutboxEntry>> Outbox::waiting(int at_most) const {
  Statement select(database_, "SELECT sequence, run, document FROM outbox WHERE answer='' ORDER BY sequence LIMIT ?");
  select.bind(std::int64_t{at_most});
  std::vector<OutboxEntry> entries;
  while (true) {
    const auto row = select.step();
    if (!row) {
      return tl::unexpected(row.error());
    }
    if (!*row) {
      return entries;
    }
    OutboxEntry entry;
    entry.sequence = select.integer();
    entry.run = select.integer();
    entry.document = select.text();
    entries.push_back(std::move(entry));
  }
}

Expected<void> Outbox::keep_documents(const std::vector<OutboxEntry>& entries) {
  return transaction(database_, [&]() -> Expected<void> {
    Statement update(database_, "UPDATE outbox SET document=? WHERE sequence=? AND document=''");
    for (const OutboxEntry& entry : entries) {
      if (auto ok = update.bind(entry.document).bind(entry.sequence).run(); !ok) {
        return ok;
      }
    }
    return {};
  });
}

// What was taken needs its document no more: the hub has it, and the run is here.
Expected<void> Outbox::keep_answers(const std::vector<std::pair<std::int64_t, std::string>>& answers) {
  return transaction(database_, [&]() -> Expected<void> {
    Statement update(database_,
                     "UPDATE outbox SET answer=?1, document=CASE WHEN ?1 LIKE 'refused%' THEN document ELSE '' END "
                     "WHERE sequence=?2");
    for (const auto& [sequence, answer] : answers) {
      if (auto ok = update.bind(answer).bind(sequence).run(); !ok) {
        return ok;
      }
    }
    return {};
  });
}

Expected<std::optional<RunStore::Parameters>> Outbox::parameters(RunId run) const {
  Statement select(database_, "SELECT name, value, sigma, determined FROM parameters WHERE run=?");
  select.bind(run);
  RunStore::Parameters parameters;
  int found = 0;
  while (true) {
    const auto row = select.step();
    if (!row) {
      return tl::unexpected(row.error());
    }
    if (!*row) {
      return found == sensor_parameter_count ? std::optional(parameters) : std::nullopt;
    }
    if (const auto index = find_sensor_parameter(select.text())) {
      const auto i = static_cast<std::size_t>(*index);
      parameters.value[i] = select.real();
      parameters.sigma[i] = select.real();
      parameters.determined[i] = select.integer() != 0;
      ++found;
    }
  }
}

Expected<OutboxCounts> Outbox::counts() const {
  Statement select(database_,
                   "SELECT count(*) FILTER (WHERE answer=''), count(*) FILTER (WHERE answer IN ('stored','present')), "
                   "count(*) FILTER (WHERE answer LIKE 'refused%') FROM outbox");
  const auto row = select.step();
  if (!row) {
    return tl::unexpected(row.error());
  }
  OutboxCounts counts;
  counts.waiting = select.integer();
  counts.sent = select.integer();
  counts.refused = select.integer();
  return counts;
}

Expected<std::vector<RefusedRun>> Outbox::refused() const {
  Statement select(database_,
                   "SELECT sequence, run, answer FROM outbox WHERE answer LIKE 'refused%' ORDER BY sequence");
  std::vector<RefusedRun> all;
  while (true) {
    const auto row = select.step();
    if (!row) {
      return tl::unexpected(row.error());
    }
    if (!*row) {
      return all;
    }
    RefusedRun one;
    one.sequence = select.integer();
    one.run = select.integer();
    one.reason = select.text();
    all.push_back(std::move(one));
  }
}

Expected<std::vector<std::pair<std::string, std::int64_t>>> Outbox::units() const {
  Statement select(database_,
                   "SELECT r.serial, coalesce((SELECT max(h.arrival) FROM hub_past h WHERE h.serial=r.serial), 0) "
                   "FROM (SELECT DISTINCT serial FROM runs WHERE serial<>'') r ORDER BY 1");
  std::vector<std::pair<std::string, std::int64_t>> units;
  while (true) {
    const auto row = select.step();
    if (!row) {
      return tl::unexpected(row.error());
    }
    if (!*row) {
      return units;
    }
    std::string serial = select.text();
    units.emplace_back(std::move(serial), select.integer());
  }
}

Expected<void> Outbox::keep_past(const std::vector<PastCertificate>& past) {
  return transaction(database_, [&]() -> Expected<void> {
    Statement head(database_, "INSERT OR REPLACE INTO hub_past(arrival, set_name, run, serial, utc) VALUES(?,?,?,?,?)");
    Statement row(database_,
                  "INSERT OR REPLACE INTO hub_past_parameters(arrival, name, value, sigma, determined) "
                  "VALUES(?,?,?,?,?)");
    for (const PastCertificate& one : past) {
      if (auto ok = head.bind(one.arrival).bind(one.set).bind(one.run).bind(one.serial).bind(one.utc).run(); !ok) {
        return ok;
      }
      for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
        row.bind(one.arrival).bind(std::string(sensor_parameters[i].name)).bind(one.parameters.value[i]);
        row.bind(one.parameters.sigma[i]).bind(std::int64_t{one.parameters.determined[i]});
        if (auto ok = row.run(); !ok) {
          return ok;
        }
      }
    }
    return {};
  });
}

}  // namespace selfcal::hub
