#include "estimator/diagnosis/regression/linear_model.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace selfcal::diagnosis {
namespace {

bool same_column(const Candidate& a, const Candidate& b) {
  return a.effect == b.effect && a.modulation == b.modulation &&
         (a.constant == b.constant || (std::isnan(a.constant) && std::isnan(b.constant)));
}

}  // namespace

PassInput OperatingPoint::pass(const NoiseModel& noise) const {
  PassInput about = input;
  about.data = &recording.data();
  about.noise = noise;
  return about;
}

void settle(PassInput& input) {
  if (input.held) {
    return;
  }
  for (const double sign : {+1.0, -1.0, +1.0, -1.0}) {
    input.sign = sign;
    const PassOutput out = run_pass(input);
    input.parameters += out.mean.segment<sensor_parameter_count>(out.layout.parameters());
    input.C_nb = out.C_nb;
  }
  input.sign = +1.0;
}

OperatingPoint settle(const RecordingContext& context, const OperatingPoint& from, const Hypothesis& hypothesis) {
  OperatingPoint point{from.input, CorrectedRecording(context, from.input, hypothesis.correction())};
  PassInput about = point.pass(hypothesis.noise);
  settle(about);
  point.input.parameters = about.parameters;
  point.input.C_nb = about.C_nb;
  return point;
}

LinearModel LinearModel::about(const RecordingContext& context, const OperatingPoint& point,
                               const Hypothesis& hypothesis, const std::vector<Variant>& alternatives, bool map) {
  LinearModel model;
  model.variants_ = alternatives;
  std::vector<Candidate> candidates;
  candidates.reserve(alternatives.size());
  for (const Variant& v : alternatives) {
    candidates.push_back({v.effect, v.constant, 0, 0});
  }
  const auto among = [&](const Candidate& c) {
    const auto found =
        std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& x) { return same_column(x, c); });
    const auto at = static_cast<std::size_t>(found - candidates.begin());
    if (found == candidates.end()) {
      candidates.push_back(c);
    }
    return at;
  };
  std::vector<std::size_t> of_terms, of_taken_out;
  for (const Term& t : hypothesis.terms) {
    of_terms.push_back(among({t.effect, t.constant, 0, 0}));
    if (candidates.size() > model.variants_.size()) {
      model.variants_.push_back(t);
    }
  }
  const Correction& taken_out = point.recording.taken_out();
  for (const Candidate& c : taken_out.effects) {
    of_taken_out.push_back(among(c));
  }
  SignaturePass pass(context, std::move(candidates), map);
  for (const std::size_t k : of_terms) {
    model.terms_.push_back(pass.candidates()[k]);
  }
  for (const std::size_t k : of_taken_out) {
    const std::vector<int> columns = columns_of(pass.candidates()[k]);
    model.taken_out_.insert(model.taken_out_.end(), columns.begin(), columns.end());
  }
  model.taken_out_size_ = taken_out.size;
  model.candidates_ = pass.candidates();
  model.alternatives_.assign(model.candidates_.begin(),
                             model.candidates_.begin() + static_cast<std::ptrdiff_t>(alternatives.size()));
  model.map_ = pass.map();
  model.first_map_column_ = pass.first_map_column();
  model.linearisation_ = point.input.parameters;
  model.rows_ = std::make_shared<const SignatureRows>(pass.run(point.pass(hypothesis.noise)));
  model.evidence_ = Evidence(*model.rows_);
  if (!model.taken_out_.empty()) {
    model.evidence_.restore(model.taken_out_, model.taken_out_size_);
  }
  return model;
}

std::vector<Candidate> LinearModel::terms_of(const Hypothesis& other) const {
  std::vector<Candidate> all;
  for (const Term& t : other.terms) {
    const auto found = std::find_if(variants_.begin(), variants_.end(), [&](const Variant& v) { return same(v, t); });
    assert(found != variants_.end());
    all.push_back(candidates_[static_cast<std::size_t>(found - variants_.begin())]);
  }
  return all;
}

GroupTest LinearModel::test(const Candidate& alternative) const {
  return test_group(evidence_, columns_of(alternative), columns_of(terms_));
}

Hypothesis LinearModel::fitted(Hypothesis h) const {
  const std::vector<Candidate> terms = terms_of(h);
  const Fit fit = evidence_.fit(columns_of(terms));
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Eigen::Index count = terms[i].count;
    h.terms[i].amplitude = fit.value.segment(at, count);
    h.terms[i].covariance = fit.covariance.block(at, at, count, count);
    at += count;
  }
  return h;
}

double LinearModel::log_likelihood() const {
  return rows_->pass.log_likelihood +
         0.5 * (rows_->residual.squaredNorm() - evidence_.square + evidence_.fit(columns_of(terms_)).delta_chi2);
}

Eigen::VectorXd LinearModel::residual() const {
  Eigen::VectorXd residual = rows_->residual;
  if (!taken_out_.empty()) {
    residual += rows_->columns(Eigen::all, taken_out_) * taken_out_size_;
  }
  return residual;
}

Eigen::VectorXd LinearModel::residual_after(const std::vector<int>& fitted, const std::vector<int>& known,
                                            const Eigen::VectorXd& known_size) const {
  Eigen::VectorXd left = residual();
  if (!fitted.empty()) {
    left -= rows_->columns(Eigen::all, fitted) * evidence_.fit(fitted).value;
  }
  if (!known.empty()) {
    left -= rows_->columns(Eigen::all, known) * known_size;
  }
  return left;
}

ParameterVector LinearModel::parameters(const std::vector<int>& columns, const Eigen::VectorXd& size) const {
  const PassOutput& pass = rows_->pass;
  ParameterVector value = linearisation_ + pass.mean.segment<sensor_parameter_count>(pass.layout.parameters());
  if (!columns.empty()) {
    value += rows_->shift(Eigen::all, columns) * size;
  }
  if (!taken_out_.empty()) {
    value -= rows_->shift(Eigen::all, taken_out_) * taken_out_size_;
  }
  return value;
}

ParameterMatrix LinearModel::covariance() const {
  const int at = rows_->pass.layout.parameters();
  return rows_->pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(at, at);
}

int LinearModel::append(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& shift) {
  const Eigen::Index at = rows_->columns.cols(), count = columns.cols();
  evidence_.append(rows_->columns.transpose() * columns, columns.transpose() * columns,
                   columns.transpose() * residual());
  auto rows = std::make_shared<SignatureRows>(*rows_);
  rows->columns.conservativeResize(Eigen::NoChange, at + count);
  rows->shift.conservativeResize(Eigen::NoChange, at + count);
  rows->columns.rightCols(count) = columns;
  rows->shift.rightCols(count) = shift;
  rows_ = std::move(rows);
  return static_cast<int>(at);
}

}  // namespace selfcal::diagnosis
