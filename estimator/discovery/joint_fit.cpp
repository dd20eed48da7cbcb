#include "estimator/discovery/joint_fit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/search/judgement.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/common_coefficients.hpp"
#include "estimator/discovery/law_motion.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::discovery {
namespace {

// The logarithm of a constant moves by no more in one round: beyond that its signature is no longer nearly linear in it.
constexpr double largest_step = 0.33;
constexpr double told_correlation = 0.5;

std::vector<EffectTerm> terms_on(const JointStart& start, std::size_t r) {
  std::vector<EffectTerm> terms;
  for (const UnitEffect& effect : start.effects) {
    if (effect.on_recording(r)) {
      terms.push_back(effect.on[r]);
    }
  }
  return terms;
}

class Fitter {
 public:
  Fitter(std::span<const JointRecording> unit, JointStart& start, const std::stop_token& stop)
      : unit_(unit), start_(start), stop_(stop) {
    for (const JointRecording& r : unit) {
      about_.push_back(r.about);
    }
    laws_ = static_cast<Eigen::Index>(start.laws.size());
    first_effect_ = laws_;
    for (const LawTerm& law : start.laws) {
      first_effect_ += static_cast<Eigen::Index>(law.constants.size());
    }
    count_ = first_effect_;
    for (const UnitEffect& effect : start.effects) {
      places_.emplace_back(unit.size(), -1);
      for (std::size_t r = 0; r < unit.size(); ++r) {
        if (effect.on_recording(r)) {
          places_.back()[r] = count_;
          count_ += effect.on[r].count();
        }
      }
    }
  }

  tl::expected<JointFit, std::string> run(int rounds) {
    JointFit fit;
    for (int round = 0; round < rounds; ++round) {
      if (const auto failure = linearise(); !failure.empty()) {
        return tl::unexpected(failure);
      }
      fit = solve();
    }
    return fit;
  }

 private:
  // The recording less what is fitted so far.
  diagnosis::CorrectedRecording rest_of(std::size_t r) const {
    diagnosis::CorrectedRecording rest = without_effects({unit_[r].data, about_[r]}, r, start_);
    if (start_.laws.empty()) {
      return rest;
    }
    PassInput input = about_[r];
    input.data = &rest.data();
    const diagnosis::RecordingContext context(rest.data());
    const LawMotion motion(context);
    const NodeTable table = collect_nodes(motion, input);
    return without_laws(motion, table, input, start_.laws, start_.coefficient);
  }

  // What turns the columns of a recording into those of the unknowns: a law's constant has its coefficient as a factor.
  Eigen::VectorXd column_scale(Eigen::Index columns) const {
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(columns);
    Eigen::Index at = laws_;
    for (std::size_t k = 0; k < start_.laws.size(); ++k) {
      for (std::size_t c = 0; c < start_.laws[k].constants.size(); ++c) {
        scale(at++) = start_.coefficient(static_cast<Eigen::Index>(k));
      }
    }
    return scale;
  }

  // Puts the columns of recording r where the vector of unknowns has them. [unknowns x columns]
  Eigen::MatrixXd placement(std::size_t r, Eigen::Index columns) const {
    Eigen::MatrixXd place = Eigen::MatrixXd::Zero(count_, columns);
    place.topLeftCorner(first_effect_, first_effect_).setIdentity();
    Eigen::Index column = first_effect_;
    for (std::size_t e = 0; e < start_.effects.size(); ++e) {
      for (int k = 0; places_[e][r] >= 0 && k < start_.effects[e].on[r].count(); ++k) {
        place(places_[e][r] + k, column++) = 1.0;
      }
    }
    return place * column_scale(columns).asDiagonal();
  }

