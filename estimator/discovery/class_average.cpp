#include "estimator/discovery/class_average.hpp"

#include <algorithm>

#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery {
namespace {

struct Rival {
  LawTerm term;
  double odds = 0.0;
};

// The most probable expressions of a law's class but for its own: each has 24 of its own.
std::vector<Rival> rivals_of(const DiscoveredLaw& law, std::size_t most) {
  std::vector<Rival> rivals;
  const auto add = [&](int axis, const std::string& text, double odds) {
    auto expression = laws::Expression::parse(text);
    if (expression && !(axis == law.term.axis && text == law.expression)) {
      rivals.push_back({{axis, std::move(*expression), {}}, odds});
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
  std::stable_sort(rivals.begin(), rivals.end(), [](const Rival& a, const Rival& b) { return a.odds > b.odds; });
  rivals.resize(std::min(rivals.size(), most), Rival{});
  return rivals;
}

// Of the law in the words in which it is told.
double own_odds(const DiscoveredLaw& law) {
  double odds = 1.0;
  for (const ClassMember& m : law.ambiguous) {
    if (m.axis == law.term.axis && m.expression == law.expression) {
      for (const OtherWords& other : m.also) {
        odds -= other.odds;
      }
    }
  }
  return odds;
}

std::size_t place_of(const DiscoveredLaw& law, const std::vector<LawTerm>& terms) {
  const auto found = std::find_if(terms.begin(), terms.end(), [&](const LawTerm& t) {
    return t.axis == law.term.axis && t.expression.text(t.constants) == law.expression;
  });
  return static_cast<std::size_t>(found - terms.begin());
}

}  // namespace

ClassAverage average_over_classes(std::span<const UnitRecording> recordings, const Discovery& found,
                                  std::size_t members, const std::stop_token& stop) {
  const SharedParameters as_found = share_parameters(found.fit);
  ClassAverage average{as_found.parameters, as_found.covariance};
  const std::vector<std::unique_ptr<Scene>> scenes = scenes_of(recordings);
  for (const auto& scene : scenes) {
    scene->table = collect_nodes(scene->motion, scene->input);
  }
  for (const DiscoveredLaw& law : found.laws) {
    const std::size_t place = place_of(law, found.fit.terms);
    const std::vector<Rival> rivals = rivals_of(law, members);
    double total = own_odds(law);
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
