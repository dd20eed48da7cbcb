#include "tools/cli/online_client.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <operator_api/ins1_proxy.hpp>
#include <operator_api/manager1_proxy.hpp>

#include <algorithm>
#include <charconv>
#include <cstdlib>

#include "protocol/operator_api/names.hpp"

namespace selfcal::cli {
namespace {

// A request that the daemon declines for its content is the operator's to change; all else is trouble.
Error from_bus(const sdbus::Error& error) {
  const bool declined = error.getName() == operator_api::error_unknown;
  std::string message = error.getMessage();
  if (error.getName() == "org.freedesktop.DBus.Error.ServiceUnknown") {
    message = "selfcald is not running on this bus";
  }
  if (error.getName() == "org.freedesktop.DBus.Error.AccessDenied") {
    message = "not allowed: only root and members of group selfcal may do this";
  }
  return {declined ? ErrorKind::usage : ErrorKind::device, message};
}

}  // namespace

class ManagerClient::Proxy : public sdbus::ProxyInterfaces<org::selfcal::Manager1_proxy> {
 public:
  explicit Proxy(sdbus::IConnection& connection)
      : ProxyInterfaces(connection, operator_api::bus_name, operator_api::manager_path) {
    registerProxy();
  }
  ~Proxy() { unregisterProxy(); }
};

ManagerClient::ManagerClient(std::unique_ptr<sdbus::IConnection> connection)
    : connection_(std::move(connection)), proxy_(std::make_unique<Proxy>(*connection_)) {}

ManagerClient::~ManagerClient() = default;

Expected<std::unique_ptr<ManagerClient>> ManagerClient::connect() {
  const char* chosen = std::getenv(operator_api::bus_variable);
  const std::string bus = chosen == nullptr || *chosen == '\0' ? "system" : chosen;
  try {
    auto connection = bus == "system"    ? sdbus::createSystemBusConnection()
                      : bus == "session" ? sdbus::createSessionBusConnection()
                                         : sdbus::createSessionBusConnectionWithAddress(bus);
    return std::unique_ptr<ManagerClient>(new ManagerClient(std::move(connection)));
  } catch (const sdbus::Error& error) {
    return fail(ErrorKind::device, fmt::format("D-Bus ({}): {}", bus, error.getMessage()));
  }
}

template <typename Call>
auto ManagerClient::call(Call make) -> Expected<decltype(make())> {
  try {
    if constexpr (std::is_void_v<decltype(make())>) {
      make();
      return {};
    } else {
      return make();
    }
  } catch (const sdbus::Error& error) {
    return tl::unexpected<Error>(from_bus(error));
  }
}

Expected<std::uint64_t> ManagerClient::start(const std::string& ins, const Entries& options) {
  return call([&] { return proxy_->Start(ins, options); });
}
Expected<std::uint64_t> ManagerClient::amend(std::uint64_t run, const Entries& options) {
  return call([&] { return proxy_->Amend(run, options); });
}
Expected<void> ManagerClient::abort(const std::string& ins, const std::string& reason) {
  return call([&] { proxy_->Abort(ins, reason); });
}
Expected<std::uint64_t> ManagerClient::import_recording(int descriptor, const Entries& options) {
  return call([&] { return proxy_->Import(sdbus::UnixFd(descriptor), options); });
}
Expected<std::uint64_t> ManagerClient::rollback(const std::string& serial, const std::string& reason) {
  return call([&] { return proxy_->Rollback(serial, reason); });
}
Expected<std::string> ManagerClient::show(std::uint64_t run) {
  return call([&] { return proxy_->Show(run); });
}
Expected<std::string> ManagerClient::history(const std::string& serial) {
  return call([&] { return proxy_->History(serial); });
}
Expected<std::string> ManagerClient::check_database() {
  return call([&] { return proxy_->CheckDatabase(); });
}
Expected<std::string> ManagerClient::backup_database(const std::string& name) {
  return call([&] { return proxy_->BackupDatabase(name); });
}
Expected<std::string> ManagerClient::restore_database(const std::string& name) {
  return call([&] { return proxy_->RestoreDatabase(name); });
}
Expected<std::vector<std::string>> ManagerClient::instruments() {
  return call([&] { return proxy_->Instruments(); });
}

class InsWatch::Proxy : public sdbus::ProxyInterfaces<org::selfcal::Ins1_proxy> {
 public:
  Proxy(sdbus::IConnection& connection, InsWatch& owner)
      : ProxyInterfaces(connection, operator_api::bus_name, operator_api::ins_path(owner.ins_)), owner_(owner) {
    registerProxy();
  }
  ~Proxy() { unregisterProxy(); }

