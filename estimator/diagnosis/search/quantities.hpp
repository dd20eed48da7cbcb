// Where the misfit is by what the sensors were under: gimbal angles, the directions of gravity and of the Earth's rate
// in b, temperature.
#pragma once

#include <vector>

#include "estimator/diagnosis/search/locate.hpp"

namespace selfcal::diagnosis {

// Columns: a bias of each of the six axes (deg/h, ug) while a quantity lies in a bin; the constant is the bin's number. Bins
// of 45 deg of either angle, of the axis of b nearest to the direction, of whole degrees C (at most ten).
std::vector<Candidate> quantity_bins(const RecordingContext& context);

// Of each quantity the bin and axis that stand out most, each tested alone given that `fitted` columns are fitted; those
// above 3 sigma, largest first. `bins` as in the rows that `evidence` is of.
std::vector<Located> locate_by_quantity(const Evidence& evidence, const std::vector<Candidate>& bins,
                                        const std::vector<int>& fitted, double mean_temperature_c);

}  // namespace selfcal::diagnosis
