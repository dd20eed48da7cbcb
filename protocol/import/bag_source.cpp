// A bag as columns: rows are the messages of one Imu.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "protocol/import/bag.hpp"

namespace selfcal::import {
namespace {

// Two messages further apart than so many of their usual intervals have nothing between them.
constexpr std::int64_t most_intervals = 3;
constexpr std::int64_t longest_interval_ns = 1000000000000;
constexpr std::size_t most_named = 8;  // of what is not read

// The values of a series at other times: linear between two stamps; NaN outside and in gaps.
class Between {
 public:
  Between(const Series& series, std::size_t field, std::int64_t usual_ns)
      : turns_(series.units[field] == "rad"), widest_ns_(most_intervals * std::min(usual_ns, longest_interval_ns)) {
    const std::vector<std::int64_t>& stamps = series.stamp_ns;
    for (std::size_t k = 0; k < stamps.size(); ++k) {
      points_.push_back({stamps[k], series.values[field][k]});
    }
    std::stable_sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.at < b.at; });
  }

  double at(std::int64_t stamp) const {
    const auto behind = std::lower_bound(points_.begin(), points_.end(), stamp,
                                         [](const Point& p, std::int64_t wanted) { return p.at < wanted; });
    if (behind != points_.end() && behind->at == stamp) {
      return behind->value;
    }
    if (behind == points_.begin() || behind == points_.end() || behind->at - std::prev(behind)->at > widest_ns_) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    const Point& before = *std::prev(behind);
    const double part = static_cast<double>(stamp - before.at) / static_cast<double>(behind->at - before.at);
    const double step = behind->value - before.value;
    // An angle that begins anew after a turn goes the short way.
    constexpr double turn = 6.283185307179586;
    return before.value + part * (turns_ ? std::remainder(step, turn) : step);
  }

 private:
  struct Point {
    std::int64_t at;
    double value;
  };
  std::vector<Point> points_;
  bool turns_;
  std::int64_t widest_ns_;
};

// Of a series that was received in order: the median of the intervals; 0 where there is none.
std::int64_t usual_interval(const Series& series) {
  std::vector<std::int64_t> stamps = series.stamp_ns;
  std::sort(stamps.begin(), stamps.end());
  std::vector<std::int64_t> intervals;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    intervals.push_back(stamps[k] - stamps[k - 1]);
  }
  if (intervals.empty()) {
    return 0;
  }
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

class BagSource final : public ColumnSource {
 public:
  BagSource(Bag bag, std::string file) : bag_(std::move(bag)), file_(std::move(file)) {
    for (std::size_t s = 0; s < bag_.series.size(); ++s) {
      const Series& series = bag_.series[s];
      if (series.is_imu()) {
        add(series.topic + ".header.stamp", "ns", {s, stamp});
      }
      for (std::size_t f = 0; f < series.fields.size(); ++f) {
        add(fmt::format("{}.{}", series.topic, series.fields[f]), series.units[f], {s, f});
      }
    }
    form_ = describe();
  }

  const std::vector<std::string>& names() const override { return names_; }
  const std::vector<std::string>& units() const override { return units_; }
  std::string form() const override { return form_; }

