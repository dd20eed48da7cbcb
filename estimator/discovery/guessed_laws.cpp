#include "estimator/discovery/guessed_laws.hpp"

#include <algorithm>
#include <utility>

#include "estimator/discovery/kept_names.hpp"
#include "estimator/discovery/named_effects.hpp"

namespace selfcal::discovery {
namespace {

using diagnosis::ModelEffect;

// Of one law, that an effect makes of it in whose words it may be: constants of effects are tried at a few values.
constexpr double nearly_all_of_a_law = 0.95;

constexpr std::size_t many_laws = 4;

// Of the effects that explain a recording best with one of the laws, so many are asked for beside laws. The square falls by so much more than
// for the law alone, and by such a share of what all laws together make it fall by.
constexpr std::size_t best_effects = 2;
constexpr double least_more = 60.0, least_of_all_laws = 0.8;

}  // namespace

std::string FittedLaws::forms() const {
  std::string all;
  for (const LawTerm& term : terms) {
    std::string text = term.expression.text(term.constants) + ';';
    std::erase_if(text, [](char c) { return c == '.' || c == 'e' || (c >= '0' && c <= '9'); });
    all += static_cast<char>('a' + term.axis) + text;
  }
  return all;
}

bool FittedLaws::much_like(const FittedLaws& other) const {
  constexpr double much = 0.2;
  return forms() == other.forms() &&
         ((coefficient - other.coefficient).array().abs() < much * other.coefficient.array().abs()).all();
}

FittedLaws FittedLaws::where(const std::function<bool(std::size_t)>& kept) const {
  FittedLaws some;
  some.coefficient.resize(coefficient.size());
  for (std::size_t k = 0; k < terms.size(); ++k) {
    if (kept(k)) {
      some.coefficient(static_cast<Eigen::Index>(some.terms.size())) = coefficient(static_cast<Eigen::Index>(k));
      some.terms.push_back(terms[k]);
    }
  }
  some.coefficient.conservativeResize(static_cast<Eigen::Index>(some.terms.size()));
  return some;
}

const ModelEffect* strongest(const std::vector<ModelEffect>& effects) {
  const auto found = std::max_element(effects.begin(), effects.end(), [&](const ModelEffect& a, const ModelEffect& b) {
    return square_of(a) < square_of(b);
  });
  return found == effects.end() ? nullptr : &*found;
}

LawGuesses::LawGuesses(const UnitRecording& recording, const std::vector<ModelEffect>& rejected,
                       const FittedLaws& alone, const Of& of, LawsBeside laws_beside, const std::stop_token& stop)
    : recording_(recording),
      rejected_(rejected),
      alone_(alone),
      processes_(of.processes),
      laws_beside_(std::move(laws_beside)),
      stop_(stop) {
  for (std::size_t place = 0; place < best_effects; ++place) {
    beside_best_effects_.emplace_back([this, place] { return beside_best(place); });
  }
  if (of.names) {
    add([this] { return not_made_by_any(); });
    add([this] { return not_made_best(); });
    return;
  }
  add([this] { return not_made_by_rejected(); });
  add([this] { return not_made_by_any(); });
  if (const ModelEffect* name = strongest(rejected)) {
    add([this, name] { return beside(*name); });
  }
  // An effect of one triad may have been written as several laws of it.
  const auto of_gyros = [&](std::size_t k) { return alone_.terms[k].axis < 3; };
  const std::size_t laws = alone.terms.size();
  std::size_t gyros = 0;
  for (std::size_t k = 0; k < laws; ++k) {
    gyros += of_gyros(k) ? 1 : 0;
  }
  if (gyros > 0 && gyros < laws) {
    add([this, of_gyros] { return where(of_gyros); });
    add([this, of_gyros] { return where([&](std::size_t k) { return !of_gyros(k); }); });
  } else if (laws == 2) {
    add([this] { return where([](std::size_t k) { return k == 0; }); });
    add([this] { return where([](std::size_t k) { return k == 1; }); });
  }
  if (laws >= many_laws) {
    add_for_many(of.strongest_law);
  }
}

void LawGuesses::add(std::function<std::optional<FittedLaws>()> choice) {
  choices_.emplace_back([choice = std::move(choice)]() -> std::optional<LawGuess> {
    std::optional<FittedLaws> laws = choice();
    return laws ? std::optional<LawGuess>({std::move(*laws), {}}) : std::nullopt;
  });
}

std::optional<LawGuess> LawGuesses::beside_best(std::size_t place) {
  if (alone_.terms.empty()) {
    return std::nullopt;
  }
  const std::vector<CatalogueReach::BesideOneLaw> best = reach().beside_one_law();
  if (place >= best.size() || best[place].more < least_more ||
      best[place].gain < least_of_all_laws * reach().gain_of_laws()) {
    return std::nullopt;
  }
  std::optional<FittedLaws> laws = laws_beside_(best[place].effect);
  return laws ? std::optional<LawGuess>({std::move(*laws), {best[place].effect.effect}}) : std::nullopt;
}

// So many laws are rarely all there are: one of them may be a law and the others a description, or those of one axis an effect.
void LawGuesses::add_for_many(std::size_t strongest_law) {
  add([this, strongest_law] { return where([&](std::size_t k) { return k == strongest_law; }); });
  for (int axis = 0; axis < 6; ++axis) {
    const auto there =
        std::count_if(alone_.terms.begin(), alone_.terms.end(), [&](const LawTerm& l) { return l.axis == axis; });
    if (there > 1) {
      add([this, axis] { return where([&](std::size_t k) { return alone_.terms[k].axis != axis; }); });
    }
  }
}

const CatalogueReach& LawGuesses::reach() {
  if (!reach_) {
    reach_.emplace(recording_, alone_.terms, alone_.coefficient, stop_);
  }
  return *reach_;
}

std::optional<FittedLaws> LawGuesses::without_these(const std::vector<bool>& made) const {
  const bool any = std::find(made.begin(), made.end(), true) != made.end();
  return any ? std::optional(alone_.where([&](std::size_t k) { return !made[k]; })) : std::nullopt;
}

std::optional<FittedLaws> LawGuesses::not_made_by_rejected() const {
  return without_these(made_by_effects(recording_, rejected_, alone_.terms, stop_));
}

// By no effect of the catalogue, alone or with the others of its axis: beside a strong law that nobody knew an effect may have been too weak
// to be rejected even.
std::optional<FittedLaws> LawGuesses::not_made_by_any() {
  std::vector<bool> made;
  for (std::size_t k = 0; k < alone_.terms.size(); ++k) {
    made.push_back(share_of([k](std::size_t law) { return law == k; }) >= nearly_all_of_a_law ||
                   share_of([&](std::size_t law) { return alone_.terms[law].axis == alone_.terms[k].axis; }) >=
                       nearly_all_of_a_law);
  }
  return without_these(made);
}

// All but the one that an effect makes best.
std::optional<FittedLaws> LawGuesses::not_made_best() {
  std::size_t best = 0;
  double most = 0.0;
  for (std::size_t k = 0; k < alone_.terms.size(); ++k) {
    const double share = share_of([k](std::size_t law) { return law == k; });
    best = share > most ? k : best;
    most = std::max(most, share);
  }
  std::vector<bool> made(alone_.terms.size(), false);
  made[best] = most >= nearly_all_of_a_law;
  return without_these(made);
}

double LawGuesses::share_of(const Chosen& of) {
  std::vector<bool> those;
  for (std::size_t k = 0; k < alone_.terms.size(); ++k) {
    those.push_back(of(k));
  }
  return reach().share(those);
}

std::optional<FittedLaws> LawGuesses::beside(const ModelEffect& name) {
  return !processes_ && reach().largest_share(*name.effect) < least_share_of_laws ? std::nullopt : laws_beside_(name);
}

std::optional<FittedLaws> LawGuesses::where(const Chosen& kept) {
  const auto taken = [&kept](std::size_t k) { return !kept(k); };
  return share_of(taken) < least_share_of_laws ? std::nullopt : std::optional(alone_.where(kept));
}

}  // namespace selfcal::discovery
