#include "estimator/diagnosis/search/remains.hpp"

#include <array>
#include <cmath>

#include "estimator/diagnosis/search/quantities.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double counts = 3.0;  // sigmas from which a coefficient counts
// An equation that is right to 3 % of its amplitude leaves as much: its own form, not another effect's.
constexpr double form_square = 1e-3;

Eigen::VectorXd sigmas(const Term& term) {
  return term.amplitude.cwiseQuotient(term.covariance.diagonal().cwiseSqrt()).cwiseAbs();
}

// Columns of the dwells and rotations of a walk's triad: what one axis's walk does not take up another's does.
std::vector<int> columns_of_triad(const LinearModel& model, const BiasProcess& process) {
  std::vector<int> columns;
  for (std::size_t k = 0; k < model.map().size(); ++k) {
    const LocatedColumn& m = model.map()[k];
    const bool segment = m.kind == LocatedColumn::Kind::dwell || m.kind == LocatedColumn::Kind::rotation;
    if (segment && (m.axis < 3) == process.of_gyro()) {
      columns.push_back(model.first_map_column() + static_cast<int>(k));
    }
  }
  return columns;
}

// Whether columns `group` can stand for half of one of the term's coefficients that count.
bool stands_for(const LinearModel& model, const std::vector<int>& group, const Candidate& own,
                const Eigen::VectorXd& z) {
  // The greater part of it. Of 59 pairs met in 150 blind cases none shares from 0.299 to 0.541: nothing between decides.
  constexpr double half_of_it = 0.5;
  const double least = std::min(counts, z.maxCoeff());
  const Eigen::MatrixXd other = model.rows().columns(Eigen::all, group);
  const Eigen::MatrixXd G = other.transpose() * other;
  for (Eigen::Index k = 0; k < z.size(); ++k) {
    const Eigen::VectorXd column = model.rows().columns.col(own.first + k);
    if (z(k) >= least && fit_columns(G, other.transpose() * column).delta_chi2 / column.squaredNorm() > half_of_it) {
      return true;
    }
  }
  return false;
}

}  // namespace

bool any_collinear(const LinearModel& model, const Hypothesis& named) {
  const std::vector<Candidate>& terms = model.terms();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Eigen::VectorXd z = sigmas(named.terms[i]);
    for (const Candidate& other : terms) {  // lines of a sway are several of one kind
      if (other.effect != terms[i].effect && stands_for(model, columns_of(other), terms[i], z)) {
        return true;
      }
    }
    for (const BiasProcess& process : named.processes) {
      // A walk follows any slow curve. An instability is noise of the filter, beside which the term is significant or not; so is a walk
      // beside a coarse quantum, where the filter was asked inside the dwells.
      if (process.kernel.kind == BiasKernel::Kind::random_walk && !named.noise.axes &&
          stands_for(model, columns_of_triad(model, process), terms[i], z)) {
        return true;
      }
    }
  }
  return false;
}

Structure structure_left(const Stage& stage) {
  using Kind = LocatedColumn::Kind;
  const std::vector<int> others = stage.columns();
  const std::vector<BiasProcess>& processes = stage.hypothesis().processes;
  const Evidence& given = stage.given_forms();
  const Eigen::VectorXd size = given.fit(others).value;
  Structure found;
  int tests = 0;
  for (const Kind kind : {Kind::dwell, Kind::rotation, Kind::after_turn, Kind::time}) {
    for (int axis = 0; axis < 6; ++axis) {
      std::vector<int> group;
      for (std::size_t k = 0; k < stage.model.map().size(); ++k) {
        if (stage.model.map()[k].kind == kind && stage.model.map()[k].axis == axis) {
          group.push_back(stage.model.first_map_column() + static_cast<int>(k));
        }
      }
      const GroupTest left = test_group(given, group, others);
      const bool processes_there = std::any_of(processes.begin(), processes.end(),
                                               [&](const BiasProcess& p) { return p.of_gyro() == (axis < 3); });
      const bool named =
          processes_there || (!others.empty() && square_within(given, group, others, size) >= left.delta_chi2);
      double& smallest = named ? found.log_p_named : found.log_p_elsewhere;
      smallest = std::min(smallest, left.log_p);
      ++tests;
    }
  }
  found.log_p_named = log_corrected(found.log_p_named, tests);
  found.log_p_elsewhere = log_corrected(found.log_p_elsewhere, tests);
  return found;
}

