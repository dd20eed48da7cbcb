#include "tests/hostile/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>

#include "daemon/run/calibration_run.hpp"
#include "daemon/run/state_budget.hpp"
#include "protocol/uds/client.hpp"
#include "tests/hostile/middle.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/status_frames.hpp"
#include "tests/unit/daemon/simulated_timers.hpp"
#include "tests/unit/sim_ins/virtual_unit.hpp"

namespace selfcal::hostile {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t longest_block = flash::page_bytes + 2;  // one page to a block
constexpr double page_s = flash::samples_per_page / 50.0;       // of data
constexpr double session_end_s = 10.0;                          // taking the INS out of its session, and some bus time
constexpr auto whole_limit = 3600s;
constexpr auto s3_and_margin = 6s;
constexpr std::size_t most_events = 400;
constexpr double written_value =
    1e-7;                    // of every coefficient of the new set, SI: 0.01 ug, 0.1 ppm, 0.02 arcsec or deg/h
constexpr auto hop = 200us;  // what a batch of frames takes from one end to the next

const uds::SecurityKey key{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};

isotp::Options link() {
  isotp::Options options;
  options.address = {ins::can_id::request, ins::can_id::response, ins::can_id::functional, false};
  options.fd = true;
  options.frame_bytes = can::max_fd_bytes;
  return options;
}

sim::SimConfig small() {
  sim::SimConfig config;
  config.sample_rate_hz = 50.0;
  return config;
}

sim::DiagnosticOptions diagnostics() {
  sim::DiagnosticOptions options;
  options.key = key;
  options.longest_response = longest_block;
  options.seed_salt = 99;
  return options;
}

Schedule short_schedule() {
  Schedule schedule;
  schedule.positions = {{0.0, 0.0}, {90.0, 0.0}};
  schedule.dwell_s = {10.0, 10.0};
  schedule.rotation_s = 5.0;
  return schedule;
}

// The port of the daemon as CanPort is one, on frames that the scene carries; the same words for what goes wrong.
class ScenePort : public InsPort {
 public:
  explicit ScenePort(Timers& timers) : client(link(), client_timings()), timers_(timers) {}
  ~ScenePort() override { timers_.cancel(answer_); }

  void request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
               std::function<void(Answer<Bytes>)> done) override {
    done_ = std::move(done);
    service_ = payload[0];
    longest_answer_ = longest_answer;
    if (!client.request(payload, timers_.now(), longest_answer)) {
      answer(tl::unexpected(PortError{PortError::Kind::protocol, 0, "sim0: the request cannot be sent"}));
    }
    wake();
  }
  void cancel() override {
    client.cancel();
    done_ = {};
    timers_.cancel(answer_);
  }
  void reopen() override {
    client.cancel();
    keep_session(false);
  }
  void keep_session(bool keep) override { client.keep_session(keep, timers_.now()); }
  void take_timings(const uds::SessionTimings& stated) override {
    client.set_timings(uds::with_stated(client_timings(), stated));
  }
  std::uint64_t lost_frames() const override { return 0; }
  std::string_view interface() const override { return "sim0"; }

  void deliver(const uds::Outcome& outcome) {
    if (outcome.kind == uds::Outcome::Kind::positive) {
      answer(Bytes(outcome.response.begin(), outcome.response.end()));
    } else {
      answer(tl::unexpected(explain(outcome)));
    }
  }
  void take_status(const can::CanFrame& frame) {
    if (ins::apply_status_frame(frame, status_) && on_status) {
      on_status(status_);
    }
  }

  uds::Client client;
  std::function<void()> wake;

 private:
  static uds::ClientTimings client_timings() {
    uds::ClientTimings timings;
    timings.p2 = 1s;
    return timings;
  }
  void answer(Answer<Bytes> result) {
    timers_.cancel(answer_);
    answer_ = timers_.after(0ns, [this, result = std::move(result)]() mutable {
      if (const auto done = std::exchange(done_, {})) {
        done(std::move(result));
      }
    });
  }
  PortError explain(const uds::Outcome& outcome) const {
    const auto service = uds::service_name(service_);
    switch (outcome.kind) {
      case uds::Outcome::Kind::negative:
        return {PortError::Kind::negative, outcome.nrc,
                fmt::format("sim0: INS refused {}: {}", service, uds::describe_nrc(outcome.nrc))};
      case uds::Outcome::Kind::timeout:
        return {PortError::Kind::link, 0,
                fmt::format("sim0: no answer to {} within {} s", service,
                            std::chrono::duration<double>(client.timings().p2).count())};
      case uds::Outcome::Kind::too_long:
        return {PortError::Kind::protocol, 0,
                fmt::format("sim0: the answer to {} announces {} bytes, {} are the most it can have", service,
                            outcome.announced, longest_answer_)};
      case uds::Outcome::Kind::transport:
        return {PortError::Kind::link, 0,
                fmt::format("sim0: {}: transfer broken off: {}", service, isotp::name(outcome.why))};
      default: return {PortError::Kind::protocol, 0, fmt::format("sim0: malformed answer to {}", service)};
    }
  }

