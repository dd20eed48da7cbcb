// Answers one recording of the discovery trial. Links no simulation.
//
//   selfcal_discovery_answer RECORDING [--discover | --catalogue | --stepwise | --process]
//
// One JSON line; with --discover also where the catalogue leaves nothing; the others are rivals (rivals.hpp).
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "daemon/estimate/calibrate_recording.hpp"
#include "daemon/estimate/diagnosis_json.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/search/locate.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/scene.hpp"
#include "protocol/recording/recording_file.hpp"
#include "tests/discovery/rivals.hpp"

namespace {

using namespace selfcal;
using nlohmann::ordered_json;

ordered_json to_json(const discovery::Discovery& d) {
  ordered_json j = {{"misfit_before", d.misfit_before}, {"misfit_after", d.misfit_after}, {"refused", d.refused}};
  j["laws"] = ordered_json::array();
  j["described"] = ordered_json::array();
  for (const discovery::DiscoveredLaw& law : d.described) {
    j["described"].push_back({{"axis", law.term.axis}, {"expression", law.expression}, {"gain", law.gain}});
  }
  for (const discovery::DiscoveredLaw& law : d.laws) {
    ordered_json members = ordered_json::array();
    for (const discovery::ClassMember& m : law.ambiguous) {
      members.push_back({{"expression", m.expression}, {"axis", m.axis}, {"odds", m.odds}});
    }
    j["laws"].push_back({{"axis", law.term.axis},
                         {"expression", law.expression},
                         {"coefficient", law.coefficient},
                         {"sigma", law.sigma},
                         {"significance", law.significance},
                         {"held_out_gain", law.held_out_gain},
                         {"share", law.share},
                         {"stability", law.stability},
                         {"carries_over", law.carries_over},
                         {"class", members}});
  }
  j["processes"] = ordered_json::array();
  for (const discovery::DiscoveredProcess& p : d.processes) {
    j["processes"].push_back(
        {{"axis", p.axis}, {"process", discovery::name_of(p.kind)}, {"size", p.size}, {"sigma", p.sigma}});
  }
  const discovery::FittedRecording& fitted = d.fit.recordings.front();
  j["parameters"] = std::vector<double>(fitted.parameters.begin(), fitted.parameters.end());
  const ParameterVector sigma = fitted.covariance.diagonal().cwiseSqrt();
  j["parameter_sigma"] = std::vector<double>(sigma.data(), sigma.data() + sigma.size());
  return j;
}

// The same recording answered by a rival, in the same form.
ordered_json rival_json(const std::string& rival, const ImuData& data, const CalibrationResult& calibration) {
  const discovery::Scene scene({data, calibration});
  const discovery::PieceSums sums = discovery::sum_over_pieces(scene.motion, scene.input);
  const auto laws = rival == "--stepwise" ? discovery_trial::stepwise(sums, scene.motion.available())
                                          : discovery_trial::gaussian_process(sums, scene.motion.available());
  ordered_json j = {
      {"laws", ordered_json::array()}, {"described", ordered_json::array()}, {"processes", ordered_json::array()}};
  for (const discovery_trial::RivalLaw& law : laws) {
    j["laws"].push_back({{"axis", law.axis}, {"expression", law.expression}, {"coefficient", law.coefficient}});
  }
  return j;
}

int answer(const std::string& path, const std::string& way) {
  const bool always = !way.empty() && way != "--catalogue";
  const auto loaded = read_recording(path, {.gaps_are_errors = false, .gimbal_contradiction_is_error = false});
  if (!loaded) {
    fmt::print(stderr, "selfcal_discovery_answer: {}\n", loaded.error().message);
    return 3;
  }
  std::vector<double> temperature;
  const ImuData data = imu_view(loaded->recording, temperature);
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  ordered_json j;
  bool wanted = always;
  if (!always) {
    const diagnosis::DiagnosisOutcome outcome = diagnosis::diagnose(data, {});
    if (outcome.diagnosis) {
      j["verdict"] = verdict_name(outcome.diagnosis->verdict);
      j["names"] = ordered_json::array();
      for (const auto& finding : outcome.diagnosis->findings) {
        j["names"].push_back(finding.effect);
      }
      wanted = outcome.diagnosis->unexplained && way.empty();
    }
  }
  j["diagnosis_s"] = elapsed();
  if (wanted) {
    const CalibrationOutcome calibration = diagnosis::calibrate_still(data, {});
    if (calibration.result) {
      const std::vector<discovery::UnitRecording> recordings{{data, *calibration.result}};
      j["discovery"] = way == "--stepwise" || way == "--process" ? rival_json(way, data, *calibration.result)
                                                                 : to_json(discovery::discover(recordings, {}));
    }
  }
  j["seconds"] = elapsed();
  fmt::print("{}\n", j.dump());
  return 0;
}

}  // namespace

int main(int count, char** values) {
  try {
    const std::span<char*> arguments(values, static_cast<std::size_t>(count));
    const std::string way = arguments.size() == 3 ? arguments[2] : "";
    const bool known =
        way.empty() || way == "--catalogue" || way == "--discover" || way == "--stepwise" || way == "--process";
    if (arguments.size() < 2 || arguments.size() > 3 || !known) {
      fmt::print(stderr,
                 "usage: selfcal_discovery_answer RECORDING [--discover | --catalogue | --stepwise | --process]\n");
      return 2;
    }
    return answer(arguments[1], way);
  } catch (const std::exception& problem) {
    fmt::print(stderr, "selfcal_discovery_answer: {}\n", problem.what());
    return 5;
  }
}
