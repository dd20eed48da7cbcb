// Columns of the catalogue's effects along one recording, for a pass that carries laws beside them.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "estimator/diagnosis/effects/effect.hpp"
#include "estimator/diagnosis/regression/recording_context.hpp"
#include "estimator/discovery/column_pass.hpp"

namespace selfcal::discovery {

// An effect on one recording, as it is fitted so far.
struct EffectTerm {
  const diagnosis::Effect* effect = nullptr;
  double constant = NAN;       // NaN: none
  Eigen::VectorXd size;        // [coefficients] in typical sizes
  bool constant_free = false;  // has a column: the derivative by the constant's logarithm, at this size

  int count() const { return static_cast<int>(size.size()) + (constant_free ? 1 : 0); }
};

// The coefficients of each term in turn, per typical size, and behind them the constant that is free. Sensors' effects only.
class EffectColumns : public ColumnSource {
 public:
  // Both must outlive it.
  EffectColumns(const diagnosis::RecordingContext& context, std::span<const EffectTerm> terms);
  int count() const override { return count_; }
  int active(double /*time_s*/) const override { return count_; }
  bool block_ends_before(std::size_t sample) const override { return context_.divides(sample); }
  void block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
             Eigen::Ref<Eigen::Matrix3Xd> angle) override;

 private:
  const diagnosis::RecordingContext& context_;
  std::span<const EffectTerm> terms_;
  int count_ = 0;
};

// The columns of one source, active from the start, and behind them those of another one that divides the recording alike. Both must
// outlive it.
class TwoSources : public ColumnSource {
 public:
  TwoSources(ColumnSource& first, ColumnSource& second) : first_(first), second_(second) {}
  int count() const override { return first_.count() + second_.count(); }
  int active(double time_s) const override { return first_.count() + second_.active(time_s); }
  bool block_ends_before(std::size_t sample) const override { return first_.block_ends_before(sample); }
  void block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
             Eigen::Ref<Eigen::Matrix3Xd> angle) override;

 private:
  ColumnSource &first_, &second_;
};

// run_columns with the effects' coefficients, and constants that are free, projected out of everything. `context`: of the recording that
// `trace` is of.
ColumnSums run_beside(std::span<const EffectTerm> effects, const diagnosis::RecordingContext& context,
                      const PassInput& input, const PassTrace& trace, ColumnSource& columns,
                      const std::stop_token& stop = {}, RowSink* rows = nullptr);

}  // namespace selfcal::discovery
