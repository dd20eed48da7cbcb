#include "protocol/import/split_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>

namespace selfcal::import {
namespace {

struct SplitTime {
  std::size_t seconds = 0, part = 0;
  double part_s = 1.0;  // seconds a unit
};

std::optional<SplitTime> split_time(const ColumnSource& source) {
  const std::vector<std::string>& names = source.names();
  const auto letters = [](const std::string& name) {
    std::string text;
    for (const char c : name) {
      if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
        text.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
      }
    }
    return text;
  };
  const auto ends_with_any = [](const std::string& text, std::initializer_list<const char*> endings) {
    return std::any_of(endings.begin(), endings.end(), [&](const char* e) { return text.ends_with(e); });
  };
  for (std::size_t k = 0; k + 1 < names.size(); ++k) {
    const std::string first = letters(names[k]), second = letters(names[k + 1]);
    const bool nano = ends_with_any(second, {"nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"});
    const bool micro = ends_with_any(second, {"usec", "usecs", "microsec", "microsecs", "microseconds"});
    if ((nano || micro) && ends_with_any(first, {"sec", "secs", "seconds", "unixtime"}) &&
        !ends_with_any(first, {"nsec", "nsecs", "usec", "usecs", "msec", "msecs", "nanoseconds", "microseconds",
                               "milliseconds"})) {
      return SplitTime{k, k + 1, nano ? 1e-9 : 1e-6};
    }
  }
  return std::nullopt;
}

bool is_part(double part, double part_s) { return part >= 0.0 && part * part_s < 1.0; }

class WholeTime final : public ColumnSource {
 public:
  WholeTime(std::unique_ptr<ColumnSource> source, const SplitTime& split)
      : source_(std::move(source)), split_(split), units_(source_->units()) {
    units_.resize(source_->names().size());
    units_[split.seconds].assign(1, 's');
  }

  const std::vector<std::string>& names() const override { return source_->names(); }
  const std::vector<std::string>& units() const override { return units_; }
  std::string form() const override { return fmt::format("{}; {}", source_->form(), put_together()); }
  const TextDialect* dialect() const override { return source_->dialect(); }
  std::string preamble() const override { return source_->preamble(); }
  std::vector<std::string> labels(std::size_t column) const override { return source_->labels(column); }
  std::string put_together() const override {
    return fmt::format("time is {} with the part of a second in {}", source_->title(split_.seconds),
                       source_->title(split_.part));
  }

  Expected<ColumnData> read(const ColumnRequest& request) const override {
    const bool stamped = request.stamp == split_.seconds && !request.stamp_is_date;
    const auto asked = std::find(request.columns.begin(), request.columns.end(), split_.seconds);
    if (!stamped && asked == request.columns.end()) {
      return source_->read(request);
    }
    ColumnRequest with_part = request;
    with_part.columns.push_back(split_.part);
    return source_->read(with_part).map([&](ColumnData data) {
      const std::vector<double> part = std::move(data.values.back());
      data.values.pop_back();
      for (std::size_t row = 0; row < data.rows; ++row) {
        // What is no part of a second leaves the row without a time.
        const double more = is_part(part[row], split_.part_s) ? part[row] * split_.part_s : NAN;
        if (stamped) {
          data.stamps[row] += is_part(part[row], split_.part_s)
                                  ? static_cast<long double>(part[row]) * static_cast<long double>(split_.part_s)
                                  : static_cast<long double>(NAN);
        }
        if (asked != request.columns.end()) {
          data.values[static_cast<std::size_t>(asked - request.columns.begin())][row] += more;
        }
      }
      return data;
    });
  }

 private:
  std::unique_ptr<ColumnSource> source_;
  SplitTime split_;
  std::vector<std::string> units_;
};

}  // namespace

std::unique_ptr<ColumnSource> with_whole_time(std::unique_ptr<ColumnSource> source) {
  const std::optional<SplitTime> split = split_time(*source);
  if (!split) {
    return source;
  }
  ColumnRequest request;
  request.columns = {split->part};
  request.tolerant = true;
  request.most_rows = 1000;
  const Expected<ColumnData> data = source->read(request);
  const bool parts = data && std::all_of(data->values[0].begin(), data->values[0].end(), [&](double part) {
                       return !std::isfinite(part) || is_part(part, split->part_s);
                     });
  return parts ? std::make_unique<WholeTime>(std::move(source), *split) : std::move(source);
}

}  // namespace selfcal::import
