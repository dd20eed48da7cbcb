#include "estimator/diagnosis/regression/signature_pass.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <numeric>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::array<double, 6> after_turn_edges = {0.0, 5.0, 15.0, 30.0, 60.0, 120.0};  // s
constexpr int time_bins = 8;

class BlockSignatures : public ExtraSignatures {
 public:
  BlockSignatures(const RecordingContext& context, const std::vector<Candidate>& candidates,
                  const std::vector<LocatedColumn>& map, int first_map)
      : context_(context), candidates_(candidates), map_(map), first_map_(first_map) {}

  int count() const override { return first_map_ + static_cast<int>(map_.size()); }
  bool block_ends_before(std::size_t sample) const override { return context_.divides(sample); }

  void block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
             Eigen::Ref<Eigen::Matrix3Xd> angle) override {
    const EffectContext c = context_.of(block);
    for (const Candidate& candidate : candidates_) {
      add_signature(candidate, c, velocity.middleCols(candidate.first, candidate.count),
                    angle.middleCols(candidate.first, candidate.count));
    }
    if (!map_.empty()) {
      map_columns(block, c, velocity, angle);
    }
  }

 private:
  void map_columns(const SensorBlock& block, const EffectContext& c, Eigen::Ref<Eigen::Matrix3Xd> velocity,
                   Eigen::Ref<Eigen::Matrix3Xd> angle) const {
    const std::size_t segment = context_.segment_at(0.5 * (block.start_s + block.end_s));
    const bool rotation = context_.segments()[segment].rotation;
    int number = 0;  // of dwells or rotations before this one
    for (std::size_t k = 0; k < segment; ++k) {
      number += context_.segments()[k].rotation == rotation ? 1 : 0;
    }
    for (std::size_t k = 0; k < map_.size(); ++k) {
      const LocatedColumn& m = map_[k];
      double dt = 0.0;
      switch (m.kind) {
        case LocatedColumn::Kind::dwell: dt = !rotation && m.index == number ? c.dt : 0.0; break;
        case LocatedColumn::Kind::rotation: dt = rotation && m.index == number ? c.dt : 0.0; break;
        case LocatedColumn::Kind::after_turn:
          dt = std::min(c.since_turn_end_s, m.end_s) - std::max(c.since_turn_start_s, m.start_s);
          dt = rotation || before_its_turn_ended(block, c) ? 0.0 : std::max(0.0, dt);
          break;
        case LocatedColumn::Kind::time:
          dt = std::max(0.0, std::min(c.end_s, m.end_s) - std::max(c.start_s, m.start_s));
          break;
      }
      if (dt > 0.0) {
        (m.axis < 3 ? angle : velocity)(m.axis % 3, first_map_ + static_cast<int>(k)) = dt * map_unit(m.axis);
      }
    }
  }

  // A dwell as found may begin milliseconds before the turn has ended. What the clock of the turn before says there is no time after
  // this one, and 10 ms of a bias are a knock on the velocity: nothing that a place of the map stands for.
  bool before_its_turn_ended(const SensorBlock& block, const EffectContext& c) const {
    constexpr double apart_s = 1.0;  // a turn's end as found and as it was differ by 0.3 s at most
    const Segment& dwell = context_.segments()[context_.segment_at(0.5 * (block.start_s + block.end_s))];
    return c.since_turn_end_s > block.end_s - dwell.start_s + apart_s;
  }

  const RecordingContext& context_;
  const std::vector<Candidate>& candidates_;
  const std::vector<LocatedColumn>& map_;
  int first_map_;
};

// Carries s and writes the rows; the second navigator runs in step with that of the pass.
class RowWriter : public PassObserver {
 public:
  RowWriter(const PassInput& input, BlockSignatures& signatures, const std::vector<Candidate>& candidates,
            double start_s, SignatureRows& rows)
      : input_(input),
        navigator_(*input.data, input.parameters, input.C_nb, input.sign, input.interval_s, &signatures),
        candidates_(candidates),
        start_s_(start_s),
        rows_(rows),
        transition_(input.noise.observation, input.noise.biases, input.interval_s),
        dynamic_(transition_.count()),
        s_(Eigen::MatrixXd::Zero(dynamic_ + sensor_parameter_count, signatures.count())),
        at_epoch_(Eigen::Matrix3Xd::Zero(3, signatures.count())) {
    const double most = static_cast<double>(input.data->size()) / input.data->sample_rate_hz / input.interval_s + 2.0;
    rows.columns.resize(3 * static_cast<Eigen::Index>(most), signatures.count());
    rows.residual.resize(rows.columns.rows());
    displace(0.0);
    s_.topRows<3>() = -at_epoch_;  // where the pass begins the position was observed too
  }

