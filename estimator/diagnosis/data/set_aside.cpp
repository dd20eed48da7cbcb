#include "estimator/diagnosis/data/set_aside.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>

#include "estimator/diagnosis/data/axes.hpp"
#include "estimator/diagnosis/data/disturbance.hpp"
#include "estimator/models/segments.hpp"
#include "estimator/models/sensor_noise.hpp"
#include "estimator/navigation/coarse_alignment.hpp"

namespace selfcal::diagnosis {
namespace {

// Faults and noise are judged by medians and 90 % points of the recording: sound ones as long as no more is faulty.
constexpr double most_lost = 0.1;
constexpr double turn_margin_s = 0.5;       // between a turn as found and as it was
constexpr double disturbed_margin_s = 1.0;  // a second that is disturbed in part is not loud enough to be found
// What stands still for less between two turns says nothing of the attitude there: it is one turn.
constexpr double least_dwell_s = 5.0;
// Without read-outs an attitude comes from gravity and the Earth's rate. In 20 s an angle random walk of 0.003 deg/sqrt(h) leaves
// 0.1 rad of heading, where the passes still find the way.
constexpr double least_alignment_s = 20.0;

std::string seconds_text(const char* pattern, double a, double b = 0.0) {
  char text[200];
  std::snprintf(text, sizeof text, pattern, a, b);
  return text;
}

using Increments = std::vector<std::array<double, 3>>;

Vector3 mean_of(const Increments& all, std::size_t first, std::size_t last) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = first; i < last; ++i) {
    sum += Eigen::Map<const Vector3>(all[i].data());
  }
  return sum / static_cast<double>(last - first);
}

void fill(Increments& all, const Coast& coast, const Vector3& value) {
  for (std::size_t i = coast.first; i < coast.last; ++i) {
    Eigen::Map<Vector3>(all[i].data()) = value;
  }
}

ImuData part_of(const ImuData& data, const Segment& s) {
  ImuData part = data;
  part.time_s = data.time_s.subspan(s.first, s.last - s.first);
  part.delta_theta = data.delta_theta.subspan(s.first, s.last - s.first);
  part.delta_v = data.delta_v.subspan(s.first, s.last - s.first);
  part.gimbal_outer = part.gimbal_inner = part.temperature = {};
  part.coasts = {};
  return part;
}

bool has_read_outs(const ImuData& data) { return !data.gimbal_outer.empty() && !data.gimbal_inner.empty(); }

// The turn between two dwells: by the read-outs, or by gravity and the Earth's rate; up is where gravity is, on both sides.
Matrix3 turn_between(const ImuData& data, const Segment& before, const Segment& behind, const Vector3& up_before,
                     const Vector3& up_behind) {
  const bool read_outs = has_read_outs(data);
  const auto attitude = [&](const Segment& s) {
    return read_outs ? gimbal_matrix(s.outer, s.inner) : coarse_alignment(part_of(data, s), s.end_s - s.start_s).C_nb;
  };
  const Matrix3 turn = attitude(before).transpose() * attitude(behind);
  return Eigen::Quaterniond::FromTwoVectors(turn * up_behind, up_before).toRotationMatrix() * turn;
}

// The piece of a dwell next to a coast, on one side of it.
std::optional<Segment> dwell_beside(const std::vector<Segment>& pieces, const Coast& coast, bool behind) {
  std::optional<Segment> found;
  for (const Segment& s : pieces) {
    if (!s.rotation && (behind ? s.first >= coast.last : s.last <= coast.first)) {
      if (behind) {
        return s;
      }
      found = s;
    }
  }
  return found;
}

// Neighbours that overlap are one; so are turns with next to nothing between them.
std::vector<Coast> joined(std::vector<Coast> all, std::size_t least_dwell) {
  std::sort(all.begin(), all.end(), [](const Coast& a, const Coast& b) { return a.first < b.first; });
  std::vector<Coast> out;
  for (const Coast& c : all) {
    const std::size_t near = !out.empty() && out.back().turned && c.turned ? least_dwell : 0;
    if (!out.empty() && c.first <= out.back().last + near) {
      out.back().last = std::max(out.back().last, c.last);
      out.back().gyros = out.back().gyros || c.gyros;
      out.back().turned = out.back().turned || c.turned;
    } else {
      out.push_back(c);
    }
  }
  return out;
}

double seconds_of(const std::vector<Coast>& coasts, const ImuData& data) {
  double sum = 0.0;
  for (const Coast& c : coasts) {
    sum += data.time_s[c.last - 1] - data.time_s[c.first] + 1.0 / data.sample_rate_hz;
  }
  return sum;
}

// Why the turn that the gyros did not see cannot be made out; empty: it can.
std::string objection_to(const Coast& c, const ImuData& data, const std::optional<Segment>& before,
                         const std::optional<Segment>& behind) {
  if (!before || !behind) {
    return seconds_text("the gyros are lost in a turn at %.0f s, and no dwell lies on one of its sides",
                        data.time_s[c.first]);
  }
  const double shorter = std::min(before->end_s - before->start_s, behind->end_s - behind->start_s);
  if (!has_read_outs(data) && shorter < least_alignment_s) {
    return seconds_text(
        "the gyros are lost in a turn at %.0f s, no read-outs say how far it went, and the %.0f s beside it are too "
        "short for gravity and the Earth's rate to say",
        data.time_s[c.first], shorter);
  }
  return {};
}

}  // namespace

