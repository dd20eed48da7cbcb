// What the named effects differ from their equations by (form.hpp): columns about the corrected recording, and their sizes.
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/naming.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double strong = 10.0;     // sigmas of a coefficient from which its form may show
constexpr double collinear = 1e-3;  // of a form's length, left beside the named effects: rounding
// Share of an effect's square up to which what is left is its form: half of its amplitude, as a spectrum of time constants may differ
// from one (form.cpp). A drift that is a slow curve in time or follows the attitude resembles what is in no catalogue: 7 %.
constexpr double form_share = 0.25, resembling_share = 0.005;

// Square of what an equation leaves that is right to 3 % of its amplitude, over its own.
constexpr double form_square = 1e-3;

}  // namespace

// Largest square among the named effects of a triad (0: gyros, 1: accelerometers; -1: of all).
double Naming::largest_square(int triad) const {
  double largest = 0.0;
  for (const Chosen& c : chosen_) {
    const bool gyro = c.candidate.effect->triad == Triad::gyro;
    if (triad < 0 || (triad == 0) == gyro) {
      largest = std::max(largest, test_group(evidence(), columns_of(c.candidate), {}).gain);
    }
  }
  return largest;
}

// A bias that wanders by less than what the named effect's form may be off by.
bool Naming::within_form(const WalkTest& walk) const {
  return walk.gain < form_square * largest_square(walk.axis < 3 ? 0 : 1);
}

// A further effect that says nothing: within what the named ones' forms may be off by, smaller than a tenth of what such sensors
// typically show (nobody would look for it), and moving none of the 24 by half a sigma (nobody would miss it).
bool Naming::immaterial(const Candidate& candidate, const GroupTest& test) const {
  constexpr double typical_share = 0.1, noticed_sigma = 0.5;
  if (chosen_.empty() || test.gain > form_square * largest_square(-1)) {
    return false;
  }
  std::vector<int> all = chosen_columns();
  const std::vector<int> own = columns_of(candidate);
  all.insert(all.end(), own.begin(), own.end());
  const Eigen::VectorXd size = given_forms().fit(all).value.tail(candidate.count);
  if (size.cwiseAbs().maxCoeff() > typical_share) {
    return false;
  }
  const int at = model_.rows().pass.layout.parameters();
  const ParameterVector sigma = model_.rows()
                                    .pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at)
                                    .diagonal()
                                    .cwiseSqrt();
  const ParameterVector shift = model_.rows().shift.middleCols(candidate.first, candidate.count) * size;
  return shift.cwiseAbs().cwiseQuotient(sigma).maxCoeff() < noticed_sigma;
}

void Naming::append_forms() {
  families_.clear();
  std::vector<Candidate> more;
  std::vector<FormFamily> of_candidate;  // of each of `more`, without columns
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const Candidate& own = chosen_[i].candidate;
    bool shows = false;
    for (int k = 0; k < own.count; ++k) {
      shows |= std::abs(chosen_[i].size(k)) * std::sqrt(evidence().information(own.first + k, own.first + k)) > strong;
    }
    for (const FormCandidate& form : shows ? forms_of(own) : std::vector<FormCandidate>{}) {
      more.push_back(form.candidate);
      of_candidate.push_back({form.kind, i, form.most, {}});
    }
  }
  if (!more.empty()) {
    SignaturePass pass(context_, more, false);
    const SignatureRows beside = pass.run(point_.pass());
    const std::vector<int> named = chosen_columns();
    const Eigen::MatrixXd Z = model_.rows().columns(Eigen::all, named);
    const Eigen::LDLT<Eigen::MatrixXd> solver = solver_beside(Z.transpose() * Z);
    const Eigen::MatrixXd named_shift = model_.rows().shift(Eigen::all, named);
    std::vector<Eigen::VectorXd> columns, shifts;
    const auto at = static_cast<int>(model_.rows().columns.cols());
    for (std::size_t f = 0; f < more.size(); ++f) {
      const Candidate& form = pass.candidates()[f];
      FormFamily& family = of_candidate[f];
      for (int k = 0; k < form.count; ++k) {
        const double size = chosen_[family.chosen].size(k);
        const Eigen::VectorXd whole = size * beside.columns.col(form.first + k);
        const Eigen::VectorXd along = solver.solve(Z.transpose() * whole);
        const Eigen::VectorXd left = whole - Z * along;
        if (left.norm() > collinear * whole.norm()) {
          family.columns.push_back(at + static_cast<int>(columns.size()));
          columns.push_back(left);
          shifts.push_back(size * beside.shift.col(form.first + k) - named_shift * along);
        }
      }
      const bool same =
          !families_.empty() && families_.back().kind == family.kind && families_.back().chosen == family.chosen;
      if (!family.columns.empty() && same) {
        std::vector<int>& all = families_.back().columns;
        all.insert(all.end(), family.columns.begin(), family.columns.end());
      } else if (!family.columns.empty()) {
        families_.push_back(family);
      }
    }
    const auto count = static_cast<Eigen::Index>(columns.size());
    Eigen::MatrixXd appended(model_.rows().columns.rows(), count), shift(model_.rows().shift.rows(), count);
    for (Eigen::Index k = 0; k < count; ++k) {
      appended.col(k) = columns[static_cast<std::size_t>(k)];
      shift.col(k) = shifts[static_cast<std::size_t>(k)];
    }
    model_.append(appended, shift);
  }
  size_forms();
}