  void propagated(const Interval& /*interval*/, const UdFilter& /*filter*/) override {
    navigator_.next(own_);
    Eigen::MatrixXd next = transition_.over(own_) * s_.topRows(dynamic_);
    next.topRows<9>().noalias() +=
        own_.Gamma.leftCols<sensor_parameter_count>() * s_.bottomRows<sensor_parameter_count>();
    next.topRows<9>() += own_.Gamma.rightCols(s_.cols());
    s_.topRows(dynamic_) = next;
    displace(own_.end_s - start_s_);
    if (own_.coasted) {
      s_.topRows<3>() = -at_epoch_;  // as where the pass begins
    }
    middle_s_ = 0.5 * (own_.start_s + own_.end_s);
  }

  void updated(int axis, const VectorX& h, const ScalarInnovation& innovation, const UdFilter& filter) override {
    const double scale = 1.0 / std::sqrt(innovation.variance);
    const Eigen::RowVectorXd nu = h.transpose() * s_.topRows(dynamic_) + at_epoch_.row(axis);
    rows_.columns.row(row_) = scale * nu;
    rows_.residual(row_) = scale * innovation.value;
    rows_.time_s.push_back(middle_s_);
    ++row_;
    s_.noalias() -= filter.gain() * nu;
  }

  void finish() {
    rows_.columns.conservativeResize(row_, Eigen::NoChange);
    rows_.residual.conservativeResize(row_);
    rows_.shift = s_.bottomRows<sensor_parameter_count>();
  }

 private:
  void displace(double t) {
    for (const Candidate& candidate : candidates_) {
      if (candidate.effect->displacement != nullptr) {
        auto part = at_epoch_.middleCols(candidate.first, candidate.count);
        part.setZero();
        candidate.effect->displacement(t, candidate.constant, part);
        for (int k = 0; k < candidate.count; ++k) {
          const EffectParameter& p = candidate.effect->parameters[static_cast<std::size_t>(k)];
          part.col(k) *= p.typical * p.si_per_unit;
        }
      }
    }
  }

  const PassInput& input_;
  IntervalNavigator navigator_;
  const std::vector<Candidate>& candidates_;
  double start_s_;
  SignatureRows& rows_;
  Interval own_;
  DynamicTransition transition_;
  int dynamic_;
  Eigen::MatrixXd s_;
  Eigen::Matrix3Xd at_epoch_;
  double middle_s_ = 0.0;
  Eigen::Index row_ = 0;
};

std::vector<LocatedColumn> map_columns(const RecordingContext& context) {
  using Kind = LocatedColumn::Kind;
  std::vector<LocatedColumn> all;
  const double start = context.segments().front().start_s;
  const double span = context.segments().back().end_s - start;
  for (int axis = 0; axis < 6; ++axis) {
    int dwell = 0, rotation = 0;
    for (const Segment& s : context.segments()) {
      int& number = s.rotation ? rotation : dwell;
      all.push_back({s.rotation ? Kind::rotation : Kind::dwell, number++, axis, s.start_s - start, s.end_s - start});
    }
    for (std::size_t b = 0; b + 1 < after_turn_edges.size(); ++b) {
      all.push_back({Kind::after_turn, static_cast<int>(b), axis, after_turn_edges[b], after_turn_edges[b + 1]});
    }
    for (int b = 0; b < time_bins; ++b) {
      all.push_back({Kind::time, b, axis, span * b / time_bins, span * (b + 1) / time_bins});
    }
  }
  return all;
}

// Takes the effects out block by block, spread evenly over the block's samples.
class Subtraction : public ExtraSignatures {
 public:
  Subtraction(const RecordingContext& context, const Correction& correction, AngleVelocity& theta, AngleVelocity& v)
      : signatures_(context, correction.effects, none_, static_cast<int>(correction.size.size())),
        size_(correction.size),
        data_(context.data()),
        theta_(theta),
        v_(v) {}
  int count() const override { return static_cast<int>(size_.size()); }
  bool block_ends_before(std::size_t sample) const override { return signatures_.block_ends_before(sample); }
  void block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
             Eigen::Ref<Eigen::Matrix3Xd> angle) override {
    signatures_.block(block, velocity, angle);
    const double n = static_cast<double>(block.last - block.first);
    const Vector3 dv = velocity * size_ / n;
    const Vector3 dtheta = angle * size_ / n;
    for (std::size_t i = block.first; i < block.last; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        theta_[i][axis] = data_.delta_theta[i][axis] - dtheta(static_cast<Eigen::Index>(axis));
        v_[i][axis] = data_.delta_v[i][axis] - dv(static_cast<Eigen::Index>(axis));
      }
    }
  }

 private:
  std::vector<LocatedColumn> none_;
  BlockSignatures signatures_;
  const Eigen::VectorXd& size_;
  const ImuData& data_;
  AngleVelocity& theta_;
  AngleVelocity& v_;
};

