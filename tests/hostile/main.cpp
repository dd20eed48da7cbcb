// Calibrations with a hostile INS, in simulated time:
//   hostile_ins [--cases FILE] [--only TEXT] [--random N] [--seed S] [--jobs N] [--verbose] [--expect-violations]
// Each case is a process of its own, so that a crash is seen, and so is the memory that it took. Exit status 0: everything
// held in every case; 1: not so; 2, 3: usage, bad table. With --expect-violations 0 where
// something was broken in every case (negative control).
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <map>

#include "tests/hostile/scene.hpp"

namespace selfcal::hostile {
namespace {

constexpr long memory_limit_kib = 96L * 1024;  // a clean run takes a third of it
constexpr unsigned wall_limit_s = 240;         // a run that goes round in circles without time passing

struct Settings {
  std::string cases, only;
  std::uint64_t random = 0, seed = 1;
  unsigned jobs = 1;
  bool verbose = false, expect_violations = false;
};

struct Tally {
  std::uint64_t cases = 0, failed = 0, idle = 0;
  std::map<std::string, std::uint64_t> endings;
  long largest_kib = 0;
  double longest_s = 0.0;
};

// What the child tells of its case: one line each.
void report(const Outcome& outcome, std::FILE* to) {
  fmt::print(to, "{}\n{}\n{}\n{}\n", outcome.state, outcome.reason, outcome.seconds, outcome.acted);
  for (const std::string& violation : outcome.violations) {
    fmt::print(to, "{}\n", violation);
  }
}

std::vector<std::string> lines_of(int fd) {
  std::string text;
  std::array<char, 4096> part{};
  for (ssize_t got = 0; (got = ::read(fd, part.data(), part.size())) > 0;) {
    text.append(part.data(), static_cast<std::size_t>(got));
  }
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

class Runner {
 public:
  explicit Runner(const Settings& settings) : settings_(settings) {
    const char* folder = std::getenv("TMPDIR");
    folder_ = fmt::format("{}/hostile_ins.{}", folder != nullptr ? folder : "/tmp", ::getpid());
    std::filesystem::create_directories(folder_);
  }
  ~Runner() { std::filesystem::remove_all(folder_); }
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  void run(const Case& one) {
    if (running_.size() >= settings_.jobs) {
      collect();
    }
    start(one);
  }
  void finish() {
    while (!running_.empty()) {
      collect();
    }
  }
  const Tally& tally() const { return tally_; }

 private:
  struct Child {
    Case one;
    int fd = -1;
  };

  void start(const Case& one) {
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0) {
      std::perror("hostile_ins: pipe");
      std::exit(5);
    }
    std::fflush(stdout);
    const pid_t child = ::fork();
    if (child == 0) {
      ::close(ends[0]);
      ::alarm(wall_limit_s);
      std::FILE* const out = ::fdopen(ends[1], "w");
      if (std::freopen("/dev/null", "w", stderr) == nullptr) {  // the daemon's journal
        ::_exit(5);
      }
      report(play(one, folder_ / std::to_string(::getpid())), out);
      std::fflush(out);
      ::_exit(0);
    }
    ::close(ends[1]);
    running_[child] = {one, ends[0]};
  }

  void collect() {
    int status = 0;
    struct rusage use {};
    const pid_t child = ::wait4(-1, &status, 0, &use);
    const auto found = running_.find(child);
    if (found == running_.end()) {
      return;
    }
    const std::vector<std::string> told = lines_of(found->second.fd);
    ::close(found->second.fd);
    judge(found->second.one, told, status, use.ru_maxrss);
    std::filesystem::remove_all(folder_ / std::to_string(child));
    running_.erase(found);
  }

  void judge(const Case& one, const std::vector<std::string>& told, int status, long kib) {
    constexpr std::size_t head = 4;
    std::vector<std::string> violations;
    std::string ending = "crashed";
    std::string reason;
    bool idle = false;
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || told.size() < head) {
      violations.push_back(WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM
                               ? fmt::format("goes round in circles: {} s of the wall clock", wall_limit_s)
                               : fmt::format("the daemon died of signal {}", WTERMSIG(status)));
    } else {
      ending = told[0];
      reason = told[1];
      idle = told[3] == "0";
      tally_.longest_s = std::max(tally_.longest_s, std::stod(told[2]));
      violations.assign(told.begin() + head, told.end());
    }
    if (kib > memory_limit_kib) {
      violations.push_back(fmt::format("{} KiB of memory", kib));
    }
    if (idle && settings_.random == 0 && !one.rules.empty()) {
      violations.push_back("no rule acted: the case proves nothing");
    }
    ++tally_.cases;
    ++tally_.endings[ending];
    tally_.idle += idle ? 1 : 0;
    tally_.failed += violations.empty() ? 0 : 1;
    tally_.largest_kib = std::max(tally_.largest_kib, kib);
    if (settings_.verbose || !violations.empty()) {
      fmt::print("{} {}: {}{}{}\n", violations.empty() ? "held" : "BROKEN", one.name, ending,
                 reason.empty() ? "" : ": ", reason);
    }
    if (!violations.empty()) {
      for (const std::string& violation : violations) {
        fmt::print("       {}\n", violation);
      }
      for (const Rule& rule : one.rules) {
        fmt::print("       rule: {}\n", describe(rule));
      }
    }
  }

  Settings settings_;
  std::filesystem::path folder_;
  std::map<pid_t, Child> running_;
  Tally tally_;
};

int run(const Settings& settings) {
  Runner runner(settings);
  if (settings.random > 0) {
    for (std::uint64_t k = 0; k < settings.random; ++k) {
      runner.run(random_case(settings.seed + k));
    }
  } else {
    const auto cases = read_cases(settings.cases);
    if (!cases) {
      fmt::print(stderr, "hostile_ins: {}\n", cases.error().message);
      return static_cast<int>(cases.error().kind);
    }
    for (const Case& one : *cases) {
      if (one.name.find(settings.only) != std::string::npos) {
        runner.run(one);
      }
    }
  }
  runner.finish();
  const Tally& tally = runner.tally();
  std::string endings;
  for (const auto& [ending, count] : tally.endings) {
    endings += fmt::format("{}{} {}", endings.empty() ? "" : ", ", ending, count);
  }
  fmt::print("{} cases: {} held, {} broken ({}); longest {:.0f} s of simulated time, largest {} KiB{}\n", tally.cases,
             tally.cases - tally.failed, tally.failed, endings, tally.longest_s, tally.largest_kib,
             tally.idle > 0 ? fmt::format("; in {} no rule acted", tally.idle) : "");
  const std::uint64_t wanted = settings.expect_violations ? tally.cases : 0;
  return tally.cases > 0 && tally.failed == wanted ? 0 : 1;
}

}  // namespace
}  // namespace selfcal::hostile

int main(int argc, char** argv) {
  CLI::App app{"Calibrations with a hostile INS, in simulated time"};
  selfcal::hostile::Settings settings;
  app.add_option("--cases", settings.cases, "table of cases, TOML");
  app.add_option("--only", settings.only, "cases whose name holds this text");
  app.add_option("--random", settings.random, "so many random cases instead");
  app.add_option("--seed", settings.seed, "of the first random case; the next has the next");
  app.add_option("--jobs", settings.jobs, "cases at a time")->check(CLI::Range(1, 64));
  app.add_flag("--verbose", settings.verbose, "a line for every case");
  app.add_flag("--expect-violations", settings.expect_violations,
               "exit status 0 only where something was broken in every case");
  CLI11_PARSE(app, argc, argv);
  return selfcal::hostile::run(settings);
}
