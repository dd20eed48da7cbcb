#include "estimator/diagnosis/poses/attitude_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/geometry/earth.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

class Columns : public RowColumns {
 public:
  Columns(const AttitudeModel& model, const AttitudeLayout& layout) : model_(model), layout_(layout) {}
  Eigen::Index size() const override { return layout_.size(); }
  void fill(const AttitudeRow& row, Eigen::Ref<Eigen::MatrixXd> J) const override {
    J.setZero();
    for (Eigen::Index c = 0; c < layout_.axes; ++c) {
      for (Eigen::Index l = 0; l < 3; ++l) {
        J.middleCols<3>(layout_.W() + 3 * c) += row.by_W.middleCols<3>(3 * l) * model_.seen(l, c);
      }
    }
    J.middleCols<3>(layout_.bias()) = row.by_bias;
    J.middleCols<3>(layout_.slope()) = row.by_bias * (row.time_s - model_.middle_s);
    J.middleCols<3>(layout_.earth()) = -row.length_s * Matrix3::Identity();
    J.col(layout_.delay()) = row.rate_before - row.rate;
    J.col(layout_.drift()) =
        (row.rate_before * (row.stamp_s - row.length_s - model_.middle_s)) - row.rate * (row.stamp_s - model_.middle_s);
    J.col(layout_.smoothing()) = row.by_smoothing;
    const AttitudeModel::At at = model_.walk_at(row.time_s);
    add_node(at.node, (1.0 - at.share) * row.by_bias, J);
    add_node(at.node + 1, at.share * row.by_bias, J);
  }

 private:
  void add_node(Eigen::Index node, const Matrix3& by, Eigen::Ref<Eigen::MatrixXd> J) const {
    const Eigen::Index middle = layout_.nodes / 2;
    if (node != middle) {
      J.middleCols<3>(layout_.walk() + 3 * (node < middle ? node : node - 1)) += by;
    }
  }
  const AttitudeModel& model_;
  const AttitudeLayout& layout_;
};

// Precision of the walk's nodes for unit density: increments over `node_s`, the middle one pinned.
Eigen::MatrixXd precision_of_walk(const AttitudeLayout& layout, double node_s) {
  const Eigen::Index n = layout.nodes - 1, middle = layout.nodes / 2;
  Eigen::MatrixXd difference = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (k != middle) {
      difference(k, k < middle ? k : k - 1) = -1.0;
    }
    if (k + 1 != middle) {
      difference(k, k + 1 < middle ? k + 1 : k) = 1.0;
    }
  }
  const Eigen::MatrixXd one = difference.transpose() * difference / node_s;
  Eigen::MatrixXd three = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      three.block<3, 3>(3 * i, 3 * j) = one(i, j) * Matrix3::Identity();
    }
  }
  return three;
}

// Mean and covariance of the parameters less where they are now; Earth's rate and walk absolute.
struct Posterior {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  double walk_psd = 0.0, log_evidence = 0.0;
};

struct Candidate {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  double log_evidence = 0.0;
};

// Of answers that exclude each other, by their evidence.
Candidate mix(const std::vector<Candidate>& all) {
  double best = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (const Candidate& c : all) {
    best = std::max(best, c.log_evidence);
  }
  Candidate mixed;
  mixed.mean = Eigen::VectorXd::Zero(all.front().mean.size());
  for (const Candidate& c : all) {
    const double weight = std::exp(c.log_evidence - best);
    sum += weight;
    mixed.mean += weight * c.mean;
  }
  mixed.mean /= sum;
  mixed.covariance = Eigen::MatrixXd::Zero(mixed.mean.size(), mixed.mean.size());
  for (const Candidate& c : all) {
    const Eigen::VectorXd off = c.mean - mixed.mean;
    mixed.covariance += std::exp(c.log_evidence - best) / sum * (c.covariance + off * off.transpose());
  }
  mixed.log_evidence = best + std::log(sum);
  return mixed;
}

Candidate solve(const Eigen::MatrixXd& H, const Eigen::VectorXd& h, const Eigen::MatrixXd& prior) {
  const Eigen::MatrixXd sum = H + prior;
  const Eigen::VectorXd scale = sum.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> factor(Eigen::MatrixXd(scale.asDiagonal() * sum * scale.asDiagonal()));
  Candidate c;
  c.covariance = scale.asDiagonal() * factor.solve(Eigen::MatrixXd(scale.asDiagonal()));
  c.mean = scale.cwiseProduct(factor.solve(scale.cwiseProduct(h)));
  c.log_evidence = 0.5 * h.dot(c.mean) + scale.array().log().sum() -
                   Eigen::VectorXd(Eigen::MatrixXd(factor.matrixL()).diagonal()).array().log().sum();
  return c;
}

