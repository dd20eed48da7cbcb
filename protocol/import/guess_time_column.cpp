#include "protocol/import/guess_time_column.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocol/import/guess_time.hpp"
#include "protocol/import/incomplete_rows.hpp"
#include "protocol/import/time_steps.hpp"

namespace selfcal::import {
namespace {

class Finder {
 public:
  Finder(const ColumnSource& source, const std::vector<NamedColumn>& named, const Values& values,
         const std::vector<bool>& lost)
      : source_(source), named_(named), values_(values), lost_(lost) {}

  FoundTime find(bool rate_is_given) {
    const std::vector<std::size_t> times = times_by_name(source_.names(), named_);
    std::string named_but;
    for (const std::size_t k : times) {
      if (is_time(k)) {
        remark(fmt::format("{}, by its name; it increases evenly", source_.title(k)), false);
        doubt_rivals(times);
        return std::move(found_);
      }
      named_but = fmt::format("{} is named so, but {}", source_.title(k), why_uneven(values_[k]));
    }
    if (!(rate_is_given || rises_without_name()) && !named_but.empty()) {
      remark(std::move(named_but), true);
    }
    return std::move(found_);
  }

 private:
  void remark(std::string text, bool doubt) { found_.remarks.push_back({"time.column", std::move(text), doubt}); }

  bool is_time(std::size_t column) {
    ColumnRequest request;
    request.tolerant = true;
    request.stamp = column;
    request.most_rows = lost_.size();
    for (const bool date : {false, true}) {
      request.stamp_is_date = date;
      Expected<ColumnData> data = source_.read(request);
      if (data) {
        leave_out(lost_, *data);
        found_.clock_words = continue_full_clocks(data->stamps);
        found_.clock_words += put_in_order(data->stamps);  // values of a few late rows judge no worse where they are
      }
      if (data && rises_evenly(data->stamps)) {
        found_.column = column;
        found_.is_date = date;
        found_.stamps = std::move(data->stamps);
        return true;
      }
      if (data && !date && all_finite(values_[column])) {
        break;
      }
    }
    return false;
  }

  // Another column that is called a time, and runs at another rate than the one that was taken.
  void doubt_rivals(const std::vector<std::size_t>& times) {
    const NamedColumn& taken = named_[*found_.column];
    const double unit = found_.is_date ? 1.0 : seconds_of_unit(taken.unit);
    for (const std::size_t k : times) {
      const bool comparable = k != *found_.column && taken.other_unit.empty() && named_[k].other_unit.empty();
      const auto faster = comparable && all_finite(values_[k])
                              ? other_rate(found_.stamps, unit, values_[k], seconds_of_unit(named_[k].unit))
                              : std::nullopt;
      if (faster) {
        return remark(fmt::format("{} runs {:.3g} times as fast as {}: which is the sensors' clock?", source_.title(k),
                                  *faster, source_.title(*found_.column)),
                      true);
      }
    }
  }

  // A column that rises by 1 is a counter as well as a time.
  bool rises_without_name() {
    for (const bool counters : {false, true}) {
      for (std::size_t k = 0; k < named_.size(); ++k) {
        const bool free = named_[k].role == Role::unknown || named_[k].role == Role::other ||
                          (counters && named_[k].role == Role::counter);
        const bool rises_by_1 = values_[k].size() > 1 && values_[k][1] - values_[k][0] == 1.0;
        const bool readable = all_finite(values_[k]) || (!values_[k].empty() && !std::isfinite(values_[k].front()));
        if (free && rises_by_1 == counters && readable && is_time(k)) {
          remark(source_.title(k) + (counters ? counter_words(source_.preamble()) : ": it increases evenly"), counters);
          return true;
        }
      }
    }
    return false;
  }

  const ColumnSource& source_;
  const std::vector<NamedColumn>& named_;
  const Values& values_;
  const std::vector<bool>& lost_;
  FoundTime found_;
};

}  // namespace

FoundTime find_time_column(const ColumnSource& source, const std::vector<NamedColumn>& named, const Values& values,
                           const std::vector<bool>& lost, bool rate_is_given) {
  return Finder(source, named, values, lost).find(rate_is_given);
}

}  // namespace selfcal::import
