#include "estimator/discovery/laws_leave.hpp"

#include <utility>

#include "estimator/diagnosis/regression/evidence.hpp"
#include "estimator/diagnosis/search/judgement.hpp"
#include "estimator/diagnosis/search/quantities.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/scene.hpp"
#include "estimator/statistics/whiteness.hpp"

namespace selfcal::discovery {

diagnosis::CorrectedRecording less_laws(const UnitRecording& recording, const LawFit& fit) {
  const diagnosis::RecordingContext context(recording.data);
  const LawMotion motion(context);
  const PassInput input = diagnosis::forward_pass(recording.data, recording.calibration);
  return without_laws(motion, collect_nodes(motion, input), input, fit.terms, fit.coefficient);
}

LawFit fit_of_told(std::span<const UnitRecording> recordings, const Discovery& found, const std::stop_token& stop) {
  if (found.described.empty()) {
    return found.fit;
  }
  const std::vector<std::unique_ptr<Scene>> scenes = scenes_with_tables(recordings);
  std::vector<LawTerm> told;
  told.reserve(found.laws.size());
  for (const DiscoveredLaw& law : found.laws) {
    told.push_back(law.term);
  }
  return fit_laws(laws_on(scenes), std::move(told), 0, stop);
}

Left left_by_laws(const UnitRecording& recording, const LawFit& fit, bool coloured) {
  const diagnosis::CorrectedRecording rest = less_laws(recording, fit);
  const diagnosis::RecordingContext context(recording.data);
  std::vector<diagnosis::Candidate> bins = diagnosis::quantity_bins(context);
  int columns = 0;
  for (diagnosis::Candidate& bin : bins) {
    bin.first = columns;
    bin.count = static_cast<int>(bin.effect->parameters.size());
    columns += bin.count;
  }
  diagnosis::SignaturePass pass(context, bins, true);
  const diagnosis::SignatureRows rows = pass.run(diagnosis::forward_pass(rest.data(), recording.calibration));
  const diagnosis::Evidence evidence(rows);
  diagnosis::Shown shown{evidence.square, test_whiteness(rows.residual).log_p,
                         diagnosis::locate(evidence, pass.map(), pass.first_map_column(), {})};
  const diagnosis::Rules rules{.budget = diagnosis::budget_of_one,
                               .motion_fitted = recording.calibration.moored,
                               .coloured = coloured,
                               .goes_on = {}};
  Left left;
  left.adequacy = diagnosis::adequacy(rules, shown, evidence.rows, rules.alpha, rules.alpha);
  left.places = std::move(shown.map.places);
  left.by_quantity = diagnosis::locate_by_quantity(evidence, bins, {}, context.mean_temperature());
  return left;
}

}  // namespace selfcal::discovery
