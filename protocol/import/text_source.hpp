// The columns of a delimited text: read in one go, a line at a time.
#pragma once

#include "protocol/import/column_source.hpp"

namespace selfcal::import {

Expected<std::unique_ptr<ColumnSource>> open_text(const std::filesystem::path& file,
                                                  const std::optional<TextDialect>& dialect);

}  // namespace selfcal::import