SetAside::SetAside(const ImuData& data) : data_(data) {
  mend_beside(data);
  const std::vector<DataFault> faults = find_data_faults(data_);
  const auto whole = std::find_if(faults.begin(), faults.end(), [](const DataFault& f) { return f.stretches.empty(); });
  if (whole != faults.end()) {
    refused_ = whole->words + ": a fault of the whole recording";
    data_ = data;
    left_out_.clear();
    return;
  }
  leave_out(faults, {});
  const bool gyros = std::any_of(coasts_.begin(), coasts_.end(), [](const Coast& c) { return c.gyros; });
  if (refused_.empty() && gyros && estimate_sensor_noise(data_, observed(find_segments(data_), data_)).base_moves) {
    refused_ = "the base moves, and how it turned while the gyros were lost nothing else says";
  }
  if (refused_.empty()) {
    leave_out({}, find_disturbed(data_, find_segments(data_)));
  }
  if (refused_.empty() && !faults.empty()) {  // else it was looked for already
    std::vector<DataFault> axes;
    find_wrong_axes(data_, find_segments(data_), axes);
    refused_ = axes.empty() ? "" : axes.front().words;
  }
  if (!refused_.empty()) {
    data_ = data;
    left_out_.clear();
  }
}

void SetAside::mend_beside(const ImuData& data) {
  beside_ = mend_side_channels(data);
  if (beside_.faults.empty()) {
    return;
  }
  data_.gimbal_outer = beside_.outer;
  data_.gimbal_inner = beside_.inner;
  data_.temperature = beside_.temperature;
  for (const DataFault& fault : beside_.faults) {
    for (const FaultyStretch& s : fault.stretches) {
      left_out_.push_back({begin_of(s.first), data_.time_s[s.last - 1], fault.id, fault.words, false, false});
    }
  }
  std::sort(left_out_.begin(), left_out_.end(),
            [](const LeftOut& a, const LeftOut& b) { return a.start_s < b.start_s; });
}

// `segments`: of the recording. In a turn all of it is lost with the gyros.
void SetAside::add(FaultyStretch s, const std::vector<Segment>& segments, const std::string& id,
                   const std::string& words) {
  bool turned = false;
  const std::size_t margin = samples(turn_margin_s);
  for (const Segment& segment : segments) {
    const std::size_t first = segment.first - std::min(segment.first, margin);
    const std::size_t last = std::min(data_.size(), segment.last + margin);
    if (segment.rotation && s.gyros && s.first < last && s.last > first) {
      s.first = std::min(s.first, first);
      s.last = std::max(s.last, last);
      turned = true;
    }
  }
  constexpr std::size_t shadow = 5;  // samples by which what one fault does to another test reaches beyond it
  const bool told = std::any_of(coasts_.begin(), coasts_.end(), [&](const Coast& c) {
    return c.first <= s.first + shadow && s.last <= c.last + shadow && (c.gyros || !s.gyros);
  });
  coasts_.push_back({s.first, s.last, s.gyros, turned, Matrix3::Identity()});
  if (!told) {
    left_out_.push_back({begin_of(s.first), data_.time_s[s.last - 1], id, words, turned});
  }
}

void SetAside::leave_out(const std::vector<DataFault>& faults, const std::vector<FaultyStretch>& disturbed) {
  if (faults.empty() && disturbed.empty()) {
    return;
  }
  if (delta_v_.empty()) {
    delta_theta_.assign(data_.delta_theta.begin(), data_.delta_theta.end());
    delta_v_.assign(data_.delta_v.begin(), data_.delta_v.end());
    data_.delta_theta = delta_theta_;
    data_.delta_v = delta_v_;
  }
  const std::vector<Segment> segments = find_segments(data_);
  for (const DataFault& fault : faults) {
    for (const FaultyStretch& s : fault.stretches) {
      add(s, segments, fault.id, fault.words);
    }
  }
  const std::size_t pad = samples(disturbed_margin_s);
  for (const FaultyStretch& s : disturbed) {
    add({s.first - std::min(s.first, pad), std::min(data_.size(), s.last + pad), false}, segments, "disturbed",
        "the base is shaken: louder than its other seconds");
  }
  std::sort(left_out_.begin(), left_out_.end(),
            [](const LeftOut& a, const LeftOut& b) { return a.start_s < b.start_s; });
  coasts_ = joined(std::move(coasts_), samples(least_dwell_s));
  data_.coasts = coasts_;
  mend();
}

// Puts something harmless into the samples: the mean of the dwell around them, the turn between the dwells beside them.
void SetAside::mend() {
  const double lost_s = seconds_of(coasts_, data_), all_s = data_.time_s.back() - data_.time_s.front();
  if (lost_s > most_lost * all_s) {
    refused_ =
        seconds_text("%.0f of %.0f s are faulty, and by no more than a tenth can the rest be judged", lost_s, all_s);
    return;
  }
  const std::vector<Segment> pieces = observed(find_segments(data_), data_);
  for (Coast& c : coasts_) {
    const auto before = dwell_beside(pieces, c, false), behind = dwell_beside(pieces, c, true);
    refused_ = !before && !behind ? "no dwell is free of faults"
               : c.turned         ? objection_to(c, data_, before, behind)
                                  : std::string();
    if (!refused_.empty()) {
      return;
    }
    const Segment& from = before ? *before : *behind;
    const Vector3 up = mean_of(delta_v_, from.first, from.last), rate = mean_of(delta_theta_, from.first, from.last);
    fill(delta_v_, c, up);
    if (c.turned) {
      const Vector3 up_behind = mean_of(delta_v_, behind->first, behind->last);
      c.turn = turn_between(data_, *before, *behind, up.normalized(), up_behind.normalized());
      const Eigen::AngleAxisd whole(c.turn);
      fill(delta_theta_, c, rate + whole.angle() / static_cast<double>(c.last - c.first) * whole.axis());
    } else if (c.gyros) {
      fill(delta_theta_, c, rate);
    }
  }
}

}  // namespace selfcal::diagnosis