  // Passes over all recordings about what is fitted so far. Empty, or a failure in words.
  std::string linearise() {
    information_ = Eigen::MatrixXd::Zero(count_, count_);
    score_ = Eigen::VectorXd::Zero(count_);
    recordings_.clear();
    for (std::size_t r = 0; r < unit_.size(); ++r) {
      const diagnosis::CorrectedRecording rest = rest_of(r);
      const CalibrationOutcome calibration = diagnosis::calibrate_still(rest.data(), {}, stop_);
      if (!calibration.result) {
        return calibration.failure.message;
      }
      const PassInput input = diagnosis::forward_pass(rest.data(), *calibration.result);
      const diagnosis::RecordingContext context(rest.data());
      const LawMotion motion(context);
      const NodeTable table = start_.laws.empty() ? NodeTable{} : collect_nodes(motion, input);
      const std::vector<EffectTerm> terms = terms_on(start_, r);
      LawColumns of_laws(motion, table, start_.laws, true);
      EffectColumns of_effects(context, terms);
      TwoSources source(of_laws, of_effects);
      add(r, input, run_columns(input, trace_pass(input, stop_), source, stop_));
      about_[r] = input;
      about_[r].data = &unit_[r].data;
      if (stop_.stop_requested()) {
        return "stopped";
      }
    }
    return {};
  }

  void add(std::size_t r, const PassInput& input, const ColumnSums& sums) {
    const Eigen::MatrixXd place = placement(r, sums.score.size());
    information_ += place * sums.information * place.transpose();
    score_ += place * sums.score;
    const int first = sums.pass.layout.parameters();
    FittedRecording one;
    one.shift = sums.shift * place.transpose();
    one.parameters = input.parameters + sums.pass.mean.segment<sensor_parameter_count>(first);
    one.covariance_alone = sums.pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(first, first);
    recordings_.push_back(std::move(one));
  }

  // The unknowns as they are; of a law's constant, what it moves by: nothing.
  Eigen::VectorXd point() const {
    Eigen::VectorXd v = Eigen::VectorXd::Zero(count_);
    v.head(laws_) = start_.coefficient;
    for (std::size_t e = 0; e < start_.effects.size(); ++e) {
      for (std::size_t r = 0; r < unit_.size(); ++r) {
        const EffectTerm& term = start_.effects[e].on[r];
        if (places_[e][r] >= 0) {
          v.segment(places_[e][r], term.size.size()) = term.size;
          if (term.constant_free) {
            v(places_[e][r] + term.size.size()) = std::log(term.constant);
          }
        }
      }
    }
    return v;
  }

  JointFit solve() {
    const Eigen::MatrixXd covariance = solve_scaled(information_, Eigen::MatrixXd::Identity(count_, count_));
    const Eigen::VectorXd move = covariance * score_;
    for (FittedRecording& r : recordings_) {
      r.parameters += r.shift * move;
    }
    JointGaussian all = JointGaussian::of(recordings_, point() + move, covariance);
    const Eigen::Index behind = all.x.size() - count_;
    JointFit fit;
    fit.shared = share(all, unit_.size());
    for (std::size_t e = 0; e < start_.effects.size(); ++e) {
      fit.effects.push_back(decide(e, behind, all));
    }
    // Values go with the laws' constants as they are told.
    JointGaussian told = all;
    if (first_effect_ > laws_) {
      Eigen::MatrixXd D = Eigen::MatrixXd::Zero(first_effect_ - laws_, all.x.size());
      D.middleCols(behind + laws_, first_effect_ - laws_).setIdentity();
      told.impose(D);
    }
    all.x = told.x;
    read_parameters(all, unit_.size(), fit.shared);
    fit.shared.coefficient = all.x.segment(behind, laws_);
    fit.shared.coefficient_covariance = all.covariance.block(behind, behind, first_effect_, first_effect_);
    read_effects(all, behind, fit);
    add_entangled(all, behind, fit);
    start_.coefficient = fit.shared.coefficient;
    return fit;
  }

  FittedEffect decide(std::size_t e, Eigen::Index behind, JointGaussian& all) const {
    const UnitEffect& effect = start_.effects[e];
    std::vector<CoefficientPlaces> coefficients(effect.effect->parameters.size());
    CoefficientPlaces constant;
    for (std::size_t r = 0; r < unit_.size(); ++r) {
      if (places_[e][r] < 0) {
        continue;
      }
      for (std::size_t k = 0; k < coefficients.size(); ++k) {
        coefficients[k].add(r, behind + places_[e][r] + static_cast<Eigen::Index>(k));
      }
      if (effect.on[r].constant_free) {
        constant.add(r, behind + places_[e][r] + static_cast<Eigen::Index>(coefficients.size()));
      }
    }
    if (!std::isnan(effect.effect->constant.tried().front())) {
      coefficients.push_back(constant);
    }
    const CommonCoefficients decision = decide_common(coefficients, all);
    FittedEffect fitted;
    fitted.effect = effect.effect;
    fitted.log_p_common = decision.log_p;
    fitted.common = decision.common;
    fitted.differing = decision.differing;
    return fitted;
  }

