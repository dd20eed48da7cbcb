#include "estimator/discovery/effect_columns.hpp"

#include <cmath>

#include "estimator/diagnosis/regression/signature_pass.hpp"

namespace selfcal::discovery {
namespace {

// Step of the derivative by a constant's logarithm: its square is the error.
constexpr double derivative_step = 1e-3;

struct Integrals {
  Eigen::Matrix3Xd velocity, angle;
};

Integrals integrals(const EffectTerm& term, double constant, const diagnosis::EffectContext& context) {
  const Eigen::Index n = term.size.size();
  Integrals i{Eigen::Matrix3Xd::Zero(3, n), Eigen::Matrix3Xd::Zero(3, n)};
  diagnosis::add_signature({term.effect, constant, 0, static_cast<int>(n)}, context, i.velocity, i.angle);
  return i;
}

}  // namespace

EffectColumns::EffectColumns(const diagnosis::RecordingContext& context, std::span<const EffectTerm> terms)
    : context_(context), terms_(terms) {
  for (const EffectTerm& term : terms) {
    count_ += term.count();
  }
}

void EffectColumns::block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
                          Eigen::Ref<Eigen::Matrix3Xd> angle) {
  const diagnosis::EffectContext context = context_.of(block);
  Eigen::Index at = 0;
  for (const EffectTerm& term : terms_) {
    const Eigen::Index n = term.size.size();
    const Integrals here = integrals(term, term.constant, context);
    velocity.middleCols(at, n) += here.velocity;
    angle.middleCols(at, n) += here.angle;
    if (term.constant_free) {
      const Integrals up = integrals(term, term.constant * std::exp(derivative_step), context);
      const Integrals down = integrals(term, term.constant * std::exp(-derivative_step), context);
      velocity.col(at + n) += (up.velocity - down.velocity) * term.size / (2.0 * derivative_step);
      angle.col(at + n) += (up.angle - down.angle) * term.size / (2.0 * derivative_step);
    }
    at += term.count();
  }
}

void TwoSources::block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
                       Eigen::Ref<Eigen::Matrix3Xd> angle) {
  first_.block(block, velocity.leftCols(first_.count()), angle.leftCols(first_.count()));
  second_.block(block, velocity.rightCols(second_.count()), angle.rightCols(second_.count()));
}

ColumnSums run_beside(std::span<const EffectTerm> effects, const diagnosis::RecordingContext& context,
                      const PassInput& input, const PassTrace& trace, ColumnSource& columns,
                      const std::stop_token& stop, RowSink* rows) {
  if (effects.empty()) {
    return run_columns(input, trace, columns, stop, rows);
  }
  EffectColumns of_effects(context, effects);
  TwoSources both(of_effects, columns);  // those that begin later stand behind
  return project_out(run_columns(input, trace, both, stop, rows), 0, of_effects.count(), rows);
}

}  // namespace selfcal::discovery
