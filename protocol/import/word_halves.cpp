#include "protocol/import/word_halves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/import/name_words.hpp"

namespace selfcal::import {
namespace {

struct Pair {
  std::size_t high = 0, low = 0;
};

// Without the last word that is one of THESE; empty: none is.
template <std::size_t count>
Words without(const Words& words, const std::array<std::string_view, count>& these) {
  const auto last = std::find_if(words.rbegin(), words.rend(), [&](const std::string& word) {
    return std::find(these.begin(), these.end(), word) != these.end();
  });
  Words rest = words;
  if (last == words.rend()) {
    return {};
  }
  rest.erase(rest.begin() + (words.rend() - last - 1));
  return rest;
}

std::vector<Pair> pairs_by_name(const std::vector<std::string>& names) {
  constexpr std::array<std::string_view, 6> low{"low", "lo", "lsw", "lsb", "lower", "l"};
  constexpr std::array<std::string_view, 7> high{"high", "hi", "msw", "msb", "upper", "h", "out"};
  std::vector<Words> words;
  words.reserve(names.size());
  for (const std::string& name : names) {
    words.push_back(words_of(name));
  }
  std::vector<Pair> pairs;
  for (std::size_t k = 0; k < words.size(); ++k) {
    const Words stem = without(words[k], low);
    const bool letter = is_one_of(words[k], {"l"});  // beside a plain name it may be the left one
    for (std::size_t j = 0; j < words.size() && !stem.empty(); ++j) {
      if (j != k && (without(words[j], high) == stem || (!letter && words[j] == stem))) {
        pairs.push_back({j, k});
        break;
      }
    }
  }
  return pairs;
}

bool whole_within(const std::vector<double>& values, double base) {
  return std::all_of(values.begin(), values.end(), [base](double v) {
    return !std::isfinite(v) || (v == std::floor(v) && v >= -0.5 * base && v < base);
  });
}

double without_sign(double half, double base) { return half < 0.0 ? half + base : half; }
double with_sign(double half, double base) { return half >= 0.5 * base ? half - base : half; }
double joined(double high, double low, double base) { return with_sign(high, base) * base + without_sign(low, base); }

// Of the rows in which the high half is another one than before.
bool takes_all_values(const std::vector<double>& high, const std::vector<double>& low, double base) {
  std::array<double, 8> counts{};
  double all = 0.0;
  for (std::size_t k = 1; k < low.size(); ++k) {
    if (std::isfinite(low[k]) && high[k] != high[k - 1]) {
      counts.at(static_cast<std::size_t>(without_sign(low[k], base) / base * static_cast<double>(counts.size()))) +=
          1.0;
      all += 1.0;
    }
  }
  constexpr double about = 0.5, fewest = 25.0;  // of as many in each; 25 scatter by 5: half of them are 2.5 sigma
  const double each = all / static_cast<double>(counts.size());
  return each >= fewest &&
         std::all_of(counts.begin(), counts.end(), [each](double n) { return std::abs(n - each) < about * each; });
}

// Whether the low half leaps back where the high one takes a step, rather than forth. What a step of most of a word makes is neither.
bool carries(const std::vector<double>& high, const std::vector<double>& low, double base) {
  double steps = 0.0, back = 0.0, forth = 0.0;
  for (std::size_t k = 1; k < high.size(); ++k) {
    const double step = with_sign(high[k], base) - with_sign(high[k - 1], base);
    const double by = step * (without_sign(low[k], base) - without_sign(low[k - 1], base));
    steps += std::abs(step) == 1.0 ? 1.0 : 0.0;
    back += std::abs(step) == 1.0 && by < -0.5 * base ? 1.0 : 0.0;
    forth += std::abs(step) == 1.0 && by > 0.5 * base ? 1.0 : 0.0;
  }
  constexpr double fewest = 20.0, share = 0.2, times = 2.0;
  return back >= fewest && back > share * steps && back > times * forth;
}

class WholeWords final : public ColumnSource {
 public:
  WholeWords(std::unique_ptr<ColumnSource> source, std::vector<Pair> pairs, double base)
      : source_(std::move(source)), pairs_(std::move(pairs)), base_(base), names_(source_->names()) {
    for (const Pair& pair : pairs_) {
      names_[pair.low] += low_half;
    }
  }

  const std::vector<std::string>& names() const override { return names_; }
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
    ColumnRequest both = request;
    for (const Pair& pair : pairs_) {
      if (std::find(request.columns.begin(), request.columns.end(), pair.high) != request.columns.end()) {
        both.columns.push_back(pair.low);
      }
    }
    return source_->read(both).map([&](ColumnData data) {
      std::size_t behind = request.columns.size();
      for (const Pair& pair : pairs_) {
        const auto asked = std::find(request.columns.begin(), request.columns.end(), pair.high);
        if (asked == request.columns.end()) {
          continue;
        }
        const std::vector<double>& low = data.values[behind++];
        for (auto at = asked; at != request.columns.end(); ++at) {
          std::vector<double>& high = data.values[static_cast<std::size_t>(at - request.columns.begin())];
          for (std::size_t row = 0; row < data.rows && *at == pair.high; ++row) {
            high[row] = joined(high[row], low[row], base_);
          }
        }
      }
      data.values.resize(request.columns.size());
      return data;
    });
  }

 private:
  std::string own_words() const {
    std::string which;
    for (const Pair& pair : pairs_) {
      which += fmt::format("{}{} and {}", which.empty() ? "" : ", ", pair.high + 1, pair.low + 1);
    }
    return fmt::format("words of {} bits are put together from high and low half: columns {}", base_ > 256.0 ? 32 : 16,
                       which);
  }

  std::unique_ptr<ColumnSource> source_;
  std::vector<Pair> pairs_;
  double base_;
  std::vector<std::string> names_;
};

}  // namespace

std::unique_ptr<ColumnSource> with_whole_words(std::unique_ptr<ColumnSource> source) {
  const std::vector<Pair> pairs = pairs_by_name(source->names());
  constexpr std::size_t triad = 3, enough = 200000;
  if (pairs.size() < triad) {
    return source;
  }
  ColumnRequest request;
  request.tolerant = true;
  request.most_rows = enough;
  for (const Pair& pair : pairs) {
    request.columns.push_back(pair.high);
    request.columns.push_back(pair.low);
  }
  const Expected<ColumnData> data = source->read(request);
  if (!data) {
    return source;
  }
  const auto all_within = [&data](double base) {
    return std::all_of(data->values.begin(), data->values.end(),
                       [base](const std::vector<double>& v) { return whole_within(v, base); });
  };
  constexpr double byte = 256.0, word = 65536.0;
  const double base = all_within(byte) ? byte : word;
  if (!all_within(base)) {
    return source;
  }
  std::vector<Pair> halves;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const std::vector<double>&high = data->values[2 * k], &low = data->values[2 * k + 1];
    if (takes_all_values(high, low, base) || carries(high, low, base)) {
      halves.push_back(pairs[k]);
    }
  }
  if (halves.size() < triad) {
    return source;
  }
  return std::make_unique<WholeWords>(std::move(source), std::move(halves), base);
}

}  // namespace selfcal::import
