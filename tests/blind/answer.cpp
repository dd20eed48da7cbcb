// Answers one recording of the blind trial. Links the diagnosis and nothing of the virtual INS.
//
//   selfcal_blind_answer RECORDING ASSUMED     ASSUMED: the noise a simulation would assume, JSON; the answer, one line
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <nlohmann/json.hpp>
#include <span>

#include "daemon/estimate/calibrate_recording.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/recording/recording_file.hpp"
#include "tests/blind/rivals.hpp"

namespace {

using namespace selfcal;
using diagnosis::Diagnosis;
using diagnosis::Finding;
using nlohmann::ordered_json;

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::vector<double> listed(const ParameterVector& v) { return {v.data(), v.data() + v.size()}; }

const char* words(diagnosis::DiagnosisVerdict verdict) {
  using enum diagnosis::DiagnosisVerdict;
  switch (verdict) {
    case adequate: return "adequate";
    case named: return "named";
    case none_of_the_above: return "none of the above";
    case not_enough_information: return "not enough information";
    case data_fault: return "data fault";
  }
  return "";
}

ordered_json to_json(const Finding& f) {
  ordered_json j = {{"effect", f.effect},
                    {"class", f.equivalent},
                    {"stochastic", f.stochastic},
                    {"log_p", f.log_p},
                    {"held_out_gain", f.held_out_gain},
                    {"probability", f.probability}};
  j["parameters"] = ordered_json::object();
  for (const auto& p : f.parameters) {
    j["parameters"][p.name] = {p.value, p.sigma};
  }
  return j;
}

ordered_json to_json(const diagnosis::Adequacy& a) {
  return {{"accepted", a.accepted},
          {"nis", a.nis},
          {"log_p_white", a.log_p_white},
          {"map", a.largest_sigma},
          {"log_p_structure", a.log_p_structure}};
}

ordered_json to_json(const Diagnosis& d) {
  ordered_json j;
  j["verdict"] = words(d.verdict);
  j["mismatch"] = d.mismatch;
  j["unexplained"] = d.unexplained;
  for (const auto& [name, list] : {std::pair{"findings", &d.findings}, {"rejected", &d.rejected}}) {
    j[name] = ordered_json::array();
    for (const Finding& f : *list) {
      j[name].push_back(to_json(f));
    }
  }
  for (const Finding& f : d.suspected) {
    j["suspected"].push_back(f.effect);
  }
  for (const auto& u : d.undetectable) {
    j["undetectable"].push_back(u.effect->id);
  }
  for (const auto& f : d.faults) {
    j["data_faults"].push_back(f.id);
  }
  j["before"] = to_json(d.before);
  j["after"] = to_json(d.after);
  j["log_p_limit"] = d.log_p_limit;
  j["moored"] = d.calibration.moored;
  j["value"] = listed(d.value);
  j["sigma"] = listed(d.sigma);
  j["value_without"] = listed(d.calibration.value);
  j["sigma_without"] = listed(d.calibration.sigma);
  return j;
}

int fail_with(int code, const std::string& message) {
  fmt::print(stderr, "selfcal_blind_answer: {}\n", message);
  return code;
}

int run(std::span<char*> a) {
  const auto assumed = a.size() == 3 ? nlohmann::json::parse(a[2], nullptr, false) : nlohmann::json();
  if (!assumed.is_object()) {
    return fail_with(2, "usage: selfcal_blind_answer RECORDING '{\"gyro_arw_deg_per_sqrt_h\": ...}'");
  }
  const auto loaded = read_recording(a[1]);
  if (!loaded) {
    return fail_with(3, loaded.error().message);
  }
  diagnosis::DiagnosisOptions options;
  options.assumed = {assumed.at("gyro_arw_deg_per_sqrt_h").get<double>() * units::degree_per_sqrt_hour,
                     assumed.at("accel_vrw_ug_per_sqrt_hz").get<double>() * units::micro_g_per_sqrt_hz,
                     assumed.at("gyro_lsb_arcsec").get<double>() * units::arcsecond,
                     assumed.at("accel_lsb_m_per_s").get<double>()};
  std::vector<double> first_temperature;
  const ImuData data = imu_view(loaded->recording, first_temperature);
  const double begin = cpu_seconds();
  const diagnosis::DiagnosisOutcome outcome = diagnosis::diagnose(data, options);
  const double end = cpu_seconds();
  ordered_json j;
  if (!outcome.diagnosis) {
    j["verdict"] = "failed";
    j["failure"] = outcome.failure;
  } else {
    j = to_json(*outcome.diagnosis);
    const blind::RivalAnswers rivals = blind::ask_rivals(data, *outcome.diagnosis, options.false_alarm_rate);
    j["rivals"] = {{"whiteness", rivals.whiteness_alarms},
                   {"bic", rivals.bic_names},
                   {"always_on", rivals.always_on_names},
                   {"always_on_value", listed(rivals.always_on_value)},
                   {"always_on_sigma", listed(rivals.always_on_sigma)}};
  }
  j["cpu_s"] = end - begin;
  fmt::print("{}\n", j.dump());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv, static_cast<std::size_t>(argc)});
  } catch (const std::exception& e) {  // a noise that is no number, a missing name
    std::fprintf(stderr, "selfcal_blind_answer: %s\n", e.what());
    return 3;
  }
}
