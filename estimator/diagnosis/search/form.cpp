#include "estimator/diagnosis/search/form.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// An equation that is right to some per cent: 5 % of an effect that shows at 10 sigma is half a sigma.
constexpr double some_per_cent = 0.05;
// Relaxations and warm-ups are spectra of time constants: two of 70 % and 30 % are as common as a single one
// (Ferry, Viscoelastic Properties of Polymers, 1980). A slow curve in time resembles every other, so it gets less room.
constexpr double of_a_spectrum = 0.3, of_a_slow_curve = 0.1;
// Down to a hundredth: what sets in with a delay of a second lacks a second.
constexpr std::array<double, 7> constant_ratios = {0.01, 0.03, 0.1, 0.3, 0.6, 1.7, 3.0};
// What creeps after a turn may go on through the next one, or be held by it.
constexpr double held_by_turns = 1.0;

double in_turns(const EffectContext& c) { return c.turning ? 1.0 : 0.0; }
double time(const EffectContext& c) { return (c.start_s + c.end_s) / c.duration_s - 1.0; }  // -1 to 1
template <int axis>
double force(const EffectContext& c) {
  return c.u(axis);
}
template <int axis>
double force_square(const EffectContext& c) {
  return c.u(axis) * c.u(axis);
}
// Of a gimbal angle; without read-outs the recording says nothing of it.
double angle_function(double (*function)(double), double angle) { return std::isnan(angle) ? 0.0 : function(angle); }
double sine_outer(const EffectContext& c) { return angle_function(std::sin, c.outer); }
double cosine_outer(const EffectContext& c) { return angle_function(std::cos, c.outer); }
double sine_inner(const EffectContext& c) { return angle_function(std::sin, c.inner); }
double cosine_inner(const EffectContext& c) { return angle_function(std::cos, c.inner); }
double rate(const EffectContext& c) {
  constexpr double usual = 20.0 * units::degree;  // a second: 90 deg in some five
  return c.rate.norm() / usual;
}

// What leaves other slow curves is one.
bool slow_curve(const Effect& e) { return e.lack_of_fit != nullptr && !e.lack_of_fit->needs_gimbal; }

}  // namespace

std::vector<FormCandidate> forms_of(const Candidate& named) {
  std::vector<FormCandidate> all;
  const Effect& effect = *named.effect;
  if (effect.sensor == nullptr || effect.data_fault != nullptr) {
    return all;
  }
  const auto modulated = [&](FormKind kind, double most, Modulation by) {
    all.push_back({kind, most, {named.effect, named.constant, 0, 0, by}});
  };
  if (!std::isnan(named.constant)) {
    for (const double ratio : constant_ratios) {
      all.push_back({FormKind::constants,
                     slow_curve(effect) ? of_a_slow_curve : of_a_spectrum,
                     {named.effect, named.constant * ratio, 0, 0}});
    }
  }
  modulated(FormKind::in_turns, effect.since_turns ? held_by_turns : some_per_cent, in_turns);
  modulated(FormKind::time, some_per_cent, time);
  for (const Modulation by : {force<0>, force<1>, force<2>, force_square<0>, force_square<1>, force_square<2>,
                              sine_outer, cosine_outer, sine_inner, cosine_inner}) {
    modulated(FormKind::attitude, some_per_cent, by);
  }
  modulated(FormKind::rate, some_per_cent, rate);
  return all;
}