Eigen::VectorXd weak_prior(const AttitudeModel& model, const AttitudeLayout& layout) {
  Eigen::VectorXd sigma(layout.walk());
  const double gain = 1.0 / std::cbrt(std::abs(model.W.determinant()));  // raw per rad/s
  constexpr double scale = 0.5, rate = 1.0, slope = 0.01, delay = 1.0, drift = 0.01, smoothing = 1e-3;
  sigma.segment(layout.W(), 3 * layout.axes).setConstant(scale / gain);
  sigma.segment<3>(layout.bias()).setConstant(rate * gain);
  sigma.segment<3>(layout.slope()).setConstant(slope * gain);
  sigma.segment<3>(layout.earth()).setConstant(earth::rotation_rate);
  sigma(layout.delay()) = delay;
  sigma(layout.drift()) = drift;
  sigma(layout.smoothing()) = smoothing;
  return sigma.cwiseAbs2().cwiseInverse();
}

Posterior posterior_of(const AttitudeModel& model, const AttitudeLayout& layout, const AttitudeInformation& info,
                       double walk_unit) {
  const Eigen::Index walks = 3 * (layout.nodes - 1), fixed = layout.walk();
  Eigen::VectorXd now = Eigen::VectorXd::Zero(layout.size());
  now.segment<3>(layout.earth()) = model.earth;
  const Eigen::Index middle = layout.nodes / 2;
  for (Eigen::Index node = 0; node < layout.nodes; ++node) {
    if (node != middle) {
      now.segment<3>(fixed + 3 * (node < middle ? node : node - 1)) = model.walk.col(node);
    }
  }
  const Eigen::VectorXd h = info.h + info.H * now;
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(layout.size(), layout.size());
  prior.diagonal().head(fixed) = weak_prior(model, layout);
  const Eigen::MatrixXd walk = precision_of_walk(layout, model.node_s);
  std::vector<Candidate> all;
  std::vector<double> densities{0.0};
  constexpr int octaves = 11;
  constexpr double least_walk = 0.05;
  for (int k = 0; k < octaves; ++k) {
    densities.push_back(std::ldexp(least_walk * least_walk * walk_unit, 2 * k));
  }
  double best = -std::numeric_limits<double>::infinity();
  Posterior found;
  for (const double density : densities) {
    Candidate c;
    if (density == 0.0) {
      c = solve(info.H.topLeftCorner(fixed, fixed), h.head(fixed), prior.topLeftCorner(fixed, fixed));
      c.mean.conservativeResizeLike(Eigen::VectorXd::Zero(layout.size()));
      Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(layout.size(), layout.size());
      whole.topLeftCorner(fixed, fixed) = c.covariance;
      c.covariance = whole;
      c.log_evidence += std::log(static_cast<double>(densities.size() - 1));  // as likely before as all walks together
    } else {
      prior.bottomRightCorner(walks, walks) = walk / density;
      c = solve(info.H, h, prior);
      c.log_evidence -= 0.5 * static_cast<double>(walks) * std::log(density * model.node_s);
    }
    if (c.log_evidence > best) {
      best = c.log_evidence;
      found.walk_psd = density;
    }
    all.push_back(std::move(c));
  }
  const Candidate mixed = mix(all);
  const double about_now = now.dot(info.h) + 0.5 * now.dot(info.H * now);  // that of residuals of 0 instead of these
  return {mixed.mean, mixed.covariance, found.walk_psd, mixed.log_evidence - about_now};
}

// Steps in sigma, the largest.
double move(const Posterior& posterior, const AttitudeLayout& layout, AttitudeModel& model) {
  const Eigen::VectorXd& x = posterior.mean;
  Eigen::VectorXd step = x.head(layout.walk());
  step.segment<3>(layout.earth()) -= model.earth;
  for (Eigen::Index c = 0; c < layout.axes; ++c) {
    model.W += x.segment<3>(layout.W() + 3 * c) * model.seen.col(c).transpose();
  }
  model.bias += x.segment<3>(layout.bias());
  model.slope += x.segment<3>(layout.slope());
  model.earth = x.segment<3>(layout.earth());
  model.delay_s += x(layout.delay());
  model.drift += x(layout.drift());
  model.smoothing += x(layout.smoothing());
  const Eigen::Index middle = layout.nodes / 2;
  for (Eigen::Index node = 0; node < layout.nodes; ++node) {
    if (node != middle) {
      model.walk.col(node) = x.segment<3>(layout.walk() + 3 * (node < middle ? node : node - 1));
    }
  }
  return (step.array() / posterior.covariance.diagonal().head(layout.walk()).array().sqrt()).abs().maxCoeff();
}

