#include "tests/monte_carlo/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/monte_carlo/chi_squared.hpp"

namespace selfcal::monte_carlo {
namespace {

constexpr double chance = 0.999;  // of a right estimator passing a ratio that few runs make coarse

// Upper limit of a root mean square of `degrees` squares of expected value 1.
double rms_limit(double limit, double degrees, double probability) {
  return std::max(limit, std::sqrt(chi_squared_quantile(probability, degrees) / degrees));
}

Ratio per_degree(const Nees& sum, double confidence) {
  if (sum.degrees == 0) {
    return {};
  }
  const double tail = 0.5 * (1.0 - confidence);
  return {sum.sum / sum.degrees, chi_squared_quantile(tail, sum.degrees) / sum.degrees,
          chi_squared_quantile(1.0 - tail, sum.degrees) / sum.degrees};
}

void add(Nees& sum, const Nees& n) {
  sum.sum += n.sum;
  sum.degrees += n.degrees;
}

struct Sums {
  ParameterVector bound = ParameterVector::Zero(), plan = ParameterVector::Zero(), own = ParameterVector::Zero();
  Nees nees, gyro_drift;
  std::array<Nees, control_names.size()> controls;
};

void take(const Trial& t, Sums& sums, CaseReport& report) {
  ++report.runs;
  sums.bound += t.error_bound.cwiseAbs2();
  sums.plan += t.error_plan.cwiseAbs2();
  sums.own += t.own_bound.cwiseAbs2();
  add(sums.nees, t.nees);
  add(sums.gyro_drift, t.gyro_drift);
  for (std::size_t k = 0; k < sums.controls.size(); ++k) {
    add(sums.controls[k], t.controls[k]);
  }
  report.consistent += t.verdict == Verdict::consistent ? 1 : 0;
  report.inconsistent += t.verdict == Verdict::inconsistent ? 1 : 0;
  report.not_converged += t.verdict == Verdict::not_converged ? 1 : 0;
  report.most_passes = std::max(report.most_passes, t.passes);
  report.nis += t.nis;
  report.arw_ratio += t.arw_ratio;
  report.vrw_ratio += t.vrw_ratio;
}

std::string interval(const Ratio& r) { return fmt::format("{:.3f} [{:.3f}, {:.3f}]", r.value, r.low, r.high); }

nlohmann::ordered_json json(const Ratio& r) { return {{"value", r.value}, {"low", r.low}, {"high", r.high}}; }

}  // namespace

bool CaseReport::holds() const {
  const auto outside = [](const Ratio& control) { return control.high == 0.0 || !control.holds(); };
  return failures.empty() && runs > 0 && overall.holds() && nees.holds() && gyro_drift_nees.holds() &&
         std::all_of(single.begin(), single.end(), [](const Ratio& r) { return r.holds(); }) &&
         std::all_of(controls.begin(), controls.end(), outside);
}

CaseReport evaluate(const std::string& name, const std::vector<Trial>& trials, const Limits& limits) {
  CaseReport report;
  report.name = name;
  Sums sums;
  for (const Trial& t : trials) {
    if (t.failure.empty()) {
      take(t, sums, report);
    } else {
      report.failures.push_back(fmt::format("seed {}: {}", t.seed, t.failure));
    }
  }
  if (report.runs == 0) {
    return report;
  }
  const double n = report.runs;
  // Errors of one run are correlated; the determined directions are what scatters independently.
  report.overall = {std::sqrt(sums.bound.mean() / n), 0.0, rms_limit(limits.overall, sums.nees.degrees, chance)};
  const double shared = 1.0 - (1.0 - chance) / sensor_parameter_count;
  for (int i = 0; i < sensor_parameter_count; ++i) {
    report.single[static_cast<std::size_t>(i)] = {std::sqrt(sums.bound(i) / n), 0.0,
                                                  rms_limit(limits.single, n, shared)};
  }
  report.overall_plan = std::sqrt(sums.plan.mean() / n);
  report.own_bound = (sums.own / n).cwiseSqrt();
  report.nees = per_degree(sums.nees, limits.confidence);
  report.gyro_drift_nees = per_degree(sums.gyro_drift, limits.confidence);
  for (std::size_t k = 0; k < report.controls.size(); ++k) {
    report.controls[k] = per_degree(sums.controls[k], limits.confidence);
  }
  report.nis /= n;
  report.arw_ratio /= n;
  report.vrw_ratio /= n;
  return report;
}

std::string text(const CaseReport& r) {
  std::string out = fmt::format("{}: {} ({} runs)\n", r.name, r.holds() ? "holds" : "FAILS", r.runs);
  for (const std::string& failure : r.failures) {
    out += fmt::format("  no answer, {}\n", failure);
  }
  out += fmt::format("  rms(error)/bound   {:.3f} (limit {:.3f}); against the plan {:.3f}\n", r.overall.value,
                     r.overall.high, r.overall_plan);
  out +=
      fmt::format("  NEES per degree    {}\n  gyro drift alone   {}\n", interval(r.nees), interval(r.gyro_drift_nees));
  for (std::size_t k = 0; k < r.controls.size(); ++k) {
    if (r.controls[k].high > 0.0) {
      out += fmt::format("  {:<18} {} {}\n", control_names[k], interval(r.controls[k]),
                         r.controls[k].holds() ? "NOT DETECTED" : "detected");
    }
  }
  out += fmt::format("  verdicts           {} consistent, {} inconsistent, {} not converged; at most {} passes\n",
                     r.consistent, r.inconsistent, r.not_converged, r.most_passes);
  out += fmt::format("  found              NIS {:.3f}, ARW x {:.3f}, VRW x {:.3f}\n", r.nis, r.arw_ratio, r.vrw_ratio);
  out += fmt::format("  each of the 24     rms(error)/bound (limit {:.3f}), own sigma/bound\n", r.single[0].high);
  for (std::size_t i = 0; i < r.single.size(); ++i) {
    out += fmt::format("    {:<24} {:.3f} {:.3f}{}\n", sensor_parameters[i].name, r.single[i].value,
                       r.own_bound(static_cast<int>(i)), r.single[i].holds() ? "" : "  ABOVE");
  }
  return out;
}

nlohmann::ordered_json json(const CaseReport& r) {
  nlohmann::ordered_json j;
  j["case"] = r.name;
  j["holds"] = r.holds();
  j["runs"] = r.runs;
  j["failures"] = r.failures;
  j["rms_over_bound"] = json(r.overall);
  j["rms_over_plan"] = r.overall_plan;
  j["nees_per_degree"] = json(r.nees);
  j["gyro_drift_nees_per_degree"] = json(r.gyro_drift_nees);
  for (std::size_t k = 0; k < r.controls.size(); ++k) {
    if (r.controls[k].high > 0.0) {
      j["controls"][std::string(control_names[k])] = json(r.controls[k]);
    }
  }
  j["verdicts"] = {{"consistent", r.consistent}, {"inconsistent", r.inconsistent}, {"not_converged", r.not_converged}};
  j["nis"] = r.nis;
  j["arw_found"] = r.arw_ratio;
  j["vrw_found"] = r.vrw_ratio;
  for (std::size_t i = 0; i < r.single.size(); ++i) {
    j["parameters"][std::string(sensor_parameters[i].name)] = {{"rms_over_bound", r.single[i].value},
                                                               {"limit", r.single[i].high},
                                                               {"sigma_over_bound", r.own_bound(static_cast<int>(i))}};
  }
  return j;
}

}  // namespace selfcal::monte_carlo
