#include "daemon/hub/replicator.hpp"

#include <fmt/format.h>

#include <system_error>

#include "daemon/hub/hub_schema.hpp"
#include "daemon/hub/run_message.hpp"

namespace selfcal::hub {
namespace {

constexpr int at_once = 50;        // entries in one transaction
constexpr int oldest_version = 1;  // of the schema that this program can send to; later ones keep submit_run

// Classes of SQLSTATE that tell of the document and not of the hub: data exception, integrity, a limit of PostgreSQL.
bool of_the_document(const std::string& sql_state) {
  return sql_state.starts_with("22") || sql_state.starts_with("23") || sql_state.starts_with("54");
}

}  // namespace

Replicator::Replicator(HubConfig config, std::map<std::string, std::string> types, RunStore& store, Outbox& outbox)
    : config_(std::move(config)), types_(std::move(types)), store_(store), outbox_(outbox) {}

Expected<void> Replicator::connect() {
  if (connection_ && connection_->alive()) {
    return {};
  }
  connection_.reset();
  auto connection = Connection::open(config_.connection, Security::authenticated);
  if (!connection) {
    return tl::unexpected(connection.error());
  }
  const auto version = version_of(**connection);
  if (!version) {
    return tl::unexpected(version.error());
  }
  if (*version < oldest_version) {
    return fail(ErrorKind::device, fmt::format("hub {}: schema version {}, at least {} is needed",
                                               (*connection)->place(), *version, oldest_version));
  }
  connection_ = std::move(*connection);
  return {};
}

Expected<void> Replicator::make_document(OutboxEntry& entry) {
  const auto run = store_.run(entry.run);
  if (!run) {
    return tl::unexpected(run.error());
  }
  if (!*run) {
    return fail(ErrorKind::device, fmt::format("outbox: run {} is not in the database", entry.run));
  }
  std::optional<KeptRecording> recording;
  std::error_code ignored;
  // One that was pruned meanwhile is gone; its results go all the same.
  if (!config_.recordings.empty() && !(*run)->recording.empty() &&
      std::filesystem::exists((*run)->recording, ignored)) {
    auto kept = keep_recording((*run)->recording, config_.recordings);
    if (!kept) {
      return tl::unexpected(kept.error());
    }
    recording = *kept;
  }
  const auto type = types_.find((*run)->ins);
  auto message = run_message(store_, outbox_, **run, type == types_.end() ? (*run)->ins : type->second, recording);
  if (!message) {
    return tl::unexpected(message.error());
  }
  entry.document = std::move(*message);
  return {};
}

Expected<void> Replicator::make_documents(std::vector<OutboxEntry>& entries) {
  std::vector<OutboxEntry> made;
  for (OutboxEntry& entry : entries) {
    if (entry.document.empty()) {
      if (auto ok = make_document(entry); !ok) {
        return ok;
      }
      made.push_back(entry);
    }
  }
  return made.empty() ? Expected<void>{} : outbox_.keep_documents(made);
}

// One statement, so one transaction that waits for nobody: a set that is cut off in the middle of it leaves no lock at the hub.
Expected<Replicator::Answers> Replicator::submit(const std::vector<OutboxEntry>& entries) {
  std::vector<std::int64_t> sequences, runs;
  std::vector<std::string> documents;
  for (const OutboxEntry& entry : entries) {
    sequences.push_back(entry.sequence);
    runs.push_back(entry.run);
    documents.push_back(entry.document);
  }
  const auto rows = connection_->ask(
      "SELECT submit_run(sequence, run, document) FROM (SELECT * FROM unnest($1::bigint[], $2::bigint[], $3::jsonb[]) "
      "WITH ORDINALITY e(sequence, run, document, place) ORDER BY place) e",
      {sql_array(sequences), sql_array(runs), sql_array(documents)});
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  if (rows->size() != static_cast<int>(entries.size())) {
    return fail(ErrorKind::device,
                fmt::format("hub {}: {} answers to {} runs", connection_->place(), rows->size(), entries.size()));
  }
  Answers answers;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    answers.emplace_back(entries[i].sequence, rows->text(static_cast<int>(i), 0));
  }
  return answers;
}

