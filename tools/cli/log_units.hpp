// What the names of a log's columns say of units and of columns that stand alone.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "protocol/import/guess_names.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::cli {

// SI per unit where the names of all say one of this quantity; 0: they do not. "gyro_rad" of PX4 is a rate.
double unit_of(const std::vector<import::NamedColumn>& named, const std::vector<std::size_t>& columns,
               import::Quantity quantity);

// The only column that is called a temperature, from 1; 0: none.
std::size_t named_temperature(const std::vector<import::NamedColumn>& named);

// rad per unit of a read-out: of degrees, unless its name says another unit of angles.
double unit_of_angle(const import::NamedColumn& column);

// Whether its name calls it an angle of a table: by its unit, else by a word.
bool called_angle(const import::NamedColumn& column, const std::string& name);

}  // namespace selfcal::cli
