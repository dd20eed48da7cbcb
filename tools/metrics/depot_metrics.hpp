// Figures of a depot as Prometheus takes them: of its hub, of a set's outbox, of batches. Asked anew at each collection.
#pragma once

#include <prometheus/collectable.h>

#include <string>
#include <vector>

namespace selfcal::metrics {

struct Sources {
  std::string hub;                   // connection string; empty: none
  std::string state_directory;       // of a set's service; empty: none
  std::vector<std::string> batches;  // folders
};

// A source that cannot be read is a figure too: selfcal_up is 0 for it, and its other figures are left out.
class DepotMetrics : public prometheus::Collectable {
 public:
  explicit DepotMetrics(Sources sources) : sources_(std::move(sources)) {}
  std::vector<prometheus::MetricFamily> Collect() const override;

 private:
  Sources sources_;
};

}  // namespace selfcal::metrics
