// sim_ins: a virtual INS on a CAN interface.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>

#include "protocol/ins_interface/identifiers.hpp"
#include "sim_ins/device/bus_node.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::sim {
namespace {

volatile int stop_requested = 0;

struct Arguments {
  std::string config, key, flash, truth, physics, scenario;
  std::uint64_t seed = 1;
  std::vector<std::string> faults;
  std::uint32_t arbitration_rate = 1'000'000, data_rate = 5'000'000;
  NodeOptions node;
};

Expected<double> number(const std::string& fault, const std::string& text) {
  double value = 0.0;
  const bool hex = text.starts_with("0x");
  unsigned whole = 0;
  const char* end = text.data() + text.size();
  const auto result = hex ? std::from_chars(text.data() + 2, end, whole, 16) : std::from_chars(text.data(), end, value);
  if (result.ec != std::errc{} || result.ptr != end || value < 0.0) {
    return fail(ErrorKind::usage, fmt::format("--fault {}: '{}' is not a number", fault, text));
  }
  return hex ? whole : value;
}

// KEY=VALUE, as the help text lists them: each a fault, or several, of a scenario.
Expected<void> take_fault(const std::string& text, const SimConfig& config, Scenario& scenario) {
  const auto equals = text.find('=');
  const std::string key = text.substr(0, equals);
  const auto value = number(text, equals == std::string::npos ? "" : text.substr(equals + 1));
  if (!value) {
    return tl::unexpected(value.error());
  }
  using K = FaultKind;
  const std::map<std::string, std::vector<K>> kinds{
      {"nrc", {K::nrc}},     {"crc", {K::spoilt_page}},           {"stuck", {K::stuck_gimbal}},
      {"reset", {K::reset}}, {"saturated", {K::saturated_accel}}, {"frozen", {K::frozen_gyro, K::frozen_accel}},
      {"drop", {K::drop}},   {"duplicate", {K::duplicate}},       {"corrupt", {K::corrupt}},
  };
  const auto known = kinds.find(key);
  if (known == kinds.end()) {
    return fail(ErrorKind::usage, fmt::format("--fault {}: unknown fault '{}'", text, key));
  }
  constexpr double limit_mps2 = 0.5 * 9.80665;
  for (const K kind : known->second) {
    const bool of_sensor = kind == K::saturated_accel || kind == K::frozen_gyro || kind == K::frozen_accel;
    for (int axis = 0; axis < (of_sensor ? 3 : 1); ++axis) {
      Fault fault;
      fault.kind = kind;
      if (of_sensor || kind == K::stuck_gimbal || kind == K::reset) {
        fault.at_s = *value;
        fault.value = axis;
        fault.amount = limit_mps2 / config.sample_rate_hz / config.accel_lsb_m_per_s;
      } else if (kind == K::nrc || kind == K::spoilt_page) {
        fault.value = *value;
      } else {
        fault.probability = *value;
      }
      scenario.faults.push_back(fault);
    }
  }
  return {};
}

Expected<uds::SecurityKey> read_key(const std::string& path) {
  std::ifstream file(path);
  std::string digits;
  file >> digits;
  uds::SecurityKey key{};
  bool good = digits.size() == 2 * key.size();
  for (std::size_t i = 0; good && i < key.size(); ++i) {
    const char* at = digits.data() + 2 * i;
    const auto [end, error] = std::from_chars(at, at + 2, key[i], 16);
    good = error == std::errc{} && end == at + 2;
  }
  if (!good) {
    return fail(ErrorKind::bad_input, fmt::format("key file {}: 32 hexadecimal digits expected", path));
  }
  return key;
}

void configure(CLI::App& app, Arguments& a) {
  NodeOptions& node = a.node;
  node.request_id = ins::can_id::request;
  node.response_id = ins::can_id::response;
  node.functional_id = ins::can_id::functional;
  node.status_id = ins::can_id::status;
  app.add_option("--interface", node.interface, "CAN interface")->capture_default_str();
  app.add_option("--config", a.config, "sim.toml: site, attitude, sensors, gimbal");
  app.add_option("--seed", a.seed, "of every random draw: the same seed gives the same bits")->capture_default_str();
  app.add_option("--key", a.key, "file with the SecurityAccess key, 32 hexadecimal digits")->required();
  app.add_option("--flash", a.flash, "file that holds the FLASH; without it nothing outlives the process");
  app.add_option("--truth", a.truth, "write the true sensor errors to this JSON file");
  app.add_option("--physics", a.physics, "concealed physics, TOML");
  app.add_option("--scenario", a.scenario, "faults by time, TOML (see sim_ins/README.md)");
  app.add_option("--speed", node.speed, "INS seconds per second")->check(CLI::Range(0.01, 1e5))->capture_default_str();
  app.add_option("--patience", node.patience, "stretches the time-outs of ISO-TP and session, for slow testers")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
  app.add_option("--turnaround", node.turnaround_ms, "of the tester in an upload, ms of INS time for each request")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  app.add_flag("--fd", node.fd, "CAN FD with bit rate switch");
  app.add_option("--bit-rate", a.arbitration_rate, "bit/s")->capture_default_str();
  app.add_option("--data-bit-rate", a.data_rate, "bit/s, FD data phase")->capture_default_str();
  app.add_option("--request-id", node.request_id, "CAN identifier of requests");
  app.add_option("--response-id", node.response_id, "CAN identifier of responses");
  app.add_option("--functional-id", node.functional_id, "CAN identifier of functional requests");
  app.add_option("--status-id", node.status_id, "CAN identifier of the state frame; the gimbal frame has the next");
  app.add_flag("--extended-ids", node.extended_ids, "29-bit identifiers");
  app.add_option(
      "--fault", a.faults,
      "KEY=VALUE, repeated. nrc=0x22: refuse every request so; crc=P: page P arrives spoilt once; "
      "stuck=T, frozen=T, saturated=T: gimbal, IMU, accelerometers (at 0.5 g) from T s of the rotation on; reset=T: at "
      "T s; drop=P, duplicate=P, corrupt=P: probability per frame sent");
}

Expected<int> run(Arguments& a) {
  Expected<SimConfig> config{SimConfig{}};
  if (!a.config.empty()) {
    config = read_sim_config(a.config);
  }
  if (!config) {
    return tl::unexpected(config.error());
  }
  Expected<ConcealedPhysics> physics{ConcealedPhysics{}};
  if (!a.physics.empty()) {
    physics = read_physics(a.physics);
  }
  if (!physics) {
    return tl::unexpected(physics.error());
  }
  const auto key = read_key(a.key);
  if (!key) {
    return tl::unexpected(key.error());
  }
  Scenario scenario;
  scenario.seed = a.seed;
  if (!a.scenario.empty()) {
    auto read = read_scenario(a.scenario);
    if (!read) {
      return tl::unexpected(read.error());
    }
    scenario = std::move(*read);
  }
  for (const std::string& fault : a.faults) {
    if (const auto taken = take_fault(fault, *config, scenario); !taken) {
      return tl::unexpected(taken.error());
    }
  }
  a.node.scenario = scenario;
  auto flash = FlashMemory::open(a.flash, flash_bytes);
  if (!flash) {
    return tl::unexpected(flash.error());
  }
  auto instrument = Instrument::create(*config, a.seed, *physics, std::move(*flash), scenario);
  if (!instrument) {
    return tl::unexpected(instrument.error());
  }
  a.node.rates = {a.arbitration_rate, a.data_rate};
  a.node.diagnostics.key = *key;
  a.node.diagnostics.longest_response = a.node.fd ? 65535 : 4095;
  auto node = BusNode::open(a.node, **instrument);
  if (!node) {
    return tl::unexpected(node.error());
  }
  if (!a.truth.empty()) {
    if (const auto written = write_truth(a.truth, *config, a.seed, *physics); !written) {
      return tl::unexpected(written.error());
    }
  }
  (*node)->run(stop_requested);
  return 0;
}

int configure_and_run(int argc, char** argv) {
  CLI::App app{"A virtual INS with its own two-axis gimbal, on a CAN interface"};
  Arguments arguments;
  configure(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : static_cast<int>(ErrorKind::usage);
  }
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = 1; };
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGINT, &action, nullptr);
  const auto status = run(arguments);
  if (!status) {
    fmt::print(stderr, "sim_ins: {}\n", status.error().message);
    return static_cast<int>(status.error().kind);
  }
  return *status;
}

}  // namespace
}  // namespace selfcal::sim

int main(int argc, char** argv) {
  try {
    return selfcal::sim::configure_and_run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "sim_ins: %s\n", error.what());  // unlike fmt::print it cannot throw
    return static_cast<int>(selfcal::ErrorKind::internal);
  }
}
