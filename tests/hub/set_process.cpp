// A test set without an INS: writes runs into its database by the service's own code, at its own pace, and sends them to the hub
// by the sender's own code. Killed anywhere and started again it goes on where its database stands.
//
//   hub_set STATE-FOLDER CONNECTION SET SETS RUNS PACE-MS RECORDINGS-FOLDER
//
// While a file STATE-FOLDER/cut exists its hub is out of reach. What run k of set s measured is a function of k and s, so that
// the hub can be held to it. Ends when all is written and sent, and prints how often it tried.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <string>
#include <thread>

#include "daemon/host/wall_clock.hpp"
#include "daemon/hub/replicator.hpp"
#include "daemon/store/database_copies.hpp"

namespace {

using namespace selfcal;
using namespace std::chrono_literals;

struct Arguments {
  std::filesystem::path state;
  std::string connection;
  std::int64_t set = 0, sets = 1, runs = 1, pace_ms = 0;
  std::string recordings;
};

constexpr std::int64_t units = 500;
constexpr std::int64_t first_second = 1'767'225'600;  // 2026-01-01
constexpr std::int64_t ten_years_s = 315'569'520;

void end(const Error& error) {
  fmt::print(stderr, "{}\n", error.message);
  std::_Exit(5);
}

// The fleet's calendar: calibration n, of all sets', is of a unit in an order that changes with each round.
RunRecord planned(const Arguments& arguments, std::int64_t run) {
  const std::int64_t n = (run - 1) * arguments.sets + arguments.set;
  const std::int64_t all = arguments.sets * arguments.runs;
  const std::int64_t unit = (n % units * 7 + n / units * 13) % units;
  RunRecord record;
  record.ins = "bench";
  record.serial = fmt::format("U-{:03}", unit);
  record.user = "trial";
  record.schedule = "horizontal";
  record.software = "trial";
  record.started_utc = utc_text(first_second + n * (ten_years_s / all));
  record.ended_utc = utc_text(first_second + n * (ten_years_s / all) + 1);
  return record;
}

RunStore::Parameters measured(const Arguments& arguments, std::int64_t run) {
  RunStore::Parameters parameters;
  for (std::size_t i = 0; i < parameters.value.size(); ++i) {
    parameters.value[i] = static_cast<double>(arguments.set * 1'000'000 + run) + static_cast<double>(i) / 32.0;
    parameters.sigma[i] = 0.25;
    parameters.determined[i] = true;
  }
  return parameters;
}

void finish(RunStore& store, const Arguments& arguments, RunRecord record) {
  const RunRecord plan = planned(arguments, record.id);
  if (auto ok = store.store_parameters(record.id, measured(arguments, record.id)); !ok) {
    end(ok.error());
  }
  if (record.id % 50 == 0) {
    record.recording = (arguments.state / fmt::format("recording-{}.h5", record.id)).string();
    std::ofstream(record.recording) << "recording of set " << arguments.set << ", run " << record.id << "\n";
  }
  record.serial = plan.serial;
  record.state = State::completed;
  record.ended_utc = plan.ended_utc;
  record.exit_status = 0;
  if (auto ok = store.update_run(record); !ok) {
    end(ok.error());
  }
}

void write_runs(const Arguments& arguments, std::atomic<bool>& written) {
  auto store = RunStore::open(database_path(arguments.state));
  if (!store) {
    end(store.error());
  }
  const auto unfinished = (*store)->unfinished_runs();
  if (!unfinished) {
    end(unfinished.error());
  }
  for (const RunRecord& left : *unfinished) {
    finish(**store, arguments, left);
  }
  std::int64_t next = static_cast<std::int64_t>((*store)->runs_of_serial("")->size()) + 1;
  for (; next <= arguments.runs; ++next) {
    while (next == arguments.runs && std::filesystem::exists(arguments.state / "hold")) {
      std::this_thread::sleep_for(20ms);  // the trial has more to do to it
    }
    RunRecord record = planned(arguments, next);
    record.ended_utc.clear();
    const auto id = (*store)->create_run(record);
    if (!id || *id != next) {
      end(id ? Error{ErrorKind::internal, fmt::format("run {} instead of {}", *id, next)} : id.error());
    }
    record.id = *id;
    finish(**store, arguments, record);
    std::this_thread::sleep_for(std::chrono::milliseconds(arguments.pace_ms));
  }
  written = true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 8) {
    fmt::print(stderr, "usage: hub_set STATE-FOLDER CONNECTION SET SETS RUNS PACE-MS RECORDINGS-FOLDER\n");
    return 2;
  }
  const Arguments arguments{
      argv[1], argv[2], std::atoll(argv[3]), std::atoll(argv[4]), std::atoll(argv[5]), std::atoll(argv[6]), argv[7]};
  auto store = RunStore::open(database_path(arguments.state));
  auto outbox = hub::Outbox::open(database_path(arguments.state));
  if (!store || !outbox) {
    end(store ? outbox.error() : store.error());
  }
  std::atomic<bool> written = false;
  const std::jthread writer([&] { write_runs(arguments, written); });
  HubConfig config;
  config.connection = arguments.connection;
  config.recordings = arguments.recordings;
  hub::Replicator replicator(config, {{"bench", "trial"}}, **store, **outbox);
  int failures = 0, past = 0;
  while (true) {
    const bool all_written = written;  // before the look at the outbox
    if (std::filesystem::exists(arguments.state / "cut")) {
      replicator.disconnect();
      std::this_thread::sleep_for(50ms);
      continue;
    }
    const auto result = replicator.step();
    if (!result) {
      ++failures;
      std::this_thread::sleep_for(100ms);
      continue;
    }
    past += result->past;
    const auto counts = (*outbox)->counts();
    if (!counts) {
      end(counts.error());
    }
    if (all_written && counts->waiting == 0 && !result->more && result->past == 0) {
      fmt::print("sent {} refused {} failures {} past {}\n", counts->sent, counts->refused, failures, past);
      return 0;
    }
    if (!result->more) {
      std::this_thread::sleep_for(50ms);
    }
  }
}
