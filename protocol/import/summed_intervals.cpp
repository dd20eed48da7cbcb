#include "protocol/import/summed_intervals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "protocol/import/median.hpp"

namespace selfcal::import {
namespace {

// Letters without a unit behind them: "delta_t [ms]" is "deltat".
std::string bare_name(const std::string& name) {
  std::string text;
  for (const char c : name) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      text.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
    }
  }
  for (const std::string_view unit : {"nsec", "usec", "msec", "sec", "ns", "us", "ms", "s"}) {
    if (text.size() > unit.size() && text.ends_with(unit)) {
      text.erase(text.size() - unit.size());
      break;
    }
  }
  return text;
}

bool is_called_an_interval(const std::string& name) {
  static constexpr std::array<std::string_view, 6> names = {"dt",        "deltat",   "deltatime",
                                                            "timedelta", "timestep", "sampleinterval"};
  return std::find(names.begin(), names.end(), bare_name(name)) != names.end();
}

std::vector<double> finite_of(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  return values;
}

// Positive and of about one size but for a few gaps; the first may be zero.
bool are_intervals(const std::vector<double>& values) {
  constexpr std::size_t fewest = 10;
  constexpr double about = 0.5, most_others = 0.05;
  const std::vector<double> finite =
      finite_of({values.begin() + std::min<std::ptrdiff_t>(1, std::ssize(values)), values.end()});
  if (finite.size() < fewest) {
    return false;
  }
  const double typical = median(finite);
  const auto others =
      std::count_if(finite.begin(), finite.end(), [&](double v) { return std::abs(v - typical) > about * typical; });
  return *std::min_element(finite.begin(), finite.end()) > 0.0 &&
         static_cast<double>(others) < most_others * static_cast<double>(finite.size());
}

bool rises(const std::vector<double>& values) {
  return std::adjacent_find(values.begin(), values.end(), [](double a, double b) { return !(b > a); }) == values.end();
}

// A row without an interval has no time, and those behind it are as far away as rows usually are.
template <class Value>
void sum_up(std::vector<Value>& values) {
  const std::vector<double> finite = finite_of({values.begin(), values.end()});
  const double typical = finite.empty() ? 0.0 : median(finite);
  long double sum = 0.0L;
  for (Value& v : values) {
    sum += std::isfinite(v) ? static_cast<long double>(v) : static_cast<long double>(typical);
    v = std::isfinite(v) ? static_cast<Value>(sum) : v;
  }
}

class SummedIntervals final : public ColumnSource {
 public:
  SummedIntervals(std::unique_ptr<ColumnSource> source, std::size_t column)
      : source_(std::move(source)), column_(column) {}

  const std::vector<std::string>& names() const override { return source_->names(); }
  const std::vector<std::string>& units() const override { return source_->units(); }
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
        sum_up(data.stamps);
      }
      for (std::size_t k = 0; k < request.columns.size(); ++k) {
        if (request.columns[k] == column_) {
          sum_up(data.values[k]);
        }
      }
      return data;
    });
  }

 private:
  std::string own_words() const {
    return fmt::format("time is the sum of the intervals in {}", source_->title(column_));
  }

  std::unique_ptr<ColumnSource> source_;
  std::size_t column_;
};

}  // namespace

std::unique_ptr<ColumnSource> with_summed_intervals(std::unique_ptr<ColumnSource> source) {
  const std::vector<std::string>& names = source->names();
  const auto named = std::find_if(names.begin(), names.end(), is_called_an_interval);
  if (named == names.end()) {
    return source;
  }
  const auto column = static_cast<std::size_t>(named - names.begin());
  ColumnRequest request;
  for (std::size_t k = 0; k < names.size(); ++k) {
    request.columns.push_back(k);
  }
  request.tolerant = true;
  request.most_rows = 1000;
  const Expected<ColumnData> data = source->read(request);
  if (!data || !are_intervals(data->values[column]) || std::any_of(data->values.begin(), data->values.end(), rises)) {
    return source;
  }
  return std::make_unique<SummedIntervals>(std::move(source), column);
}

}  // namespace selfcal::import