// Values that jump are not used; several in a row are another frame, or a body that was gone: the piece ends before them.
void set_aside(std::vector<AttitudeRow>& rows, const AttitudeNoise& noise, Used& used) {
  used.assign(rows.size(), true);
  const Innovations all = innovations_of(rows, used, noise);
  std::vector<double> sizes;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    sizes.push_back(all.value[k].squaredNorm() / all.variance[k]);
  }
  std::vector<double> sorted = sizes;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  constexpr double median = 2.366, far = 45.0, longest = 5.0;  // chi-squared of 3: beyond `far` one of 1e9
  const double limit = far * std::max(1e-12, *middle / median);
  LevelFilter filter(noise);
  Vector3 z = Vector3::Zero(), level = z, error = z;
  std::vector<std::size_t> in_a_row;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].begins) {
      filter.begin();
      z = level = error = Vector3::Zero();
      in_a_row.clear();
    }
    z += rows[k].more;
    const LevelFilter::Step step = filter.predict(rows[k].length_s);
    error *= step.keeps;
    const Vector3 innovation = z - level - error;
    if (innovation.squaredNorm() <= limit * step.variance) {
      filter.update(step);
      level += step.level * innovation;
      error += step.error * innovation;
      in_a_row.clear();
      continue;
    }
    used[k] = false;
    in_a_row.push_back(k);
    if (rows[k].held || static_cast<double>(in_a_row.size()) >= longest) {
      if (k + 1 < rows.size()) {
        rows[k + 1].begins = true;
      }
    }
  }
}

// Before anything is known of the noise: rows far beyond what rows usually show end a piece.
void set_aside_roughly(std::vector<AttitudeRow>& rows, Used& used) {
  std::vector<double> sizes;
  sizes.reserve(rows.size());
  for (const AttitudeRow& row : rows) {
    sizes.push_back(row.more.norm());
  }
  std::vector<double> sorted = sizes;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  constexpr double far = 20.0;
  used.assign(rows.size(), true);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (sizes[k] > far * *middle) {
      used[k] = false;
      if (k + 1 < rows.size()) {
        rows[k + 1].begins = true;
      }
    }
  }
}

// Enlarges sigma of what the parts of the log contradict each other about.
double enlarge(const AttitudeInformation& info, const Eigen::MatrixXd& whole, Eigen::MatrixXd& covariance) {
  const Eigen::MatrixXd shifts = whole.topRows(covariance.rows()) * info.scores;
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(covariance.rows());
  constexpr double significance = 1e-3;
  for (Eigen::Index k = 0; k < covariance.rows(); ++k) {
    const Eigen::VectorXd along = whole.row(k).transpose();
    const double expected = along.dot(info.H * along);
    const double seen = shifts.row(k).squaredNorm();
    // A few parts hold most of what is known: as many degrees of freedom.
    const double fourth = shifts.row(k).array().pow(4).sum();
    const double degrees = fourth > 0.0 ? std::max(1.0, 3.0 * seen * seen / fourth) : 1.0;
    if (expected > 0.0 && log_chi_squared_tail(degrees * seen / expected, degrees) < std::log(significance)) {
      factor(k) = std::sqrt(seen / expected);
    }
  }
  covariance = factor.asDiagonal() * covariance * factor.asDiagonal();
  return factor.maxCoeff();
}

void set_nodes(const GyroTrack& track, AttitudeModel& model, AttitudeLayout& layout) {
  const double duration = track.time_s.back() - track.time_s.front();
  constexpr double node_s = 20.0, most = 24.0;
  const Eigen::Index pieces = 2 * static_cast<Eigen::Index>(std::clamp(duration / node_s / 2.0, 1.0, most / 2.0));
  layout.nodes = pieces + 1;
  layout.axes = model.seen.cols();
  model.walk = Eigen::MatrixXd::Zero(3, layout.nodes);
  model.begin_s = track.time_s.front();
  model.node_s = duration / static_cast<double>(pieces);
  model.middle_s = 0.5 * (track.time_s.front() + track.time_s.back());
}

