// Where a search stands, as a value: a hypothesis, and the recording linearised about it. Every step of the search is a
// function from one stage to another.
#pragma once

#include <vector>

#include "estimator/diagnosis/regression/linear_model.hpp"
#include "estimator/diagnosis/search/form.hpp"

namespace selfcal::diagnosis {

// What is named, and what else may be.
struct Selection {
  Hypothesis hypothesis;
  std::vector<Variant>
      alternatives;  // every one that is tried, the terms' own too, at the constant it was last followed to
  // Named once, too weak beside others. They are not taken again: what was seen may be another's, and they would fall and be
  // taken for ever.
  std::vector<Variant> fallen;
};

// What the terms differ from their equations by.
struct Forms {
  std::vector<FormFamily> families;  // columns of the stage's model
  OpenForms open;                    // of these, as marginalised
  Evidence given;  // the model's normal equations with the open ones marginalised; empty: none is open
};

struct Stage {
  Selection selection;  // amplitudes as fitted
  OperatingPoint point;
  LinearModel model;  // of the alternatives, the terms, the map and the forms, about the hypothesis at the point
  Forms forms;

  const Hypothesis& hypothesis() const { return selection.hypothesis; }
  std::vector<int> columns() const { return columns_of(model.terms()); }
  // Normal equations in which everything else is tested: the open forms marginalised.
  const Evidence& given_forms() const { return forms.open.empty() ? model.evidence() : forms.given; }
};

// With these constants at this point; amplitudes as they are, no forms.
Stage linearised(const RecordingContext& context, const OperatingPoint& point, Selection selection);

// With the terms fitted and taken out of the increments, the 24 settled beside them, and the signatures carried about the new
// trajectory, until the amplitudes stand still. All terms have columns in `from`.
Stage settled(const RecordingContext& context, const Stage& from, Selection selection);

// `evidence` with the open forms marginalised.
Evidence given_forms(const Evidence& evidence, const OpenForms& open);

// With columns for the forms of the terms that are strong enough to show one, and those opened that the data ask for.
Stage with_forms(const RecordingContext& context, Stage stage);

// What forms that are not open may do to the 24.
ParameterMatrix covariance_of_closed_forms(const Stage& stage);

}  // namespace selfcal::diagnosis
