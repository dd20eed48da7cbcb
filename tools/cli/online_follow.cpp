#include "tools/cli/online_follow.hpp"

#include <fmt/format.h>
#include <signal.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

#include "tools/cli/run_progress.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

volatile sig_atomic_t interrupts = 0;

void on_interrupt(int) { interrupts = interrupts + 1; }
void on_resize(int) {}

RunProgressView view_of(const Entries& progress) {
  RunProgressView view;
  view.words = entry<std::string>(progress, "words", "");
  view.state = entry<std::string>(progress, "state", "");
  view.link_up = entry(progress, "link_up", true);
  view.left_s = entry(progress, "finish_in_s", -1.0);
  view.position = entry<std::int32_t>(progress, "position", 0);
  view.positions = entry<std::int32_t>(progress, "positions", 0);
  view.pages_pulled = entry<std::uint32_t>(progress, "pages_pulled", 0);
  view.pages_expected = entry<std::uint32_t>(progress, "pages_expected", 0);
  view.pass = entry<std::int32_t>(progress, "pass", 0);
  view.pass_fraction = entry(progress, "pass_fraction", 0.0);
  view.sigma = entry(progress, "sigma", std::vector<double>());
  view.tolerance = entry(progress, "tolerance", std::vector<double>());
  return view;
}

}  // namespace

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;  // no SA_RESTART: the wait for news is to end
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = on_resize;  // ends the wait too (poll is never restarted): the line is drawn anew at once
  action.sa_flags = SA_RESTART;
  sigaction(SIGWINCH, &action, nullptr);
}

bool interrupted() { return interrupts != 0; }

class Follower::Impl {
 public:
  Impl(ManagerClient& manager, std::string ins)
      : manager_(manager), ins_(std::move(ins)), watch_(manager.connection(), ins_) {
    watch_.on_progress = [this](std::uint64_t run, const Entries& progress) {
      if (run == run_) {
        view_ = view_of(progress);
        draw();
      }
    };
    watch_.on_warning = [this](std::uint64_t run, const std::string& text) {
      if (run != run_) {
        return;
      }
      line_.clear();
      fmt::print(stderr, "warning: {}\n", text);
      draw();
    };
    watch_.on_finished = [this](std::uint64_t run, int exit_status, const std::string& reason) {
      if (run == run_ || run_ == 0) {
        early_[run] = {exit_status, reason};
      }
    };
  }

  Expected<Ending> follow(std::uint64_t run) {
    run_ = run;
    int seen = 0;
    auto looked = std::chrono::steady_clock::now();
    while (true) {
      if (const auto done = early_.find(run); done != early_.end()) {
        line_.clear();
        return done->second;
      }
      if (interrupts != seen) {
        seen = interrupts;
        line_.clear();
        fmt::print(stderr, "stopping run {} safely\n", run);
        if (auto asked = manager_.abort(ins_, "interrupted"); !asked) {
          fmt::print(stderr, "selfcal: {}\n", asked.error().message);
        }
      }
      if (auto news = wait_for_news(manager_.connection(), 500); !news) {
        return tl::unexpected(news.error());
      }
      draw();
      // A daemon that was restarted has told nobody: look for oneself now and then.
      if (std::chrono::steady_clock::now() - looked < std::chrono::seconds(3)) {
        continue;
      }
      looked = std::chrono::steady_clock::now();
      if (auto ended = look(run)) {
        line_.clear();
        return *ended;
      }
    }
  }

 private:
  std::optional<Expected<Ending>> look(std::uint64_t run) {
    const auto document = manager_.show(run);
    if (!document) {
      if (++misses_ < patience) {
        return std::nullopt;
      }
      return Expected<Ending>(tl::unexpected(document.error()));
    }
    misses_ = 0;
    const auto json = nlohmann::json::parse(*document);
    if (json.at("exit_status").is_null()) {
      return std::nullopt;
    }
    return Expected<Ending>(Ending{json.at("exit_status").get<int>(), json.at("reason").get<std::string>()});
  }

  void draw() {
    if (view_) {
      line_.show(progress_line(run_, *view_, line_.room()));
    }
  }

  static constexpr int patience = 10;  // looks, 3 s apart: a restarted daemon is back by then
  ManagerClient& manager_;
  std::string ins_;
  InsWatch watch_;
  ProgressLine line_;
  std::optional<RunProgressView> view_;  // the latest
  std::uint64_t run_ = 0;
  int misses_ = 0;
  std::map<std::uint64_t, Ending> early_;
};

Follower::Follower(ManagerClient& manager, std::string ins) : impl_(std::make_unique<Impl>(manager, std::move(ins))) {}

Follower::~Follower() = default;

Expected<Ending> Follower::follow(std::uint64_t run) { return impl_->follow(run); }

}  // namespace selfcal::cli
