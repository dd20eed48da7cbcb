// The man in the middle on two real buses:
//   hostile_node --tester vcan0 --ins vcan1 --cases FILE --case NAME
// Everything that the tester's bus carries for the INS goes to the other one and back, as the rules of the case have it.
// Rules that cut the INS's power do nothing here. Ends upon SIGTERM and tells on standard error how often a rule acted.
#include <fmt/format.h>
#include <poll.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>

#include "protocol/can/socket.hpp"
#include "tests/hostile/middle.hpp"
#include "tests/own_ins/identifiers.hpp"

namespace selfcal::hostile {
namespace {

volatile int stop_requested = 0;

struct Settings {
  std::string tester = "vcan0", ins = "vcan1", cases, name;
};

Time now() { return std::chrono::duration_cast<Time>(std::chrono::steady_clock::now().time_since_epoch()); }

Expected<Case> find_case(const Settings& settings) {
  const auto cases = read_cases(settings.cases);
  if (!cases) {
    return tl::unexpected(cases.error());
  }
  for (const Case& one : *cases) {
    if (one.name == settings.name) {
      return one;
    }
  }
  return fail(ErrorKind::usage, fmt::format("{}: no case is called '{}'", settings.cases, settings.name));
}

Expected<can::Socket> open(const std::string& interface, std::initializer_list<std::uint32_t> ids) {
  can::SocketOptions options;
  options.interface = interface;
  for (const std::uint32_t id : ids) {
    options.filters.push_back({id, 0x1FFFFFFF, false});
  }
  return can::Socket::open(options);
}

Expected<void> send_all(can::Socket& socket, std::span<const can::CanFrame> frames) {
  while (!frames.empty() && stop_requested == 0) {
    const auto taken = socket.send(frames);
    if (!taken) {
      return tl::unexpected(taken.error());
    }
    frames = frames.subspan(*taken);
    if (!frames.empty()) {
      pollfd waiting{socket.fd(), POLLOUT, 0};
      ::poll(&waiting, 1, 1);
    }
  }
  return {};
}

Expected<void> pass_on(can::Socket& tester, can::Socket& ins, Middle& middle) {
  for (can::Socket* from : {&tester, &ins}) {
    const auto frames = from->receive();
    if (!frames) {
      return tl::unexpected(frames.error());
    }
    for (const can::ReceivedFrame& received : *frames) {
      if (!received.event) {
        from == &tester ? middle.from_tester(received.frame, now()) : middle.from_ins(received.frame, now());
      }
    }
  }
  std::vector<can::CanFrame> to_tester, to_ins;
  middle.take(to_tester, to_ins, now());
  if (auto sent = send_all(tester, to_tester); !sent) {
    return sent;
  }
  return send_all(ins, to_ins);
}

Expected<void> run(const Settings& settings) {
  const auto one = find_case(settings);
  if (!one) {
    return tl::unexpected(one.error());
  }
  namespace id = ins::can_id;
  auto tester = open(settings.tester, {id::request, id::functional});
  auto ins = open(settings.ins, {id::response, id::status, id::gimbal});
  for (const auto* socket : {&tester, &ins}) {
    if (!*socket) {
      return tl::unexpected(socket->error());
    }
  }
  isotp::Options link;
  link.address = {id::request, id::response, id::functional, false};
  Middle middle(link, one->rules, [] {});
  fmt::print(stderr, "hostile_node: {}\n", one->name);
  while (stop_requested == 0) {
    if (auto passed = pass_on(*tester, *ins, middle); !passed) {
      return passed;
    }
    std::array<pollfd, 2> waiting{pollfd{tester->fd(), POLLIN, 0}, pollfd{ins->fd(), POLLIN, 0}};
    ::poll(waiting.data(), waiting.size(), 1);
  }
  fmt::print(stderr, "hostile_node: rules acted {} times\n", middle.acted());
  return {};
}

}  // namespace
}  // namespace selfcal::hostile

int main(int argc, char** argv) {
  CLI::App app{"A man in the middle between selfcald and an INS, on two CAN interfaces"};
  selfcal::hostile::Settings settings;
  app.add_option("--tester", settings.tester, "interface of the tester")->capture_default_str();
  app.add_option("--ins", settings.ins, "interface of the INS")->capture_default_str();
  app.add_option("--cases", settings.cases, "table of cases, TOML")->required();
  app.add_option("--case", settings.name, "name of the case")->required();
  CLI11_PARSE(app, argc, argv);
  struct sigaction action {};
  action.sa_handler = [](int) { selfcal::hostile::stop_requested = 1; };
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGINT, &action, nullptr);
  if (const auto done = selfcal::hostile::run(settings); !done) {
    fmt::print(stderr, "hostile_node: {}\n", done.error().message);
    return static_cast<int>(done.error().kind);
  }
  return 0;
}
