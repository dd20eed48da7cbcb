// selfcal metrics: figures of hub, outbox and batches for Prometheus, printed once or served.
#include <fmt/format.h>
#include <prometheus/exposer.h>
#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <csignal>
#include <memory>
#include <sstream>

#include "tools/cli/command.hpp"
#include "tools/metrics/depot_metrics.hpp"

namespace selfcal::cli {
namespace {

struct Arguments {
  metrics::Sources sources;
  std::string listen;
};

// Until a signal ends it.
Expected<int> serve(const std::string& address, const std::shared_ptr<metrics::DepotMetrics>& figures) {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  sigprocmask(SIG_BLOCK, &ends, nullptr);  // before its threads begin
  try {
    prometheus::Exposer exposer(address);
    exposer.RegisterCollectable(figures);
    int signal = 0;
    sigwait(&ends, &signal);
    return 0;
  } catch (const std::exception& error) {  // of the library: an address that is none, or in use
    return fail(ErrorKind::usage, fmt::format("--listen {}: {}", address, error.what()));
  }
}

Expected<int> metrics_of(const Arguments& arguments) {
  const metrics::Sources& sources = arguments.sources;
  if (sources.hub.empty() && sources.state_directory.empty() && sources.batches.empty()) {
    return fail(ErrorKind::usage, "nothing to ask: --hub, --state-directory or --batch");
  }
  const auto figures = std::make_shared<metrics::DepotMetrics>(sources);
  if (!arguments.listen.empty()) {
    return serve(arguments.listen, figures);
  }
  std::ostringstream text;
  prometheus::TextSerializer().Serialize(text, figures->Collect());
  fmt::print("{}", text.str());
  return 0;
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  options.text("--hub", arguments->sources.hub, "connection string of a hub");
  options.text("--state-directory", arguments->sources.state_directory, "of a set's service: its outbox");
  options.texts("--batch", arguments->sources.batches, "folder of a batch; repeated");
  options.text("--listen", arguments->listen, "HOST:PORT at which /metrics is served; else printed once");
  return [arguments] { return metrics_of(*arguments); };
}

const CommandRegistration registration{{"metrics", "figures of hub, outbox and batches for Prometheus", configure}};

}  // namespace
}  // namespace selfcal::cli
