#include "estimator/discovery/class_average.hpp"

#include <algorithm>

#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery {
namespace {

struct Rival {
  LawTerm term;
  double odds = 0.0;
};

// A law in the words in which it is told, and the most probable other expressions of its class: each has 24 of its own.
struct Words {
  double own_odds = 1.0;
  std::vector<Rival> rivals;
};

Words words_of(const DiscoveredLaw& law, std::size_t most) {
  Words words;
  const auto add = [&](int axis, const std::string& text, double odds) {
    if (axis == law.term.axis && text == law.expression) {
      words.own_odds = odds;
    } else if (auto expression = laws::Expression::parse(text)) {
      words.rivals.push_back({{axis, std::move(*expression), {}}, odds});
    }
  };
  for (const ClassMember& m : law.ambiguous) {
    double odds = m.odds;  // of its own words
    for (const OtherWords& other : m.also) {
      add(m.axis, other.expression, other.odds);
      odds -= other.odds;
    }
    add(m.axis, m.expression, odds);
  }
  std::stable_sort(words.rivals.begin(), words.rivals.end(),
                   [](const Rival& a, const Rival& b) { return a.odds > b.odds; });
  words.rivals.resize(std::min(words.rivals.size(), most), Rival{});
  return words;
}

std::size_t place_of(const DiscoveredLaw& law, const std::vector<LawTerm>& terms) {
  const auto found = std::find_if(terms.begin(), terms.end(), [&](const LawTerm& t) {
    return t.axis == law.term.axis && t.expression.text(t.constants) == law.expression;
  });
  return static_cast<std::size_t>(found - terms.begin());
}

}  // namespace

ClassAverage average_over_classes(std::span<const UnitRecording> recordings, const Discovery& found,
                                  const LawFit& told_alone, std::size_t members, const std::stop_token& stop) {
  const SharedParameters as_found = share_parameters(found.fit);
  ClassAverage average{as_found.parameters, as_found.covariance};
  if (!found.described.empty()) {
    const SharedParameters without = share_parameters(told_alone);
    for (std::size_t r = 0; r < recordings.size(); ++r) {
      const ParameterVector moved = without.parameters[r] - as_found.parameters[r];
      average.covariance[r] += moved * moved.transpose();
    }
  }
  const std::vector<std::unique_ptr<Scene>> scenes = scenes_with_tables(recordings);
  for (const DiscoveredLaw& law : found.laws) {
    const std::size_t place = place_of(law, found.fit.terms);
    const auto [own_odds, rivals] = words_of(law, members);
    double total = own_odds;
    for (const Rival& rival : rivals) {
      total += rival.odds;
    }
    std::vector<ParameterVector> mean(recordings.size(), ParameterVector::Zero());
    std::vector<ParameterMatrix> square(recordings.size(), ParameterMatrix::Zero());
    for (const Rival& rival : rivals) {
      if (place == found.fit.terms.size() || stop.stop_requested()) {
        break;
      }
      std::vector<LawTerm> terms = found.fit.terms;
      terms[place] = rival.term;
      const SharedParameters instead = share_parameters(fit_laws(laws_on(scenes), terms, 0, stop));
      for (std::size_t r = 0; r < recordings.size(); ++r) {
        const ParameterVector moved = instead.parameters[r] - as_found.parameters[r];
        mean[r] += rival.odds / total * moved;
        square[r] += rival.odds / total * moved * moved.transpose();
      }
    }
    for (std::size_t r = 0; r < recordings.size(); ++r) {
      average.parameters[r] += mean[r];
      average.covariance[r] += square[r] - mean[r] * mean[r].transpose();
    }
  }
  return average;
}

}  // namespace selfcal::discovery
