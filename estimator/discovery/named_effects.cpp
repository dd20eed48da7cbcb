#include "estimator/discovery/named_effects.hpp"

#include <algorithm>

#include "estimator/diagnosis/signature_pass.hpp"
#include "estimator/diagnosis/still_calibration.hpp"

namespace selfcal::discovery {

Increments without_named(const ImuData& data, const diagnosis::Diagnosis& d) {
  Increments increments{{data.delta_theta.begin(), data.delta_theta.end()}, {data.delta_v.begin(), data.delta_v.end()}};
  diagnosis::Correction correction;
  Eigen::Index columns = 0;
  for (const diagnosis::ModelEffect& effect : d.model) {
    const bool named = std::any_of(d.findings.begin(), d.findings.end(),
                                   [&](const diagnosis::Finding& f) { return f.effect == effect.effect->id; });
    if (named && effect.effect->sensor != nullptr) {
      const auto count = static_cast<int>(effect.size.size());
      correction.effects.push_back({effect.effect, effect.constant, static_cast<int>(columns), count});
      correction.size.conservativeResize(columns + count);
      correction.size.tail(count) = effect.size;
      columns += count;
    }
  }
  if (columns > 0) {
    const diagnosis::RecordingContext context(data);
    PassInput input = diagnosis::forward_pass(data, d.calibration);
    input.parameters = d.value_as_named;
    diagnosis::subtract_effects(context, input, correction, increments.delta_theta, increments.delta_v);
  }
  return increments;
}

}  // namespace selfcal::discovery
