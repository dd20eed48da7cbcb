// The daemon as the command line sees it: a connection, its objects, and D-Bus errors as ours.
#pragma once

#include <sdbus-c++/sdbus-c++.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal::cli {

using Entries = std::map<std::string, sdbus::Variant>;

// The daemon's manager object, called without a thread of its own.
class ManagerClient {
 public:
  static Expected<std::unique_ptr<ManagerClient>> connect();
  ~ManagerClient();

  Expected<std::uint64_t> start(const std::string& ins, const Entries& options);
  Expected<std::uint64_t> amend(std::uint64_t run, const Entries& options);
  Expected<void> abort(const std::string& ins, const std::string& reason);
  Expected<std::uint64_t> import_recording(int descriptor, const Entries& options);
  Expected<std::uint64_t> rollback(const std::string& serial, const std::string& reason);
  Expected<std::string> show(std::uint64_t run);
  Expected<std::string> history(const std::string& serial);
  Expected<std::string> check_database();
  Expected<std::string> backup_database(const std::string& name);
  Expected<std::string> restore_database(const std::string& name);
  Expected<std::vector<std::string>> instruments();
  sdbus::IConnection& connection() { return *connection_; }

 private:
  class Proxy;
  explicit ManagerClient(std::unique_ptr<sdbus::IConnection> connection);
  template <typename Call>
  auto call(Call make) -> Expected<decltype(make())>;

  std::unique_ptr<sdbus::IConnection> connection_;
  std::unique_ptr<Proxy> proxy_;
};

// A value of a progress report, or what it is when absent.
template <typename T>
T entry(const Entries& entries, const std::string& key, T otherwise) {
  const auto found = entries.find(key);
  return found == entries.end() || !found->second.containsValueOfType<T>() ? otherwise : found->second.get<T>();
}

struct InsSnapshot {
  std::string name, serial, state, user, since;
  std::uint64_t run = 0;
  Entries progress;
};

// What happens to one INS. Callbacks come from wait().
class InsWatch {
 public:
  InsWatch(sdbus::IConnection& connection, std::string ins);
  ~InsWatch();

  std::function<void(std::uint64_t run, const Entries&)> on_progress;
  std::function<void(std::uint64_t run, const std::string& words)> on_state;
  std::function<void(std::uint64_t run, const std::string& text)> on_warning;
  std::function<void(std::uint64_t run, int exit_status, const std::string& reason)> on_finished;

  Expected<InsSnapshot> snapshot();
  // The state of its bus in a clause. The INS is asked where the caller may do so and no run needs it.
  Expected<std::string> bus();

 private:
  class Proxy;
  std::string ins_;
  std::unique_ptr<Proxy> proxy_;
};

// Serves the connection until something arrives or the time is over; a caught signal ends the wait too.
Expected<void> wait_for_news(sdbus::IConnection& connection, int timeout_ms);

// Of `--with RUN`, repeated. An error (usage) where one is no number of a run.
Expected<std::vector<std::uint64_t>> run_numbers(const std::vector<std::string>& texts);

// The name of the INS meant: `given`, or the only one configured.
Expected<std::string> choose_ins(ManagerClient& manager, const std::string& given);

}  // namespace selfcal::cli
