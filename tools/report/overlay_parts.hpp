// The quiet parts of a recording's dwells, and how a quantity scatters from one to the next. Private to this folder.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "tools/report/overlay_bands.hpp"

namespace selfcal::report {

constexpr std::size_t sensor_count = 6;

// Gyros x y z, accelerometers x y z: increment of sample i, SI; its unit of rate on the page, SI; its name.
double increment(const ImuData& data, std::size_t sensor, std::size_t i);
double page_unit(std::size_t sensor);
std::string sensor_name(std::size_t sensor);

struct Range {
  std::size_t first, last;  // samples [first, last)
  std::size_t size() const { return last - first; }
};

// Dwells without what gimbal and filter need to settle, and without stretches that were left out.
std::vector<Range> quiet(const ImuData& data);

// Dwells are the parts by which a quantity scatters; few long ones are cut into pieces, short
// enough that no burst is most of one.
class Parts {
 public:
  explicit Parts(const std::vector<Range>& ranges)
      : of_each_(ranges.empty() || ranges.size() >= few ? 1 : (most_pieces + ranges.size() - 1) / ranges.size()),
        parts_(of_each_ * ranges.size()) {}
  // `at`: sample in r, which is ranges[range].
  void add(std::size_t range, const Range& r, std::size_t at, double value) {
    Part& part = parts_[range * of_each_ + std::min(of_each_ - 1, (at - r.first) * of_each_ / r.size())];
    part.sum += value;
    part.count += 1.0;
  }
  const std::vector<Part>& all() const { return parts_; }

 private:
  static constexpr std::size_t few = 8, most_pieces = 48;
  std::size_t of_each_;
  std::vector<Part> parts_;
};

}  // namespace selfcal::report