// Mean over the log: the slope is none of it, the walk is.
void tell_mean_bias(const Eigen::MatrixXd& covariance, AttitudeFit& fit) {
  const Eigen::Index middle = fit.layout.nodes / 2;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, covariance.cols());
  J.middleCols<3>(fit.layout.bias()).setIdentity();
  fit.mean_bias = fit.model.bias;
  for (Eigen::Index node = 0; node < fit.layout.nodes; ++node) {
    const bool at_an_end = node == 0 || node == fit.layout.nodes - 1;
    const double share = (at_an_end ? 0.5 : 1.0) / static_cast<double>(fit.layout.nodes - 1);
    fit.mean_bias += share * fit.model.walk.col(node);
    if (node != middle) {
      const Eigen::Index at = fit.layout.walk() + 3 * (node < middle ? node : node - 1);
      J.middleCols<3>(at) = share * Matrix3::Identity();
    }
  }
  fit.mean_bias_sigma = (J * covariance * J.transpose()).diagonal().cwiseSqrt();
}

void count_lost(AttitudeFit& fit) {
  for (std::size_t k = 0; k < fit.rows.size(); ++k) {
    if (!fit.used[k] && fit.rows[k].held) {
      ++fit.held;
      fit.held_s += fit.rows[k].length_s;
    } else if (!fit.used[k]) {
      ++fit.left_out;
    }
  }
}

// What a node's bias is known to by white noise alone: a walk is seen if it goes as far in as long. Raw^2/s.
double walk_unit(const AttitudeFit& fit) {
  const double gain = 1.0 / std::cbrt(std::abs(fit.model.W.determinant()));
  constexpr double least = 1e-300;
  return std::max(least, fit.noise.walk_psd * gain * gain / (fit.model.node_s * fit.model.node_s));
}

// The gyros' white noise, which a bias is known by, is itself known by a few hundred of its times at best: marginalised.
Posterior averaged(const AttitudeFit& fit, const Posterior& best) {
  std::vector<Candidate> all;
  constexpr int factors = 8;
  constexpr double least = 0.6, ratio = 1.25;
  for (int k = 0; k < factors; ++k) {
    const WeighedNoise at = beside(fit.noise, least * std::pow(ratio, k), fit.rows, fit.used);
    const AttitudeInformation info = information_of(fit.rows, fit.used, at.noise, Columns(fit.model, fit.layout));
    const Posterior found = posterior_of(fit.model, fit.layout, info, walk_unit(fit));
    all.push_back({found.mean, found.covariance, found.log_evidence + at.log_likelihood});
  }
  const Candidate mixed = mix(all);
  return {mixed.mean, mixed.covariance, best.walk_psd, mixed.log_evidence};
}

}  // namespace

AttitudeFit fit_attitude(const GyroTrack& track, const ReferenceAttitude& attitude, const Knots& knots,
                         const AttitudeStart& start) {
  AttitudeFit fit;
  fit.model = start.model;
  set_nodes(track, fit.model, fit.layout);
  for (const Knot& knot : knots.all) {
    fit.q_rm.push_back(attitude.readings[start.reading].q_rm[knot.sample]);
  }
  constexpr int rounds = 15, rough = 2;
  constexpr double settled = 0.01;
  AttitudeInformation info;
  Posterior posterior;
  for (int round = 0; round < rounds; ++round) {
    fit.rows = integrate(track, knots, fit.q_rm, fit.model);
    if (fit.rows.empty()) {
      return fit;
    }
    if (round < rough) {
      set_aside_roughly(fit.rows, fit.used);
    } else {
      set_aside(fit.rows, fit.noise, fit.used);
    }
    fit.noise = fit_noise(fit.rows, fit.used, knots.interval_s);
    info = information_of(fit.rows, fit.used, fit.noise, Columns(fit.model, fit.layout));
    posterior = posterior_of(fit.model, fit.layout, info, walk_unit(fit));
    if (move(posterior, fit.layout, fit.model) < settled && round > rough + 1) {
      break;
    }
  }
  fit.rows = integrate(track, knots, fit.q_rm, fit.model);
  set_aside(fit.rows, fit.noise, fit.used);
  posterior = averaged(fit, posterior);
  move(posterior, fit.layout, fit.model);
  fit.walk_psd = posterior.walk_psd;
  fit.covariance = posterior.covariance.topLeftCorner(fit.layout.walk(), fit.layout.walk());
  tell_mean_bias(posterior.covariance, fit);
  const Eigen::VectorXd before = fit.covariance.diagonal();
  fit.misfit = enlarge(info, posterior.covariance, fit.covariance);
  fit.mean_bias_sigma.array() *=
      (fit.covariance.diagonal().array() / before.array()).sqrt().segment<3>(fit.layout.bias());
  count_lost(fit);
  return fit;
}

}  // namespace selfcal::diagnosis
