// What is settled once the names stand: the noise of the base, and what the constants' uncertainty adds.
#include <Eigen/LU>
#include <cmath>

#include "estimator/diagnosis/naming.hpp"

namespace selfcal::diagnosis {

// The calibration took part of what was left out for motion of the base. With the effects fitted its white noise is
// the one of the greatest likelihood, down to a micrometre, by factors of 3.
void Naming::sharpen_observation() {
  constexpr double factor = 1.0 / 3.0, least = 0.9e-6;   // m
  if ((chosen_.empty() && walks_.empty()) || input_.noise.observation.state_count() > 0) {
    return;
  }
  const auto log_likelihood = [&](const SignatureRows& rows) {
    Evidence evidence(rows);
    const double raw = evidence.square;
    evidence.restore(applied_columns_, applied_);
    for (const WalkTest& walk : walks_) {
      evidence.absorb(walk.columns, walk.covariance);
    }
    return rows.pass.log_likelihood + 0.5 * (raw - evidence.square + evidence.fit(chosen_columns()).gain);
  };
  double best = log_likelihood(rows_);
  bool better = false;
  double sigma = factor * input_.noise.observation.sigma;
  for (; sigma > least; sigma *= factor) {
    PassInput trial = input_;
    trial.noise.observation.sigma = sigma;
    const double found = log_likelihood(pass_.run(trial));
    if (found < best) {
      break;
    }
    best = found;
    better = true;
    input_.noise.observation.sigma = sigma;
  }
  if (better) {
    relinearise();
  }
}

// The derivative by the logarithm of a constant is one more column: sizes, constants and the 24 get their joint
// covariance. Its prior sigma is that of the grids, a factor of e^2.
void Naming::carry_constants() {
  constexpr double constant_prior = 2.0, size_prior = 300.0;
  std::vector<Candidate> around;
  std::vector<double> step;
  for (const Chosen& c : chosen_) {
    if (!std::isnan(c.candidate.constant)) {
      // A frequency may shift the phase by an eighth of a radian over the recording.
      const double periods = c.candidate.constant * rows_.time_s.back();
      const double h = c.candidate.effect->id == "base_sway" ? 0.02 / periods : 0.05;
      step.push_back(h);
      around.push_back({c.candidate.effect, c.candidate.constant * std::exp(h), 0, 0});
      around.push_back({c.candidate.effect, c.candidate.constant * std::exp(-h), 0, 0});
    }
  }
  joint_columns_ = chosen_columns();
  const auto sizes = static_cast<Eigen::Index>(joint_columns_.size());
  if (sizes == 0) {
    return;
  }
  if (!around.empty()) {
    SignaturePass pass(context_, around, false);
    const SignatureRows beside = pass.run(input_);
    const Eigen::Index first = rows_.columns.cols();
    const auto more = static_cast<Eigen::Index>(step.size());
    rows_.columns.conservativeResize(Eigen::NoChange, first + more);
    rows_.shift.conservativeResize(Eigen::NoChange, first + more);
    std::size_t k = 0;
    for (const Chosen& c : chosen_) {
      if (std::isnan(c.candidate.constant)) {
        continue;
      }
      const Candidate &above = pass.candidates()[2 * k], &below = pass.candidates()[2 * k + 1];
      const Eigen::VectorXd size = c.size / (2.0 * step[k]);
      const auto derivative = [&](const Eigen::MatrixXd& m) -> Eigen::VectorXd {
        return m.middleCols(above.first, above.count) * size - m.middleCols(below.first, below.count) * size;
      };
      const Eigen::Index at = first + static_cast<Eigen::Index>(k);
      rows_.columns.col(at) = derivative(beside.columns);
      rows_.shift.col(at) = derivative(beside.shift);
      joint_columns_.push_back(static_cast<int>(at));
      ++k;
    }
    evidence_ = Evidence(rows_);
    evidence_.restore(applied_columns_, applied_);
    for (const WalkTest& walk : walks_) {
      evidence_.absorb(walk.columns, walk.covariance);
    }
  }
  Eigen::MatrixXd information = evidence_.information(joint_columns_, joint_columns_);
  information.diagonal().head(sizes).array() += 1.0 / (size_prior * size_prior);
  information.diagonal().tail(information.rows() - sizes).array() += 1.0 / (constant_prior * constant_prior);
  joint_covariance_ = information.inverse();
  Eigen::Index at = 0, constant = sizes;
  for (Chosen& c : chosen_) {
    c.covariance = joint_covariance_.block(at, at, c.candidate.count, c.candidate.count);
    at += c.candidate.count;
    if (!std::isnan(c.candidate.constant)) {
      c.constant_sigma = c.candidate.constant * std::sqrt(joint_covariance_(constant, constant));
      ++constant;
    }
  }
}

}  // namespace selfcal::diagnosis
