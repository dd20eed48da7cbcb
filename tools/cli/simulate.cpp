// selfcal simulate: a recording from the same model as the virtual INS.
#include <cstdint>
#include <memory>

#include "protocol/recording/recording_file.hpp"
#include "protocol/schedule_file/schedule_file.hpp"
#include "sim_ins/physics.hpp"
#include "sim_ins/simulate.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/output_file.hpp"

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
  if (const auto known = check_output(arguments.output, {".h5", ".hdf5", ".csv"}); !known) {
    return tl::unexpected(known.error());
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

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<SimulateArguments>();
  options.text("--config", arguments->config, "sim.toml: site, attitude, sensors, gimbal");
  options.text("--schedule", arguments->schedule, "table2, horizontal, or a TOML file");
  options.number("--dwell", arguments->dwell_s, range::dwell, "seconds at each position, in place of the schedule's");
  options.number("--rotation", arguments->rotation_s, range::rotation,
                 "seconds for each move, in place of the schedule's");
  options.whole("--seed", arguments->seed, range::seed, "same seed, same bits");
  options.text("--physics", arguments->physics, "TOML file of effects outside the 24-parameter model");
  options.text("-o,--output", arguments->output, "recording to write: .h5 or .hdf5, or .csv", Needed::yes);
  options.text("--truth", arguments->truth, "also write what the sensors' errors truly are, as JSON");
  return [arguments] { return simulate_recording(*arguments); };
}

const CommandRegistration registration{{"simulate", "a recording from the virtual INS's model", configure}};

}  // namespace
}  // namespace selfcal::cli
