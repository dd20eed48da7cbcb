#include "estimator/discovery/class_average.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "estimator/discovery/absorbed.hpp"
#include "estimator/discovery/laws_leave.hpp"
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

// Adds what the members of a law's class spread about the equation in which it is told. Of what is only described none is the law, and their
// odds say nothing: all count alike, and the mean stays.
void add_class(ClassAverage& average, const DiscoveredLaw& law, const LawFit& fit,
               const std::vector<ParameterVector>& as_found, const std::vector<LawRecording>& recordings,
               std::size_t members, const std::stop_token& stop) {
  const std::size_t place = place_of(law, fit.terms);
  auto [own_odds, rivals] = words_of(law, members);
  const bool told = law.why.empty();
  if (!told) {
    own_odds = 1.0;
    for (Rival& rival : rivals) {
      rival.odds = 1.0;
    }
  }
  double total = own_odds;
  for (const Rival& rival : rivals) {
    total += rival.odds;
  }
  std::vector<ParameterVector> mean(recordings.size(), ParameterVector::Zero());
  std::vector<ParameterMatrix> square(recordings.size(), ParameterMatrix::Zero());
  for (const Rival& rival : rivals) {
    if (place == fit.terms.size() || stop.stop_requested()) {
      break;
    }
    std::vector<LawTerm> terms = fit.terms;
    terms[place] = rival.term;
    const SharedParameters instead = share_parameters(fit_laws(recordings, terms, 0, stop));
    for (std::size_t r = 0; r < recordings.size(); ++r) {
      const ParameterVector moved = instead.parameters[r] - as_found[r];
      mean[r] += rival.odds / total * moved;
      square[r] += rival.odds / total * moved * moved.transpose();
    }
  }
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    average.covariance[r] += square[r];
    if (told) {
      average.parameters[r] += mean[r];
      average.covariance[r] -= mean[r] * mean[r].transpose();
    }
  }
}

// What is described may move the 24 as far again, and by what they take up of it unseen.
void hold_described(ClassAverage& average, const std::vector<ParameterVector>& with,
                    const std::vector<ParameterVector>& without, const std::vector<std::unique_ptr<Scene>>& scenes,
                    std::span<const DiscoveredLaw> described) {
  for (std::size_t r = 0; r < with.size(); ++r) {
    const ParameterVector moved = without[r] - with[r];
    average.covariance[r] += moved * moved.transpose();
    average.covariance[r].diagonal() += absorbed(scenes[r]->table, described).cwiseAbs2();
  }
}

}  // namespace

ClassAverage average_over_classes(std::span<const UnitRecording> recordings, const Discovery& found,
                                  const LawFit& told_alone, std::size_t members, const std::stop_token& stop) {
  const bool beside = !found.processes.empty();
  const auto average_of = [&](const LawFit& fit) {
    if (beside) {
      return beside_processes(recordings, fit, found.processes, stop);
    }
    SharedParameters shared = share_parameters(fit);
    return ClassAverage{std::move(shared.parameters), std::move(shared.covariance)};
  };
  ClassAverage average = average_of(found.fit);
  if (beside && found.described.empty()) {
    return average;
  }
  const std::vector<ParameterVector> as_found = average.parameters;
  const std::vector<std::unique_ptr<Scene>> scenes = scenes_with_tables(recordings);
  if (!found.described.empty()) {
    hold_described(average, as_found, average_of(told_alone).parameters, scenes, found.described);
  }
  if (!beside) {
    const std::vector<LawRecording> with_laws = laws_on(scenes);
    for (const std::vector<DiscoveredLaw>* laws : {&found.laws, &found.described}) {
      for (const DiscoveredLaw& law : *laws) {
        add_class(average, law, found.fit, as_found, with_laws, members, stop);
      }
    }
  }
  return average;
}

}  // namespace selfcal::discovery
