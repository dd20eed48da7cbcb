// selfcal_sender: sends the runs of a set to its depot's hub. A process of its own beside selfcald: nothing that a network, a
// server or TLS does can hold up a calibration, and the service itself needs no network.
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "daemon/host/config.hpp"
#include "daemon/host/hub_config.hpp"
#include "daemon/host/journal.hpp"
#include "daemon/hub/replicator.hpp"
#include "daemon/store/database_copies.hpp"
#include "protocol/command_line/command_line.hpp"

namespace {

using namespace selfcal;
namespace hub = selfcal::hub;

constexpr double longest_pause_s = 60.0;  // between tries while the hub is away

int complain(const Error& error) {
  fmt::print(stderr, "selfcal_sender: {}\n", error.message);
  return static_cast<int>(error.kind);
}

// Says what changes and not what stays: a hub may be away for weeks.
class Story {
 public:
  void away(const Error& error) {
    if (error.message != trouble_) {
      trouble_ = error.message;
      journal::write(journal::Level::warning, fmt::format("runs wait for the hub: {}", trouble_));
      sd_notify(0, fmt::format("STATUS=Runs wait: {}", trouble_).c_str());
    }
  }
  void well(const hub::StepResult& result, const hub::OutboxCounts& counts) {
    if (!trouble_.empty()) {
      trouble_.clear();
      journal::write(journal::Level::notice, "the hub is there again");
    }
    for (const hub::RefusedRun& run : result.refused) {
      journal::Fields fields;
      fields.run = run.run;
      journal::write(journal::Level::warning, fmt::format("the hub takes run {} not: {}", run.run, run.reason), fields);
    }
    sd_notify(
        0, fmt::format("STATUS=Sent {}, refused {}, waiting {}", counts.sent, counts.refused, counts.waiting).c_str());
  }

 private:
  std::string trouble_;
};

// True: a signal asks to end. The pause is over at once then.
bool pause(int signals, double seconds) {
  pollfd wait{signals, POLLIN, 0};
  return poll(&wait, 1, static_cast<int>(seconds * 1000.0)) > 0;
}

int replicate(const Config& config, const HubConfig& to, bool until_empty) {
  if (auto ok = hub::check_authenticated(to.connection); !ok) {
    return complain(ok.error());
  }
  auto store = RunStore::open(database_path(config.state_directory));
  if (!store) {
    return complain(store.error());
  }
  auto outbox = hub::Outbox::open(database_path(config.state_directory));
  if (!outbox) {
    return complain(outbox.error());
  }
  sigset_t asked;
  sigemptyset(&asked);
  sigaddset(&asked, SIGTERM);
  sigaddset(&asked, SIGINT);
  sigprocmask(SIG_BLOCK, &asked, nullptr);
  const int signals = signalfd(-1, &asked, SFD_CLOEXEC);
  signal(SIGPIPE, SIG_IGN);

  std::map<std::string, std::string> types;
  for (const InsConfig& ins : config.instruments) {
    types[ins.name] = ins.profile_name;
  }
  hub::Replicator replicator(to, types, **store, **outbox);
  Story story;
  sd_notify(0, "READY=1");
  double wait_s = 0.0;
  while (!pause(signals, wait_s)) {
    const auto result = replicator.step();
    if (!result) {
      if (until_empty || result.error().kind == ErrorKind::bad_input) {
        return complain(result.error());
      }
      story.away(result.error());
      wait_s = std::clamp(2.0 * wait_s, to.interval_s, std::max(longest_pause_s, to.interval_s));
      continue;
    }
    const auto counts = (*outbox)->counts();
    if (!counts) {
      return complain(counts.error());
    }
    story.well(*result, *counts);
    wait_s = result->more ? 0.0 : to.interval_s;
    if (until_empty && !result->more) {
      fmt::print("sent {}, refused {}, waiting {}\n", counts->sent, counts->refused, counts->waiting);
      return 0;
    }
  }
  return 0;
}

int run(int argc, char** argv) {
  CommandLine line("selfcal_sender", SELFCAL_VERSION, "selfcal_sender: sends runs to a depot's hub");
  std::string config_file = "/etc/selfcal/selfcald.toml";
  bool until_empty = false;
  line.options().text("-c,--config", config_file, "selfcald's configuration file");
  line.options().flag("--until-empty", until_empty, "end when all is sent; an error where the hub is away");
  if (const std::optional<int> ended = line.parse(argc, argv)) {
    return *ended;
  }
  const auto config = load_config(config_file);
  if (!config) {
    return complain(config.error());
  }
  const auto to = load_hub_config(config_file);
  if (!to) {
    return complain(to.error());
  }
  if (!*to) {
    fmt::print("{}: no section [hub]: nothing is sent\n", config_file);
    // The unit is of Type=notify: without this an end that is no failure would count as one.
    sd_notify(0, "READY=1\nSTATUS=No section [hub]: nothing is sent");
    return 0;
  }
  return replicate(*config, **to, until_empty);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "selfcal_sender: %s\n", error.what());
    return static_cast<int>(ErrorKind::internal);
  }
}
