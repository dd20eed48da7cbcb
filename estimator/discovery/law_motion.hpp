// The variables of laws along a recording, from the calibrated motion.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "estimator/diagnosis/regression/recording_context.hpp"
#include "estimator/laws/expression.hpp"

namespace selfcal::discovery {

// One point of the recording at which laws are evaluated: it stands for dt seconds around it.
struct Node {
  double time_s = 0.0;  // since the start of the recording, middle of the stretch
  double dt = 0.0;      // s
};

// The nodes of one stretch (one, or two or three where a turn begins or ends in it) with their variables.
struct StretchNodes {
  std::vector<Node> nodes;
  laws::Channels channels;  // [nodes x variables]
};

// All nodes of a pass over the recording, in order of time.
struct NodeTable {
  std::vector<Node> nodes;
  laws::Channels channels;  // [nodes x variables]
};

class LawMotion {
 public:
  // `context` must outlive this.
  explicit LawMotion(const diagnosis::RecordingContext& context);

  // The variables that this recording has: without read-outs no angles and senses, without a channel no temperature.
  const laws::VariableSet& available() const { return available_; }
  StretchNodes of(const SensorBlock& block) const;
  const diagnosis::RecordingContext& context() const { return context_; }
  double start_s() const { return start_s_; }  // of the recording, recording's time

 private:
  struct Sense {
    double outer = 0.0, inner = 0.0;  // -1, 0, 1
  };
  std::size_t turns_begun(double t) const;  // at or before t, s since the start
  std::size_t turns_ended(double t) const;
  double temperature_rate(double t) const;  // degC/min

  const diagnosis::RecordingContext& context_;
  laws::VariableSet available_;
  double start_s_ = 0.0;  // recording's time
  std::vector<double> begins_s_, ends_s_;
  std::vector<Sense> senses_;  // after k turns have begun, [turns + 1]
};

// The nodes of a pass with this input.
NodeTable collect_nodes(const LawMotion& motion, const PassInput& input);
// [nodes] s
Eigen::ArrayXd dt_of(const NodeTable& table);

}  // namespace selfcal::discovery
