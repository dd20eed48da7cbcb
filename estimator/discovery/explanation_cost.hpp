// What an explanation costs beside the square that it leaves: twice the logarithm of the choices that it is, and of its coefficients (BIC).
// Names of the catalogue and laws of a search of half a million functions are weighed by the sum.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::discovery {

// Odds from which an explanation takes another's place.
constexpr double far_likelier = 10.0;

// `rows`: of the recording that is explained.
double cost_of_laws(std::size_t laws, double rows);
double cost_of_a_name(double rows);
// Of a size that so many draws show: of a process, whose freedom costs in its likelihood, or of a law's coefficient alone.
double cost_of_a_size(double draws);
// Of a name's coefficients those count that the recording shows.
double cost_of_names(const std::vector<diagnosis::ModelEffect>& names, double rows);

// The diagnosis as it is where no effect of a sensor is named: the names are rejected, those of base and data stay.
diagnosis::Diagnosis without_names(diagnosis::Diagnosis diagnosis);
// The same where these effects are not named.
diagnosis::Diagnosis without_names(diagnosis::Diagnosis diagnosis, std::span<const diagnosis::Effect* const> names);
// The diagnosis as it is where all that was rejected is named, before what else it finds.
diagnosis::Diagnosis with_rejected_names(diagnosis::Diagnosis diagnosis);

}  // namespace selfcal::discovery
