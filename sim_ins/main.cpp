// sim_ins: a virtual INS on a CAN interface.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>

#include "protocol/command_line/command_line.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/profile/records.hpp"
#include "sim_ins/device/bus_node.hpp"
#include "sim_ins/device/frame_node.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::sim {
namespace {

volatile int stop_requested = 0;

struct Arguments {
  std::string profile, config, key, flash, truth, physics, scenario;
  std::uint64_t seed = 1;
  std::vector<std::string> faults;
  std::uint64_t arbitration_rate = 1'000'000, data_rate = 5'000'000;
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
  if (!file) {
    return fail(ErrorKind::bad_input, fmt::format("key file {}: cannot open: {}", path, std::strerror(errno)));
  }
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

// Looked for before the command line is parsed: what the profile says are the defaults of other options.
std::string profile_argument(int argc, char** argv) {
  constexpr std::string_view name = "--profile";
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == name && i + 1 < argc) {
      return argv[i + 1];
    }
    if (argument.starts_with(name) && argument.substr(name.size()).starts_with('=')) {
      return std::string(argument.substr(name.size() + 1));
    }
  }
  return {};
}

Expected<void> take_profile(const std::string& file, NodeOptions& node) {
  if (!file.empty()) {
    auto profile = profile::load_profile(file);
    if (!profile) {
      return tl::unexpected(profile.error());
    }
    node.diagnostics.profile = std::move(*profile);
  }
  const profile::Bus& bus = node.diagnostics.profile->bus;
  node.request_id = bus.request;
  node.response_id = bus.response;
  node.functional_id = bus.functional;
  node.status_id = bus.status.value_or(0);
  node.tells_status = bus.status.has_value();
  node.extended_ids = bus.extended_ids;
  node.fd = bus.fd;
  return {};
}

// What the profile gives because the INS does not tell it must be so here.
Expected<void> check_format(const profile::Profile& profile, const ins::SampleFormatRecord& own) {
  const auto bytes = profile::encode(profile, own);
  const auto told = bytes ? profile::decode_sample_format(profile, *bytes) : tl::unexpected(bytes.error());
  if (!told) {
    return tl::unexpected(told.error());
  }
  constexpr double as_f32 = 1e-6;
  for (const auto& [name, by_profile, here] :
       {std::tuple("sample_rate", told->sample_rate_hz, own.sample_rate_hz),
        std::tuple("angle_per_count", told->delta_theta_lsb_rad, own.delta_theta_lsb_rad),
        std::tuple("velocity_per_count", told->delta_v_lsb_mps, own.delta_v_lsb_mps),
        std::tuple("gimbal_per_count", told->gimbal_lsb_rad, own.gimbal_lsb_rad)}) {
    if (!(std::abs(by_profile - here) <= as_f32 * here)) {
      return fail(ErrorKind::bad_input, fmt::format("{}: sample_format: {} is {:.9g}, this INS has {:.9g}",
                                                    profile.file, name, by_profile, here));
    }
  }
  return {};
}

