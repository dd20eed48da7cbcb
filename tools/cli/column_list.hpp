// Columns that an option lists: numbers from 1 or names, commas between.
#pragma once

#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/column_source.hpp"

namespace selfcal::cli {

// Counted from 0. An error (bad_input) names PATH, OPTION and the word that is none of its columns.
Expected<std::vector<std::size_t>> listed_columns(const std::string& path, const import::ColumnSource& source,
                                                  const std::string& option, const std::string& list);

}  // namespace selfcal::cli
