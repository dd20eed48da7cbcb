// selfcal batch: the same work on many recordings, on this machine or a Slurm cluster.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocol/command_line/depot_ranges.hpp"
#include "protocol/document/document_head.hpp"
#include "tools/batch/batch_journal.hpp"
#include "tools/batch/hub_results.hpp"
#include "tools/batch/plans.hpp"
#include "tools/batch/slurm.hpp"
#include "tools/batch/step_work.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double hub_patience_s = 60.0;

struct Arguments {
  std::vector<std::string> recordings, sbatch;
  std::string folder, options, simulation, hub, round, draw, answer;
  std::optional<std::uint64_t> jobs;
  std::uint64_t tasks_a_job = 8, tries = 3, limit_s = 3600;
  std::optional<std::uint64_t> part;
  batch::Trial trial;
  batch::MonteCarlo monte_carlo;
  std::uint64_t seed = 1, clean = 300, repeats = 2;  // of the blind trial
  bool slurm = false, again = false, json = false;
};

batch::Bounds bounds_of(const Arguments& arguments) {
  return {static_cast<int>(arguments.tries), static_cast<unsigned>(arguments.limit_s)};
}

void print_failures(const batch::BatchFolder& folder) {
  for (std::size_t i = 0; i < folder.plan().tasks.size(); ++i) {
    if (const auto line = folder.failure(i)) {
      fmt::print("failed: {}: {}\n", folder.task(i).label, *line);
    }
  }
}

// Status 0 where every task is done.
int print_counts(const batch::BatchFolder& folder) {
  const batch::Counts counts = batch::count(folder.states());
  print_failures(folder);
  fmt::print("batch {}: {} of {} tasks done, {} failed, {} blocked, {} open{}; {:.1f} s of processor time\n",
             folder.plan().kind, counts.done, counts.all(), counts.failed, counts.blocked, counts.open,
             folder.paused() ? ", paused" : "", folder.processor_s());
  return counts.done == counts.all() ? 0 : 1;
}

// What the last task found, for people: Monte Carlo's table, the blind trial's score.
Expected<void> print_outcome(const batch::BatchFolder& folder) {
  const std::size_t last = folder.plan().tasks.size() - 1;
  const batch::Step step = folder.task(last).step;
  if (!folder.has_result(last) || (step != batch::Step::statistics && step != batch::Step::score)) {
    return {};
  }
  const auto result = folder.result(last);
  if (!result) {
    return tl::unexpected(result.error());
  }
  if (step == batch::Step::score) {
    fmt::print("{}", result->at("text").is_string() ? result->at("text").get<std::string>() : "");
    return {};
  }
  fmt::print("{:<24}{:>8}{:>12}{:>12}{:>8}{:>12}\n", "parameter", "unit", "rms error", "sigma", "ratio", "within 95 %");
  for (const Json& p : result->at("parameters")) {
    if (p.at("ratio").is_null()) {
      fmt::print("{:<24}{:>8}  not determined\n", p.at("name").get<std::string>(), p.at("unit").get<std::string>());
      continue;
    }
    fmt::print("{:<24}{:>8}{:>12.4g}{:>12.4g}{:>8.2f}{:>9}/{}\n", p.at("name").get<std::string>(),
               p.at("unit").get<std::string>(), p.at("rms_error").get<double>(), p.at("sigma").get<double>(),
               p.at("ratio").get<double>(), p.at("within_95").get<int>(), p.at("determined").get<int>());
  }
  return {};
}

// Works the batch off, with the hub's results where one is given.
Expected<void> work(batch::BatchFolder& folder, const Arguments& arguments, const batch::BatchJournal& journal,
                    batch::HubResults* hub) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < folder.plan().tasks.size(); ++i) {
    all.push_back(i);
  }
  std::size_t ended = all.size() - batch::count(folder.states()).open;
  ProgressLine line;
  const batch::OnEnded on_ended = [&](std::size_t task) {
    ++ended;
    journal.task_ended(task);
    line.show(fmt::format("batch {}: {} of {} tasks", folder.plan().kind, ended, all.size()));
    if (hub != nullptr && folder.has_result(task)) {
      hub->offer(task);
    }
  };
  if (arguments.slurm) {
    const batch::SlurmOptions options{arguments.tasks_a_job, arguments.sbatch};
    return batch::drive_slurm(folder, options, bounds_of(arguments), on_ended);
  }
  return batch::work_off(folder, all, arguments.jobs.value_or(std::max(1U, std::thread::hardware_concurrency())),
                         bounds_of(arguments), on_ended);
}

