#include "estimator/discovery/column_pass.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace selfcal::discovery {
namespace {

constexpr Eigen::Index batch_rows = 192;

class Carrier {
 public:
  Carrier(const PassInput& input, ColumnSource& source, ColumnSums& sums, RowSink* sink)
      : navigator_(*input.data, input.parameters, input.C_nb, input.sign, input.interval_s, &source),
        source_(source),
        sums_(sums),
        sink_(sink),
        start_s_(input.data->time_s.front() - 1.0 / input.data->sample_rate_hz),
        transition_(input.noise.observation, input.noise.biases, input.interval_s),
        dynamic_(transition_.count()),
        n_(source.count()),
        s_(Eigen::MatrixXd::Zero(dynamic_ + sensor_parameter_count, n_)),
        batch_(Eigen::MatrixXd::Zero(batch_rows, n_)),
        batch_residual_(Eigen::VectorXd::Zero(batch_rows)) {
    sums_.information = Eigen::MatrixXd::Zero(n_, n_);
    sums_.score = Eigen::VectorXd::Zero(n_);
    if (sink_ != nullptr) {
      const double most = static_cast<double>(input.data->size()) / input.data->sample_rate_hz / input.interval_s + 2.0;
      sink_->columns.resize(3 * static_cast<Eigen::Index>(most), n_);
      sink_->residual.resize(sink_->columns.rows());
      sink_->time_s.clear();
    }
  }

  void propagate() {
    navigator_.next(own_);
    active_ = std::min(n_, source_.active(own_.end_s - start_s_));
    next_.noalias() = transition_.over(own_) * s_.topLeftCorner(dynamic_, active_);
    next_.topRows<9>().noalias() +=
        own_.Gamma.leftCols<sensor_parameter_count>() * s_.bottomLeftCorner(sensor_parameter_count, active_);
    next_.topRows<9>() += own_.Gamma.middleCols(sensor_parameter_count, active_);
    s_.topLeftCorner(dynamic_, active_) = next_;
    middle_s_ = 0.5 * (own_.start_s + own_.end_s);
  }

  void update(const VectorX& h, const ScalarInnovation& innovation, const VectorX& gain) {
    const double scale = 1.0 / std::sqrt(innovation.variance);
    auto s = s_.leftCols(active_);
    nu_.noalias() = h.transpose() * s.topRows(dynamic_);
    batch_.row(filled_).head(active_) = scale * nu_;
    batch_residual_(filled_) = scale * innovation.value;
    if (sink_ != nullptr) {
      sink_->columns.row(row_).head(active_) = scale * nu_;
      sink_->columns.row(row_).tail(n_ - active_).setZero();
      sink_->residual(row_) = scale * innovation.value;
      sink_->time_s.push_back(middle_s_);
    }
    ++row_;
    ++filled_;
    s.noalias() -= gain * nu_;
    if (filled_ == batch_rows) {
      flush();
    }
  }

  void finish() {
    flush();
    sums_.information = sums_.information.selfadjointView<Eigen::Lower>();
    sums_.rows = static_cast<double>(row_);
    sums_.shift = s_.bottomRows<sensor_parameter_count>();
    if (sink_ != nullptr) {
      sink_->columns.conservativeResize(row_, Eigen::NoChange);
      sink_->residual.conservativeResize(row_);
    }
  }

 private:
  void flush() {
    const auto Z = batch_.topLeftCorner(filled_, active_);
    const auto r = batch_residual_.head(filled_);
    if (active_ > 0 && filled_ > 0) {
      sums_.information.topLeftCorner(active_, active_).selfadjointView<Eigen::Lower>().rankUpdate(Z.transpose());
      sums_.score.head(active_).noalias() += Z.transpose() * r;
    }
    sums_.square += r.squaredNorm();
    batch_.topRows(filled_).setZero();
    filled_ = 0;
  }