  Timers& timers_;
  Timers::Id answer_ = 0;
  std::function<void(Answer<Bytes>)> done_;
  std::uint8_t service_ = 0;
  std::size_t longest_answer_ = 0;
  ins::Status status_;
};

// Every coefficient the same, so that the set is known again wherever it turns up.
class SceneEstimators : public Estimators {
 public:
  explicit SceneEstimators(Timers& timers) : timers_(timers) {}
  void start(EstimateJob, EstimateProgress, std::function<void(Expected<Estimate>)> on_done) override {
    timer_ = timers_.after(5s, [on_done] {
      Estimate estimate;
      estimate.result.value.setConstant(written_value);
      estimate.result.sigma.setConstant(0.1);
      estimate.result.determined.fill(true);
      estimate.result.plausible.fill(true);
      estimate.result_json = "{}";
      on_done(estimate);
    });
  }
  void start_running(RunningJob, RunningDone) override {}
  void cancel() override { timers_.cancel(timer_); }

 private:
  Timers& timers_;
  Timers::Id timer_ = 0;
};

class Scene : public RunObserver {
 public:
  Scene(const Case& one, const std::filesystem::path& folder)
      : case_(one),
        folder_(folder),
        unit_(small(), std::move(*sim::FlashMemory::open("", sim::flash_bytes)), diagnostics()),
        middle_(link(), one.rules, [this] { cut_power_wanted_ = true; }),
        port_(timers_),
        estimators_(timers_),
        store_(std::move(*RunStore::open(folder / "selfcal.db"))) {
    port_.wake = [this] { wake(); };
    unit_.power_on(timers_.now());
    tick();
    send_status();
    timers_.run_until([] { return false; }, 3s);
  }

  Outcome play() {
    begin();
    const SteadyTime begun = timers_.now();
    entered_ = begun;
    const bool ended = timers_.run_until([this] { return finished_ > 0; }, whole_limit);
    outcome_.state = name(run_->record().state);
    outcome_.reason = run_->record().reason;
    outcome_.seconds = seconds(timers_.now() - begun);
    outcome_.acted = middle_.acted();
    if (!ended) {
      violation("the run has not ended after {:.0f} s; it is {}", outcome_.seconds, outcome_.state);
      return outcome_;
    }
    timers_.run_until([] { return false; }, s3_and_margin);
    check_story();
    check_ins();
    return outcome_;
  }

 private:
  template <typename... Args>
  void violation(fmt::format_string<Args...> format, Args&&... args) {
    outcome_.violations.push_back(fmt::format(format, std::forward<Args>(args)...));
  }
  static double seconds(SteadyTime t) { return std::chrono::duration<double>(t).count(); }

  static InsConfig config() {
    InsConfig config;
    config.name = std::string("unit");
    config.interface = std::string("sim0");
    config.drift_check_s = 10.0;
    config.lost_after_s = 20.0;
    config.running_estimate_s = 0.0;
    return config;
  }
  void begin() {
    RunRecord record;
    record.ins = std::string("unit");
    record.id = *store_->create_run(record);
    run_ = std::make_unique<CalibrationRun>(RunContext{timers_, *store_, port_, estimators_, *this}, config(),
                                            short_schedule(), key, record, folder_);
    run_->begin();
  }

  // --- frames ---------------------------------------------------------------------------------------------------
  void wake() {
    if (!woken_) {
      woken_ = true;
      timers_.after(hop, [this] {
        woken_ = false;
        carry();
      });
    }
  }
  // One hop of everything that is under way.
  void carry() {
    const Time now = timers_.now();
    if (std::exchange(cut_power_wanted_, false)) {
      unit_.power_on(now);
    }
    std::array<can::CanFrame, 64> frames;
    std::size_t moved = 0;
    if (const auto outcome = port_.client.on_time(now)) {
      port_.deliver(*outcome);
    }
    for (std::size_t n = port_.client.pending(frames, now); n > 0; n = port_.client.pending(frames, now)) {
      for (std::size_t i = 0; i < n; ++i) {
        middle_.from_tester(frames[i], now);
      }
      if (const auto outcome = port_.client.sent(n, now)) {
        port_.deliver(*outcome);
      }
      moved += n;
    }
    unit_.step(now);
    for (std::size_t n = unit_.pending(frames, now); n > 0; n = unit_.pending(frames, now)) {
      for (std::size_t i = 0; i < n; ++i) {
        middle_.from_ins(frames[i], now);
      }
      unit_.sent(n, now);
      moved += n;
    }
    to_tester_.clear();
    to_ins_.clear();
    middle_.take(to_tester_, to_ins_, now);
    for (const can::CanFrame& frame : to_ins_) {
      unit_.on_frame(frame, now);
    }
    for (const can::CanFrame& frame : to_tester_) {
      if (!port_.client.accepts(frame)) {
        port_.take_status(frame);
      } else if (const auto outcome = port_.client.on_frame(frame, now)) {
        port_.deliver(*outcome);
      }
    }
    moved += to_tester_.size() + to_ins_.size();
    if (moved > 0) {
      wake();
    }
  }
  // The clock of the INS and whatever waits for a time.
  void tick() {
    carry();
    const bool busy = !unit_.server().idle() || unit_.flash().busy();
    timers_.after(busy ? 1ms : 10ms, [this] { tick(); });
  }
  void send_status() {
    ins::Status status = unit_.instrument().status();
    status.unlocked = unit_.diagnostics().unlocked();
    status.session = static_cast<std::uint8_t>(unit_.diagnostics().session());
    middle_.from_ins(ins::encode_state_frame(status, alive_, ins::can_id::status), timers_.now());
    middle_.from_ins(ins::encode_gimbal_frame(status, alive_++, ins::can_id::gimbal), timers_.now());
    timers_.after(200ms, [this] { send_status(); });
  }