// With what the hub has of this batch. A batch that goes on waits for a hub that is away; a new one ends at once, for a person is there.
Expected<std::unique_ptr<batch::HubResults>> results_of_hub(batch::BatchFolder& folder, const Arguments& arguments) {
  const batch::Counts counts = batch::count(folder.states());
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(counts.done > 0 ? hub_patience_s : 0.0);
  while (true) {
    auto hub = batch::HubResults::open(arguments.hub, folder);
    const auto came = hub ? (*hub)->exchange(folder) : tl::unexpected(hub.error());
    if (came) {
      if (*came > 0) {
        fmt::print("{} results came from the hub\n", *came);
      }
      return hub;
    }
    if (came.error().kind != ErrorKind::device || std::chrono::steady_clock::now() >= end) {
      return tl::unexpected(came.error());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
}

Expected<int> drive(batch::BatchFolder& folder, const Arguments& arguments) {
  const auto lock = folder.lock();
  const auto known = lock ? batch::check_programs(folder.plan()) : tl::unexpected(lock.error());
  if (!known) {
    return tl::unexpected(known.error());
  }
  std::unique_ptr<batch::HubResults> hub;
  if (!arguments.hub.empty()) {
    auto there = results_of_hub(folder, arguments);
    if (!there) {
      return tl::unexpected(there.error());
    }
    hub = std::move(*there);
  }
  const batch::BatchJournal journal(folder);
  journal.begun();
  const auto worked = work(folder, arguments, journal, hub.get());
  const auto sent = hub ? hub->flush(hub_patience_s) : Expected<void>{};
  if (!worked || !sent) {
    const Error& error = worked ? sent.error() : worked.error();
    journal.broken_off(error);
    return tl::unexpected(error);
  }
  journal.ended();
  if (const auto printed = print_outcome(folder); !printed) {
    return tl::unexpected(printed.error());
  }
  const int status = print_counts(folder);
  if (hub) {
    fmt::print("hub: {} results stored, {} there already; {:.2f} s\n", hub->stored(), hub->present(), hub->seconds());
  }
  return status;
}

// Files that the plan names by content, before the plan itself.
Expected<void> take_inputs(const batch::Planned& planned, const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder / "inputs", error);
  for (const auto& [name, from] : planned.inputs) {
    if (!error && !fs::exists(folder / "inputs" / name, error)) {
      fs::copy_file(from, folder / "inputs" / name, error);
    }
    if (error) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}", (folder / "inputs" / name).string(), error.message()));
    }
  }
  if (error) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", folder.string(), error.message()));
  }
  return {};
}

Expected<int> begin(const Expected<batch::Planned>& planned, const Arguments& arguments) {
  if (!planned) {
    return tl::unexpected(planned.error());
  }
  if (planned->plan.tasks.empty()) {
    return fail(ErrorKind::usage, "no recording is given");
  }
  if (const auto taken = take_inputs(*planned, arguments.folder); !taken) {
    return tl::unexpected(taken.error());
  }
  auto folder = batch::BatchFolder::create(arguments.folder, planned->plan);
  return folder ? drive(*folder, arguments) : tl::unexpected(folder.error());
}

Expected<int> of_recordings(batch::Step step, const Arguments& arguments) {
  return begin(batch::plan_of_recordings(step, arguments.recordings, batch::words_in(arguments.options)), arguments);
}

Expected<int> estimate(Arguments& arguments) { return of_recordings(batch::Step::estimate, arguments); }
Expected<int> diagnose(Arguments& arguments) { return of_recordings(batch::Step::diagnose, arguments); }

Expected<int> trial(Arguments& arguments) {
  arguments.trial.draw = batch::words_in(arguments.draw);
  arguments.trial.answer = batch::words_in(arguments.answer);
  return begin(batch::plan_of_trial(arguments.trial), arguments);
}