  // Values into the fit and, for the next round, into the start.
  void read_effects(const JointGaussian& all, Eigen::Index behind, JointFit& fit) {
    for (std::size_t e = 0; e < start_.effects.size(); ++e) {
      UnitEffect& effect = start_.effects[e];
      double known = NAN, known_sigma = 0.0;  // the constant, of the first recording that named the effect
      for (std::size_t r = 0; r < unit_.size(); ++r) {
        if (effect.on_recording(r) && effect.on[r].constant_free) {
          EffectTerm& term = effect.on[r];
          const Eigen::Index at = behind + places_[e][r] + term.size.size();
          term.constant *= std::exp(std::clamp(all.x(at) - std::log(term.constant), -largest_step, largest_step));
          known_sigma = std::isnan(known) ? term.constant * std::sqrt(all.covariance(at, at)) : known_sigma;
          known = std::isnan(known) ? term.constant : known;
        }
      }
      for (std::size_t r = 0; r < unit_.size(); ++r) {
        if (!effect.on_recording(r)) {
          continue;
        }
        EffectTerm& term = effect.on[r];
        const Eigen::Index at = behind + places_[e][r], n = term.size.size();
        term.size = all.x.segment(at, n);
        const Eigen::MatrixXd covariance = all.covariance.block(at, at, n, n);
        EffectFit one{r, term.size, covariance.diagonal().cwiseMax(0.0).cwiseSqrt(), covariance, NAN, 0.0};
        if (term.constant_free) {
          one.constant_sigma = term.constant * std::sqrt(std::max(0.0, all.covariance(at + n, at + n)));
        } else if (!std::isnan(known)) {
          term.constant = known;
          one.constant_sigma = known_sigma;
        }
        one.constant = term.constant;
        fit.effects[e].each.push_back(std::move(one));
      }
      fit.effects[e].log_p_none = log_p_none(e, behind, fit.effects[e], all);
    }
  }

  // Coefficients that are common count once.
  double log_p_none(std::size_t e, Eigen::Index behind, const FittedEffect& fitted, const JointGaussian& all) const {
    std::vector<Eigen::Index> places;
    for (const EffectFit& one : fitted.each) {
      for (Eigen::Index c = 0; c < one.size.size(); ++c) {
        if (&one == &fitted.each.front() || !fitted.common[static_cast<std::size_t>(c)]) {
          places.push_back(behind + places_[e][one.recording] + c);
        }
      }
    }
    Eigen::MatrixXd D = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(places.size()), all.x.size());
    for (std::size_t k = 0; k < places.size(); ++k) {
      D(static_cast<Eigen::Index>(k), places[k]) = 1.0;
    }
    return all.log_p_of_zero(D);
  }

  void add_entangled(const JointGaussian& all, Eigen::Index behind, JointFit& fit) const {
    for (std::size_t k = 0; k < start_.laws.size(); ++k) {
      const Eigen::Index law = behind + static_cast<Eigen::Index>(k);
      for (std::size_t e = 0; e < start_.effects.size(); ++e) {
        for (const EffectFit& one : fit.effects[e].each) {
          for (Eigen::Index c = 0; c < one.size.size(); ++c) {
            const bool again = fit.effects[e].common[static_cast<std::size_t>(c)] &&
                               one.recording != fit.effects[e].each.front().recording;
            const Eigen::Index at = behind + places_[e][one.recording] + c;
            const double rho = all.covariance(law, at) / std::sqrt(all.covariance(law, law) * all.covariance(at, at));
            if (!again && std::abs(rho) >= told_correlation) {
              const LawTerm& term = start_.laws[k];
              fit.entangled.push_back(
                  {k, term.axis, term.expression.text(term.constants), e, one.recording, static_cast<int>(c), rho});
            }
          }
        }
      }
    }
  }

