#include "estimator/discovery/law_class.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace selfcal::discovery {
namespace {

constexpr double largest_log_odds = 50.0;

bool nearly(const std::vector<double>& a, const std::vector<double>& b) {
  constexpr double tolerance = 0.1;  // alternatives of a constant are farther apart
  return a.empty() || std::abs(a.front() - b.front()) < tolerance * std::abs(b.front());
}

bool same_value(const LawTerm& a, const LawTerm& b) { return same_law(a, b) && nearly(a.constants, b.constants); }

}  // namespace

std::vector<double> shares_of(const std::vector<Candidate>& alternatives) {
  const std::size_t n = alternatives.size();
  std::vector<double> shares(n, 1.0);
  if (n < 2 || !(alternatives.front().spacing > 0.0)) {
    return shares;
  }
  const auto value = [&](std::size_t j) { return std::log(alternatives[j].term.constants.front()); };  // they ascend
  for (std::size_t j = 0; j < n; ++j) {
    const std::size_t below = j == 0 ? 0 : j - 1, above = std::min(n - 1, j + 1);
    shares[j] = 0.5 * (value(above) - value(below)) / alternatives.front().spacing;
  }
  return shares;
}

LawClass::LawClass(const UnitRecording& like, Candidate own, const std::vector<std::vector<Candidate>>& others,
                   const std::vector<Candidate>& own_values, double least_odds, const std::stop_token& stop)
    : own_(std::move(own)), tried_(best_of(others)), least_odds_(least_odds), possible_{own_} {
  // Of a function's belief, that of each which is possible.
  std::vector<double> share = {own_values.empty() ? 1.0 : Shortlist::wave_step};
  // A wave that is another one has a peak as wide as this one's, of which one period stands for all.
  double of_another_wave = share.front();
  for (const Candidate& c : own_values) {
    of_another_wave += Shortlist::wave_step * odds(c);
  }
  for (const std::vector<Candidate>& alternatives : others) {
    std::vector<double> shares = shares_of(alternatives);
    for (std::size_t j = 0; j < alternatives.size(); ++j) {
      if (!own_values.empty() && alternatives[j].term.constants.size() == 2) {
        shares[j] = of_another_wave;
      }
      if (same_value(alternatives[j].term, own_.term)) {
        share.front() = std::min(share.front(), shares[j]);
      } else if (is_member(alternatives[j])) {
        possible_.push_back(alternatives[j]);
        share.push_back(shares[j]);
      }
    }
  }
  for (const Candidate& c : own_values) {
    if (is_member(c)) {
      possible_.push_back(c);
      share.push_back(Shortlist::wave_step);
    }
  }
  laws_.reserve(possible_.size());
  for (std::size_t j = 0; j < possible_.size(); ++j) {
    laws_.push_back({possible_[j].term, possible_[j].coefficient, share[j] * odds(possible_[j])});
  }
  elsewhere_ = carry_over(like, laws_, stop);
}

double LawClass::odds(const Candidate& c) const {
  return std::exp(std::min(largest_log_odds, c.merit() - own_.merit()));
}

bool LawClass::is_member(const Candidate& c) const { return c.merit() > own_.merit() + std::log(least_odds_); }

std::size_t LawClass::best_elsewhere() const {
  // A form between two others that fit predicts either: |y||z| stands for y^2 and z^2. It must be probable itself.
  constexpr double least_odds = 0.05;
  const auto merit = [](const Candidate& c) { return c.merit(); };
  const double highest = merit(*std::max_element(possible_.begin(), possible_.end(),
                                                 [&](const auto& a, const auto& b) { return merit(a) < merit(b); }));
  std::size_t best = 0;
  for (std::size_t a = 1; a < possible_.size(); ++a) {
    if (merit(possible_[a]) < highest + std::log(least_odds)) {
      continue;
    }
    const bool most_probable = std::none_of(possible_.begin(), possible_.end(), [&](const Candidate& other) {
      return same_law(other.term, possible_[a].term) && other.merit() > possible_[a].merit();
    });
    best = most_probable && elsewhere_.merit[a] > elsewhere_.merit[best] ? a : best;
  }
  return best;
}

std::vector<Candidate> LawClass::split(bool members) const {
  std::vector<Candidate> some;
  if (members) {
    some.push_back(own_);
  }
  for (const Candidate& c : tried_) {
    if (!same_law(c.term, own_.term) && is_member(c) == members) {
      some.push_back(c);
    }
  }
  return some;
}

std::size_t LawClass::place(const Candidate& c) const {
  const auto found =
      std::find_if(possible_.begin(), possible_.end(), [&](const Candidate& p) { return same_value(p.term, c.term); });
  return static_cast<std::size_t>(found - possible_.begin());
}

LawClass::Likeness LawClass::likeness(const Candidate& a, const Candidate& b) const {
  const std::size_t of_a = place(a), of_b = place(b), none = possible_.size();
  if (of_a == none || of_b == none) {
    return Likeness::none;
  }
  return one_function(elsewhere_, laws_, of_a, of_b)        ? Likeness::anywhere
         : one_function_here(elsewhere_, laws_, of_a, of_b) ? Likeness::here
                                                            : Likeness::none;
}

// `own` stands for its function, and the most probable expression for each other one.
std::vector<ClassMember> LawClass::functions() const {
  std::vector<std::pair<Candidate, ClassMember>> all;
  for (const Candidate& c : members()) {
    const auto same =
        std::find_if(all.begin(), all.end(), [&](const auto& one) { return likeness(one.first, c) != Likeness::none; });
    if (same == all.end()) {
      all.push_back({c, {c.text(), c.term.axis, odds(c), {}}});
    } else {
      same->second.odds += odds(c);
      same->second.also.push_back({c.text(), odds(c), likeness(same->first, c) == Likeness::here});
    }
  }
  const double own_odds = all.front().second.odds;
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first.cost < b.first.cost; });
  std::vector<ClassMember> result;
  result.reserve(all.size());
  for (auto& [candidate, member] : all) {
    member.odds /= own_odds;
    for (OtherWords& other : member.also) {
      other.odds /= own_odds;
    }
    result.push_back(std::move(member));
  }
  return result;
}

}  // namespace selfcal::discovery
