#include "daemon/store/run_state.hpp"

#include <array>

namespace selfcal {
namespace {

constexpr std::array state_names{"connecting",   "unlocking",    "scheduling",   "starting",   "rotating",
                                 "ending_early", "draining",     "estimating",   "judging",    "checking_old",
                                 "erasing",      "writing",      "verifying",    "committing", "resetting",
                                 "confirming",   "checking_new", "ending_check", "stopping",   "putting_back",
                                 "completed",    "refused",      "failed",       "aborted"};
constexpr std::array state_words{"looking for the INS",
                                 "unlocking the INS",
                                 "writing the schedule",
                                 "starting the rotation",
                                 "rotating, pulling data",
                                 "ending the rotation early: the data suffice",
                                 "pulling the last data",
                                 "estimating",
                                 "judging the result",
                                 "measuring the drift with the old coefficients",
                                 "erasing the inactive slot",
                                 "writing the coefficients",
                                 "reading the coefficients back",
                                 "committing",
                                 "power-cycling the INS",
                                 "reading what is in force",
                                 "measuring the drift with the new coefficients",
                                 "ending the navigation check of the INS",
                                 "stopping the gimbal",
                                 "putting the old coefficients back",
                                 "completed",
                                 "refused: nothing was written",
                                 "failed",
                                 "aborted"};

static_assert(state_names.size() == static_cast<std::size_t>(State::aborted) + 1);
static_assert(state_words.size() == state_names.size());

}  // namespace

bool is_final(State state) { return state >= State::completed; }

bool gimbal_may_turn(State state) {
  return state == State::starting || state == State::rotating || state == State::ending_early ||
         state == State::stopping;
}

std::string_view name(State state) { return state_names.at(static_cast<std::size_t>(state)); }
std::string_view words(State state) { return state_words.at(static_cast<std::size_t>(state)); }

std::optional<State> state_from_name(std::string_view text) {
  for (std::size_t i = 0; i < state_names.size(); ++i) {
    if (text == state_names[i]) {
      return static_cast<State>(i);
    }
  }
  return std::nullopt;
}

}  // namespace selfcal