// A form that takes up more than a form can be is none: it stays closed.
void Naming::size_forms() {
  const std::vector<int> named = chosen_columns();
  std::vector<FormFamily> families = families_;
  for (bool settled = false; !settled;) {
    forms_ = diagnosis::open_forms(evidence(), families, named);
    settled = true;
    Eigen::Index at = 0;
    for (FormFamily& f : forms_.families) {
      const auto size = static_cast<Eigen::Index>(f.columns.size());
      const Eigen::VectorXd mean = forms_.mean.segment(at, size);
      at += size;
      f.square = mean.dot(evidence().information(f.columns, f.columns) * mean);
      const Chosen& c = chosen_[f.chosen];
      const double own = test_group(evidence(), columns_of(c.candidate), chosen_columns(f.chosen)).gain;
      if (f.square > (c.candidate.effect->lack_of_fit ? resembling_share : form_share) * own) {
        std::erase_if(families, [&](const FormFamily& x) { return x.kind == f.kind && x.chosen == f.chosen; });
        settled = false;
        break;
      }
    }
  }
  if (!forms_.empty()) {
    given_forms_ = evidence();
    given_forms_.marginalise(forms_.columns, forms_.sigma.cwiseAbs2().asDiagonal());
  }
}

// What forms that are not open may do to the 24.
ParameterMatrix Naming::covariance_of_closed_forms() const {
  std::vector<FormFamily> closed = families_;
  std::erase_if(closed, [&](const FormFamily& x) {
    return std::any_of(forms_.families.begin(), forms_.families.end(),
                       [&](const FormFamily& f) { return f.kind == x.kind && f.chosen == x.chosen; });
  });
  return closed_forms(given_forms(), closed, chosen_columns(), model_.rows().shift);
}

// A walk follows any slow curve, and may have been taken for what a form is: each is tried without.
bool Naming::drop_weak_walk() {
  for (std::size_t i = 0; i < walks_.size(); ++i) {
    const WalkTest walk = walks_[i];
    walks_.erase(walks_.begin() + static_cast<std::ptrdiff_t>(i));
    model_.marginalise(walks_);
    refit();
    append_forms();
    const WalkTest without =
        test_walk(given_forms(), model_.map(), model_.first_map_column(), walk.axis, chosen_columns());
    const double log_p = log_chi_squared_tail(without.gain, 1.0);
    if (!significance().holds(significance().corrected(log_p))) {
      for (Chosen& c : chosen_) {  // their constants were found beside the walk
        refine_constant(c);
      }
      linearise();
      relinearise();
      return true;
    }
    walks_.insert(walks_.begin() + static_cast<std::ptrdiff_t>(i), walk);
    model_.marginalise(walks_);
    refit();
    append_forms();
  }
  return false;
}

}  // namespace selfcal::diagnosis