 private:
  void onProgressChanged(const std::uint64_t& run, const Entries& progress) override {
    if (owner_.on_progress) {
      owner_.on_progress(run, progress);
    }
  }
  void onStateChanged(const std::uint64_t& run, const std::string&, const std::string& words) override {
    if (owner_.on_state) {
      owner_.on_state(run, words);
    }
  }
  void onWarning(const std::uint64_t& run, const std::string& text) override {
    if (owner_.on_warning) {
      owner_.on_warning(run, text);
    }
  }
  void onFinished(const std::uint64_t& run, const std::int32_t& exit_status, const std::string& reason) override {
    if (owner_.on_finished) {
      owner_.on_finished(run, exit_status, reason);
    }
  }

  InsWatch& owner_;
};

InsWatch::InsWatch(sdbus::IConnection& connection, std::string ins)
    : ins_(std::move(ins)), proxy_(std::make_unique<Proxy>(connection, *this)) {}

InsWatch::~InsWatch() = default;

Expected<InsSnapshot> InsWatch::snapshot() {
  try {
    InsSnapshot snapshot;
    snapshot.name = ins_;
    snapshot.serial = proxy_->Serial();
    snapshot.state = proxy_->State();
    snapshot.user = proxy_->User();
    snapshot.since = proxy_->Since();
    snapshot.run = proxy_->Run();
    snapshot.progress = proxy_->Progress();
    return snapshot;
  } catch (const sdbus::Error& error) {
    return tl::unexpected<Error>(from_bus(error));
  }
}

Expected<std::string> InsWatch::bus() {
  try {
    return proxy_->AskBus();
  } catch (const sdbus::Error& error) {
    if (error.getName() != "org.freedesktop.DBus.Error.AccessDenied") {
      return tl::unexpected<Error>(from_bus(error));
    }
  }
  try {
    return entry(proxy_->Standing(), "bus", std::string());
  } catch (const sdbus::Error& error) {
    return tl::unexpected<Error>(from_bus(error));
  }
}

Expected<void> wait_for_news(sdbus::IConnection& connection, int timeout_ms) {
  try {
    bool any = false;
    while (connection.processPendingRequest()) {
      any = true;
    }
    if (any) {
      return {};
    }
    const auto data = connection.getEventLoopPollData();
    pollfd descriptor{data.fd, data.events, 0};
    const int bus_timeout = data.getPollTimeout();
    poll(&descriptor, 1, bus_timeout < 0 ? timeout_ms : std::min(timeout_ms, bus_timeout));
    while (connection.processPendingRequest()) {
    }
    return {};
  } catch (const sdbus::Error& error) {
    return fail(ErrorKind::device, fmt::format("D-Bus: connection lost: {}", error.getMessage()));
  }
}

Expected<std::string> choose_ins(ManagerClient& manager, const std::string& given) {
  const auto instruments = manager.instruments();
  if (!instruments) {
    return tl::unexpected(instruments.error());
  }
  if (given.empty() && instruments->size() == 1) {
    return instruments->front();
  }
  if (std::find(instruments->begin(), instruments->end(), given) != instruments->end()) {
    return given;
  }
  return fail(ErrorKind::usage,
              fmt::format("{}; configured: {}", given.empty() ? "which INS?" : fmt::format("no INS \"{}\"", given),
                          fmt::join(*instruments, ", ")));
}

Expected<std::vector<std::uint64_t>> run_numbers(const std::vector<std::string>& texts) {
  std::vector<std::uint64_t> runs;
  for (const std::string& text : texts) {
    std::uint64_t run = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), run);
    if (error != std::errc{} || end != text.data() + text.size() || run == 0) {
      return fail(ErrorKind::usage, fmt::format("--with {}: the number of a run is expected", text));
    }
    runs.push_back(run);
  }
  return runs;
}

}  // namespace selfcal::cli
