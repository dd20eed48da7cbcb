#include "protocol/import/clock_digits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace selfcal::import {
namespace {

// Seconds of the day of hhmmss.ss; not a number where the digits are none of a time.
long double seconds_of_day(long double digits) {
  const long double hours = std::floor(digits / 10000.0L), minutes = std::floor(std::fmod(digits, 10000.0L) / 100.0L),
                    seconds = std::fmod(digits, 100.0L);
  const bool good = digits >= 0.0L && hours < 24.0L && minutes < 60.0L && seconds < 61.0L;  // with a leap second
  return good ? 3600.0L * hours + 60.0L * minutes + seconds : static_cast<long double>(NAN);
}

// Whether the digits rise, all are of a time, and the only leaps of 40 are those from a minute to the next.
bool is_clock(const std::vector<double>& values) {
  std::size_t minutes = 0;
  constexpr double between = 40.0;  // hhmm60 to hhmm99 are none
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!std::isfinite(static_cast<double>(seconds_of_day(values[k])))) {
      return false;
    }
    const double step = k > 0 ? values[k] - values[k - 1] : 0.0;
    const bool next_minute = k > 0 && std::floor(values[k] / 100.0) != std::floor(values[k - 1] / 100.0);
    if (step < 0.0 && values[k] >= 100.0) {
      return false;  // it falls, and not to a new day
    }
    minutes += next_minute && step >= between ? 1 : 0;
  }
  return minutes > 0;
}

std::vector<double> values_of(const ColumnSource& source, std::size_t column, std::size_t rows) {
  ColumnRequest request;
  request.columns = {column};
  request.tolerant = true;
  request.most_rows = rows;
  Expected<ColumnData> data = source.read(request);
  std::vector<double> values = data ? std::move(data->values[0]) : std::vector<double>();
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  return values;
}

class ClockOfDay final : public ColumnSource {
 public:
  ClockOfDay(std::unique_ptr<ColumnSource> source, std::size_t column)
      : source_(std::move(source)), column_(column), units_(source_->units()) {
    units_.resize(source_->names().size());
    units_[column].assign(1, 's');
  }

  const std::vector<std::string>& names() const override { return source_->names(); }
  const std::vector<std::string>& units() const override { return units_; }
  std::string form() const override { return fmt::format("{}; {}", source_->form(), own_words()); }
  const TextDialect* dialect() const override { return source_->dialect(); }
  std::string preamble() const override { return source_->preamble(); }
  std::vector<std::string> labels(std::size_t column) const override { return source_->labels(column); }
  std::string put_together() const override {
    const std::string others = source_->put_together();
    return others.empty() ? own_words() : fmt::format("{}; {}", others, own_words());
  }

  Expected<ColumnData> read(const ColumnRequest& request) const override {
    return source_->read(request).map([&](ColumnData data) {
      if (request.stamp == column_ && !request.stamp_is_date) {
        std::transform(data.stamps.begin(), data.stamps.end(), data.stamps.begin(), seconds_of_day);
      }
      for (std::size_t k = 0; k < request.columns.size(); ++k) {
        if (request.columns[k] == column_) {
          std::transform(data.values[k].begin(), data.values[k].end(), data.values[k].begin(),
                         [](double v) { return static_cast<double>(seconds_of_day(v)); });
        }
      }
      return data;
    });
  }

 private:
  std::string own_words() const {
    return fmt::format("{} is a time of the day, hhmmss: in seconds", source_->title(column_));
  }

  std::unique_ptr<ColumnSource> source_;
  std::size_t column_;
  std::vector<std::string> units_;
};

}  // namespace

std::unique_ptr<ColumnSource> with_clock_digits(std::unique_ptr<ColumnSource> source) {
  constexpr std::size_t head = 1000, most = 2000000;
  for (std::size_t column = 0; column < source->names().size(); ++column) {
    const std::vector<double> first = values_of(*source, column, head);
    constexpr std::size_t fewest = 10;
    const double step =
        first.size() < fewest ? 0.0 : (first.back() - first.front()) / static_cast<double>(first.size() - 1);
    const bool rises = step > 0.0 && std::is_sorted(first.begin(), first.end()) && first.back() != first.front();
    const bool of_time = std::all_of(first.begin(), first.end(),
                                     [](double v) { return std::isfinite(static_cast<double>(seconds_of_day(v))); });
    // Two minutes and more of it, at the pace of its first rows.
    constexpr double two_minutes = 120.0;
    if (rises && of_time &&
        is_clock(values_of(*source, column,
                           static_cast<std::size_t>(std::min(static_cast<double>(most), two_minutes / step + head))))) {
      return std::make_unique<ClockOfDay>(std::move(source), column);
    }
  }
  return source;
}

}  // namespace selfcal::import
