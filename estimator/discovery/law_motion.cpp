#include "estimator/discovery/law_motion.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/geometry/angles.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {
namespace {

using laws::Variable;

constexpr double before_any_turn_s = 1e9;
constexpr double least_turn = 5.0 * units::degree;  // of one axis: less is a drive that misses its position
constexpr double seconds_per_hour = 3600.0;
constexpr double temperature_window_s = 30.0;

std::size_t index_at(const ImuData& data, double t) {
  const auto at = std::lower_bound(data.time_s.begin(), data.time_s.end(), t);
  return std::min(static_cast<std::size_t>(at - data.time_s.begin()), data.size() - 1);
}

}  // namespace

LawMotion::LawMotion(const diagnosis::RecordingContext& context)
    : context_(context), start_s_(context.data().time_s.front() - 1.0 / context.data().sample_rate_hz) {
  const ImuData& data = context.data();
  const bool angles = !data.gimbal_outer.empty() && !data.gimbal_inner.empty();
  available_.set();
  for (const Variable v : {Variable::outer, Variable::inner, Variable::wo, Variable::wi, Variable::so, Variable::si}) {
    available_.set(static_cast<std::size_t>(v), angles);
  }
  available_.set(static_cast<std::size_t>(Variable::T), context.has_temperature());
  available_.set(static_cast<std::size_t>(Variable::dT), context.has_temperature());
  senses_.push_back({});
  for (const diagnosis::Turn& turn : context.turns()) {
    begins_s_.push_back(turn.start_s - start_s_);
    ends_s_.push_back(turn.end_s - start_s_);
    Sense sense = senses_.back();
    if (angles) {  // read-outs on either side: half a turn and more in one move would be told as the other sense
      double outer = 0.0, inner = 0.0;
      const std::size_t first = index_at(data, turn.start_s), last = index_at(data, turn.end_s);
      for (std::size_t i = first + 1; i <= last; ++i) {
        outer += within_half_a_turn(data.gimbal_outer[i] - data.gimbal_outer[i - 1]);
        inner += within_half_a_turn(data.gimbal_inner[i] - data.gimbal_inner[i - 1]);
      }
      sense.outer = std::abs(outer) < least_turn ? sense.outer : (outer > 0.0 ? 1.0 : -1.0);
      sense.inner = std::abs(inner) < least_turn ? sense.inner : (inner > 0.0 ? 1.0 : -1.0);
    }
    senses_.push_back(sense);
  }
}

std::size_t LawMotion::turns_begun(double t) const {
  return static_cast<std::size_t>(std::upper_bound(begins_s_.begin(), begins_s_.end(), t) - begins_s_.begin());
}

std::size_t LawMotion::turns_ended(double t) const {
  return static_cast<std::size_t>(std::upper_bound(ends_s_.begin(), ends_s_.end(), t) - ends_s_.begin());
}

double LawMotion::temperature_rate(double t) const {
  const ImuData& data = context_.data();
  const auto mean = [&](double from, double to) {
    const std::size_t first = index_at(data, start_s_ + std::max(from, 0.0));
    const std::size_t last = std::max(index_at(data, start_s_ + to), first + 1);
    double sum = 0.0, time = 0.0;
    for (std::size_t i = first; i < std::min(last, data.size()); ++i) {
      sum += data.temperature[i];
      time += data.time_s[i];
    }
    const double n = static_cast<double>(std::min(last, data.size()) - first);
    return std::pair(sum / n, time / n);
  };
  const auto [early, early_s] = mean(t - temperature_window_s, t);
  const auto [late, late_s] = mean(t, t + temperature_window_s);
  return late_s > early_s ? 60.0 * (late - early) / (late_s - early_s) : 0.0;
}