namespace {

// Axes on which the term has a coefficient that counts.
std::array<bool, 3> concerned_axes(const Term& term) {
  std::array<bool, 3> concerned{};
  const Eigen::VectorXd z = sigmas(term);
  for (Eigen::Index k = 0; k < z.size(); ++k) {
    const Eigen::Index axis = z.size() > 3 ? k / 3 : k;  // a matrix row by row
    concerned[static_cast<std::size_t>(axis)] |= z(k) >= std::min(counts, z.maxCoeff());
  }
  return concerned;
}

// Columns of the terms and of their derivatives by the constants.
std::vector<int> columns_with_derivatives(const WithConstants& with) {
  std::vector<int> all = columns_of(with.model.terms());
  for (const PlacedTerm& t : with.terms) {
    for (int k = 0; t.derivative >= 0 && k < t.candidate.count; ++k) {
      all.push_back(t.derivative + k);
    }
  }
  return all;
}

// Of what `left` has on the axes that a term concerns, column by column, given all that is named and its constants: the
// smallest p, corrected. `own`: the term's Δχ².
double log_p_left(const RecordingContext& context, const Stage& stage, const WithConstants& with, const Effect& left,
                  const std::array<bool, 3>& concerned, double own) {
  constexpr double tests_per_axis = 3.0;  // four functions of the gimbal angles; warm-ups are alike: two
  std::vector<Candidate> beside;
  for (const double constant : left.constant.tried()) {
    beside.push_back({&left, constant, 0, 0});
  }
  const SignatureRows rows =
      SignaturePass(context, std::move(beside), false).run(stage.point.pass(stage.hypothesis().noise));
  LinearModel model = with.model;
  const int first = model.append(rows.columns, rows.shift);
  const Evidence given = given_forms(model.evidence(), stage.forms.open);
  const std::vector<int> others = columns_with_derivatives(with);
  double smallest = 0.0;
  for (int column = 0; column < static_cast<int>(rows.columns.cols()); ++column) {  // axis by axis in threes
    if (concerned[static_cast<std::size_t>(column % 3)]) {
      const GroupTest test = test_group(given, {first + column}, others);
      smallest = test.delta_chi2 > form_square * own ? std::min(smallest, test.log_p) : smallest;
    }
  }
  const auto axes = std::count(concerned.begin(), concerned.end(), true);
  return log_corrected(smallest, tests_per_axis * static_cast<double>(axes));
}

}  // namespace

// A drift that is named after one curve in time must not need a second, one named after gravity, field or rate no
// function of the gimbal angles beside it: over tens of minutes and eighteen positions much looks alike, and a test of
// everything that may be left has little power against what is likely.
double log_p_of_lack_of_fit(const RecordingContext& context, const Stage& stage, const WithConstants& with,
                            const Hypothesis& named) {
  const bool gimbal = !context.data().gimbal_outer.empty() && !context.data().gimbal_inner.empty();
  double smallest = 0.0;
  for (std::size_t i = 0; i < named.terms.size(); ++i) {
    const Effect* left = named.terms[i].effect->lack_of_fit.get();
    if (left != nullptr && (!left->needs_gimbal || gimbal)) {
      const double own = test_group(stage.model.evidence(), columns_of(stage.model.terms()[i]), {}).delta_chi2;
      smallest = std::min(smallest, log_p_left(context, stage, with, *left, concerned_axes(named.terms[i]), own));
    }
  }
  return smallest;
}

ByQuantity locate_by_quantities(const RecordingContext& context, const Stage& stage) {
  std::vector<Variant> bins;
  for (const Candidate& bin : quantity_bins(context)) {
    bins.push_back({bin.effect, bin.constant, bin.constant});
  }
  const LinearModel model = LinearModel::about(context, stage.point, stage.hypothesis(), bins, false);
  const double mean_c = context.mean_temperature();
  return {locate_by_quantity(model.evidence(), model.alternatives(), {}, mean_c),
          locate_by_quantity(model.evidence(), model.alternatives(), columns_of(model.terms()), mean_c)};
}

}  // namespace selfcal::diagnosis