void configure(Options& options, Arguments& a) {
  NodeOptions& node = a.node;
  options.text("--profile", a.profile, "what it speaks, TOML (config/profiles); without it our own INS");
  options.text("--interface", node.interface, "CAN interface");
  options.text("--config", a.config, "sim.toml: site, attitude, sensors, gimbal");
  options.whole("--seed", a.seed, range::seed, "of every random draw: the same seed gives the same bits");
  options.text("--key", a.key, "file with the SecurityAccess key, 32 hexadecimal digits", Needed::yes);
  options.text("--flash", a.flash, "file that holds the FLASH; without it nothing outlives the process");
  options.text("--truth", a.truth, "write the true sensor errors to this JSON file");
  options.text("--physics", a.physics, "concealed physics, TOML");
  options.text("--scenario", a.scenario, "faults by time, TOML (see sim_ins/README.md)");
  options.number("--speed", node.speed, range::speed, "INS seconds per second");
  options.number("--patience", node.patience, range::patience,
                 "stretches the time-outs of ISO-TP and session, for slow testers");
  options.number("--turnaround", node.turnaround_ms, range::turnaround,
                 "of the tester in an upload, ms of INS time for each request");
  options.flag("--fd", node.fd, "CAN FD with bit rate switch");
  options.whole("--bit-rate", a.arbitration_rate, range::bit_rate, "bit/s");
  options.whole("--data-bit-rate", a.data_rate, range::data_bit_rate, "bit/s, FD data phase");
  options.can_identifier("--request-id", node.request_id, "CAN identifier of requests, hexadecimal");
  options.can_identifier("--response-id", node.response_id, "CAN identifier of responses, hexadecimal");
  options.can_identifier("--functional-id", node.functional_id, "CAN identifier of functional requests, hexadecimal");
  options.can_identifier("--status-id", node.status_id,
                         "CAN identifier of the state frame, hexadecimal; the gimbal frame has the next");
  options.flag("--extended-ids", node.extended_ids, "29-bit identifiers");
  options.texts(
      "--fault", a.faults,
      "KEY=VALUE, repeated. nrc=0x22: refuse every request so; crc=P: page P arrives spoilt once; "
      "stuck=T, frozen=T, saturated=T: gimbal, IMU, accelerometers (at 0.5 g) from T s of the rotation on; reset=T: at "
      "T s; drop=P, duplicate=P, corrupt=P: probability per frame sent");
}

// What it does from then on, until it is told to stop.
Expected<std::function<void()>> open_node(const Arguments& a, const SimConfig& config, const ConcealedPhysics& physics,
                                          Instrument& instrument) {
  const auto serving = [](auto opened) -> Expected<std::function<void()>> {
    if (!opened) {
      return tl::unexpected(opened.error());
    }
    return [node = std::shared_ptr(std::move(*opened))] { node->run(stop_requested); };
  };
  if (a.node.diagnostics.profile->frames) {
    return serving(FrameNode::open(a.node, instrument, CommandedGimbal(config, a.seed, physics, a.node.scenario)));
  }
  if (a.node.diagnostics.profile->move) {
    instrument.turn_by_moves(CommandedGimbal(config, a.seed, physics, a.node.scenario));
  }
  return serving(BusNode::open(a.node, instrument));
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
  const profile::Profile& profile = *a.node.diagnostics.profile;
  auto instrument =
      Instrument::create(*config, a.seed, *physics, std::move(*flash), scenario, profile.raw.page.most_repetitions());
  if (!instrument) {
    return tl::unexpected(instrument.error());
  }
  if (const auto same = check_format(profile, (*instrument)->sample_format()); !same) {
    return tl::unexpected(same.error());
  }
  a.node.rates = {static_cast<std::uint32_t>(a.arbitration_rate), static_cast<std::uint32_t>(a.data_rate)};
  a.node.diagnostics.key = *key;
  a.node.diagnostics.longest_response = a.node.fd ? 65535 : 4095;
  const auto serve = open_node(a, *config, *physics, **instrument);
  if (!serve) {
    return tl::unexpected(serve.error());
  }
  if (!a.truth.empty()) {
    if (const auto written = write_truth(a.truth, *config, a.seed, *physics); !written) {
      return tl::unexpected(written.error());
    }
  }
  (*serve)();
  return 0;
}

int configure_and_run(int argc, char** argv) {
  CommandLine line("sim_ins", SELFCAL_VERSION, "A virtual INS with its own two-axis gimbal, on a CAN interface");
  Arguments arguments;
  if (const auto taken = take_profile(profile_argument(argc, argv), arguments.node); !taken) {
    fmt::print(stderr, "sim_ins: {}\n", taken.error().message);
    return static_cast<int>(taken.error().kind);
  }
  configure(line.options(), arguments);
  if (const std::optional<int> ended = line.parse(argc, argv)) {
    return *ended;
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
