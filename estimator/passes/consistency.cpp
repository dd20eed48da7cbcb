#include "estimator/passes/consistency.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "estimator/statistics/whiteness.hpp"

namespace selfcal {
namespace {

constexpr double normal_999 = 3.29;  // two-sided 99.9 % of the normal distribution

Eigen::VectorXd normalised_innovations(const std::vector<Epoch>& epochs) {
  Eigen::VectorXd all(3 * std::ssize(epochs));
  for (std::size_t k = 0; k < epochs.size(); ++k) {
    all.segment<3>(3 * static_cast<Eigen::Index>(k)) =
        epochs[k].innovation.cwiseQuotient(epochs[k].variance.cwiseSqrt());
  }
  return all;
}

std::string format(const char* pattern, auto... values) {
  char text[400];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

}  // namespace

Consistency judge_innovations(const PassOutput& pass, bool converged, double parity_max_sigma, bool noise_given) {
  Consistency c;
  const auto n = static_cast<double>(pass.epochs.size());
  c.nis_mean = pass.nis_mean;
  c.parity_max_sigma = parity_max_sigma;
  // The mean of 3n squares of standard normals.
  const double spread = normal_999 * std::sqrt(2.0 / (3.0 * n));
  c.nis_low = 1.0 - spread;
  c.nis_high = 1.0 + spread;

  const Whiteness white = test_whiteness(normalised_innovations(pass.epochs));
  c.whiteness_p_value = std::exp(white.log_p);
  c.autocorrelation = white.autocorrelation;

  // The noise densities are estimates, good to some per cent, so a few per cent of NIS say nothing about the model.
  constexpr double density_margin = 0.15;
  const bool nis_high = c.nis_mean > c.nis_high + density_margin;
  constexpr double correlation_limit = 0.05;
  const bool coloured = c.whiteness_p_value < 1e-3 && std::abs(c.autocorrelation) > correlation_limit;
  if (!converged) {
    c.verdict = Verdict::not_converged;
    c.words = "The passes did not settle: the answer still moves from pass to pass and must not be used.";
  } else if (nis_high || (coloured && c.nis_mean > 0.5)) {
    c.verdict = Verdict::inconsistent;
    c.words = format(
        "The data do not fit the 24-parameter model: innovations are %.2f times as strong as predicted (NIS), "
        "correlation %.2f from second to second (whiteness p = %.2g). Something is left out; the sigmas are "
        "too small.",
        c.nis_mean, c.autocorrelation, c.whiteness_p_value);
  } else if (c.nis_mean < c.nis_low - density_margin) {
    c.words = format(
        "Nothing contradicts the model, but innovations are weaker than predicted (NIS %.3f): the noise %s "
        "is larger than that of the data, and the sigmas are larger than they need be.",
        c.nis_mean, noise_given ? "given" : "estimated from the increments' spectra");
  } else {
    const char* colour = c.whiteness_p_value < 1e-3 ? "nearly white" : "white";
    c.words = format(
        "Innovations are as predicted (NIS %.3f) and %s (p = %.2g, correlation %.2f from second to second); "
        "forward and reverse passes agree within %.3f sigma.",
        c.nis_mean, colour, c.whiteness_p_value, c.autocorrelation, c.parity_max_sigma);
  }
  return c;
}

std::vector<SegmentSummary> summarise_segments(const std::vector<Segment>& segments, const PassOutput& pass) {
  std::vector<Epoch> epochs = pass.epochs;
  std::sort(epochs.begin(), epochs.end(),
            [](const Epoch& a, const Epoch& b) { return a.interval_middle_s < b.interval_middle_s; });
  std::vector<SegmentSummary> summaries;
  std::size_t next = 0;
  for (const Segment& segment : segments) {
    SegmentSummary s{segment.rotation,
                     segment.start_s,
                     segment.end_s,
                     segment.outer * 180.0 / M_PI,
                     segment.inner * 180.0 / M_PI,
                     0.0,
                     0};
    while (next < epochs.size() && epochs[next].interval_middle_s < segment.end_s) {
      s.nis_mean += (epochs[next].innovation.cwiseAbs2().cwiseQuotient(epochs[next].variance)).sum() / 3.0;
      ++s.epochs;
      ++next;
    }
    if (s.epochs > 0) {
      s.nis_mean /= s.epochs;
    }
    summaries.push_back(s);
  }
  return summaries;
}

std::vector<UndeterminedDirection> undetermined_directions(const ParameterMatrix& covariance,
                                                           const ParameterVector& tolerance) {
  const ParameterMatrix scaled =
      tolerance.cwiseInverse().asDiagonal() * covariance * tolerance.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<ParameterMatrix> eigen(scaled);
  std::vector<UndeterminedDirection> found;
  for (int k = sensor_parameter_count - 1; k >= 0; --k) {  // largest first
    const double sigma = std::sqrt(std::max(0.0, eigen.eigenvalues()(k)));
    if (sigma <= 1.0) {
      break;
    }
    UndeterminedDirection direction;
    direction.direction = eigen.eigenvectors().col(k);
    direction.sigma = sigma;
    direction.words = format("sigma %.1f tolerances:", sigma);
    for (int i = 0; i < sensor_parameter_count; ++i) {
      if (std::abs(direction.direction(i)) > 0.3) {
        direction.words += format(" %+.2f ", direction.direction(i)) +
                           std::string(sensor_parameters[static_cast<std::size_t>(i)].name);
      }
    }
    found.push_back(direction);
  }
  return found;
}

void judge_parameters(CalibrationResult& result, const ParameterVector& tolerance) {
  const ParameterVector limit = plausible_limit();
  for (int i = 0; i < sensor_parameter_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    result.determined[k] = result.sigma(i) <= tolerance(i);
    // A value known no better than to a third of the range says nothing about what is possible.
    result.plausible[k] = std::abs(result.value(i)) <= limit(i) || 3.0 * result.sigma(i) > limit(i);
  }
  result.undetermined = undetermined_directions(result.covariance, tolerance);
}

}  // namespace selfcal
