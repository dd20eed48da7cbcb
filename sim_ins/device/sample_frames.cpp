#include "sim_ins/device/sample_frames.hpp"

#include <fmt/format.h>

#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::sim {

using profile::Frame;
using profile::Signal;

can::CanFrame begin_frame(const profile::Profile& profile, const Frame& kind) {
  can::CanFrame frame;
  frame.id = kind.id;
  frame.extended = profile.bus.extended_ids;
  frame.fd = frame.bit_rate_switch = profile.bus.fd;
  frame.size = static_cast<std::uint8_t>(kind.bytes);
  for (const Signal& signal : kind.signals) {
    if (signal.constant) {
      profile::put_raw(signal, *signal.constant, std::span(frame.data).first(kind.bytes));
    }
  }
  return frame;
}

void put_value(const Frame& kind, std::string_view name, double value, can::CanFrame& frame) {
  const Signal* signal = kind.find(name);
  const auto raw = signal == nullptr ? std::nullopt : profile::raw_for(*signal, value);
  if (raw) {
    profile::put_raw(*signal, *raw, std::span(frame.data).first(kind.bytes));
  }
}

void append_sample(const profile::Profile& profile, const ImuSample& sample, std::uint64_t counter,
                   std::vector<can::CanFrame>& frames) {
  const profile::Raw& axes = profile.raw;
  constexpr std::string_view letters[] = {"x", "y", "z"}, gimbal[] = {"outer", "inner"};
  const std::array<double, 2> read_out{sample.outer, sample.inner};
  for (const Frame& kind : profile::sample_frames(profile)) {
    can::CanFrame frame = begin_frame(profile, kind);
    const Signal& count = *kind.find("counter");
    profile::put_raw(count, counter & ((std::uint64_t{1} << count.length) - 1),
                     std::span(frame.data).first(kind.bytes));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string_view axis = letters[axes.axis[k]];
      put_value(kind, fmt::format("delta_theta_{}", axis), axes.sign[k] * sample.delta_theta[k], frame);
      put_value(kind, fmt::format("delta_v_{}", axis), axes.sign[k] * sample.delta_v[k], frame);
    }
    for (std::size_t k = 0; k < 2; ++k) {
      const double angle = std::remainder(axes.gimbal_sign[k] * read_out[k], 360.0 * units::degree);
      put_value(kind, gimbal[axes.gimbal[k]], angle, frame);
    }
    put_value(kind, "temperature", sample.temperature_c, frame);
    frames.push_back(frame);
  }
}

}  // namespace selfcal::sim
