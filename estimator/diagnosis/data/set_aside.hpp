// The part of a recording that is sound: what is faulty in a stretch is left out, and the rest answers.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "estimator/diagnosis/data/faults.hpp"
#include "estimator/diagnosis/data/side_channels.hpp"
#include "estimator/models/segments.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal::diagnosis {

class SetAside {
 public:
  // Looks for faults (faults.hpp) and for seconds in which the base is disturbed.
  explicit SetAside(const ImuData& data);
  SetAside(const SetAside&) = delete;
  SetAside& operator=(const SetAside&) = delete;

  // The recording with what was left out marked (models/imu_data.hpp); as it was where nothing is, or where `refused`.
  const ImuData& data() const { return data_; }
  const std::vector<LeftOut>& left_out() const { return left_out_; }  // chronological
  // Why a faulty recording is not answered in part; empty: it is, or nothing is faulty.
  const std::string& refused() const { return refused_; }

 private:
  void add(FaultyStretch stretch, const std::vector<Segment>& segments, const std::string& id,
           const std::string& words);
  void mend_beside(const ImuData& data);
  void leave_out(const std::vector<DataFault>& faults, const std::vector<FaultyStretch>& disturbed);
  void mend();

  double begin_of(std::size_t sample) const {
    return sample > 0 ? data_.time_s[sample - 1] : data_.time_s[0] - 1.0 / data_.sample_rate_hz;
  }
  std::size_t samples(double seconds) const {
    return static_cast<std::size_t>(std::round(seconds * data_.sample_rate_hz));
  }

  ImuData data_;
  MendedSideChannels beside_;
  std::vector<std::array<double, 3>> delta_theta_, delta_v_;
  std::vector<Coast> coasts_;
  std::vector<LeftOut> left_out_;
  std::string refused_;
};

}  // namespace selfcal::diagnosis