  std::span<const JointRecording> unit_;
  JointStart& start_;
  const std::stop_token& stop_;
  std::vector<PassInput> about_;
  Eigen::Index laws_ = 0, first_effect_ = 0, count_ = 0;  // unknowns: laws, their constants, effects
  std::vector<std::vector<Eigen::Index>> places_;         // [effects][recordings] of the unknowns; -1: none
  Eigen::MatrixXd information_;
  Eigen::VectorXd score_;
  std::vector<FittedRecording> recordings_;
};

std::size_t place_of(const DiscoveredLaw& law, const std::vector<LawTerm>& terms) {
  const auto found = std::find_if(terms.begin(), terms.end(), [&](const LawTerm& t) {
    return t.axis == law.term.axis && t.expression.text(t.constants) == law.expression;
  });
  return static_cast<std::size_t>(found - terms.begin());
}

// What a sigma held beyond the linear fit stays in it.
double with_variance(double sigma, double linear_before, double linear) {
  return std::sqrt(std::max(0.0, sigma * sigma - linear_before) + std::max(0.0, linear));
}

}  // namespace

bool FittedEffect::nothing_left() const {
  constexpr double not_there = 0.01;
  return log_p_none > std::log(not_there);
}

bool FittedEffect::all_common() const {
  return std::all_of(common.begin(), common.end(), [](bool one) { return one; });
}

diagnosis::CorrectedRecording without_effects(const JointRecording& recording, std::size_t r, const JointStart& start) {
  diagnosis::Correction correction;
  for (const EffectTerm& term : terms_on(start, r)) {
    correction.add(*term.effect, term.constant, term.size);
  }
  return {diagnosis::RecordingContext(recording.data), recording.about, std::move(correction)};
}

tl::expected<JointFit, std::string> fit_jointly(std::span<const JointRecording> unit, JointStart& start, int rounds,
                                                const std::stop_token& stop) {
  return Fitter(unit, start, stop).run(rounds);
}

void adopt(const JointFit& joint, Discovery& found) {
  const SharedParameters before = share_parameters(found.fit);
  const Eigen::MatrixXd& now = joint.shared.coefficient_covariance;
  for (std::vector<DiscoveredLaw>* laws : {&found.laws, &found.described}) {
    for (DiscoveredLaw& law : *laws) {
      const std::size_t place = place_of(law, found.fit.terms);
      if (place == found.fit.terms.size()) {
        continue;
      }
      const auto row = static_cast<Eigen::Index>(place);
      law.coefficient = joint.shared.coefficient(row);
      law.sigma = with_variance(law.sigma, found.fit.covariance(row, row), now(row, row));
      auto at = static_cast<Eigen::Index>(found.fit.terms.size());
      for (std::size_t k = 0; k < place; ++k) {
        at += static_cast<Eigen::Index>(found.fit.terms[k].constants.size());
      }
      for (Constant& constant : law.constants) {
        constant.sigma = with_variance(constant.sigma, found.fit.covariance(at, at), now(at, at));
        ++at;
      }
    }
  }
  // Beside a process each recording has its own 24: what it leaves open is not what the fit of the laws alone leaves.
  if (!found.processes.empty()) {
    return;
  }
  for (std::size_t r = 0; r < found.average.parameters.size(); ++r) {
    found.average.parameters[r] += joint.shared.parameters[r] - before.parameters[r];
    found.average.covariance[r] += joint.shared.covariance[r] - before.covariance[r];
  }
}

void adopt(const JointFit& joint, diagnosis::Diagnosis& d) {
  for (const FittedEffect& fitted : joint.effects) {
    if (fitted.each.empty() || fitted.each.front().recording != 0) {
      continue;
    }
    const EffectFit& fit = fitted.each.front();
    for (diagnosis::ModelEffect& m : d.model) {
      if (m.effect == fitted.effect) {
        m.size = fit.size;
        m.covariance = fit.covariance;
        m.constant = fit.constant;
      }
    }
    for (diagnosis::Finding& f : d.findings) {
      if (f.source == fitted.effect) {
        f.parameters = diagnosis::finding_parameters(*f.source, fit.size, fit.sigma, fit.constant, fit.constant_sigma);
        f.log_p = fitted.log_p_none;
        f.significance = sigma_from_log_p(f.log_p);
      }
    }
  }
}

}  // namespace selfcal::discovery
