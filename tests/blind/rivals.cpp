#include "tests/blind/rivals.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/regression/evidence.hpp"
#include "estimator/diagnosis/search/locate.hpp"
#include "estimator/statistics/whiteness.hpp"

namespace selfcal::blind {
namespace {

using diagnosis::Candidate;
using diagnosis::Effect;

// One variant of every effect; constants at the middle of their grid for `all`, every one otherwise.
std::vector<Candidate> candidates(const diagnosis::RecordingContext& context, bool middle_only) {
  std::vector<Candidate> list;
  for (const Effect& effect : diagnosis::catalogue()) {
    const bool channel_missing =
        effect.temperature == diagnosis::TemperatureUse::measured && !context.has_temperature();
    const std::vector<double> constants = effect.constant.tried();
    if (constants.empty() || channel_missing) {
      continue;
    }
    if (middle_only) {
      list.push_back({&effect, constants[constants.size() / 2], 0, 0});
    } else {
      for (const double constant : constants) {
        list.push_back({&effect, constant, 0, 0});
      }
    }
  }
  return list;
}

std::vector<std::string> by_bic(const diagnosis::SignaturePass& pass, const diagnosis::Evidence& evidence) {
  std::vector<std::string> names;
  std::vector<int> taken;
  double before = 0.0;
  for (;;) {
    double best = 0.0, best_gain = 0.0;
    const Candidate* winner = nullptr;
    for (const Candidate& c : pass.candidates()) {
      if (std::find(names.begin(), names.end(), c.effect->id) != names.end()) {
        continue;
      }
      std::vector<int> columns = taken;
      const std::vector<int> own = columns_of(c);
      columns.insert(columns.end(), own.begin(), own.end());
      const double gain = evidence.fit(columns).delta_chi2;
      const double fall = gain - before - c.count * std::log(evidence.rows);
      if (fall > best) {
        best = fall;
        best_gain = gain;
        winner = &c;
      }
    }
    if (winner == nullptr) {
      return names;
    }
    names.push_back(winner->effect->id);
    const std::vector<int> own = columns_of(*winner);
    taken.insert(taken.end(), own.begin(), own.end());
    before = best_gain;
  }
}

void always_on(const diagnosis::SignaturePass& pass, const diagnosis::SignatureRows& rows, const ParameterVector& about,
               RivalAnswers& answers) {
  constexpr double prior = 10.0, claim = 3.0;
  const diagnosis::Evidence evidence(rows);
  Eigen::MatrixXd information = evidence.information;
  information.diagonal().array() += 1.0 / (prior * prior);
  const Eigen::LDLT<Eigen::MatrixXd> solver(information);
  const Eigen::VectorXd size = solver.solve(evidence.score);
  const Eigen::MatrixXd covariance = solver.solve(Eigen::MatrixXd::Identity(size.size(), size.size()));
  const int at = rows.pass.layout.parameters();
  answers.always_on_value = about + rows.pass.mean.segment<sensor_parameter_count>(at) + rows.shift * size;
  answers.always_on_sigma = (rows.pass.covariance.diagonal().segment<sensor_parameter_count>(at) +
                             (rows.shift * covariance * rows.shift.transpose()).diagonal())
                                .cwiseSqrt();
  for (const Candidate& c : pass.candidates()) {
    for (const int k : columns_of(c)) {
      if (std::abs(size(k)) > claim * std::sqrt(covariance(k, k))) {
        answers.always_on_names.push_back(c.effect->id);
        break;
      }
    }
  }
}

}  // namespace

RivalAnswers ask_rivals(const ImuData& data, const diagnosis::Diagnosis& d, double false_alarm_rate) {
  RivalAnswers answers;
  const diagnosis::RecordingContext context(data);
  PassInput input;
  input.data = &data;
  input.parameters = d.calibration.value;
  input.C_nb = d.calibration.C_nb_start;
  input.noise = d.calibration.noise;
  input.prior.parameter_sigma = 2.0 * plausible_limit();

  diagnosis::SignaturePass all(context, candidates(context, true), false);
  always_on(all, all.run(input), input.parameters, answers);

  diagnosis::SignaturePass variants(context, candidates(context, false), false);
  const diagnosis::SignatureRows rows = variants.run(input);
  const diagnosis::Evidence evidence(rows);
  answers.bic_names = by_bic(variants, evidence);

  const double size_tail = log_chi_squared_tail(evidence.square, evidence.rows);
  const double white = test_whiteness(rows.residual).log_p;
  answers.whiteness_alarms = std::min(size_tail, white) < std::log(0.5 * false_alarm_rate);
  return answers;
}

}  // namespace selfcal::blind
