#include "tests/discovery/limit.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "estimator/discovery/carry_over.hpp"
#include "estimator/discovery/piece_model.hpp"
#include "estimator/discovery/pieces.hpp"
#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery_trial {
namespace {

using namespace discovery;

struct Form {
  LawTerm term;
  double count = 0.0;  // draws of it
  double gain = 0.0, coefficient = 0.0;
};

bool by_gain(const Form& a, const Form& b) { return a.gain > b.gain; }

std::vector<Form> counted(const std::vector<PossibleForm>& forms, const laws::VariableSet& available) {
  std::map<std::pair<int, std::string>, double> counts;
  for (const PossibleForm& form : forms) {
    counts[{form.axis, form.expression}] += 1.0;
  }
  std::vector<Form> all;
  for (const auto& [form, count] : counts) {
    auto expression = laws::Expression::parse(form.second);
    if (expression && (expression->variables() & ~available).none()) {
      all.push_back({{form.first, std::move(*expression), {}}, count});
    }
  }
  return all;
}

// Of means over the pieces, with what the 24 multiply projected out as means too and without: the larger one, for both lose.
void gain_over_pieces(const Scene& scene, std::vector<Form>& forms) {
  const PieceSums sums = sum_over_pieces(scene.motion, scene.input, scene.trace);
  const Dictionary dictionary = make_dictionary(sums, scene.motion.available());
  const PieceModel plain(sums, dictionary),
      beside = plain.beside({plain.information(), known_columns(sums), dictionary});
  for (Form& form : forms) {
    const Eigen::ArrayXd values = form.term.expression.evaluate(sums.channels, {});
    if (values.isFinite().all()) {
      const Eigen::VectorXd means = sums.means(values);
      form.gain = std::max(plain.gain(form.term.axis, means), beside.gain(form.term.axis, means));
    }
  }
}

// As they stand through the filter.
void gain_exactly(const Scene& scene, std::vector<Form>& forms) {
  std::vector<LawTerm> terms;
  for (const Form& form : forms) {
    terms.push_back(form.term);
  }
  LawColumns columns(scene.motion, scene.table, terms, false);
  const ColumnSums sums = run_columns(scene.input, scene.trace, columns);
  for (std::size_t k = 0; k < forms.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double information = sums.information(i, i);
    forms[k].coefficient = information > 0.0 ? sums.score(i) / information : 0.0;
    forms[k].gain = forms[k].coefficient * sums.score(i);
  }
}

}  // namespace

LimitAnswer best_of_all(const UnitRecording& recording, const std::vector<PossibleForm>& forms) {
  constexpr std::size_t looked_at = 400, weighed = 80;
  Scene scene(recording);
  scene.table = collect_nodes(scene.motion, scene.input);
  std::vector<Form> all = counted(forms, scene.motion.available());
  gain_over_pieces(scene, all);
  const auto keep = [&all](std::size_t most) {
    std::sort(all.begin(), all.end(), by_gain);
    all.resize(std::min(all.size(), most));
  };
  keep(looked_at);
  gain_exactly(scene, all);
  keep(weighed);
  LimitAnswer answer;
  if (all.empty() || !(all.front().gain > 0.0)) {
    return answer;
  }
  std::vector<PossibleLaw> possible;
  for (const Form& form : all) {
    possible.push_back({form.term, form.coefficient, form.count * std::exp(0.5 * (form.gain - all.front().gain))});
    answer.likely += possible.back().odds > 0.01 ? 1 : 0;
  }
  const CarryOver elsewhere = carry_over(recording, possible);
  const auto best = static_cast<std::size_t>(std::max_element(elsewhere.merit.begin(), elsewhere.merit.end()) -
                                             elsewhere.merit.begin());
  answer.laws = {{all[best].term.axis, all[best].term.expression.text(), all[best].coefficient}};
  answer.gain = all[best].gain;
  answer.carries_over = elsewhere.probability[best];
  return answer;
}

}  // namespace selfcal::discovery_trial
