// selfcal monitor: the LCM messages of all daemons within reach, live.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <selfcal_lcm/alarm.hpp>
#include <selfcal_lcm/estimate.hpp>
#include <selfcal_lcm/ins_status.hpp>
#include <selfcal_lcm/service_status.hpp>

#include "tools/cli/command.hpp"

namespace selfcal::cli {
namespace {

volatile sig_atomic_t ended = 0;

struct Options {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  bool once = false;
};

// The latest of each INS; on a terminal the screen is drawn anew, else each message is one line.
class Screen {
 public:
  explicit Screen(bool terminal) : terminal_(terminal) {}

  void on_service(const lcm::ReceiveBuffer*, const std::string&, const selfcal_lcm::service_status* message) {
    set("", fmt::format("selfcald {}: {} INS, {} runs in progress, up {:.0f} s", message->software,
                        message->instruments, message->runs_in_progress, message->uptime_s));
  }
  void on_ins(const lcm::ReceiveBuffer*, const std::string&, const selfcal_lcm::ins_status* message) {
    set(message->ins + " status",
        fmt::format("{} {}: {}, run {}, position {}/{}, outer {:.2f} deg, inner {:.2f} deg, {:.0f} s left, pages "
                    "{}/{}{}",
                    message->ins, message->serial, message->state, message->run, message->position, message->positions,
                    message->outer_deg, message->inner_deg, message->time_left_s, message->pages_pulled,
                    message->pages_expected, message->link_up != 0 ? "" : ", LINK LOST"));
  }
  void on_estimate(const lcm::ReceiveBuffer*, const std::string&, const selfcal_lcm::estimate* message) {
    const std::string when = message->running != 0
                                 ? fmt::format("{:.0f} s of data, rotation ends in {:.0f} s", message->data_s,
                                               message->finish_in_s)
                                 : fmt::format("pass {}, {:.0f} %", message->pass_number, 100 * message->pass_fraction);
    std::string text = fmt::format("{}: {}, {} of {} to tolerance", message->ins, when, message->tolerances_met,
                                   message->count);
    for (std::size_t i = 0; i < message->name.size(); ++i) {
      text += fmt::format("{}{:<24}{:>12.5g} +- {:<10.3g} {}", terminal_ ? "\n  " : "; ", message->name[i],
                          message->value[i], message->sigma[i], message->unit[i]);
    }
    set(message->ins + " zz", text);
  }
  void on_alarm(const lcm::ReceiveBuffer*, const std::string&, const selfcal_lcm::alarm* message) {
    set(message->ins + " alarm", fmt::format("ALARM {}: run {}: {}", message->ins, message->run, message->text));
  }

 private:
  void set(const std::string& key, const std::string& text) {
    lines_[key] = text;
    if (!terminal_) {
      fmt::print("{}\n", text);
    } else {
      fmt::print("\033[H\033[2J");
      for (const auto& [unused, line] : lines_) fmt::print("{}\n", line);
    }
    std::fflush(stdout);
  }

  bool terminal_;
  std::map<std::string, std::string> lines_;
};

Expected<int> monitor(const Options& options) {
  lcm::LCM lcm(options.url);
  if (!lcm.good()) {
    return fail(ErrorKind::device, fmt::format("LCM: {} cannot be opened (no multicast route? "
                                               "ip route add 239.255.76.67/32 dev lo)", options.url));
  }
  struct sigaction action {};
  action.sa_handler = [](int) { ended = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  Screen screen(isatty(STDOUT_FILENO) != 0);
  lcm.subscribe("SELFCAL_SERVICE", &Screen::on_service, &screen);
  lcm.subscribe("SELFCAL_INS_.*", &Screen::on_ins, &screen);
  lcm.subscribe("SELFCAL_ESTIMATE_.*", &Screen::on_estimate, &screen);
  lcm.subscribe("SELFCAL_ALARM", &Screen::on_alarm, &screen);
  int heard = 0;
  while (ended == 0) {
    const int result = lcm.handleTimeout(500);
    if (result < 0) return ended != 0 ? Expected<int>(0) : fail(ErrorKind::device, "LCM: receiving failed");
    if (result > 0 && options.once && ++heard >= 1) break;
  }
  return 0;
}

CommandRun configure(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("--url", options->url, "LCM provider; file://LOG?speed=1 replays an lcm-logger log")
      ->capture_default_str();
  app.add_flag("--once", options->once, "end after the first message");
  return [options] { return monitor(*options); };
}

const CommandRegistration registration{{"monitor", "show the daemon's LCM messages live", configure}};

}  // namespace
}  // namespace selfcal::cli
