#include "estimator/fleet/set_watch.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/statistics/distributions.hpp"

namespace selfcal::fleet {

SetVerdict SetWatch::add(int unit, const Innovation& innovation) {
  std::erase_if(window_, [&](const Entry& entry) { return entry.unit == unit; });
  window_.push_back({unit, innovation});
  if (window_.size() > units_in_window) {
    window_.pop_front();
  }
  double weight = 0.0, sum = 0.0;
  for (const Entry& entry : window_) {
    weight += 1.0 / entry.innovation.variance;
    sum += entry.innovation.value / entry.innovation.variance;
  }
  SetVerdict verdict;
  verdict.units = static_cast<int>(window_.size());
  verdict.bias = sum / weight;
  if (verdict.units >= least_units) {
    verdict.z = verdict.bias / std::sqrt(1.0 / weight + offset_sigma_ * offset_sigma_);
  }
  return verdict;
}

// The offset is drawn towards zero: its own variance is that of sets less what is not known of it. The spread of sets comes from
// their median departure, which is worth 37 of 100 normal ones: Student's t with so many degrees of freedom.
double standing_offset_z(const TypeModel& model, int set) {
  constexpr double efficiency_of_the_median = 0.37;
  const SetOffset& offset = model.sets.at(static_cast<std::size_t>(set));
  const double variance = model.set_sd * model.set_sd - offset.sigma * offset.sigma;
  const double degrees = efficiency_of_the_median * (static_cast<double>(model.sets.size()) - 1.0);
  if (!(variance > 0.0) || !(degrees > 0.0)) {
    return 0.0;
  }
  const double t = offset.value / std::sqrt(variance);
  return std::copysign(sigma_from_log_p(log_f_tail(t * t, 1.0, degrees)), t);
}

// A mean over w of N values passes z somewhere with probability (N/w) z^2 nu P(|x| > z), nu = exp(-0.583 z sqrt(2/w)): the moving
// mean's correlation falls as 1 - k/w (Siegmund, Sequential Analysis, 1985, on what is lost between discrete steps). Fixed point.
double accusation_limit(double rate, int parameters, double measurements) {
  constexpr double w = units_in_window;
  double z = 4.0;
  for (int k = 0; k < 20; ++k) {
    const double overlapping = measurements / w * z * z * std::exp(-0.583 * z * std::sqrt(2.0 / w));
    z = sigma_from_log_p(std::log(rate / (std::max(1.0, overlapping) * parameters)));
  }
  return z;
}

}  // namespace selfcal::fleet
