// Monte Carlo of the calibration against the bound: README.md of this folder.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <thread>

#include "tests/monte_carlo/report.hpp"

namespace selfcal::monte_carlo {
namespace {

struct Options {
  int runs = 100;
  int control_runs = 20;
  int jobs = 1;
  std::uint64_t seed = 1;
  double rate_hz = 200.0;
  std::vector<std::string> cases;
  Limits limits;
  bool as_json = false;
};

std::vector<Trial> run_case(const Case& c, const Options& options) {
  std::vector<Trial> trials(static_cast<std::size_t>(options.runs));
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t k = next++; k < trials.size(); k = next++) {
      trials[k] = run_trial(c, options.rate_hz, options.seed + k, static_cast<int>(k) < options.control_runs);
    }
  };
  std::vector<std::jthread> workers;
  for (int j = 1; j < options.jobs; ++j) {
    workers.emplace_back(work);
  }
  work();
  workers.clear();
  return trials;
}

int run(const Options& options) {
  nlohmann::ordered_json all;
  all["seeds"] = {options.seed, options.seed + static_cast<std::uint64_t>(options.runs) - 1};
  all["sample_rate_hz"] = options.rate_hz;
  all["cases"] = nlohmann::ordered_json::array();
  if (!options.as_json) {
    fmt::print("seeds {} to {}, {} Hz\n", options.seed, options.seed + static_cast<std::uint64_t>(options.runs) - 1,
               options.rate_hz);
  }
  bool holds = true;
  for (const Case& c : all_cases()) {
    const std::string name(c.name);
    if (!options.cases.empty() && std::find(options.cases.begin(), options.cases.end(), name) == options.cases.end()) {
      continue;
    }
    const CaseReport report = evaluate(name, run_case(c, options), options.limits);
    holds = holds && report.holds();
    if (options.as_json) {
      all["cases"].push_back(json(report));
    } else {
      fmt::print("{}", text(report));
      std::fflush(stdout);
    }
  }
  all["holds"] = holds;
  if (options.as_json) {
    fmt::print("{}\n", all.dump(1));
  }
  return holds ? 0 : 1;
}

}  // namespace
}  // namespace selfcal::monte_carlo

int main(int argc, char** argv) {
  using selfcal::monte_carlo::Case;
  selfcal::monte_carlo::Options options;
  std::vector<std::string> names;
  for (const Case& c : selfcal::monte_carlo::all_cases()) {
    names.emplace_back(c.name);
  }
  CLI::App app("Monte Carlo of the calibration against the physical bound");
  app.add_option("--runs", options.runs, "runs per case")->check(CLI::Range(2, 100000))->capture_default_str();
  app.add_option("--case", options.cases, "these cases only")->check(CLI::IsMember(names));
  app.add_option("--seed", options.seed, "of the first run; the others follow")->capture_default_str();
  app.add_option("--rate", options.rate_hz, "sample rate, Hz")->check(CLI::Range(50.0, 1000.0))->capture_default_str();
  app.add_option("--controls", options.control_runs, "runs per case that also try the negative controls")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--confidence", options.limits.confidence, "of the NEES interval")
      ->check(CLI::Range(0.5, 0.99999))
      ->capture_default_str();
  app.add_option("--jobs", options.jobs, "threads")->check(CLI::Range(1, 64))->capture_default_str();
  app.add_flag("--json", options.as_json, "JSON on standard output");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return selfcal::monte_carlo::run(options);
}