  IntervalNavigator navigator_;
  ColumnSource& source_;
  ColumnSums& sums_;
  RowSink* sink_;
  double start_s_, middle_s_ = 0.0;
  DynamicTransition transition_;
  int dynamic_, n_, active_ = 0;
  Interval own_;
  Eigen::MatrixXd s_, next_, batch_;
  Eigen::VectorXd batch_residual_;
  Eigen::RowVectorXd nu_;
  Eigen::Index filled_ = 0, row_ = 0;
};

class Tracer : public PassObserver {
 public:
  explicit Tracer(PassTrace& trace) : trace_(trace) {}
  void propagated(const Interval& /*interval*/, const UdFilter& /*filter*/) override { trace_.observed.push_back(0); }
  void updated(int axis, const VectorX& h, const ScalarInnovation& innovation, const UdFilter& filter) override {
    trace_.h[static_cast<std::size_t>(axis)] = h;
    trace_.updates.push_back({axis, innovation, filter.gain()});
    ++trace_.observed.back();
  }

 private:
  PassTrace& trace_;
};

}  // namespace

Eigen::MatrixXd solve_scaled(const Eigen::MatrixXd& information, const Eigen::MatrixXd& b) {
  // Nearer than this to the span of the others a column is collinear with them.
  constexpr double least_left = 1e-9;
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd A = scale.asDiagonal() * information * scale.asDiagonal();
  A.diagonal().array() += least_left;
  return scale.asDiagonal() * A.ldlt().solve(scale.asDiagonal() * b);
}

ColumnSums project_out(const ColumnSums& sums, int first, int count, RowSink* rows) {
  const auto n = static_cast<int>(sums.score.size());
  std::vector<int> stay, out;
  for (int k = 0; k < n; ++k) {
    (k >= first && k < first + count ? out : stay).push_back(k);
  }
  const Eigen::MatrixXd G = sums.information(out, out);
  const auto solve = [&G](const Eigen::MatrixXd& b) { return solve_scaled(G, b); };
  const Eigen::MatrixXd cross = sums.information(out, stay), taken = solve(cross);
  const Eigen::VectorXd score = sums.score(out), value = solve(score);
  const Eigen::MatrixXd shift = sums.shift(Eigen::all, out);
  ColumnSums left;
  left.information = sums.information(stay, stay) - cross.transpose() * taken;
  left.score = sums.score(stay) - cross.transpose() * value;
  left.square = sums.square - score.dot(value);
  left.rows = sums.rows;
  left.log_determinant = sums.log_determinant;
  left.shift = sums.shift(Eigen::all, stay) - shift * taken;
  left.pass = sums.pass;
  const int parameters = sums.pass.layout.parameters();
  left.pass.mean.segment<sensor_parameter_count>(parameters) += shift * value;
  left.pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(parameters, parameters) +=
      shift * solve(shift.transpose());
  if (rows != nullptr) {
    const Eigen::MatrixXd of_out = rows->columns(Eigen::all, out);
    rows->columns = rows->columns(Eigen::all, stay) - of_out * taken;
    rows->residual -= of_out * value;
  }
  return left;
}

PassTrace trace_pass(const PassInput& input, const std::stop_token& stop) {
  PassTrace trace;
  Tracer tracer(trace);
  trace.pass = run_pass(input, {}, stop, &tracer);
  return trace;
}

ColumnSums run_columns(const PassInput& input, const PassTrace& trace, ColumnSource& source,
                       const std::stop_token& stop, RowSink* rows) {
  ColumnSums sums;
  Carrier carrier(input, source, sums, rows);
  auto update = trace.updates.begin();
  for (const int observed : trace.observed) {
    if (stop.stop_requested()) {
      break;
    }
    carrier.propagate();
    for (int k = 0; k < observed; ++k, ++update) {
      carrier.update(trace.h[static_cast<std::size_t>(update->axis)], update->innovation, update->gain);
      sums.log_determinant += std::log(update->innovation.variance);
    }
  }
  carrier.finish();
  sums.pass = trace.pass;
  return sums;
}

}  // namespace selfcal::discovery
