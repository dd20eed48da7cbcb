// selfcal status, abort, show, history, db: one question to the daemon, one answer.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "daemon/host/state_lock.hpp"
#include "daemon/store/database_copies.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/document/document_head.hpp"
#include "protocol/toml_file/nearest_word.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/online_client.hpp"
#include "tools/cli/online_text.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

struct Arguments {
  std::string ins, reason, serial, name;
  std::string state_directory = "/var/lib/selfcal";
  bool offline = false;
  std::uint64_t run = 0;
  bool json = false, csv = false;
};

using Body = Expected<int> (*)(ManagerClient&, const Arguments&);

// Connects, then does it.
CommandRun online(const std::shared_ptr<Arguments>& options, Body body) {
  return [options, body]() -> Expected<int> {
    auto manager = ManagerClient::connect();
    if (!manager) {
      return tl::unexpected(manager.error());
    }
    return body(**manager, *options);
  };
}

// The figures so far, by name; null before the first.
nlohmann::ordered_json estimate_of(const Entries& progress) {
  const auto value = entry(progress, "value", std::vector<double>());
  const auto sigma = entry(progress, "sigma", std::vector<double>());
  const auto tolerance = entry(progress, "tolerance", std::vector<double>());
  if (sigma.size() != sensor_parameters.size() || value.size() != sigma.size() || tolerance.size() != sigma.size()) {
    return {};
  }
  nlohmann::ordered_json estimate{{"running", entry(progress, "running", false)},
                                  {"tolerances_met", entry<std::int32_t>(progress, "tolerances_met", 0)},
                                  {"data_s", entry(progress, "data_s", 0.0)},
                                  {"met_at_s", entry(progress, "met_at_s", -1.0)},
                                  {"parameters", nlohmann::ordered_json::array()}};
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    estimate["parameters"].push_back({{"name", sensor_parameters[i].name},
                                      {"unit", sensor_parameters[i].unit},
                                      {"value", value[i]},
                                      {"sigma", sigma[i]},
                                      {"tolerance", tolerance[i]}});
  }
  return estimate;
}

using Json = nlohmann::ordered_json;

// What the daemon remembers of the unit that `ins` spoke to last: the run whose set is in force, and the last
// calibration that has ended; null where there is none. `runs`: of that unit, or of all where it is not known.
void add_memory(Json& ins, const Json& runs) {
  ins["in_force"] = Json();
  ins["last_calibration"] = Json();
  std::string serial = ins.at("serial").get<std::string>();
  if (serial.empty()) {  // nothing since the daemon was started: the latest run knows
    for (const Json& run : runs) {
      serial = run.at("ins") == ins.at("ins") ? run.at("serial").get<std::string>() : serial;
    }
  }
  for (const Json& run : runs) {
    if (serial.empty() || run.at("serial") != serial) {
      continue;
    }
    if (run.at("in_force").at("now").get<bool>()) {
      ins["in_force"] = {
          {"run", run.at("run")}, {"kind", run.at("kind")}, {"from_utc", run.at("in_force").at("from_utc")}};
    }
    if (run.at("kind") != "rollback" && run.at("kind") != "recording" && !run.at("exit_status").is_null()) {
      ins["last_calibration"] = {
          {"run", run.at("run")}, {"state", run.at("state")}, {"ended_utc", run.at("ended_utc")}};
    }
  }
}

