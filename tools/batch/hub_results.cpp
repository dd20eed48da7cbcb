#include "tools/batch/hub_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/file_hash.hpp"

namespace selfcal::batch {
namespace {

constexpr std::size_t at_once = 50, asked_at_once = 1000;
constexpr double pause_after_trouble_s = 2.0;
constexpr std::size_t longest_file = 500'000'000;

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace

Expected<std::unique_ptr<HubResults>> HubResults::open(const std::string& connection, const BatchFolder& folder) {
  std::unique_ptr<HubResults> results(new HubResults(connection, folder));
  if (auto connected = results->connect(); !connected) {
    return tl::unexpected(connected.error());
  }
  return results;
}

Expected<void> HubResults::connect() {
  if (connection_ && connection_->alive()) {
    return {};
  }
  auto connection = hub::Connection::open(parameters_);
  if (!connection) {
    return tl::unexpected(connection.error());
  }
  connection_ = std::move(*connection);
  return {};
}

Expected<std::size_t> HubResults::exchange(BatchFolder& folder) {
  std::size_t came = 0;
  const auto& tasks = folder.plan().tasks;
  for (std::size_t from = 0; from < tasks.size(); from += asked_at_once) {
    std::string keys;
    const std::size_t to = std::min(tasks.size(), from + asked_at_once);
    for (std::size_t i = from; i < to; ++i) {
      keys += (keys.empty() ? "{" : ",") + tasks[i].key;
    }
    const auto known =
        connection_->ask("SELECT key, content FROM batch_results WHERE key = ANY($1::text[])", {keys + "}"});
    if (!known) {
      return tl::unexpected(known.error());
    }
    std::map<std::string, std::string> content;
    for (int row = 0; row < known->size(); ++row) {
      content[known->text(row, 0)] = known->text(row, 1);
    }
    for (std::size_t i = from; i < to; ++i) {
      const auto there = content.find(tasks[i].key);
      const bool here = folder.has_result(i);
      if (there == content.end()) {
        if (here) {
          waiting_.insert(i);
        }
        continue;
      }
      if (here && sha256_of_file(folder.result_path(i)).value_or("") == there->second) {
        continue;
      }
      const auto result = connection_->ask("SELECT result FROM batch_results WHERE key = $1", {tasks[i].key});
      if (!result) {
        return tl::unexpected(result.error());
      }
      if (auto kept = folder.keep_result(i, result->text(0, 0)); !kept) {
        return tl::unexpected(kept.error());
      }
      ++came;
    }
  }
  return came;
}

void HubResults::offer(std::size_t task) {
  waiting_.insert(task);
  if (waiting_.size() >= at_once && now_s() >= not_before_s_) {
    if (!send()) {
      not_before_s_ = now_s() + pause_after_trouble_s;
    }
  }
}

Expected<void> HubResults::flush(double patience_s) {
  const double end = now_s() + patience_s;
  while (true) {
    const auto sent = waiting_.empty() ? connect().and_then([&] { return note_batch(); }) : send();
    if (!differs_.empty()) {
      return fail(ErrorKind::internal, fmt::format("task {}: the hub has another result under its key", differs_));
    }
    if (sent && waiting_.empty()) {
      return {};
    }
    if (!sent && now_s() > end) {
      return fail(sent.error().kind, fmt::format("{}; {} results wait for it (the same command sends them)",
                                                 sent.error().message, waiting_.size()));
    }
    if (!sent) {
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
    }
  }
}

Expected<void> HubResults::send() {
  const double begun = now_s();
  std::vector<std::size_t> tasks(waiting_.begin(), waiting_.end());
  tasks.resize(std::min(tasks.size(), at_once));
  auto sent = connect().and_then([&] { return send_in_transaction(tasks); });
  seconds_ += now_s() - begun;
  if (!sent) {
    connection_.reset();
    return sent;
  }
  for (const std::size_t task : tasks) {
    waiting_.erase(task);
  }
  return {};
}

Expected<void> HubResults::send_in_transaction(const std::vector<std::size_t>& tasks) {
  if (auto begun = connection_->execute("BEGIN"); !begun) {
    return begun;
  }
  std::size_t stored = 0, present = 0;
  for (const std::size_t index : tasks) {
    const Task& task = folder_.task(index);
    const auto text = read_text_file(folder_.result_path(index), longest_file);
    if (!text) {
      return tl::unexpected(text.error());
    }
    const auto answer = connection_->ask("SELECT keep_result($1, $2, $3, $4, $5)",
                                         {task.key, std::string(name_of(task.step)), folder_.plan().version,
                                          task.recording_sha256.empty() ? hub::Value{} : task.recording_sha256, *text});
    if (!answer) {
      return tl::unexpected(answer.error());
    }
    const std::string word = answer->text(0, 0);
    stored += word == "stored" ? 1 : 0;
    present += word == "present" ? 1 : 0;
    differs_ = word == "differs" && differs_.empty() ? task.label : differs_;
  }
  if (auto noted = note_batch(); !noted) {
    return noted;
  }
  if (auto done = connection_->execute("COMMIT"); !done) {
    return done;
  }
  stored_ += stored;
  present_ += present;
  return {};
}

Expected<void> HubResults::note_batch() {
  const Counts counts = count(folder_.states());
  return connection_
      ->ask("SELECT note_batch($1, $2, $3, $4, $5, $6)",
            {folder_.plan().identity(), folder_.plan().kind, folder_.plan().version, std::to_string(counts.all()),
             std::to_string(counts.done), std::to_string(counts.failed + counts.blocked)})
      .map([](const hub::Rows&) {});
}

}  // namespace selfcal::batch
