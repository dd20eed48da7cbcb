#include "estimator/discovery/law_trial.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/discovery/scene.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::discovery {
namespace {

constexpr int constant_rounds = 12;

std::optional<LawTrialFailure> check(const LawMotion& motion, const NodeTable& table,
                                     const std::vector<LawTerm>& laws) {
  for (std::size_t k = 0; k < laws.size(); ++k) {
    const laws::VariableSet missing = laws[k].expression.variables() & ~motion.available();
    for (std::size_t v = 0; v < laws::variable_count; ++v) {
      if (missing.test(v)) {
        return LawTrialFailure{k, std::string(laws::variable_names[v]).append(": the recording has no such channel")};
      }
    }
    const Eigen::ArrayXd values = laws[k].expression.evaluate(table.channels, laws[k].constants);
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      if (!std::isfinite(values(i))) {
        const double t = table.nodes[static_cast<std::size_t>(i)].time_s;
        return LawTrialFailure{k, "not finite at " + std::to_string(t) + " s after the start"};
      }
    }
  }
  return std::nullopt;
}

}  // namespace

tl::expected<std::vector<TriedLaw>, LawTrialFailure> try_laws(std::span<const UnitRecording> recordings,
                                                              const std::vector<LawTerm>& laws,
                                                              const std::vector<double>& stated) {
  const std::vector<std::unique_ptr<Scene>> scenes = scenes_of(recordings);
  for (const auto& scene : scenes) {
    scene->table = collect_nodes(scene->motion, scene->input);
    if (auto failure = check(scene->motion, scene->table, laws)) {
      return tl::unexpected(std::move(*failure));
    }
  }
  const LawFit fit = fit_laws(laws_on(scenes), laws, constant_rounds);
  std::vector<TriedLaw> tried;
  auto at = static_cast<Eigen::Index>(laws.size());
  for (std::size_t k = 0; k < laws.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    TriedLaw law;
    law.term = fit.terms[k];
    law.expression = law.term.expression.text(law.term.constants);
    law.coefficient = fit.coefficient(row);
    law.sigma = std::sqrt(fit.covariance(row, row));
    for (std::size_t c = 0; c < law.term.constants.size(); ++c, ++at) {
      law.constants.push_back({"constant " + std::to_string(c + 1), "", law.term.constants[c],
                               std::sqrt(std::max(0.0, fit.covariance(at, at)))});
    }
    law.gain = fit.gain[k];
    law.held_out_gain = fit.held_out_gain[k];
    const double degrees = 1.0 + static_cast<double>(law.constants.size());
    law.significance = sigma_from_log_p(std::min(0.0, log_chi_squared_tail(law.gain, degrees)));
    law.share = std::clamp(law.gain / std::max(1.0, fit.square_before - fit.rows), 0.0, 1.0);
    law.stated = stated[k];
    law.collinear = fit.collinear[k];
    tried.push_back(std::move(law));
  }
  return tried;
}

}  // namespace selfcal::discovery