Expected<int> status(ManagerClient& manager, const Arguments& options) {
  const auto instruments = manager.instruments();
  if (!instruments) {
    return tl::unexpected(instruments.error());
  }
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const std::string& ins : *instruments) {
    if (!options.ins.empty() && options.ins != ins) {
      continue;
    }
    InsWatch watch(manager.connection(), ins);
    const auto snapshot = watch.snapshot();
    if (!snapshot) {
      return tl::unexpected(snapshot.error());
    }
    const Entries& progress = snapshot->progress;
    all.push_back({{"ins", ins},
                   {"serial", snapshot->serial},
                   {"state", snapshot->state},
                   {"run", snapshot->run},
                   {"user", snapshot->user},
                   {"since", snapshot->since},
                   {"position", entry<std::int32_t>(progress, "position", 0)},
                   {"positions", entry<std::int32_t>(progress, "positions", 0)},
                   {"time_left_s", entry(progress, "time_left_s", 0.0)},
                   {"pages_pulled", entry<std::uint32_t>(progress, "pages_pulled", 0)},
                   {"pages_expected", entry<std::uint32_t>(progress, "pages_expected", 0)},
                   {"pages_refetched", entry<std::uint32_t>(progress, "pages_refetched", 0)},
                   {"lost_frames", entry<std::uint64_t>(progress, "lost_frames", 0)},
                   {"pass", entry<std::int32_t>(progress, "pass", 0)},
                   {"finish_in_s", entry(progress, "finish_in_s", -1.0)},
                   {"link_up", entry(progress, "link_up", true)},
                   {"estimate", estimate_of(progress)}});
    if (snapshot->state == "idle") {  // else there is better to look at, more often
      const auto history = manager.history(snapshot->serial);
      if (!history) {
        return tl::unexpected(history.error());
      }
      add_memory(all.back(), Json::parse(*history).at("runs"));
    }
    const auto bus = watch.bus();
    if (!bus) {
      return tl::unexpected(bus.error());
    }
    all.back()["bus"] = *bus;
  }
  if (all.empty()) {
    return fail(ErrorKind::usage, fmt::format("no INS \"{}\"{}; configured: {}", options.ins,
                                              did_you_mean(options.ins, *instruments), fmt::join(*instruments, ", ")));
  }
  if (options.json) {
    fmt::print("{}\n", document::with_head(document::status, {{"instruments", all}}).dump());
    return 0;
  }
  for (const auto& ins : all) {
    fmt::print("{}", status_text(ins.dump(), text_columns(stdout)));
  }
  return 0;
}

CommandRun configure_status(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  options.text("INS", arguments->ins, "one INS; all if left out");
  options.flag("--json", arguments->json, "as JSON");
  return online(arguments, status);
}

Expected<int> abort_run(ManagerClient& manager, const Arguments& options) {
  const auto ins = choose_ins(manager, options.ins);
  if (!ins) {
    return tl::unexpected(ins.error());
  }
  if (auto asked = manager.abort(*ins, options.reason); !asked) {
    return tl::unexpected(asked.error());
  }
  if (options.json) {
    fmt::print("{}\n", document::with_head(document::request, {{"ins", *ins}, {"stopping", true}}).dump());
  }
  return 0;
}

CommandRun configure_abort(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  options.text("INS", arguments->ins, "which INS; may be left out where there is one");
  options.text("--reason", arguments->reason, "why; it is recorded");
  options.flag("--json", arguments->json, "as JSON");
  return online(arguments, abort_run);
}

Expected<int> show(ManagerClient& manager, const Arguments& options) {
  const auto document = manager.show(options.run);
  if (!document) {
    return tl::unexpected(document.error());
  }
  fmt::print("{}", options.json ? *document + "\n" : run_text(*document, use_colour(stdout), text_columns(stdout)));
  return 0;
}

CommandRun configure_show(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  options.whole("RUN", arguments->run, range::run, "number of the run", Needed::yes);
  options.flag("--json", arguments->json, "as JSON");
  return online(arguments, show);
}

Expected<int> history(ManagerClient& manager, const Arguments& options) {
  const auto document = manager.history(options.serial);
  if (!document) {
    return tl::unexpected(document.error());
  }
  if (!options.serial.empty() && nlohmann::json::parse(*document).at("runs").empty()) {
    fmt::print(stderr, "selfcal history: no run of an INS with serial number {} is known\n", options.serial);
    if (options.json) {
      fmt::print("{}\n", *document);
    }
    return 1;
  }
  fmt::print("{}", options.json ? *document + "\n" : options.csv ? history_csv(*document) : history_text(*document));
  return 0;
}