  // --- what must hold -------------------------------------------------------------------------------------------
  void check_story() {
    const std::string& reason = outcome_.reason;
    const bool completed = run_->record().state == State::completed;
    if (!completed) {
      const bool printable = std::ranges::all_of(reason, [](char c) { return c >= 0x20 && c != 0x7F; });
      if (reason.empty() || !printable || reason.size() > 1000) {
        violation("not a line to read: '{}'", reason);
      } else if (!case_.says.empty() && !std::regex_search(reason, std::regex(case_.says, std::regex::icase))) {
        violation("the line does not say /{}/: '{}'", case_.says, reason);
      }
    }
    if ((case_.ending == Ending::failed && completed) || (case_.ending == Ending::completed && !completed)) {
      violation("{}, expected {}: '{}'", outcome_.state, completed ? "failed" : "completed", reason);
    }
    // The first page of a rotation may be as late as its schedule is long. The end of the session is no state of its own.
    for (const auto& [state, stay] : stays_) {
      const double turning =
          state == State::rotating || state == State::ending_early ? short_schedule().duration_s() : 0.0;
      const double limit = budget_s(state, config(), page_s) + turning + session_end_s;
      if (stay > limit) {
        violation("{:.0f} s in state {}, whose budget is {:.0f} s", stay, name(state), limit);
      }
    }
    const auto events = store_->events(run_->record().id);
    if (!events || events->size() > most_events) {
      violation("{} events are stored", events ? events->size() : 0);
    }
    if (finished_ != 1) {
      violation("its end was reported {} times", finished_);
    }
  }
  void check_ins() {
    if (unit_.diagnostics().unlocked() || unit_.diagnostics().session() != uds::Session::standard) {
      violation("the INS is {} in session {} after the run", unit_.diagnostics().unlocked() ? "unlocked" : "locked",
                static_cast<int>(unit_.diagnostics().session()));
    }
    if (case_.reaches_ins && unit_.instrument().busy()) {
      timers_.run_until([this] { return !unit_.instrument().busy(); }, 30s);
      if (unit_.instrument().busy()) {
        violation("the INS is {} after the run", ins::name(unit_.instrument().state()));
      }
    }
    unit_.power_on(timers_.now());
    const ins::Coefficients& set = unit_.instrument().coefficients().in_force();
    const auto all = [&set](double value) {
      return std::ranges::all_of(set.value, [value](double v) { return v == value; });
    };
    const bool old_one = set.version == 0 && all(0.0);
    const bool new_one = set.version > 0 && all(written_value);
    if (!old_one && !new_one) {
      violation("neither the old set nor the new one is in force: version {}, {}", set.version, set.value[0]);
    }
    if (run_->record().state == State::completed && !new_one) {
      violation("completed, and version {} is in force", set.version);
    }
  }

  void on_state(const RunRecord& run) override {
    if (run.state == last_) {  // a lost link, found again: the state and its budget go on
      return;
    }
    note_stay();
    last_ = run.state;
  }
  // A page more is progress, which renews the budget of the state.
  void on_progress(const RunRecord&) override {
    if (run_->progress().pages_pulled > pages_) {
      pages_ = run_->progress().pages_pulled;
      note_stay();
    }
  }
  void note_stay() {
    double& longest = stays_[last_];
    longest = std::max(longest, seconds(timers_.now() - entered_));
    entered_ = timers_.now();
  }
  void on_warning(const RunRecord&, const std::string&) override {}
  void on_finished(const RunRecord&) override { ++finished_; }

  const Case& case_;
  std::filesystem::path folder_;
  testing_support::SimulatedTimers timers_;
  sim::VirtualUnit unit_;
  Middle middle_;
  ScenePort port_;
  SceneEstimators estimators_;
  std::unique_ptr<RunStore> store_;
  std::unique_ptr<CalibrationRun> run_;
  Outcome outcome_;
  std::vector<can::CanFrame> to_tester_, to_ins_;
  bool woken_ = false;
  bool cut_power_wanted_ = false;
  std::uint8_t alive_ = 0;
  int finished_ = 0;
  State last_ = State::connecting;
  std::uint32_t pages_ = 0;  // pulled
  SteadyTime entered_{};
  std::map<State, double> stays_;
};

}  // namespace

Outcome play(const Case& one, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  Outcome outcome;
  {
    Scene scene(one, folder);
    outcome = scene.play();
  }
  std::filesystem::remove_all(folder);
  return outcome;
}

}  // namespace selfcal::hostile