// Rows of the difference to another recording, of unit noise: half the sum of both variances is what each predicts.
void compare_with(const Eigen::VectorXd& reference, SignatureRows& rows) {
  constexpr double scale = 0.5 * std::numbers::sqrt2;
  const Eigen::Index n = std::min(rows.residual.size(), reference.size());
  const double own_square = rows.residual.squaredNorm();
  rows.residual = scale * (rows.residual.head(n) - reference.head(n)).eval();
  rows.columns = scale * rows.columns.topRows(n).eval();
  rows.time_s.resize(static_cast<std::size_t>(n));
  rows.pass.log_likelihood += 0.5 * (own_square - rows.residual.squaredNorm());
}

}  // namespace

double map_unit(int axis) { return axis < 3 ? 0.01 * units::degree_per_hour : 10.0 * units::micro_g; }

SignaturePass::SignaturePass(const RecordingContext& context, std::vector<Candidate> candidates, bool map)
    : context_(&context), candidates_(std::move(candidates)) {
  for (Candidate& candidate : candidates_) {
    candidate.first = effect_columns_;
    candidate.count = static_cast<int>(candidate.effect->parameters.size());
    effect_columns_ += candidate.count;
  }
  if (map) {
    map_ = map_columns(context);
  }
}

void Correction::add(const Effect& effect, double constant, const Eigen::VectorXd& own) {
  if (effect.sensor != nullptr) {
    const Eigen::Index first = size.size();
    effects.push_back({&effect, constant, static_cast<int>(first), static_cast<int>(own.size())});
    size.conservativeResize(first + own.size());
    size.tail(own.size()) = own;
  }
}

void add_signature(const Candidate& candidate, const EffectContext& context, Columns velocity, Columns angle) {
  if (candidate.effect->sensor == nullptr) {
    return;
  }
  candidate.effect->sensor(context, candidate.constant, velocity, angle);
  const double factor = candidate.modulation == nullptr ? 1.0 : candidate.modulation(context);
  for (int k = 0; k < candidate.count; ++k) {
    const EffectParameter& p = candidate.effect->parameters[static_cast<std::size_t>(k)];
    velocity.col(k) *= factor * p.typical * p.si_per_unit;
    angle.col(k) *= factor * p.typical * p.si_per_unit;
  }
}

std::vector<int> columns_of(const Candidate& candidate) {
  std::vector<int> columns(static_cast<std::size_t>(candidate.count));
  std::iota(columns.begin(), columns.end(), candidate.first);
  return columns;
}

std::vector<int> columns_of(const std::vector<Candidate>& candidates, std::size_t without) {
  std::vector<int> columns;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i != without) {
      const std::vector<int> own = columns_of(candidates[i]);
      columns.insert(columns.end(), own.begin(), own.end());
    }
  }
  return columns;
}

SignatureRows SignaturePass::run(const PassInput& input) {
  SignatureRows rows;
  BlockSignatures signatures(*context_, candidates_, map_, effect_columns_);
  const double start_s = context_->data().time_s.front() - 1.0 / context_->data().sample_rate_hz;
  RowWriter writer(input, signatures, candidates_, start_s, rows);
  rows.pass = run_pass(input, {}, {}, &writer);
  writer.finish();
  if (context_->reference()) {
    compare_with(context_->reference()(input.noise), rows);
  }
  rows.pass.log_likelihood += whitened_gain(context_->colour(), rows.residual);
  whiten(context_->colour(), rows.columns);
  return rows;
}

void subtract_effects(const RecordingContext& context, const PassInput& input, const Correction& correction,
                      AngleVelocity& delta_theta, AngleVelocity& delta_v) {
  Subtraction subtraction(context, correction, delta_theta, delta_v);
  IntervalNavigator navigator(*input.data, input.parameters, input.C_nb, input.sign, input.interval_s, &subtraction);
  Interval interval;
  while (navigator.next(interval)) {
  }
}

}  // namespace selfcal::diagnosis