StretchNodes LawMotion::of(const SensorBlock& block) const {
  const diagnosis::EffectContext c = context_.of(block);
  std::vector<double> edges = {c.start_s, c.end_s};
  for (const auto* times : {&begins_s_, &ends_s_}) {
    for (auto t = std::upper_bound(times->begin(), times->end(), c.start_s); t != times->end() && *t < c.end_s; ++t) {
      edges.push_back(*t);
    }
  }
  std::sort(edges.begin(), edges.end());
  StretchNodes result;
  const auto count = static_cast<Eigen::Index>(edges.size()) - 1;
  result.channels.setZero(count, static_cast<Eigen::Index>(laws::variable_count));
  const Vector3 rate = c.rate / units::degree;
  for (Eigen::Index k = 0; k < count; ++k) {
    const double from = edges[static_cast<std::size_t>(k)], to = edges[static_cast<std::size_t>(k) + 1];
    const double t = 0.5 * (from + to);
    result.nodes.push_back({t, (to - from) * c.dt / (c.end_s - c.start_s)});
    const auto set = [&](Variable v, double value) { result.channels(k, static_cast<Eigen::Index>(v)) = value; };
    for (int axis = 0; axis < 3; ++axis) {
      set(static_cast<Variable>(static_cast<int>(Variable::fx) + axis), c.u(axis));
      set(static_cast<Variable>(static_cast<int>(Variable::wx) + axis), rate(axis));
    }
    const std::size_t begun = turns_begun(t), ended = turns_ended(t);
    const bool turning = begun > ended;
    const double since = ended == 0 ? before_any_turn_s : t - ends_s_[ended - 1];
    set(Variable::t, t / seconds_per_hour);
    set(Variable::since, since);
    set(Variable::rest, turning ? 0.0 : since);
    set(Variable::n, static_cast<double>(begun));
    if (available_.test(static_cast<std::size_t>(Variable::outer))) {
      set(Variable::outer, c.outer);
      set(Variable::inner, c.inner);
      // b turns by inner about its own y, and carried by outer about z of the frame that outer carries.
      set(Variable::wo, turning ? std::cos(c.inner) * rate.z() - std::sin(c.inner) * rate.x() : 0.0);
      set(Variable::wi, turning ? rate.y() : 0.0);
      set(Variable::so, senses_[begun].outer);
      set(Variable::si, senses_[begun].inner);
    }
    if (context_.has_temperature()) {
      set(Variable::T, c.temperature);
      set(Variable::dT, temperature_rate(t));
    }
  }
  return result;
}

namespace {

class Collector : public ExtraSignatures {
 public:
  Collector(const LawMotion& motion, NodeTable& table) : motion_(motion), table_(table) {}
  int count() const override { return 0; }
  bool block_ends_before(std::size_t sample) const override { return motion_.context().divides(sample); }
  void block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> /*velocity*/,
             Eigen::Ref<Eigen::Matrix3Xd> /*angle*/) override {
    const StretchNodes stretch = motion_.of(block);
    for (Eigen::Index k = 0; k < stretch.channels.rows(); ++k) {
      table_.nodes.push_back(stretch.nodes[static_cast<std::size_t>(k)]);
      rows_.emplace_back(stretch.channels.row(k));
    }
  }
  void finish() {
    table_.channels.resize(static_cast<Eigen::Index>(rows_.size()), static_cast<Eigen::Index>(laws::variable_count));
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      table_.channels.row(static_cast<Eigen::Index>(k)) = rows_[k];
    }
  }

 private:
  const LawMotion& motion_;
  NodeTable& table_;
  std::vector<Eigen::Array<double, 1, static_cast<int>(laws::variable_count)>> rows_;
};

}  // namespace

NodeTable collect_nodes(const LawMotion& motion, const PassInput& input) {
  NodeTable table;
  Collector collector(motion, table);
  IntervalNavigator navigator(*input.data, input.parameters, input.C_nb, input.sign, input.interval_s, &collector);
  Interval interval;
  while (navigator.next(interval)) {
  }
  collector.finish();
  return table;
}

Eigen::ArrayXd dt_of(const NodeTable& table) {
  Eigen::ArrayXd dt(static_cast<Eigen::Index>(table.nodes.size()));
  std::transform(table.nodes.begin(), table.nodes.end(), dt.begin(), [](const Node& node) { return node.dt; });
  return dt;
}

}  // namespace selfcal::discovery
