#include "daemon/operator_service.hpp"

#include <fmt/format.h>
#include <pwd.h>
#include <operator_api/ins1_adaptor.hpp>
#include <operator_api/manager1_adaptor.hpp>

#include "protocol/operator_api/names.hpp"

namespace selfcal {
namespace {

using Entries = std::map<std::string, sdbus::Variant>;

template <typename T>
T granted(Granted<T> answer) {
  if (!answer) {
    throw sdbus::Error(answer.error().name, answer.error().message);
  }
  return std::move(*answer);
}

std::string user_name(uid_t uid) {
  passwd entry{};
  passwd* found = nullptr;
  char buffer[4096];
  if (getpwuid_r(uid, &entry, buffer, sizeof buffer, &found) == 0 && found != nullptr) {
    return found->pw_name;
  }
  return fmt::format("uid {}", uid);
}

Entries entries(const RunProgress& progress) {
  Entries all{
      {"position", std::int32_t{progress.ins.position}},
      {"positions", std::int32_t{progress.positions}},
      {"time_left_s", progress.ins.time_left_s},
      {"finish_in_s", progress.finish_in_s},
      {"outer_deg", progress.ins.outer_deg},
      {"inner_deg", progress.ins.inner_deg},
      {"pages_pulled", progress.pages_pulled},
      {"pages_expected", progress.pages_expected},
      {"pages_refetched", progress.pages_refetched},
      {"pass", std::int32_t{progress.pass}},
      {"pass_fraction", progress.pass_fraction},
      {"link_up", progress.link_up},
      {"lost_frames", std::uint64_t{progress.lost_frames}},
      {"state", std::string(name(progress.state))},
      {"words", std::string(words(progress.state))},
  };
  if (!progress.summary.verdict.empty()) {
    all["verdict"] = progress.summary.verdict;
    all["cause"] = progress.summary.cause;
    all["next"] = progress.summary.next;
  }
  if (progress.estimate_known) {
    all["value"] = std::vector<double>(progress.value.begin(), progress.value.end());
    all["sigma"] = std::vector<double>(progress.sigma.begin(), progress.sigma.end());
    all["tolerance"] = std::vector<double>(progress.tolerance.begin(), progress.tolerance.end());
    all["tolerances_met"] = std::int32_t{progress.tolerances_met};
    all["running"] = progress.running;
  }
  if (progress.running) {
    all["data_s"] = progress.data_s;
    all["met_at_s"] = progress.met_at_s;
  }
  return all;
}

// One option out of a request; `options` loses it, so that what is left is unknown.
template <typename T>
T take(Entries& options, const std::string& key, T otherwise) {
  const auto found = options.find(key);
  if (found == options.end()) {
    return otherwise;
  }
  T value = found->second.get<T>();
  options.erase(found);
  return value;
}

void refuse_others(const Entries& options) {
  if (options.empty()) {
    return;
  }
  throw sdbus::Error(operator_api::error_unknown, fmt::format("unknown option {}", options.begin()->first));
}

}  // namespace

class OperatorService::Manager : public sdbus::AdaptorInterfaces<org::selfcal::Manager1_adaptor> {
 public:
  Manager(sdbus::IConnection& connection, Operations& operations)
      : AdaptorInterfaces(connection, operator_api::manager_path), operations_(operations) {
    registerAdaptor();
  }
  ~Manager() { unregisterAdaptor(); }

 private:
  std::string caller() const {
    const sdbus::Message* message = getObject().getCurrentlyProcessedMessage();
    // The effective user is what the bus itself knows and its policy judges; the real one would be read from /proc,
    // where the hardened service does not see the processes of others.
    return message == nullptr ? "?" : user_name(message->getCredsEuid());
  }

  std::uint64_t Start(const std::string& ins, const Entries& given) override {
    Entries options = given;
    StartRequest request;
    request.ins = ins;
    request.schedule = take<std::string>(options, "schedule", "");
    request.schedule_toml = take<std::string>(options, "schedule_toml", "");
    request.dry_run = take(options, "dry_run", false);
    request.stop_when_met = take(options, "stop_when_met", false);
    request.force_reason = take<std::string>(options, "force", "");
    refuse_others(options);
    request.user = caller();
    return static_cast<std::uint64_t>(granted(operations_.start(request)));
  }
  std::uint64_t Amend(const std::uint64_t& run, const Entries& given) override {
    Entries options = given;
    AmendRequest request;
    request.run = static_cast<RunId>(run);
    for (const std::uint64_t other : take(options, "with", std::vector<std::uint64_t>())) {
      request.with.push_back(static_cast<RunId>(other));
    }
    request.dry_run = take(options, "dry_run", false);
    request.force_reason = take<std::string>(options, "force", "");
    refuse_others(options);
    request.user = caller();
    return static_cast<std::uint64_t>(granted(operations_.amend(request)));
  }
  std::uint64_t Import(const sdbus::UnixFd& recording, const Entries& given) override {
    Entries options = given;
    ImportRequest request;
    request.file = std::make_shared<OpenFile>(sdbus::UnixFd(recording).release());
    request.serial = take<std::string>(options, "serial", "");
    request.source = take<std::string>(options, "source", "");
    request.ins = take<std::string>(options, "ins", "");
    request.measured_utc = take<std::string>(options, "measured_utc", "");
    refuse_others(options);
    request.user = caller();
    return static_cast<std::uint64_t>(granted(operations_.import_run(request)));
  }
  void Abort(const std::string& ins, const std::string& reason) override {
    granted(operations_.abort(ins, fmt::format("aborted by {}{}{}", caller(), reason.empty() ? "" : ": ", reason)));
  }
  std::uint64_t Rollback(const std::string& serial, const std::string& reason) override {
    return static_cast<std::uint64_t>(granted(operations_.rollback(serial, reason, caller())));
  }
  std::string Show(const std::uint64_t& run) override { return granted(operations_.show(static_cast<RunId>(run))); }
  std::string History(const std::string& serial) override { return granted(operations_.history(serial)); }
  std::string CheckDatabase() override { return granted(operations_.check_database()); }
  std::string BackupDatabase(const std::string& file) override { return granted(operations_.backup_database(file)); }
  std::string RestoreDatabase(const std::string& file) override { return granted(operations_.restore_database(file)); }
  std::string Version() override { return SELFCAL_VERSION; }
  std::vector<std::string> Instruments() override { return operations_.instruments(); }

