// What is settled once the names stand: the noise of the base, and whether they are an explanation.
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
  double sigma = input_.noise.observation.sigma;
  while ((sigma *= factor) > least) {
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

bool Naming::entangled() const {
  constexpr double half_of_it = 0.5, counts = 3.0;   // share of a signature; sigmas from which a coefficient counts
  std::vector<std::vector<int>> groups;
  for (const Chosen& c : chosen_) {
    groups.push_back(columns_of(c.candidate));
  }
  // What one axis's walk does not take up another's does.
  for (const WalkTest& w : walks_) {
    groups.emplace_back();
    for (std::size_t k = 0; k < pass_.map().size(); ++k) {
      const LocatedColumn& m = pass_.map()[k];
      const bool segment = m.kind == LocatedColumn::Kind::dwell || m.kind == LocatedColumn::Kind::rotation;
      if (segment && m.axis / 3 == w.axis / 3) {
        groups.back().push_back(pass_.first_map_column() + static_cast<int>(k));
      }
    }
  }
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const Eigen::VectorXd z = chosen_[i].size.cwiseQuotient(chosen_[i].covariance.diagonal().cwiseSqrt()).cwiseAbs();
    const double least = std::min(counts, z.maxCoeff());
    for (std::size_t j = 0; j < groups.size(); ++j) {
      if (j == i || (j < chosen_.size() && chosen_[j].candidate.effect == chosen_[i].candidate.effect)) {
        continue;   // lines of a sway are several of one kind
      }
      const Eigen::MatrixXd other = rows_.columns(Eigen::all, groups[j]);
      const Eigen::MatrixXd G = other.transpose() * other;
      for (Eigen::Index k = 0; k < z.size(); ++k) {
        const Eigen::VectorXd own = rows_.columns.col(groups[i][static_cast<std::size_t>(k)]);
        const double share = fit_columns(G, other.transpose() * own).gain / own.squaredNorm();
        if (z(k) >= least && share > half_of_it) {
          return true;
        }
      }
    }
  }
  return false;
}

double Naming::log_p_structure() const {
  using Kind = LocatedColumn::Kind;
  const std::vector<int> others = chosen_columns();
  double smallest = 0.0;
  int tests = 0;
  for (const Kind kind : {Kind::dwell, Kind::rotation, Kind::after_turn, Kind::time}) {
    for (int axis = 0; axis < 6; ++axis) {
      std::vector<int> group;
      for (std::size_t k = 0; k < pass_.map().size(); ++k) {
        if (pass_.map()[k].kind == kind && pass_.map()[k].axis == axis) {
          group.push_back(pass_.first_map_column() + static_cast<int>(k));
        }
      }
      smallest = std::min(smallest, test_group(evidence_, group, others).log_p);
      ++tests;
    }
  }
  return log_corrected(smallest, tests);
}

}  // namespace selfcal::diagnosis
