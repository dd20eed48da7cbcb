// selfcal simulate: a recording from the same model as the virtual INS.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>

#include "protocol/recording/recording_file.hpp"
#include "protocol/schedule_file/schedule_file.hpp"
#include "sim_ins/physics.hpp"
#include "sim_ins/simulate.hpp"
#include "tools/cli/command.hpp"

namespace selfcal::cli {
namespace {

struct SimulateArguments {
  std::string config;
  std::string schedule{default_schedule};
  std::optional<double> dwell_s;
  std::optional<double> rotation_s;
  std::uint64_t seed = 1;
  std::string physics;
  std::string output;
  std::string truth;
};

Expected<int> simulate_recording(const SimulateArguments& arguments) {
  Expected<sim::SimConfig> config{sim::SimConfig{}};
  if (!arguments.config.empty()) {
    config = sim::read_sim_config(arguments.config);
  }
  if (!config) {
    return tl::unexpected(config.error());
  }
  const Expected<Schedule> schedule = find_schedule(arguments.schedule, arguments.dwell_s, arguments.rotation_s);
  if (!schedule) {
    return tl::unexpected(schedule.error());
  }
  Expected<sim::ConcealedPhysics> physics{sim::ConcealedPhysics{}};
  if (!arguments.physics.empty()) {
    physics = sim::read_physics(arguments.physics);
  }
  if (!physics) {
    return tl::unexpected(physics.error());
  }
  const Expected<Recording> recording = sim::simulate(*config, *schedule, arguments.seed, *physics);
  if (!recording) {
    return tl::unexpected(recording.error());
  }
  if (!arguments.truth.empty()) {
    if (const auto written = sim::write_truth(arguments.truth, *config, arguments.seed, *physics); !written) {
      return tl::unexpected(written.error());
    }
  }
  return write_recording(*recording, arguments.output).map([] { return 0; });
}

CommandRun configure(CLI::App& app) {
  auto arguments = std::make_shared<SimulateArguments>();
  app.add_option("--config", arguments->config, "sim.toml: site, attitude, sensors, gimbal");
  app.add_option("--schedule", arguments->schedule, "table2, horizontal, or a TOML file")->capture_default_str();
  app.add_option("--dwell", arguments->dwell_s, "seconds at each position, in place of the schedule's")
      ->check(CLI::PositiveNumber);
  app.add_option("--rotation", arguments->rotation_s, "seconds for each move, in place of the schedule's")
      ->check(CLI::PositiveNumber);
  app.add_option("--seed", arguments->seed, "same seed, same bits")->capture_default_str();
  app.add_option("--physics", arguments->physics, "TOML file of effects outside the 24-parameter model");
  app.add_option("-o,--output", arguments->output, "recording to write: HDF5, or CSV by its ending")->required();
  app.add_option("--truth", arguments->truth, "also write what the sensors' errors truly are, as JSON");
  return [arguments] { return simulate_recording(*arguments); };
}

const CommandRegistration registration{{"simulate", "a recording from the virtual INS's model", configure}};

}  // namespace
}  // namespace selfcal::cli
