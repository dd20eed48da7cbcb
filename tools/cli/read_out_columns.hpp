// Columns of a log that a table with its own read-outs wrote: where its axes stand, or how fast they turn.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/guess_names.hpp"
#include "tools/cli/poses_layout.hpp"

namespace selfcal::cli {

struct ReadOutColumn {
  std::size_t column = 0;  // from 0
  bool is_rate = false;    // of the axis, else its angle
  double si = 1.0;         // rad or rad/s of one unit
};

struct ReadOutColumns {
  std::vector<ReadOutColumn> axes;  // outer, inner; one; or none
  std::string notes;                // what was taken for read-outs by a name alone, or why nothing was
};

// As the caller says, else by names that call a table, an encoder, an axis or a command, with an angle rather than a rate where an axis has both;
// degrees unless a name says another unit. Columns of `layout` and of an attitude are none. Accelerometers alone have no use for them.
// Errors (bad_input): a column that the caller says and the file has not.
Expected<ReadOutColumns> read_out_columns(const import::ColumnSource& source,
                                          const std::vector<import::NamedColumn>& named, const PoseLayout& layout,
                                          const RawColumns& columns, const std::string& file);

// VALUES of a column, at TIMES in s, as angles in rad: rates are added up by the trapezoid from 0 on.
std::vector<double> read_out_angles(const ReadOutColumn& axis, const std::vector<double>& values,
                                    const std::vector<double>& time_s);

}  // namespace selfcal::cli