// The blind trial's two programs stand beside selfcal (tests/blind).
Expected<int> blind(Arguments& arguments) {
  arguments.trial.kind = "blind";
  arguments.trial.draw = {"selfcal_blind_generate", "draw", std::to_string(arguments.seed),
                          std::to_string(arguments.clean), std::to_string(arguments.repeats)};
  arguments.trial.answer = {"selfcal_blind_answer"};
  return begin(batch::plan_of_trial(arguments.trial), arguments);
}

Expected<int> monte_carlo(Arguments& arguments) {
  arguments.monte_carlo.simulation = batch::words_in(arguments.simulation);
  arguments.monte_carlo.options = batch::words_in(arguments.options);
  return begin(batch::plan_of_monte_carlo(arguments.monte_carlo), arguments);
}

Json status_document(const batch::BatchFolder& folder) {
  const batch::Counts counts = batch::count(folder.states());
  Json failures = Json::array();
  for (std::size_t i = 0; i < folder.plan().tasks.size(); ++i) {
    if (const auto line = folder.failure(i)) {
      const batch::Task& task = folder.task(i);
      failures.push_back({{"task", task.label}, {"key", task.key}, {"line", *line}, {"tries", folder.tries(i).begun}});
    }
  }
  return document::with_head(document::batch, Json{{"kind", folder.plan().kind},
                                                   {"planned_with", folder.plan().version},
                                                   {"tasks", counts.all()},
                                                   {"done", counts.done},
                                                   {"failed", counts.failed},
                                                   {"blocked", counts.blocked},
                                                   {"open", counts.open},
                                                   {"paused", folder.paused()},
                                                   {"processor_s", folder.processor_s()},
                                                   {"failures", failures}});
}

Expected<int> status(Arguments& arguments) {
  const auto folder = batch::BatchFolder::open(arguments.folder);
  if (!folder) {
    return tl::unexpected(folder.error());
  }
  if (!arguments.json) {
    return print_counts(*folder);
  }
  fmt::print("{}\n", status_document(*folder).dump(1));
  const batch::Counts counts = batch::count(folder->states());
  return counts.done == counts.all() ? 0 : 1;
}

Expected<int> pause(Arguments& arguments) {
  auto folder = batch::BatchFolder::open(arguments.folder);
  const auto paused = folder ? folder->pause(true) : tl::unexpected(folder.error());
  if (!paused) {
    return tl::unexpected(paused.error());
  }
  fmt::print("paused: tasks that run are finished, none is begun (selfcal batch resume {})\n", arguments.folder);
  return 0;
}

Expected<int> resume(Arguments& arguments) {
  auto folder = batch::BatchFolder::open(arguments.folder);
  auto ready = folder ? folder->pause(false) : tl::unexpected(folder.error());
  if (ready && arguments.again) {
    ready = folder->forget_failures();
  }
  return ready ? drive(*folder, arguments) : tl::unexpected(ready.error());
}

Expected<int> work_one(Arguments& arguments) {
  auto folder = batch::BatchFolder::open(arguments.folder);
  if (!folder) {
    return tl::unexpected(folder.error());
  }
  const char* of_array = std::getenv("SLURM_ARRAY_TASK_ID");
  if (!arguments.part && of_array == nullptr) {
    return fail(ErrorKind::usage, "--part is missing, and this is no job of an array");
  }
  const std::size_t part = arguments.part ? *arguments.part : std::strtoull(of_array, nullptr, 10);
  return batch::work_part(*folder, arguments.round, part, bounds_of(arguments)).map([] { return 0; });
}

void bounding_options(Options& options, Arguments& a) {
  options.whole("--tries", a.tries, range::tries, "of a task whose program fails");
  options.whole("--limit", a.limit_s, range::try_limit, "seconds that one try may take");
}

void driving_options(Options& options, Arguments& a) {
  options.whole("--jobs", a.jobs, range::jobs, "tasks at a time on this machine; else one a core");
  options.flag("--slurm", a.slurm, "on the Slurm cluster that sbatch knows; the folder is one that its machines share");
  options.whole("--tasks-a-job", a.tasks_a_job, range::tasks_a_job, "with --slurm: that one job of an array works off");
  options.texts("--sbatch", a.sbatch, "with --slurm: a further option of sbatch, --sbatch=--partition=night; repeated");
  options.text("--hub", a.hub, "connection string of a hub that has results by key, and gets the new ones");
  bounding_options(options, a);
}

