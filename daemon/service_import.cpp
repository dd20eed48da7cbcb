// A recording of somebody else's as a run of the history (run/imported_run.hpp).
#include <fmt/format.h>
#include <sys/stat.h>
#include <time.h>

#include <algorithm>

#include "daemon/host/journal.hpp"
#include "daemon/host/wall_clock.hpp"
#include "daemon/service.hpp"
#include "daemon/store/recording_store.hpp"
#include "protocol/operator_api/names.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t longest_serial = 64, longest_source = 512;

// They go to terminals, pages and the hub as they are.
bool one_line(const std::string& text, std::size_t longest) {
  return !text.empty() && text.size() <= longest &&
         std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; });
}

bool is_utc(const std::string& text) {
  std::tm parts{};
  const char* end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return end != nullptr && *end == '\0';
}

// Empty: nothing is wrong with it.
std::string fault_of(const ImportRequest& request) {
  if (!one_line(request.serial, longest_serial)) {
    return fmt::format("serial: one line of 1 to {} characters is expected", longest_serial);
  }
  if (!one_line(request.source, longest_source)) {
    return fmt::format("source: one line of 1 to {} characters is expected", longest_source);
  }
  if (!request.measured_utc.empty() && (!is_utc(request.measured_utc) || request.measured_utc > utc_now())) {
    return fmt::format("measured_utc: \"{}\" is no time in the past, as 2026-11-21T07:10:00Z", request.measured_utc);
  }
  struct stat about {};
  if (::fstat(request.file->descriptor(), &about) != 0 || !S_ISREG(about.st_mode)) {
    return "what was handed over is no file";
  }
  return {};
}

}  // namespace

Granted<RunId> Service::import_run(const ImportRequest& request) {
  const auto refuse = [](const char* name, std::string message) {
    return tl::unexpected<Refusal>(Refusal{name, std::move(message)});
  };
  if (const std::string fault = fault_of(request); !fault.empty()) {
    return refuse(operator_api::error_unknown, fault);
  }
  if (!request.ins.empty() && session(request.ins) == nullptr) {
    return refuse(operator_api::error_unknown, fmt::format("no INS \"{}\"", request.ins));
  }
  if (stopping_ || (import_ && !import_->over())) {
    return refuse(operator_api::error_busy, stopping_ ? std::string("the daemon is stopping")
                                                      : fmt::format("busy, run {} of a recording by user {}",
                                                                    import_->record().id, import_->record().user));
  }
  struct stat about {};
  ::fstat(request.file->descriptor(), &about);
  const auto least =
      (static_cast<std::uint64_t>(config_.free_space_mib) << 20) + static_cast<std::uint64_t>(about.st_size);
  if (const auto room = require_space(config_.state_directory, least, "an import (free_space_mib)"); !room) {
    return refuse(operator_api::error_unavailable, room.error().message);
  }
  RunRecord record;
  record.ins = request.ins;
  record.serial = request.serial;
  record.state = State::estimating;
  record.user = request.user;
  record.source = request.source;
  record.dry_run = true;
  record.started_utc = request.measured_utc.empty() ? utc_now() : request.measured_utc;
  record.software = SELFCAL_VERSION;
  const auto id = store_->create_run(record);
  if (!id) {
    return refuse(operator_api::error_unavailable, id.error().message);
  }
  record.id = *id;
  std::error_code error;
  fs::create_directories(run_folder(record.id), error);  // what fails here fails in the job, with its words
  begin_import(std::move(record), request.file);
  return *id;
}

void Service::begin_import(RunRecord record, std::shared_ptr<const OpenFile> file) {
  const Session* chosen = session(record.ins);
  const fs::path folder = run_folder(record.id);
  import_ =
      std::make_unique<ImportedRun>(loop_, *store_, std::move(record), chosen == nullptr ? InsConfig() : chosen->config,
                                    [this](const RunRecord&) { prune_recordings(); });
  import_->begin(std::move(file), folder);
}

}  // namespace selfcal