  Expected<ColumnData> read(const ColumnRequest& request) const override {
    const Expected<std::size_t> rows_of = reference(request);
    if (!rows_of) {
      return tl::unexpected(rows_of.error());
    }
    const Series& rows = bag_.series[*rows_of];
    ColumnData data;
    data.rows = rows.stamp_ns.size();
    if (data.rows > request.most_rows) {
      if (!request.tolerant) {
        return fail(ErrorKind::bad_input,
                    fmt::format("{}: {} messages, at most {} are allowed", file_, data.rows, request.most_rows));
      }
      data.rows = request.most_rows;
      data.left_out = true;
    }
    for (const std::size_t column : request.columns) {
      data.values.push_back(values_at(column, rows, data.rows));
      const std::vector<double>& values = data.values.back();
      const auto lacking = std::find_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); });
      if (!request.tolerant && lacking != values.end()) {
        return fail(ErrorKind::bad_input, fmt::format("{}: message {} of {}: {}: no finite number at its time", file_,
                                                      lacking - values.begin() + 1, rows.topic, title(column)));
      }
    }
    if (!request.stamp) {
      return data;
    }
    if (request.stamp_is_date) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: {}: numbers; dates are expected", file_, title(*request.stamp)));
    }
    if (places_[*request.stamp].field == stamp) {
      const std::vector<std::int64_t>& own = bag_.series[places_[*request.stamp].series].stamp_ns;
      data.stamps.assign(own.begin(), own.begin() + static_cast<std::ptrdiff_t>(data.rows));
    } else {
      const std::vector<double> values = values_at(*request.stamp, rows, data.rows);
      data.stamps.assign(values.begin(), values.end());
    }
    return data;
  }

 private:
  static constexpr std::size_t stamp = std::numeric_limits<std::size_t>::max();
  struct Place {
    std::size_t series;
    std::size_t field;  // or `stamp`
  };

  void add(std::string name, const std::string& unit, Place place) {
    names_.push_back(std::move(name));
    units_.push_back(unit);
    places_.push_back(place);
  }

  // The Imu whose messages are the rows; an error where two are asked for whose stamps differ.
  Expected<std::size_t> reference(const ColumnRequest& request) const {
    std::vector<std::size_t> columns = request.columns;
    if (request.stamp) {
      columns.insert(columns.begin(), *request.stamp);
    }
    std::optional<std::size_t> first;
    for (const std::size_t column : columns) {
      const std::size_t here = places_[column].series;
      const Series& series = bag_.series[here];
      if (!series.is_imu()) {
        continue;
      }
      first = first ? first : here;
      if (series.stamp_ns != bag_.series[*first].stamp_ns) {
        return fail(ErrorKind::bad_input,
                    fmt::format("{}: columns of {} and of {}, whose stamps differ; those of one are expected", file_,
                                bag_.series[*first].topic, series.topic));
      }
    }
    const auto any =
        std::find_if(bag_.series.begin(), bag_.series.end(), [](const Series& series) { return series.is_imu(); });
    return first.value_or(static_cast<std::size_t>(any - bag_.series.begin()));
  }

  std::vector<double> values_at(std::size_t column, const Series& rows, std::size_t count) const {
    const auto [from, field] = places_[column];
    const Series& series = bag_.series[from];
    std::vector<double> values;
    if (field == stamp) {
      values.assign(series.stamp_ns.begin(), series.stamp_ns.begin() + static_cast<std::ptrdiff_t>(count));
    } else if (series.stamp_ns == rows.stamp_ns) {
      const std::vector<double>& all = series.values[field];
      values.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
    } else {
      const Between between(series, field, usual_interval(series));
      for (std::size_t k = 0; k < count; ++k) {
        values.push_back(between.at(rows.stamp_ns[k]));
      }
    }
    return values;
  }

  std::string describe() const {
    const auto rows =
        std::find_if(bag_.series.begin(), bag_.series.end(), [](const Series& series) { return series.is_imu(); });
    std::string words = bag_.form;
    std::set<std::string> beside;
    for (const Series& series : bag_.series) {
      const std::string here = fmt::format("{}, {} messages", series.topic, series.stamp_ns.size());
      if (series.is_imu()) {
        words += fmt::format("; {}", here);
      } else if (series.stamp_ns != rows->stamp_ns && beside.insert(series.topic).second) {
        words += fmt::format("; {}, put linearly between their stamps at the times of the Imu", here);
      }
    }
    for (std::size_t k = 0; k < bag_.not_read.size() && k <= most_named; ++k) {
      words += k == most_named ? fmt::format(" and {} more", bag_.not_read.size() - k)
                               : fmt::format("{}{}", k == 0 ? "; not read: " : ", ", bag_.not_read[k]);
    }
    return words;
  }

  Bag bag_;
  std::string file_;
  std::vector<std::string> names_;
  std::vector<std::string> units_;
  std::vector<Place> places_;
  std::string form_;
};

}  // namespace

Expected<std::unique_ptr<ColumnSource>> bag_source(Bag bag, const std::string& file,
                                                   const std::optional<std::string>& topic) {
  std::vector<std::string> imus;
  for (const Series& series : bag.series) {
    if (series.is_imu()) {
      imus.push_back(fmt::format("{} ({} messages)", series.topic, series.stamp_ns.size()));
    }
  }
  if (imus.empty()) {
    std::set<std::string> topics(bag.not_read.begin(), bag.not_read.end());
    for (const Series& series : bag.series) {
      topics.insert(fmt::format("{} ({})", series.topic, series.type));
    }
    std::vector<std::string> first(topics.begin(), topics.end());
    first.resize(std::min(first.size(), most_named));
    return fail(ErrorKind::bad_input, fmt::format("{}: {}: no message of type sensor_msgs/Imu{}{}", file, bag.form,
                                                  first.empty() ? "" : "; topics: ", fmt::join(first, ", ")));
  }
  if (topic) {
    if (topic->empty() && imus.size() > 1) {
      return fail(ErrorKind::usage,
                  fmt::format("{}: several topics of sensor_msgs/Imu: {}; --topic says which is meant", file,
                              fmt::join(imus, ", ")));
    }
    const auto other = [&](const Series& series) {
      return series.is_imu() && !topic->empty() && series.topic != *topic;
    };
    if (static_cast<std::size_t>(std::count_if(bag.series.begin(), bag.series.end(), other)) == imus.size()) {
      return fail(ErrorKind::usage, fmt::format("{}: --topic {}: the topics of sensor_msgs/Imu are {}", file, *topic,
                                                fmt::join(imus, ", ")));
    }
    std::erase_if(bag.series, other);
  }
  return std::make_unique<BagSource>(std::move(bag), file);
}

}  // namespace selfcal::import
