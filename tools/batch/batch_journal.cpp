#include "tools/batch/batch_journal.hpp"

#include <fmt/format.h>

#include "daemon/host/journal.hpp"

namespace selfcal::batch {

using journal::Fields;
using journal::Level;

namespace {

const char* state_of(const Counts& counts, bool paused) {
  if (paused) {
    return "paused";
  }
  return counts.open > 0 ? "open" : counts.failed > 0 ? "failed" : "done";
}

Fields fields_of(const std::string& batch, const std::string& state) {
  Fields fields;
  fields.batch = batch;
  fields.state = state;
  return fields;
}

}  // namespace

BatchJournal::BatchJournal(const BatchFolder& folder)
    : folder_(folder), batch_(folder.plan().identity().substr(0, 12)) {}

void BatchJournal::begun() const {
  const Counts counts = count(folder_.states());
  journal::note(Level::notice,
                fmt::format("batch {}: {} tasks, {} of them open", folder_.plan().kind, counts.all(), counts.open),
                fields_of(batch_, "begun"));
}

void BatchJournal::task_ended(std::size_t index) const {
  if (const auto line = folder_.failure(index)) {
    const Task& task = folder_.task(index);
    Fields fields = fields_of(batch_, "failed");
    fields.step = name_of(task.step);
    fields.task = task.label;
    fields.key = task.key;
    journal::note(Level::warning, fmt::format("batch {}: {} failed: {}", folder_.plan().kind, task.label, *line),
                  fields);
  }
}

void BatchJournal::ended() const {
  const Counts counts = count(folder_.states());
  const std::string state = state_of(counts, folder_.paused());
  journal::note(state == "failed" ? Level::warning : Level::notice,
                fmt::format("batch {}: {} of {} tasks done, {} failed, {} blocked, {} open", folder_.plan().kind,
                            counts.done, counts.all(), counts.failed, counts.blocked, counts.open),
                fields_of(batch_, state));
}

void BatchJournal::broken_off(const Error& error) const {
  journal::note(Level::error, fmt::format("batch {}: {}", folder_.plan().kind, error.message),
                fields_of(batch_, "open"));
}

}  // namespace selfcal::batch
