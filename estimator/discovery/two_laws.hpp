// Two laws at once. Taken one after the other, the function that gains most may stand for a part of both, and what then comes best beside
// it mends that; neither is found, and a random process often takes their place.
#pragma once

#include <optional>
#include <span>
#include <stop_token>

#include "estimator/discovery/search_state.hpp"
#include "estimator/discovery/shortlist.hpp"

namespace selfcal::discovery {

// Two functions of the dictionary on the same or on two axes.
struct RankedPair {
  Ranked first, second;
  double merit = 0.0;  // half of what both gain together less their costs
};

// For each of the functions that gain most, `each_axis` of every axis and of one with constants a few values, the one that gains most
// beside it; best first. A wave has any phase. `model` has nothing chosen.
std::vector<RankedPair> rank_pairs(const PieceModel& model, const Dictionary& dictionary, std::size_t each_axis);

// The two laws that explain the recordings best, fitted exactly, of which each predicts what was left out and is significant beside the
// other. `model`: of the recordings with their laws in; what it has chosen is chosen no more.
std::optional<SearchState> two_laws(std::span<const LawRecording> recordings, PieceModel& model,
                                    const Dictionary& dictionary, const Shortlist& shortlist, double false_alarm_rate,
                                    const std::stop_token& stop = {});

}  // namespace selfcal::discovery
