// Plans of the batches that `selfcal batch` knows.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "tools/batch/task.hpp"

namespace selfcal::batch {

// A plan, and the files that it takes with it: name in the batch's folder inputs/, from where.
struct Planned {
  Plan plan;
  std::map<std::string, std::filesystem::path> inputs;
};

// estimate or diagnose of each recording. `recordings`: files, and folders of which all *.h5, *.hdf5, *.csv and files named by
// their SHA-256 are meant. `options`: words for the command; a word that is a file's name stands for its content.
Expected<Planned> plan_of_recordings(Step step, const std::vector<std::string>& recordings,
                                     const std::vector<std::string>& options);

// A trial of somebody's own: cases with recordings, and what is answered to them.
struct Trial {
  std::string kind = "trial";
  std::uint64_t cases = 100;
  // Program and its first words, of which those that are a file's name stand for its content. `draw` is given a case's number and the recording to write, and prints {"case": what is true, for
  // the key, "assumed": what the answerer may know, if anything}. `answer` is given the recording, and "assumed" where there is
  // some, and prints its answer, a JSON object. Times ("elapsed_s", "cpu_s", "seconds") are no part of it.
  std::vector<std::string> draw, answer;
  std::vector<std::string> uses;  // further files that the results follow from: what a script runs, for example
  std::string scorer;             // a program that is given the folder with key.jsonl and answers.jsonl; "": none
};

// Cases drawn, the key sealed, then answered, then scored.
Expected<Planned> plan_of_trial(const Trial& trial);

struct MonteCarlo {
  std::uint64_t seed = 1, runs = 100;
  std::vector<std::string> simulation;  // options of selfcal simulate
  std::vector<std::string> options;     // of selfcal estimate
};

// Recordings simulated, estimated, and the errors held against their sigmas.
Expected<Planned> plan_of_monte_carlo(const MonteCarlo& trial);

// Blanks between words; quotes as in a shell are not known.
std::vector<std::string> words_in(const std::string& text);

}  // namespace selfcal::batch
