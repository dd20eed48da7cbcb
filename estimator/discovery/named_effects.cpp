#include "estimator/discovery/named_effects.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/still_calibration.hpp"

namespace selfcal::discovery {
namespace {

bool names(const diagnosis::Diagnosis& d, const diagnosis::Effect* effect) {
  return std::any_of(d.findings.begin(), d.findings.end(),
                     [&](const diagnosis::Finding& f) { return f.source == effect; });
}

// The sizes and the constant that a diagnosis gave the effect; null: it did not name it.
const diagnosis::ModelEffect* model_of(const diagnosis::Diagnosis& d, const diagnosis::Effect* effect) {
  const auto found =
      std::find_if(d.model.begin(), d.model.end(), [&](const diagnosis::ModelEffect& m) { return m.effect == effect; });
  return names(d, effect) && found != d.model.end() ? &*found : nullptr;
}

bool can_hold(const diagnosis::Effect& effect, const ImuData& data) {
  const bool has_angles = !data.gimbal_outer.empty() && !data.gimbal_inner.empty();
  return effect.sensor != nullptr && diagnosis::applies(effect, !data.temperature.empty()) &&
         (!effect.needs_gimbal || has_angles);
}

// The effect where each recording that named it has it; where another can hold it, that of the recording that shows it best.
UnitEffect on_unit(const diagnosis::Effect* effect, std::span<const DiagnosedRecording> unit) {
  const diagnosis::ModelEffect* best = nullptr;
  for (const DiagnosedRecording& r : unit) {
    const diagnosis::ModelEffect* m = model_of(r.diagnosis, effect);
    best = m != nullptr && (best == nullptr || square_of(*m) > square_of(*best)) ? m : best;
  }
  UnitEffect result{effect, {}};
  for (const DiagnosedRecording& r : unit) {
    const diagnosis::ModelEffect* own = model_of(r.diagnosis, effect);
    result.on.emplace_back();
    if (best != nullptr && can_hold(*effect, r.data)) {
      const diagnosis::ModelEffect& from = own != nullptr ? *own : *best;
      result.on.back() = {effect, from.constant, from.size, own != nullptr && !std::isnan(from.constant)};
    }
  }
  return result;
}

std::vector<const diagnosis::Effect*> to_be_taken_out(std::span<const DiagnosedRecording> unit) {
  const bool one_unexplained =
      std::any_of(unit.begin(), unit.end(), [](const DiagnosedRecording& r) { return r.diagnosis.unexplained; });
  std::vector<const diagnosis::Effect*> effects;
  for (const DiagnosedRecording& r : unit) {
    for (const diagnosis::Finding& f : r.diagnosis.findings) {
      const bool known = std::find(effects.begin(), effects.end(), f.source) != effects.end();
      const bool in_all = std::all_of(
          unit.begin(), unit.end(), [&](const DiagnosedRecording& other) { return names(other.diagnosis, f.source); });
      if (f.source != nullptr && !known && (in_all || !one_unexplained)) {
        effects.push_back(f.source);
      }
    }
  }
  return effects;
}

}  // namespace

bool names_process(const diagnosis::Diagnosis& d) {
  return std::any_of(d.findings.begin(), d.findings.end(), [](const diagnosis::Finding& f) { return f.process; });
}

double square_of(const diagnosis::ModelEffect& m) { return m.size.dot(m.covariance.ldlt().solve(m.size)); }

tl::expected<UnexplainedRest, std::string> UnexplainedRest::of(std::span<const DiagnosedRecording> unit,
                                                               const std::stop_token& stop) {
  constexpr int rounds = 2;  // the second about what the first one found
  UnexplainedRest rest;
  rest.taken_out_ = to_be_taken_out(unit);
  for (const DiagnosedRecording& r : unit) {
    PassInput about = diagnosis::forward_pass(r.data, r.diagnosis.calibration);
    about.parameters = r.diagnosis.value_as_named;
    rest.unit_.push_back({r.data, about});
  }
  for (const diagnosis::Effect* effect : rest.taken_out_) {
    UnitEffect on_all = on_unit(effect, unit);
    const bool anywhere =
        std::any_of(on_all.on.begin(), on_all.on.end(), [](const EffectTerm& t) { return t.size.size() > 0; });
    if (anywhere) {
      rest.start_.effects.push_back(std::move(on_all));
    }
  }
  if (unit.size() > 1 && !rest.start_.effects.empty()) {
    if (const auto fitted = fit_jointly(rest.unit_, rest.start_, rounds, stop); !fitted) {
      return tl::unexpected(fitted.error());
    }
  }
  rest.beside_.resize(unit.size());
  if (unit.size() == 1) {
    for (const UnitEffect& effect : rest.start_.effects) {
      rest.beside_.front().push_back(effect.on.front());
    }
  }
  for (std::size_t r = 0; r < unit.size(); ++r) {
    auto corrected = std::make_unique<diagnosis::CorrectedRecording>(without_effects(rest.unit_[r], r, rest.start_));
    CalibrationOutcome calibration = diagnosis::calibrate_still(corrected->data(), {}, stop);
    if (!calibration.result) {
      return tl::unexpected(calibration.failure.message);
    }
    rest.calibrations_.push_back(std::make_unique<CalibrationResult>(std::move(*calibration.result)));
    rest.recordings_.push_back({corrected->data(), *rest.calibrations_.back(), rest.beside_[r]});
    rest.corrected_.push_back(std::move(corrected));
  }
  return rest;
}

tl::expected<JointFit, std::string> UnexplainedRest::beside(const std::vector<LawTerm>& laws,
                                                            const Eigen::VectorXd& coefficient,
                                                            const std::stop_token& stop) const {
  constexpr int rounds = 2;
  JointStart start{start_.effects, laws, coefficient};
  return fit_jointly(unit_, start, rounds, stop);
}

}  // namespace selfcal::discovery