namespace {

constexpr std::array<double, 4> scales = {0.1, 0.3, 1.0, 3.0};  // of `most`
// Fall of -2 log likelihood from which a family is opened. With one scale at the edge of its range the null distribution is half a
// chi-squared of one degree: some fifteen families, one in thirty recordings opens one for nothing, and loses a little power.
constexpr double worth_opening = 9.0;

// -2 log likelihood falls by b'S (I + SJS)^-1 S b - log|I + SJS| when columns ~ N(0, S^2) join.
double fall(const Normal& n, const Eigen::VectorXd& sigma) {
  const auto size = sigma.size();
  const Eigen::MatrixXd A =
      Eigen::MatrixXd::Identity(size, size) + sigma.asDiagonal() * n.information * sigma.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> solver(A);
  const Eigen::VectorXd c = sigma.cwiseProduct(n.score);
  const double log_det = 2.0 * Eigen::MatrixXd(solver.matrixL()).diagonal().array().log().sum();
  return c.dot(solver.solve(c)) - log_det;
}

Eigen::VectorXd sigmas(const std::vector<FormFamily>& families) {
  std::vector<double> all;
  for (const FormFamily& f : families) {
    all.insert(all.end(), f.columns.size(), f.scale * f.most);
  }
  return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

std::vector<int> columns_of(const std::vector<FormFamily>& families) {
  std::vector<int> all;
  for (const FormFamily& f : families) {
    all.insert(all.end(), f.columns.begin(), f.columns.end());
  }
  return all;
}

// Opens the family that gains most, at its best scale, the open ones as they are; false: none is worth it.
bool open_best(const Normal& n, std::vector<FormFamily>& families) {
  const double now = fall(n, sigmas(families));
  double best = now + worth_opening;
  std::size_t at = families.size();
  double scale = 0.0;
  for (std::size_t k = 0; k < families.size(); ++k) {
    if (families[k].scale > 0.0) {
      continue;
    }
    for (const double s : scales) {
      families[k].scale = s;
      const double found = fall(n, sigmas(families));
      if (found > best) {
        best = found;
        at = k;
        scale = s;
      }
    }
    families[k].scale = 0.0;
  }
  if (at < families.size()) {
    families[at].scale = scale;
  }
  return at < families.size();
}

}  // namespace

OpenForms open_forms(const Evidence& evidence, std::vector<FormFamily> families, const std::vector<int>& named) {
  OpenForms open;
  if (families.empty()) {
    return open;
  }
  const Normal all = evidence.given(columns_of(families), named);
  while (open_best(all, families)) {
  }
  std::erase_if(families, [](const FormFamily& f) { return f.scale == 0.0; });
  if (families.empty()) {
    return open;
  }
  open.columns = columns_of(families);
  open.sigma = sigmas(families);
  const Normal n = evidence.given(open.columns, named);
  open.log_likelihood = 0.5 * fall(n, open.sigma);
  const auto size = open.sigma.size();
  const Eigen::MatrixXd A =
      Eigen::MatrixXd::Identity(size, size) + open.sigma.asDiagonal() * n.information * open.sigma.asDiagonal();
  open.covariance = open.sigma.asDiagonal() * A.inverse() * open.sigma.asDiagonal();
  open.mean = open.covariance * n.score;
  open.square = 2.0 * open.mean.dot(n.score) - open.mean.dot(n.information * open.mean);
  open.families = std::move(families);
  return open;
}

// The scale is 0 with half of the probability, else each of `scales` with the same; Gaussian posteriors, and what they shift.
ParameterMatrix closed_forms(const Evidence& given, const std::vector<FormFamily>& closed,
                             const std::vector<int>& named, const Eigen::MatrixXd& shift) {
  ParameterMatrix sum = ParameterMatrix::Zero();
  for (const FormFamily& f : closed) {
    const Normal n = given.given(f.columns, named);
    const Eigen::MatrixXd S = shift(Eigen::all, f.columns);
    const auto size = static_cast<Eigen::Index>(f.columns.size());
    double weights = 1.0;
    ParameterMatrix spread = ParameterMatrix::Zero();
    for (const double s : scales) {
      const double v = s * f.most;
      const double gained = fall(n, Eigen::VectorXd::Constant(size, v));
      if (s > 1.0 || gained > worth_opening) {
        continue;  // more than the usual only where the data ask for it; what they ask for is open, or was refused
      }
      const double weight = std::exp(0.5 * gained) / 3.0;
      const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(size, size) + v * v * n.information;
      const Eigen::MatrixXd covariance = v * v * A.inverse();
      const Eigen::VectorXd mean = covariance * n.score;
      weights += weight;
      spread += weight * S * (covariance + mean * mean.transpose()) * S.transpose();
    }
    sum += spread / weights;
  }
  return sum;
}

}  // namespace selfcal::diagnosis
