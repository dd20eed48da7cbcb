#include "estimator/diagnosis/linear_model.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

namespace selfcal::diagnosis {
namespace {

bool same_column(const Candidate& a, const Candidate& b) {
  return a.effect == b.effect && a.modulation == b.modulation &&
         (a.constant == b.constant || (std::isnan(a.constant) && std::isnan(b.constant)));
}

}  // namespace

PassInput OperatingPoint::pass() const {
  PassInput about = input;
  about.data = &recording.data();
  return about;
}

OperatingPoint settle(const RecordingContext& context, const OperatingPoint& from, Correction correction) {
  OperatingPoint point{from.input, CorrectedRecording(context, from.input, std::move(correction))};
  if (from.input.held) {
    return point;
  }
  PassInput about = point.pass();
  for (const double sign : {+1.0, -1.0, +1.0, -1.0}) {
    about.sign = sign;
    const PassOutput out = run_pass(about);
    about.parameters += out.mean.segment<sensor_parameter_count>(out.layout.parameters());
    about.C_nb = out.C_nb;
  }
  about.sign = 1.0;
  about.data = nullptr;
  point.input = about;
  return point;
}

LinearModel LinearModel::about(const RecordingContext& context, const OperatingPoint& point,
                               std::vector<Candidate> candidates, const std::vector<WalkTest>& walks, bool map) {
  LinearModel model;
  const std::size_t own = candidates.size();
  const Correction& taken_out = point.recording.taken_out();
  std::vector<std::size_t> where;  // of what was taken out, among the candidates or behind them
  for (const Candidate& c : taken_out.effects) {
    const auto found =
        std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& x) { return same_column(x, c); });
    where.push_back(static_cast<std::size_t>(found - candidates.begin()));
    if (found == candidates.end()) {
      candidates.push_back(c);
    }
  }
  SignaturePass pass(context, std::move(candidates), map || !walks.empty());
  for (const std::size_t k : where) {
    const std::vector<int> columns = columns_of(pass.candidates()[k]);
    model.taken_out_.insert(model.taken_out_.end(), columns.begin(), columns.end());
  }
  model.taken_out_size_ = taken_out.size;
  model.candidates_.assign(pass.candidates().begin(), pass.candidates().begin() + static_cast<std::ptrdiff_t>(own));
  model.map_ = pass.map();
  model.first_map_column_ = pass.first_map_column();
  model.linearisation_ = point.input.parameters;
  model.rows_ = pass.run(point.pass());
  model.walks_ = walks;
  model.evidence_ = model.marginalised();
  return model;
}

std::vector<int> LinearModel::columns_of_walk(const WalkTest& walk) const {
  std::vector<int> columns = walk.places;
  for (int& column : columns) {
    column += first_map_column_;
  }
  return columns;
}

Evidence LinearModel::evidence_without_walks() const {
  Evidence evidence(rows_);
  if (!taken_out_.empty()) {
    evidence.restore(taken_out_, taken_out_size_);
  }
  return evidence;
}

Evidence LinearModel::marginalised() const {
  Evidence evidence = evidence_without_walks();
  for (const WalkTest& walk : walks_) {
    evidence.marginalise(columns_of_walk(walk), walk.covariance);
  }
  return evidence;
}

void LinearModel::marginalise(const WalkTest& walk) {
  walks_.push_back(walk);
  evidence_.marginalise(columns_of_walk(walk), walk.covariance);
}

void LinearModel::marginalise(std::vector<WalkTest> walks) {
  walks_ = std::move(walks);
  evidence_ = marginalised();
}

Eigen::VectorXd LinearModel::residual() const {
  Eigen::VectorXd residual = rows_.residual;
  if (!taken_out_.empty()) {
    residual += rows_.columns(Eigen::all, taken_out_) * taken_out_size_;
  }
  return residual;
}

Eigen::VectorXd LinearModel::residual_after(const std::vector<int>& fitted, const std::vector<int>& known,
                                            const Eigen::VectorXd& known_size) const {
  Eigen::VectorXd left = residual();
  if (!fitted.empty()) {
    left -= rows_.columns(Eigen::all, fitted) * evidence_.fit(fitted).value;
  }
  if (!known.empty()) {
    left -= rows_.columns(Eigen::all, known) * known_size;
  }
  for (const WalkTest& walk : walks_) {
    const Eigen::MatrixXd Z = rows_.columns(Eigen::all, columns_of_walk(walk));
    const Eigen::MatrixXd J = Z.transpose() * Z;
    const auto n = J.rows();
    left -= Z * (walk.covariance * (Eigen::MatrixXd::Identity(n, n) + J * walk.covariance).inverse() *
                 (Z.transpose() * left));
  }
  return left;
}

double LinearModel::log_likelihood(const std::vector<int>& fitted) const {
  return rows_.pass.log_likelihood +
         0.5 * (rows_.residual.squaredNorm() - evidence_.square + evidence_.fit(fitted).gain);
}

ParameterVector LinearModel::parameters(const std::vector<int>& columns, const Eigen::VectorXd& size) const {
  const PassOutput& pass = rows_.pass;
  ParameterVector value = linearisation_ + pass.mean.segment<sensor_parameter_count>(pass.layout.parameters());
  if (!columns.empty()) {
    value += rows_.shift(Eigen::all, columns) * size;
  }
  if (!taken_out_.empty()) {
    value -= rows_.shift(Eigen::all, taken_out_) * taken_out_size_;
  }
  return value;
}

int LinearModel::append(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& shift) {
  const Eigen::Index at = rows_.columns.cols();
  rows_.columns.conservativeResize(Eigen::NoChange, at + columns.cols());
  rows_.shift.conservativeResize(Eigen::NoChange, at + columns.cols());
  rows_.columns.rightCols(columns.cols()) = columns;
  rows_.shift.rightCols(columns.cols()) = shift;
  evidence_ = marginalised();
  return static_cast<int>(at);
}

int LinearModel::append(const RecordingContext& context, const OperatingPoint& point,
                        const std::vector<Candidate>& more, const Eigen::MatrixXd& combine) {
  SignaturePass pass(context, more, false);
  const SignatureRows beside = pass.run(point.pass());
  return append(beside.columns * combine.transpose(), beside.shift * combine.transpose());
}

}  // namespace selfcal::diagnosis
