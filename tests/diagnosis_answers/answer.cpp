// Everything that the diagnosis says about one recording, as one JSON document.
//
//   selfcal_diagnosis_answer RECORDING [--holdout RECORDING] [--against RECORDING]
//
// Numbers have six significant digits: a sum taken in another order changes none of them.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

#include "daemon/estimate/calibrate_recording.hpp"
#include "estimator/diagnosis/comparison.hpp"
#include "estimator/diagnosis/empirical.hpp"
#include "estimator/diagnosis/holdout.hpp"
#include "estimator/diagnosis/isolability.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/recording/recording_file.hpp"

namespace {

using namespace selfcal;
using diagnosis::Diagnosis;
using diagnosis::Finding;
using nlohmann::ordered_json;

std::string number(double x) { return fmt::format("{:.6g}", x); }

ordered_json listed(const Eigen::Ref<const Eigen::VectorXd>& v) {
  ordered_json all = ordered_json::array();
  for (const double x : v) {
    all.push_back(number(x));
  }
  return all;
}

ordered_json to_json(const Finding& f) {
  ordered_json j = {
      {"effect", f.effect},         {"equation", f.equation},           {"excited", f.excited},
      {"experiment", f.experiment}, {"equivalent", f.equivalent},       {"significance", number(f.significance)},
      {"log_p", number(f.log_p)},   {"delta_bic", number(f.delta_bic)}, {"held_out_gain", number(f.held_out_gain)},
      {"stochastic", f.stochastic}};
  for (const auto& [name, p] : f.probability) {
    if (p > 1e-9) {
      j["probability"][name] = number(p);
    }
  }
  for (const auto& p : f.parameters) {
    j["parameters"].push_back({p.name, p.unit, number(p.value), number(p.sigma)});
  }
  return j;
}

ordered_json to_json(const diagnosis::Located& l) {
  return {l.where, l.position, l.axis, number(l.significance), number(l.size), l.words};
}

ordered_json to_json(const diagnosis::Undetectable& u) { return {u.effect->id, number(u.expected_z)}; }

ordered_json to_json(const diagnosis::ModelEffect& m) {
  return {m.effect->id, number(m.constant), listed(m.size), listed(m.covariance.reshaped())};
}

ordered_json to_json(const diagnosis::DataFault& f) { return {f.id, f.words, f.first_sample, f.count}; }

ordered_json to_json(const diagnosis::Adequacy& a) {
  return {{"nis", number(a.nis)},
          {"log_p_white", number(a.log_p_white)},
          {"largest_sigma", number(a.largest_sigma)},
          {"misfit", number(a.misfit)},
          {"log_p_structure", number(a.log_p_structure)},
          {"accepted", a.accepted}};
}

ordered_json to_json(const diagnosis::HeldOutState& s) {
  return {number(s.log_likelihood), number(s.nis), number(s.log_p_white), number(s.parameter_disagreement)};
}

ordered_json to_json(const diagnosis::Split& s) {
  ordered_json j = {{"effect", s.effect->id},
                    {"rivals", diagnosis::ids_of(s.rivals)},
                    {"now", number(s.separation_now)},
                    {"contain", diagnosis::ids_of(s.contain)}};
  for (const diagnosis::Experiment& e : s.experiments) {
    j["experiments"].push_back({e.id, number(e.separation), e.closest->id});
  }
  return j;
}

template <typename T>
ordered_json all_of(const std::vector<T>& list) {
  ordered_json j = ordered_json::array();
  for (const T& one : list) {
    j.push_back(to_json(one));
  }
  return j;
}

ordered_json to_json(const Diagnosis& d) {
  return {{"verdict", static_cast<int>(d.verdict)},
          {"mismatch", d.mismatch},
          {"unexplained", d.unexplained},
          {"faults", all_of(d.faults)},
          {"findings", all_of(d.findings)},
          {"rejected", all_of(d.rejected)},
          {"suspected", all_of(d.suspected)},
          {"located", all_of(d.located)},
          {"remaining", all_of(d.remaining)},
          {"located_by", all_of(d.located_by)},
          {"remaining_by", all_of(d.remaining_by)},
          {"undetectable", all_of(d.undetectable)},
          {"detectable", all_of(d.detectable)},
          {"before", to_json(d.before)},
          {"after", to_json(d.after)},
          {"model", all_of(d.model)},
          {"log_p_limit", number(d.log_p_limit)},
          {"mean_temperature_c", number(d.mean_temperature_c)},
          {"value", listed(d.value)},
          {"sigma", listed(d.sigma)},
          {"value_as_named", listed(d.value_as_named)}};
}

struct Opened {
  LoadedRecording loaded;
  std::vector<double> first_temperature;
  ImuData data;
};

std::unique_ptr<Opened> open(const std::string& path) {
  auto loaded = read_recording(path, {.gaps_are_errors = false, .gimbal_contradiction_is_error = false});
  if (!loaded) {
    throw std::runtime_error(loaded.error().message);
  }
  auto opened = std::make_unique<Opened>();
  opened->loaded = std::move(*loaded);
  opened->data = imu_view(opened->loaded.recording, opened->first_temperature);
  return opened;
}

// The schedule as the gimbal's read-outs show it.
Schedule followed(const ImuData& data) {
  Schedule schedule;
  for (const Segment& s : find_segments(data)) {
    if (s.rotation) {
      schedule.rotation_s = s.end_s - s.start_s;
    } else {
      schedule.positions.push_back({s.outer / units::degree, s.inner / units::degree});
      schedule.dwell_s.push_back(s.end_s - s.start_s);
    }
  }
  return schedule;
}

ordered_json answer(const std::string& path, const std::string& holdout, const std::string& against) {
  diagnosis::DiagnosisOptions options;
  options.assumed = {0.001 * units::degree_per_sqrt_hour, 5.0 * units::micro_g_per_sqrt_hz, 0.1 * units::arcsecond,
                     2e-6};
  const std::unique_ptr<Opened> own = open(path);
  ordered_json j;
  if (!against.empty()) {
    const diagnosis::ComparisonOutcome c = diagnosis::compare(own->data, open(against)->data, options);
    if (!c.comparison) {
      return {{"failure", c.failure}};
    }
    return {{"difference", to_json(c.comparison->diagnosis)},
            {"in_both", all_of(c.comparison->in_both)},
            {"of_the_24", listed(c.comparison->difference)},
            {"sigma", listed(c.comparison->sigma)}};
  }
  const diagnosis::DiagnosisOutcome outcome = diagnosis::diagnose(own->data, options);
  if (!outcome.diagnosis) {
    return {{"failure", outcome.failure}};
  }
  const Diagnosis& d = *outcome.diagnosis;
  j["diagnosis"] = to_json(d);
  if (!d.faults.empty()) {
    return j;
  }
  if (d.unexplained) {
    const diagnosis::EmpiricalDescription e = diagnosis::describe_empirically(own->data, d, options.false_alarm_rate);
    j["empirical"] = {number(e.share), number(e.held_out_gain)};
    for (const diagnosis::EmpiricalTerm& t : e.terms) {
      j["empirical"].push_back({t.axis, t.function, number(t.value), number(t.sigma), number(t.held_out_gain)});
    }
  }
  j["splits"] = all_of(diagnosis::plan_splits(d, own->data, followed(own->data)));
  if (!holdout.empty()) {
    const diagnosis::HoldoutOutcome h = diagnosis::hold_out(d, open(holdout)->data, options);
    if (h.holdout) {
      j["holdout"] = {to_json(h.holdout->before), to_json(h.holdout->after), number(h.holdout->gain),
                      h.holdout->not_carried};
    } else {
      j["holdout"] = h.failure;
    }
  }
  return j;
}

int run(std::span<char*> a) {
  std::string holdout, against;
  bool good = a.size() % 2 == 0 && a.size() >= 2;
  for (std::size_t k = 2; good && k < a.size(); k += 2) {
    const std::string option = a[k];
    good = option == "--holdout" || option == "--against";
    (option == "--holdout" ? holdout : against) = a[k + 1];
  }
  if (!good) {
    fmt::print(stderr, "usage: selfcal_diagnosis_answer RECORDING [--holdout RECORDING] [--against RECORDING]\n");
    return 2;
  }
  fmt::print("{}\n", answer(a[1], holdout, against).dump());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv, static_cast<std::size_t>(argc)});
  } catch (const std::exception& e) {
    std::fprintf(stderr, "selfcal_diagnosis_answer: %s\n", e.what());
    return 3;
  }
}
