// What a term is not linear in: followed to the top of the likelihood, and given columns of its own for the average.
#pragma once

#include <vector>

#include "estimator/diagnosis/search/averaging.hpp"
#include "estimator/diagnosis/search/stage.hpp"

namespace selfcal::diagnosis {

// With the constant of term i at the top of the likelihood, the other terms beside it: a parabola through Δχ² over its
// logarithm, on a grid that closes in. `about`: where the signatures are carried, some passes.
Selection with_constant_followed(const RecordingContext& context, const Stage& about, Selection selection,
                                 std::size_t i);
// Of every term in turn; the last one first where it is `newest`, for the others were found while it was left out.
Selection with_constants_followed(const RecordingContext& context, const Stage& about, Selection selection,
                                  bool newest);

// A model with further columns for the terms' constants: derivatives by the logarithm, and others in the constant's place.
struct WithConstants {
  LinearModel model;
  std::vector<PlacedTerm> terms;
};
WithConstants with_constants(const RecordingContext& context, const Stage& stage);

}  // namespace selfcal::diagnosis
