// selfcal monitor: the LCM messages of all daemons within reach, live.
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <optional>

#include "protocol/lcm/decode.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/monitor_terminal.hpp"
#include "tools/cli/monitor_view.hpp"

namespace selfcal::cli {
namespace {

volatile sig_atomic_t ended = 0;

constexpr int frame_ms = 100;
constexpr int most_per_frame = 1000;  // messages

struct Arguments {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  bool once = false;
  double wait_s = 10.0;  // the service tells its state every second
};

// Keeps the latest of everything; where the output is no terminal each message is one line.
class Listener {
 public:
  Listener(lcm::LCM& lcm, bool lines) : lines_(lines) {
    lcm.subscribe("SELFCAL_SERVICE", &Listener::on<selfcal_lcm::service_status>, this);
    lcm.subscribe("SELFCAL_INS_.*", &Listener::on<selfcal_lcm::ins_status>, this);
    lcm.subscribe("SELFCAL_ESTIMATE_.*", &Listener::on<selfcal_lcm::estimate>, this);
    lcm.subscribe("SELFCAL_ALARM", &Listener::on<selfcal_lcm::alarm>, this);
  }

  const MonitorState& state() const { return state_; }
  int heard() const { return heard_; }

 private:
  // Undecoded, as LCM's own decoding throws on what strangers may send.
  template <typename Message>
  void on(const lcm::ReceiveBuffer* received, const std::string&) {
    const std::span bytes(static_cast<const std::uint8_t*>(received->data), received->data_size);
    if (const auto message = lcm_messages::decode<Message>(bytes)) {
      keep(*message);
      say(*message);
    }
  }
  void keep(const selfcal_lcm::service_status& message) { state_.service = message; }
  void keep(const selfcal_lcm::ins_status& message) { state_.instruments[message.ins].status = message; }
  void keep(const selfcal_lcm::estimate& message) { state_.instruments[message.ins].estimate = message; }
  void keep(const selfcal_lcm::alarm& message) { state_.take(message); }
  template <typename Message>
  void say(const Message& message) {
    ++heard_;
    if (lines_) {
      fmt::print("{}\n", message_line(message));
      std::fflush(stdout);
    }
  }

  bool lines_;
  MonitorState state_;
  int heard_ = 0;
};

// Draws at most ten times a second, however fast messages come, and at least so often.
Expected<int> watch(lcm::LCM& lcm, const Listener& listener, const Arguments& options) {
  const bool log = options.url.starts_with("file://");
  std::optional<MonitorTerminal> terminal;
  if (isatty(STDOUT_FILENO) != 0) {
    terminal.emplace();
  }
  std::size_t selected = 0;
  bool over = false;  // a log has an end; what it left stays on the screen
  const auto began = std::chrono::steady_clock::now();
  while (ended == 0 && !(options.once && listener.heard() > 0) && !(over && !terminal)) {
    if (!over && lcm.handleTimeout(frame_ms) < 0 && errno != EINTR) {
      if (!log) {
        return ended != 0 ? Expected<int>(0) : fail(ErrorKind::device, "LCM: receiving failed");
      }
      over = true;
    }
    const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - began;
    if (options.once && listener.heard() == 0 && (over || waited.count() > options.wait_s)) {
      return fail(ErrorKind::device,
                  over ? fmt::format("{}: holds no message of selfcald", options.url)
                       : fmt::format("{}: no message of selfcald within {:g} s", options.url, options.wait_s));
    }
    if (!terminal) {
      continue;
    }
    for (int more = 0; more < most_per_frame && !over && lcm.handleTimeout(0) > 0; ++more) {
    }
    const std::size_t count = listener.state().instruments.size();
    for (int key = terminal->key(); key >= 0; key = terminal->key()) {
      if (key == 'q') {
        return 0;
      }
      selected = key == '\t' && count > 0 ? (selected + 1) % count : selected;
    }
    terminal->draw(monitor_screen(listener.state(), selected, terminal->columns(), terminal->rows()));
    if (over) {
      pollfd keyboard{STDIN_FILENO, POLLIN, 0};
      poll(&keyboard, 1, frame_ms);
    }
  }
  return 0;
}

Expected<int> monitor(const Arguments& options) {
  lcm::LCM lcm(options.url);
  if (!lcm.good()) {
    return fail(ErrorKind::device, fmt::format("LCM: {} cannot be opened (no multicast route? "
                                               "ip route add 239.255.76.67/32 dev lo)",
                                               options.url));
  }
  struct sigaction action {};
  action.sa_handler = [](int) { ended = 1; };
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    sigaction(number, &action, nullptr);
  }
  const Listener listener(lcm, isatty(STDOUT_FILENO) == 0);
  return watch(lcm, listener, options);
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  options.text("--url", arguments->url, "LCM provider; file://LOG?speed=1 replays an lcm-logger log");
  options.flag("--once", arguments->once, "end after the first message");
  options.number("--wait", arguments->wait_s, range::waiting,
                 "with --once: end with status 4 where none has come after so many seconds");
  return [arguments] { return monitor(*arguments); };
}

const CommandRegistration registration{{"monitor", "show the daemon's LCM messages live", configure}};

}  // namespace
}  // namespace selfcal::cli
