#include "tools/metrics/depot_metrics.hpp"

#include <prometheus/metric_family.h>

#include <array>

#include "daemon/hub/hub_connection.hpp"
#include "daemon/hub/outbox.hpp"
#include "daemon/store/database_copies.hpp"
#include "tools/batch/batch_folder.hpp"

namespace selfcal::metrics {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using Labels = std::vector<ClientMetric::Label>;

// One family of the hub: each row is a sample, its last column the value and the others the labels.
struct Question {
  const char* name;
  const char* help;
  prometheus::MetricType type;
  std::vector<const char*> labels;
  const char* sql;
};

constexpr auto gauge = prometheus::MetricType::Gauge;
constexpr auto counter = prometheus::MetricType::Counter;

const std::vector<Question>& questions() {
  static const std::vector<Question> all = {
      {"selfcal_hub_schema_version",
       "Version of the hub's schema.",
       gauge,
       {},
       "SELECT max(version) FROM schema_version"},
      {"selfcal_hub_bytes", "Size of the hub's database.", gauge, {}, "SELECT pg_database_size(current_database())"},
      {"selfcal_hub_units", "Units that the hub knows.", gauge, {}, "SELECT count(*) FROM units"},
      {"selfcal_hub_units_overdue",
       "Units that are due and were not calibrated.",
       gauge,
       {},
       "SELECT count(*) FROM forecasts WHERE due < now()"},
      {"selfcal_hub_fit_timestamp_seconds",
       "When the fleet's model was fitted last.",
       gauge,
       {},
       "SELECT extract(epoch FROM max(at)) FROM fits HAVING max(at) IS NOT NULL"},
      {"selfcal_hub_runs_since_fit",
       "Runs that the fleet's model has not seen.",
       gauge,
       {},
       "SELECT count(*) FROM runs WHERE arrival > coalesce((SELECT max(arrival) FROM fits), 0)"},
      {"selfcal_set_runs_total",
       "Runs that the hub has of a set.",
       counter,
       {"set"},
       "SELECT s.name, count(r.arrival) FROM sets s LEFT JOIN runs r ON r.set_name = s.name GROUP BY 1 ORDER BY 1"},
      {"selfcal_set_refused_total",
       "Runs of a set that the hub refused.",
       counter,
       {"set"},
       "SELECT s.name, count(f.run) FROM sets s LEFT JOIN refusals f ON f.set_name = s.name GROUP BY 1 ORDER BY 1"},
      {"selfcal_set_seen_timestamp_seconds",
       "When a set sent something last.",
       gauge,
       {"set"},
       "SELECT name, extract(epoch FROM last_seen) FROM sets WHERE last_seen IS NOT NULL ORDER BY 1"},
      {"selfcal_set_accused",
       "1 for a parameter in which a set is accused of a bias.",
       gauge,
       {"set", "type", "parameter"},
       "SELECT o.set_name, o.type, p.name, 1 FROM set_offsets o JOIN parameters p USING (position) WHERE o.accused "
       "ORDER BY 1, 2, 3"},
      {"selfcal_hub_batch_results", "Results of batches in the hub.", gauge, {}, "SELECT count(*) FROM batch_results"},
      {"selfcal_hub_batch_tasks",
       "Tasks of a batch, as its driver told last.",
       gauge,
       {"batch", "kind", "state"},
       "SELECT left(id, 12), kind, state, n FROM batches, LATERAL (VALUES ('done', done), ('failed', failed), "
       "('open', tasks - done - failed)) v(state, n) ORDER BY 1, 3"},
      {"selfcal_hub_batch_told_timestamp_seconds",
       "When a batch's driver told last.",
       gauge,
       {"batch", "kind"},
       "SELECT left(id, 12), kind, extract(epoch FROM told) FROM batches ORDER BY 1"}};
  return all;
}

void add(MetricFamily& family, Labels labels, double value) {
  ClientMetric metric;
  metric.label = std::move(labels);
  (family.type == counter ? metric.counter.value : metric.gauge.value) = value;
  family.metric.push_back(std::move(metric));
}

// Whether the hub answered every question.
bool ask_hub(const std::string& parameters, std::vector<MetricFamily>& families) {
  const auto connection = hub::Connection::open(parameters);
  if (!connection) {
    return false;
  }
  for (const Question& question : questions()) {
    const auto rows = (*connection)->ask(question.sql);
    if (!rows) {
      return false;
    }
    MetricFamily family{question.name, question.help, question.type, {}};
    for (int row = 0; row < rows->size(); ++row) {
      Labels labels;
      for (std::size_t k = 0; k < question.labels.size(); ++k) {
        labels.push_back({question.labels[k], rows->text(row, static_cast<int>(k))});
      }
      add(family, std::move(labels), rows->real(row, static_cast<int>(question.labels.size())));
    }
    if (!family.metric.empty()) {
      families.push_back(std::move(family));
    }
  }
  return true;
}

bool ask_outbox(const std::string& state_directory, std::vector<MetricFamily>& families) {
  const auto outbox = hub::Outbox::open(database_path(state_directory));
  const auto counts = outbox ? (*outbox)->counts() : tl::unexpected(outbox.error());
  if (!counts) {
    return false;
  }
  MetricFamily family{"selfcal_outbox_runs", "Runs of this set by what became of them at the hub.", gauge, {}};
  add(family, {{"state", "waiting"}}, static_cast<double>(counts->waiting));
  add(family, {{"state", "sent"}}, static_cast<double>(counts->sent));
  add(family, {{"state", "refused"}}, static_cast<double>(counts->refused));
  families.push_back(std::move(family));
  return true;
}

bool ask_batch(const std::string& name, MetricFamily& tasks, MetricFamily& processor) {
  const auto folder = batch::BatchFolder::open(name);
  if (!folder) {
    return false;
  }
  const batch::Counts counts = batch::count(folder->states());
  for (const auto& [state, number] : {std::pair("done", counts.done), std::pair("failed", counts.failed),
                                      std::pair("blocked", counts.blocked), std::pair("open", counts.open)}) {
    add(tasks, {{"folder", name}, {"kind", folder->plan().kind}, {"state", state}}, static_cast<double>(number));
  }
  add(processor, {{"folder", name}, {"kind", folder->plan().kind}}, folder->processor_s());
  return true;
}

}  // namespace

std::vector<MetricFamily> DepotMetrics::Collect() const {
  std::vector<MetricFamily> families;
  MetricFamily up{"selfcal_up", "1 where the source answered, 0 where it did not.", gauge, {}};
  if (!sources_.hub.empty()) {
    add(up, {{"source", "hub"}}, ask_hub(sources_.hub, families) ? 1.0 : 0.0);
  }
  if (!sources_.state_directory.empty()) {
    add(up, {{"source", "outbox"}}, ask_outbox(sources_.state_directory, families) ? 1.0 : 0.0);
  }
  MetricFamily tasks{"selfcal_batch_tasks", "Tasks of a batch by state.", gauge, {}};
  MetricFamily processor{"selfcal_batch_processor_seconds_total", "Processor time of a batch's tasks.", counter, {}};
  for (const std::string& folder : sources_.batches) {
    add(up, {{"source", folder}}, ask_batch(folder, tasks, processor) ? 1.0 : 0.0);
  }
  for (MetricFamily* family : {&tasks, &processor, &up}) {
    if (!family->metric.empty()) {
      families.push_back(std::move(*family));
    }
  }
  return families;
}

}  // namespace selfcal::metrics