constexpr const char* into_help = "folder of the batch: made, or gone on with";
constexpr const char* options_help = "options of selfcal estimate or diagnose, as one text";

using Below = std::pair<Options, Expected<int> (*)(Arguments&)>;

void add_beginnings(Options& options, Arguments& a, std::vector<Below>& all) {
  for (const auto& [name, run] : {std::pair("estimate", &estimate), std::pair("diagnose", &diagnose)}) {
    all.emplace_back(options.command(name, "selfcal " + std::string(name) + " of each recording"), run);
    Options& own = all.back().first;
    own.texts("RECORDING", a.recordings, "recordings, and folders of them");
    own.text("--into", a.folder, into_help, Needed::yes);
    own.text("--options", a.options, options_help);
    driving_options(own, a);
  }
  const auto add_trial = [&](const char* name, const char* help, auto run) -> Options& {
    all.emplace_back(options.command(name, help), run);
    Options& own = all.back().first;
    own.text("--into", a.folder, into_help, Needed::yes);
    own.text("--score", a.trial.scorer, "program that is given the folder with key.jsonl and answers.jsonl");
    driving_options(own, a);
    return own;
  };
  Options& blinded = add_trial("blind", "a blind trial: cases drawn, sealed, answered, scored", blind);
  blinded.whole("--seed", a.seed, range::seed, "of the cases");
  blinded.whole("--clean", a.clean, range::cases, "clean recordings among all that the seed gives");
  blinded.whole("--repeats", a.repeats, range::cases, "of every effect at every strength, among all");
  blinded.whole("--first", a.trial.cases, range::cases, "so many cases of these");
  Options& own_trial = add_trial("trial", "a trial by programs of your own that draw cases and answer them", trial);
  own_trial.text("--draw", a.draw,
                 "program and words; given a number and a file, writes the recording, prints the case", Needed::yes);
  own_trial.text("--answer", a.answer, "program and words; given the recording, prints its answer", Needed::yes);
  own_trial.texts("--uses", a.trial.uses, "a file that these programs use: results follow from it too; repeated");
  own_trial.whole("--cases", a.trial.cases, range::cases, "so many, numbered from 0");
  all.emplace_back(options.command("monte-carlo", "recordings simulated and estimated, errors against sigmas"),
                   monte_carlo);
  Options& simulated = all.back().first;
  simulated.text("--into", a.folder, into_help, Needed::yes);
  simulated.whole("--runs", a.monte_carlo.runs, range::cases, "recordings");
  simulated.whole("--seed", a.monte_carlo.seed, range::seed, "of the first; the others follow");
  simulated.text("--simulate", a.simulation, "options of selfcal simulate, as one text");
  simulated.text("--options", a.options, "options of selfcal estimate, as one text");
  driving_options(simulated, a);
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  auto all = std::make_shared<std::vector<Below>>();
  Arguments& a = *arguments;
  all->reserve(9);
  add_beginnings(options, a, *all);
  const auto add = [&](const char* name, const char* help, auto run) -> Options& {
    all->emplace_back(options.command(name, help), run);
    all->back().first.text("FOLDER", a.folder, "of the batch", Needed::yes);
    return all->back().first;
  };
  add("status", "how far it is, and what failed; status 1 unless all is done", status)
      .flag("--json", a.json, "one JSON document");
  add("pause", "finishes the tasks that run, begins none", pause);
  Options& resumed = add("resume", "goes on: after a pause, or after whatever ended it", resume);
  resumed.flag("--again", a.again, "what has failed too");
  driving_options(resumed, a);
  Options& worker = add("work", "what a job of the cluster runs; not for people", work_one);
  worker.text("--round", a.round, "of submissions", Needed::yes);
  worker.whole("--part", a.part, range::part, "of the round; else SLURM_ARRAY_TASK_ID");
  bounding_options(worker, a);
  return [arguments, all]() -> Expected<int> {
    for (const auto& [below, run] : *all) {
      if (below.chosen()) {
        return run(*arguments);
      }
    }
    return fail(ErrorKind::internal, "batch: no command chosen");
  };
}

const CommandRegistration registration{{"batch", "the same work on many recordings, here or on a cluster", configure}};

}  // namespace
}  // namespace selfcal::cli