  Operations& operations_;
};

class OperatorService::Ins : public sdbus::AdaptorInterfaces<org::selfcal::Ins1_adaptor> {
 public:
  Ins(sdbus::IConnection& connection, Operations& operations, std::string ins)
      : AdaptorInterfaces(connection, operator_api::ins_path(ins)), operations_(operations), ins_(std::move(ins)) {
    registerAdaptor();
  }
  ~Ins() { unregisterAdaptor(); }

 private:
  const RunRecord* record() const { return operations_.record(ins_); }

  std::string Serial() override { return record() == nullptr ? "" : record()->serial; }
  std::string State() override {
    return record() == nullptr || is_final(record()->state) ? "idle" : std::string(name(record()->state));
  }
  std::uint64_t Run() override { return record() == nullptr ? 0 : static_cast<std::uint64_t>(record()->id); }
  std::string User() override { return record() == nullptr ? "" : record()->user; }
  std::string Since() override { return record() == nullptr ? "" : record()->started_utc; }
  Entries Progress() override {
    const RunProgress* progress = operations_.progress(ins_);
    return progress == nullptr ? Entries{} : entries(*progress);
  }

  Entries Standing() override {
    const selfcal::Standing standing = operations_.standing(ins_);
    return {{"bus", standing.bus},
            {"serial", standing.serial},
            {"last_calibration", static_cast<std::uint64_t>(standing.last_calibration)},
            {"last_calibration_utc", standing.last_calibration_utc},
            {"last_calibration_kind", standing.last_calibration_kind},
            {"set_version", standing.set_version}};
  }

  // The answer takes as long as the INS does; the loop goes on meanwhile.
  void AskBus(sdbus::Result<std::string>&& result) override {
    const auto kept = std::make_shared<sdbus::Result<std::string>>(std::move(result));
    operations_.ask_bus(ins_, [kept](const std::string& words) {
      try {
        kept->returnResults(words);
      } catch (const sdbus::Error&) {  // the bus is gone, and whoever asked with it
      }
    });
  }

  Operations& operations_;
  std::string ins_;
};

OperatorService::OperatorService(sdbus::IConnection& connection, Operations& operations)
    : connection_(connection), operations_(operations), manager_(std::make_unique<Manager>(connection, operations)) {
  update_instruments();
  connection_.requestName(operator_api::bus_name);
}

OperatorService::~OperatorService() = default;

void OperatorService::update_instruments() {
  const auto names = operations_.instruments();
  std::erase_if(instruments_,
                [&](const auto& entry) { return std::find(names.begin(), names.end(), entry.first) == names.end(); });
  for (const std::string& ins : names) {
    if (!instruments_.contains(ins)) {
      instruments_[ins] = std::make_unique<Ins>(connection_, operations_, ins);
    }
  }
}

OperatorService::Ins* OperatorService::find(const std::string& ins) {
  const auto found = instruments_.find(ins);
  return found == instruments_.end() ? nullptr : found->second.get();
}

void OperatorService::state_changed(const RunRecord& run) {
  if (Ins* ins = find(run.ins)) {
    ins->emitStateChanged(static_cast<std::uint64_t>(run.id), std::string(name(run.state)),
                          std::string(words(run.state)));
  }
}

void OperatorService::progress_changed(const RunRecord& run) {
  const RunProgress* progress = operations_.progress(run.ins);
  Ins* ins = find(run.ins);
  if (ins != nullptr && progress != nullptr) {
    ins->emitProgressChanged(static_cast<std::uint64_t>(run.id), entries(*progress));
  }
}

void OperatorService::warning(const RunRecord& run, const std::string& text) {
  if (Ins* ins = find(run.ins)) {
    ins->emitWarning(static_cast<std::uint64_t>(run.id), text);
  }
}

void OperatorService::finished(const RunRecord& run) {
  if (Ins* ins = find(run.ins)) {
    ins->emitFinished(static_cast<std::uint64_t>(run.id), run.exit_status, run.reason);
  }
}

}  // namespace selfcal