// A document that the server cannot even read must not stop those behind it.
Expected<Replicator::Answers> Replicator::submit_alone(const OutboxEntry& entry) {
  auto answers = submit({entry});
  if (answers || !of_the_document(connection_->sql_state())) {
    return answers;
  }
  return Answers{{entry.sequence, "refused: " + answers.error().message}};
}

Expected<int> Replicator::fetch_past() {
  const auto units = outbox_.units();
  if (!units) {
    return tl::unexpected(units.error());
  }
  std::vector<std::string> serials;
  std::vector<std::int64_t> after;
  for (const auto& [serial, arrival] : *units) {
    serials.push_back(serial);
    after.push_back(arrival);
  }
  const auto rows = connection_->ask(
      "SELECT arrival, set_name, run, serial, to_char(at, 'YYYY-MM-DD\"T\"HH24:MI:SS\"Z\"'), value, sigma, "
      "determined::int[] FROM units_past($1, $2)",
      {sql_array(serials), sql_array(after)});
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  std::vector<PastCertificate> past;
  for (int i = 0; i < rows->size(); ++i) {
    PastCertificate one{rows->integer(i, 0), rows->text(i, 1), rows->integer(i, 2),
                        rows->text(i, 3),    rows->text(i, 4), {}};
    const auto value = rows->reals(i, 5), sigma = rows->reals(i, 6), determined = rows->reals(i, 7);
    if (value.size() != one.parameters.value.size() || sigma.size() != value.size() ||
        determined.size() != value.size()) {
      return fail(ErrorKind::device,
                  fmt::format("hub {}: certificate {}: {} values", connection_->place(), one.arrival, value.size()));
    }
    for (std::size_t k = 0; k < value.size(); ++k) {
      one.parameters.value[k] = value[k];
      one.parameters.sigma[k] = sigma[k];
      one.parameters.determined[k] = determined[k] != 0.0;
    }
    past.push_back(std::move(one));
  }
  if (past.empty()) {
    return 0;
  }
  if (auto ok = outbox_.keep_past(past); !ok) {
    return tl::unexpected(ok.error());
  }
  return static_cast<int>(past.size());
}

Expected<StepResult> Replicator::step() {
  auto entries = outbox_.waiting(at_once);
  if (!entries) {
    return tl::unexpected(entries.error());
  }
  // Made while the hub is away too: recordings that are pruned later are then in the shared folder.
  if (auto ok = make_documents(*entries); !ok) {
    return tl::unexpected(ok.error());
  }
  const auto give_up = [this](const Error& error) -> tl::unexpected<Error> {
    connection_.reset();
    return tl::unexpected(error);
  };
  if (auto ok = connect(); !ok) {
    return give_up(ok.error());
  }
  StepResult result;
  if (!entries->empty()) {
    auto answers = submit(*entries);
    if (!answers && of_the_document(connection_->sql_state())) {
      entries->resize(1);
      answers = submit_alone(entries->front());
    }
    if (!answers) {
      return give_up(answers.error());
    }
    if (auto ok = outbox_.keep_answers(*answers); !ok) {
      return tl::unexpected(ok.error());
    }
    result.sent = static_cast<int>(answers->size());
    result.more = true;
    for (std::size_t i = 0; i < answers->size(); ++i) {
      if ((*answers)[i].second.starts_with("refused")) {
        result.refused.push_back({(*answers)[i].first, (*entries)[i].run, (*answers)[i].second});
      }
    }
    return result;
  }
  const auto past = fetch_past();
  if (!past) {
    return give_up(past.error());
  }
  result.past = *past;
  return result;
}

}  // namespace selfcal::hub
