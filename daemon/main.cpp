// selfcald: the calibration service.
#include <fmt/format.h>
#include <signal.h>
#include <systemd/sd-daemon.h>

#include <cstdio>
#include <utility>

#include "daemon/host/journal.hpp"
#include "daemon/ins/unlock_key.hpp"
#include "daemon/service.hpp"
#include "protocol/command_line/command_line.hpp"

namespace {

using namespace selfcal;

int complain(const Error& error) {
  fmt::print(stderr, "{}\n", error.message);
  return static_cast<int>(error.kind);
}

int serve(const std::string& config_file) {
  auto config = load_config(config_file);
  if (!config) {
    return complain(config.error());
  }

  // Signals come through the loop only; blocked before any thread exists, so that all inherit it.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    sigaddset(&signals, signal);
  }
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);

  EventLoop loop;
  auto service = Service::create(loop, std::move(*config), config_file);
  if (!service) {
    return complain(service.error());
  }

  bool stopping = false;
  for (const int number : {SIGTERM, SIGINT}) {
    loop.on_signal(number, [&] {
      sd_notify(0, "STOPPING=1\nSTATUS=Stopping; runs in progress go on at the next start");
      if (std::exchange(stopping, true)) {
        return loop.stop(0);  // asked for twice
      }
      (*service)->stop([&] { loop.stop(0); });
    });
  }
  loop.on_signal(SIGHUP, [&] {
    sd_notify(0, "RELOADING=1");
    (*service)->reload();
    sd_notify(0, "READY=1");
  });
  loop.enable_watchdog();
  sd_notify(0, "READY=1\nSTATUS=Ready");
  journal::write(journal::Level::notice, fmt::format("selfcald {} ready", SELFCAL_VERSION));
  (*service)->resume_unfinished();
  return loop.run();
}

int run(int argc, char** argv) {
  CommandLine line("selfcald", SELFCAL_VERSION,
                   "selfcald: calibrates inertial navigation systems on their own gimbals");
  std::string config_file = "/etc/selfcal/selfcald.toml";
  bool check_only = false;
  line.options().text("-c,--config", config_file, "configuration file");
  line.options().flag("--check-config", check_only, "check the configuration and end");
  if (const std::optional<int> ended = line.parse(argc, argv)) {
    return *ended;
  }
  if (check_only) {
    const auto config = load_config(config_file);
    if (!config) {
      return complain(config.error());
    }
    // Credentials exist only where systemd started the service; a file that is named has to be there now.
    for (const InsConfig& ins : config->instruments) {
      if (const auto key = load_unlock_key(ins); !ins.key_file.empty() && !key) {
        return complain(
            {key.error().kind, fmt::format("{}: ins.{}: key_file: {}", config_file, ins.name, key.error().message)});
      }
    }
    fmt::print("{}: well-formed, {} INS\n", config_file, config->instruments.size());
    return 0;
  }
  return serve(config_file);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "selfcald: %s\n", error.what());  // unlike fmt::print it cannot throw
    return static_cast<int>(ErrorKind::internal);
  }
}
