// What the terms differ from their equations by (form.hpp): columns about the corrected recording, and their sizes.
#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/search/stage.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double strong = 10.0;     // sigmas of a coefficient from which its form may show
constexpr double collinear = 1e-3;  // of a form's length, left beside the named effects: rounding
// Share of an effect's square up to which what is left is its form: half of its amplitude, as a spectrum of time constants may differ
// from one (form.cpp). A drift that is a slow curve in time or follows the attitude resembles what is in no catalogue: 7 %.
// Of 36 strong effects off their form (tests/off_form) 0.1 gives 2 a further name and 0.5 changes none; of four shares met in 150
// blind cases none lies from 0.038 to 0.554. 0.0025 and 0.01 change none of the 36, and no name in the ten blind cases that meet it.
constexpr double form_share = 0.25, resembling_share = 0.005;

// A form as a signature of its own, beside the family that its columns go to.
struct Carried {
  Candidate candidate;
  FormFamily family;
};

std::vector<Carried> forms_that_may_show(const Stage& s) {
  std::vector<Carried> all;
  const Hypothesis& h = s.hypothesis();
  for (std::size_t i = 0; i < h.terms.size(); ++i) {
    const Candidate& own = s.model.terms()[i];
    bool shows = false;
    for (int k = 0; k < own.count; ++k) {
      const double information = s.model.evidence().information(own.first + k, own.first + k);
      shows |= std::abs(h.terms[i].amplitude(k)) * std::sqrt(information) > strong;
    }
    for (const FormCandidate& form : shows ? forms_of(own) : std::vector<FormCandidate>{}) {
      all.push_back({form.candidate, {form.kind, i, form.most, {}}});
    }
  }
  return all;
}

// Signatures with the terms projected out, and what they shift the 24 by.
struct Beside {
  Eigen::MatrixXd whole, left, shift;
};

// Each form's coefficients have the sizes of its effect's.
Beside project(const RecordingContext& context, const Stage& s, std::vector<Carried>& forms) {
  std::vector<Candidate> candidates;
  candidates.reserve(forms.size());
  for (const Carried& f : forms) {
    candidates.push_back(f.candidate);
  }
  SignaturePass pass(context, std::move(candidates), false);
  const SignatureRows rows = pass.run(s.point.pass(s.hypothesis().noise));
  Eigen::VectorXd size(rows.columns.cols());
  for (std::size_t f = 0; f < forms.size(); ++f) {
    forms[f].candidate = pass.candidates()[f];
    size.segment(forms[f].candidate.first, forms[f].candidate.count) =
        s.hypothesis().terms[forms[f].family.term].amplitude;
  }
  const std::vector<int> named = s.columns();
  const Eigen::MatrixXd Z = s.model.rows().columns(Eigen::all, named);
  const Eigen::LDLT<Eigen::MatrixXd> solver = solver_beside(Z.transpose() * Z);
  Beside b;
  b.whole = rows.columns * size.asDiagonal();
  const Eigen::MatrixXd along = solver.solve(Z.transpose() * b.whole);
  b.left = b.whole - Z * along;
  b.shift = rows.shift * size.asDiagonal() - s.model.rows().shift(Eigen::all, named) * along;
  return b;
}

// Families with the columns that are left of them, numbered from `at` on; `taken`: these columns of what was projected.
std::vector<FormFamily> families_of(const std::vector<Carried>& forms, const Beside& beside, Eigen::Index at,
                                    std::vector<int>& taken) {
  std::vector<FormFamily> families;
  for (const Carried& form : forms) {
    FormFamily family = form.family;
    for (const int column : columns_of(form.candidate)) {
      if (beside.left.col(column).norm() > collinear * beside.whole.col(column).norm()) {
        family.columns.push_back(static_cast<int>(at + std::ssize(taken)));
        taken.push_back(column);
      }
    }
    const bool same = !families.empty() && families.back().kind == family.kind && families.back().term == family.term;
    if (!family.columns.empty() && same) {
      std::vector<int>& all = families.back().columns;
      all.insert(all.end(), family.columns.begin(), family.columns.end());
    } else if (!family.columns.empty()) {
      families.push_back(std::move(family));
    }
  }
  return families;
}

bool same_family(const FormFamily& a, const FormFamily& b) { return a.kind == b.kind && a.term == b.term; }

// Of the misfit, what each of the open families takes up.
void size_families(OpenForms& open, const Evidence& evidence) {
  Eigen::Index at = 0;
  for (FormFamily& f : open.families) {
    const auto size = static_cast<Eigen::Index>(f.columns.size());
    const Eigen::VectorXd mean = open.mean.segment(at, size);
    f.square = mean.dot(evidence.information(f.columns, f.columns) * mean);
    at += size;
  }
}

// A form that takes up more than a form can be is none: it stays closed.
OpenForms open_plausible(const Stage& s, std::vector<FormFamily> families) {
  const Evidence& evidence = s.model.evidence();
  const std::vector<Candidate>& terms = s.model.terms();
  while (true) {
    OpenForms open = open_forms(evidence, families, s.columns());
    size_families(open, evidence);
    const auto too_large = std::find_if(open.families.begin(), open.families.end(), [&](const FormFamily& f) {
      const double own = test_group(evidence, columns_of(terms[f.term]), columns_of(terms, f.term)).delta_chi2;
      return f.square > (terms[f.term].effect->lack_of_fit ? resembling_share : form_share) * own;
    });
    if (too_large == open.families.end()) {
      return open;
    }
    std::erase_if(families, [&](const FormFamily& f) { return same_family(f, *too_large); });
  }
}

}  // namespace

Evidence given_forms(const Evidence& evidence, const OpenForms& open) {
  Evidence given = evidence;
  if (!open.empty()) {
    given.marginalise(open.columns, open.sigma.cwiseAbs2().asDiagonal());
  }
  return given;
}

Stage with_forms(const RecordingContext& context, Stage s) {
  s.forms = {};
  std::vector<Carried> forms = forms_that_may_show(s);
  if (forms.empty()) {
    return s;
  }
  const Beside beside = project(context, s, forms);
  std::vector<int> taken;
  s.forms.families = families_of(forms, beside, s.model.rows().columns.cols(), taken);
  s.model.append(beside.left(Eigen::all, taken), beside.shift(Eigen::all, taken));
  s.forms.open = open_plausible(s, s.forms.families);
  if (!s.forms.open.empty()) {
    s.forms.given = given_forms(s.model.evidence(), s.forms.open);
  }
  return s;
}

ParameterMatrix covariance_of_closed_forms(const Stage& s) {
  std::vector<FormFamily> closed = s.forms.families;
  std::erase_if(closed, [&](const FormFamily& f) {
    return std::any_of(s.forms.open.families.begin(), s.forms.open.families.end(),
                       [&](const FormFamily& open) { return same_family(f, open); });
  });
  return closed_forms(s.given_forms(), closed, s.columns(), s.model.rows().shift);
}

}  // namespace selfcal::diagnosis