CommandRun configure_history(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  options.text("SERIAL", arguments->serial, "serial number of the INS; the runs of all if left out");
  options.flag("--json", arguments->json, "as JSON");
  options.flag("--csv", arguments->csv, "each value of each parameter, as CSV");
  options.exclude("--csv", "--json");
  return online(arguments, history);
}

// Sound, or what is wrong with it (status 1).
Expected<int> check_database(ManagerClient& manager, const Arguments& options) {
  const auto complaint = manager.check_database();
  if (!complaint) {
    return tl::unexpected(complaint.error());
  }
  if (options.json) {
    fmt::print(
        "{}\n",
        document::with_head(document::database, {{"sound", complaint->empty()}, {"complaint", *complaint}}).dump());
  } else {
    fmt::print("{}\n", complaint->empty() ? "the database is sound" : *complaint);
  }
  return complaint->empty() ? 0 : 1;
}

Expected<int> backup_database(ManagerClient& manager, const Arguments& options) {
  const auto path = manager.backup_database(options.name);
  if (!path) {
    return tl::unexpected(path.error());
  }
  fmt::print("{}\n", options.json ? document::with_head(document::database, {{"path", *path}}).dump() : *path);
  return 0;
}

Expected<int> say_restored(const std::string& kept, const Arguments& options) {
  fmt::print("{}\n", options.json   ? document::with_head(document::database, {{"kept", kept}}).dump()
                     : kept.empty() ? std::string("restored")
                                    : "restored; the former database is " + kept);
  return 0;
}

Expected<int> restore_online(ManagerClient& manager, const Arguments& options) {
  const auto kept = manager.restore_database(options.name);
  if (!kept) {
    return tl::unexpected(kept.error());
  }
  return say_restored(*kept, options);
}

Expected<int> restore_offline(const Arguments& options) {
  const auto lock = StateLock::take(options.state_directory);
  if (!lock) {
    return tl::unexpected(lock.error());
  }
  const auto kept = restore_database(options.state_directory, options.name);
  if (!kept) {
    return tl::unexpected(kept.error());
  }
  return say_restored(kept->string(), options);
}

CommandRun configure_database(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  constexpr const char* name = "name of the copy, in the state directory's folder backups";
  auto check = std::make_shared<Options>(options.command("check", "integrity, and rows that belong to no run"));
  Options backup = options.command("backup", "copy the database while the daemon uses it");
  backup.text("NAME", arguments->name, name, Needed::yes);
  auto restore = std::make_shared<Options>(
      options.command("restore", "put a backup in the database's place; the former one is kept"));
  restore->text("NAME", arguments->name, name, Needed::yes);
  restore->flag("--offline", arguments->offline, "the daemon is stopped (it does not start on a damaged database)");
  restore->text("--state-directory", arguments->state_directory, "with --offline");
  options.flag("--json", arguments->json, "as JSON");
  const CommandRun run_restore = online(arguments, restore_online);
  const CommandRun run_check = online(arguments, check_database);
  const CommandRun run_backup = online(arguments, backup_database);
  return [=] {
    if (restore->chosen()) {
      return arguments->offline ? restore_offline(*arguments) : run_restore();
    }
    return check->chosen() ? run_check() : run_backup();
  };
}

const CommandRegistration registrations[] = {
    {{"db", "check, back up or restore the daemon's database", configure_database}},
    {{"status", "what each INS is doing", configure_status}},
    {{"abort", "stop a run safely", configure_abort}},
    {{"show", "the story and the result of a run", configure_show}},
    {{"history", "all runs of an INS, and its parameters over the years", configure_history}},
};

}  // namespace
}  // namespace selfcal::cli
