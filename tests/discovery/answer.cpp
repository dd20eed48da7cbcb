// Answers one recording of the discovery trial. Links no simulation.
//
//   selfcal_discovery_answer RECORDING [RECORDING...] [--discover | --catalogue | --stepwise | --process | --form AXIS EXPRESSION ... |
//     --among FILE] [--plan FILE]
//
// One JSON line. Without a way: as `selfcal diagnose` does it, the catalogue and what it leaves; --discover: discovery alone; --form, once
// for each law: these forms and no others, coefficients and the constants `?` fitted, which is the best that a search can do; --among: one of
// the file's forms, a line "AXIS EXPRESSION" each (limit.hpp); the others are rivals (rivals.hpp). Further recordings are of the same unit. --plan writes the schedule of the next experiment, where there is one.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/estimate/analysis.hpp"
#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/calibrate_recording.hpp"
#include "daemon/estimate/diagnosis_json.hpp"
#include "daemon/estimate/unit_answer.hpp"
#include "estimator/diagnosis/data/set_aside.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/search/locate.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/law_trial.hpp"
#include "estimator/discovery/scene.hpp"
#include "protocol/recording/recording_file.hpp"
#include "protocol/schedule_file/schedule_file.hpp"
#include "tests/discovery/limit.hpp"
#include "tests/discovery/rivals.hpp"

namespace {

using namespace selfcal;
using nlohmann::ordered_json;

ordered_json to_json(const discovery::Discovery& d) {
  ordered_json j = {{"misfit_before", d.misfit_before}, {"misfit_after", d.misfit_after}, {"refused", d.refused}};
  j["laws"] = ordered_json::array();
  j["described"] = ordered_json::array();
  for (const discovery::DiscoveredLaw& law : d.described) {
    j["described"].push_back({{"axis", law.term.axis},
                              {"expression", law.expression},
                              {"gain", law.gain},
                              {"unsure", law.unsure},
                              {"carries_over", law.carries_over},
                              {"departure_log_p", law.departure_log_p}});
  }
  for (const discovery::DiscoveredLaw& law : d.laws) {
    ordered_json members = ordered_json::array();
    for (const discovery::ClassMember& m : law.ambiguous) {
      ordered_json also = ordered_json::array();
      for (const discovery::OtherWords& other : m.also) {
        also.push_back(other.expression);
      }
      members.push_back({{"expression", m.expression}, {"axis", m.axis}, {"odds", m.odds}, {"also", also}});
    }
    j["laws"].push_back({{"axis", law.term.axis},
                         {"expression", law.expression},
                         {"coefficient", law.coefficient},
                         {"sigma", law.sigma},
                         {"significance", law.significance},
                         {"gain", law.gain},
                         {"held_out_gain", law.held_out_gain},
                         {"share", law.share},
                         {"stability", law.stability},
                         {"departure_log_p", law.departure_log_p},
                         {"carries_over", law.carries_over},
                         {"class", members}});
  }
  j["processes"] = ordered_json::array();
  for (const discovery::DiscoveredProcess& p : d.processes) {
    j["processes"].push_back(
        {{"axis", p.axis}, {"process", discovery::name_of(p.kind)}, {"size", p.size}, {"sigma", p.sigma}});
  }
  const bool averaged = !d.average.parameters.empty();
  const ParameterVector& parameters = averaged ? d.average.parameters.front() : d.fit.recordings.front().parameters;
  j["parameters"] = std::vector<double>(parameters.begin(), parameters.end());
  const ParameterMatrix& covariance = averaged ? d.average.covariance.front() : d.fit.recordings.front().covariance;
  const ParameterVector sigma = covariance.diagonal().cwiseSqrt();
  j["parameter_sigma"] = std::vector<double>(sigma.data(), sigma.data() + sigma.size());
  return j;
}

// Laws that are neither judged nor told with a class, in the same form.
ordered_json to_json(const std::vector<discovery_trial::RivalLaw>& laws) {
  ordered_json j = {
      {"laws", ordered_json::array()}, {"described", ordered_json::array()}, {"processes", ordered_json::array()}};
  for (const discovery_trial::RivalLaw& law : laws) {
    j["laws"].push_back({{"axis", law.axis}, {"expression", law.expression}, {"coefficient", law.coefficient}});
  }
  return j;
}

// The same recording answered by a rival.
ordered_json rival_json(const std::string& rival, const ImuData& data, const CalibrationResult& calibration) {
  const discovery::Scene scene({data, calibration});
  const discovery::PieceSums sums = discovery_trial::with_states_held(scene.motion, scene.input);
  return to_json(rival == "--stepwise" ? discovery_trial::stepwise(sums, scene.motion.available())
                                       : discovery_trial::gaussian_process(sums, scene.motion.available()));
}

// What the catalogue says, and where it leaves something what discovery says, as the program does it.
struct DiagnosisAnswer {
  ordered_json words;
  std::optional<discovery::Discovery> found;
  std::vector<double> parameters, sigma;  // the 24 that are told
};

DiagnosisAnswer diagnosed(const ImuData& recorded, bool beyond) {
  const diagnosis::SetAside aside(recorded);  // what is faulty in a stretch is left out
  const ImuData& data = aside.data();
  DiagnosisAnswer answer;
  std::optional<diagnosis::Diagnosis> diagnosis;
  if (beyond) {
    Cause cause = cause_of(data, {});
    diagnosis = std::move(cause.diagnosis);
    answer.found = std::move(cause.beyond);
  } else {
    diagnosis = diagnosis::diagnose(data, {}).diagnosis;
  }
  if (diagnosis) {
    const diagnosis::Diagnosis told = with_laws(*diagnosis, answer.found ? &*answer.found : nullptr);
    answer.parameters.assign(told.value.begin(), told.value.end());
    answer.sigma.assign(told.sigma.begin(), told.sigma.end());
    answer.words["verdict"] = verdict_name(diagnosis->verdict);
    answer.words["names"] = ordered_json::array();
    for (const auto& finding : diagnosis->findings) {
      answer.words["names"].push_back(finding.effect);
    }
    if (diagnosis->instead) {
      answer.words["instead"] = {
          {"odds", diagnosis->instead->odds}, {"laws", ordered_json::array()}, {"names", ordered_json::array()}};
      for (const diagnosis::Effect* name : diagnosis->instead->names) {
        answer.words["instead"]["names"].push_back(name->id);
      }
      for (const auto& law : diagnosis->instead->laws) {
        answer.words["instead"]["laws"].push_back({{"axis", law.axis}, {"expression", law.expression}});
      }
    }
  }
  return answer;
}

// Laws whose forms are known.
ordered_json fitted_json(std::span<const discovery::UnitRecording> recordings,
                         const std::vector<discovery::LawTerm>& forms) {
  const std::vector<double> stated(forms.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<discovery_trial::RivalLaw> laws;
  std::vector<double> gains;
  if (const auto tried = discovery::try_laws(recordings, forms, stated)) {
    for (const discovery::TriedLaw& law : *tried) {
      laws.push_back({law.term.axis, law.expression, law.coefficient});
      gains.push_back(law.gain);
    }
  }
  ordered_json j = to_json(laws);
  for (std::size_t k = 0; k < gains.size(); ++k) {
    j["laws"][k]["gain"] = gains[k];
  }
  return j;
}

// One of the forms that could have been drawn.
ordered_json among_json(const discovery::UnitRecording& recording, const std::string& path) {
  std::vector<discovery_trial::PossibleForm> forms;
  std::ifstream file(path);
  for (discovery_trial::PossibleForm form; file >> form.axis >> form.expression;) {
    forms.push_back(form);
  }
  const discovery_trial::LimitAnswer best = discovery_trial::best_of_all(recording, forms);
  ordered_json j = to_json(best.laws);
  for (ordered_json& law : j["laws"]) {
    law["gain"] = best.gain;
    law["carries_over"] = best.carries_over;
    law["likely"] = best.likely;
  }
  return j;
}

struct Request {
  std::string way, plan, among;  // plan: where the schedule of the next experiment goes; among: a file of forms
  std::vector<discovery::LawTerm> forms;
  std::vector<std::string> files;
};

// A recording with its calibration; both stay where they are.
struct Loaded {
  Recording recording;
  std::vector<double> temperature;
  ImuData data;
  CalibrationResult calibration;
};

std::unique_ptr<Loaded> load(const std::string& path) {
  auto read = read_recording(path, {.gaps_are_errors = false, .gimbal_contradiction_is_error = false});
  if (!read) {
    fmt::print(stderr, "selfcal_discovery_answer: {}\n", read.error().message);
    return nullptr;
  }
  auto loaded = std::make_unique<Loaded>();
  loaded->recording = std::move(read->recording);
  loaded->data = imu_view(loaded->recording, loaded->temperature);
  return loaded;
}

int answer(const Request& request) {
  constexpr double experiment_s = 3000.0;
  std::vector<std::unique_ptr<Loaded>> all;
  for (const std::string& file : request.files) {
    all.push_back(load(file));
    if (!all.back()) {
      return 3;
    }
  }
  const std::clock_t begin = std::clock();  // processor time: other work on the machine does not count
  const auto elapsed = [&] { return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC; };
  ordered_json j;
  const bool as_the_program = request.way.empty();
  if (as_the_program || request.way == "--catalogue") {
    const DiagnosisAnswer answer = diagnosed(all.front()->data, as_the_program);
    j = answer.words;
    if (answer.found) {
      j["discovery"] = to_json(*answer.found);
      j["discovery"]["parameters"] = answer.parameters;
      j["discovery"]["parameter_sigma"] = answer.sigma;
    }
    j["parameters"] = answer.parameters;
    j["parameter_sigma"] = answer.sigma;
    j["seconds"] = elapsed();
    fmt::print("{}\n", j.dump());
    return 0;
  }
  std::vector<discovery::UnitRecording> recordings;
  for (const auto& one : all) {
    CalibrationOutcome outcome = diagnosis::calibrate_still(one->data, {});
    if (outcome.result) {
      one->calibration = std::move(*outcome.result);
      recordings.push_back({one->data, one->calibration});
    }
  }
  if (recordings.size() == all.size()) {
    if (request.way == "--stepwise" || request.way == "--process") {
      j["discovery"] = rival_json(request.way, all.front()->data, all.front()->calibration);
    } else if (request.way == "--form") {
      j["discovery"] = fitted_json(recordings, request.forms);
    } else if (request.way == "--among") {
      j["discovery"] = among_json(recordings.front(), request.among);
    } else {
      const discovery::Discovery found = discovery::discover(recordings, {});
      j["discovery"] = to_json(found);
      const ParameterVector& before = recordings.front().calibration.value;
      j["discovery"]["parameters_before"] = std::vector<double>(before.begin(), before.end());
      if (!request.plan.empty()) {
        discovery::ExperimentLimits limits;
        limits.duration_s = experiment_s;
        if (const auto next = plan_next(recordings, found, limits)) {
          std::ofstream(request.plan) << format_schedule(next->schedule);
        }
      }
    }
  }
  j["seconds"] = elapsed();
  fmt::print("{}\n", j.dump());
  return 0;
}

bool parse(std::span<char*> arguments, Request& request) {
  for (std::size_t k = 1; k < arguments.size(); ++k) {
    const std::string word = arguments[k];
    if (word == "--plan" && k + 1 < arguments.size()) {
      request.plan = arguments[++k];
    } else if (word == "--among" && k + 1 < arguments.size()) {
      request.way = word;
      request.among = arguments[++k];
    } else if (word == "--form" && k + 2 < arguments.size()) {
      request.way = word;
      const int axis = std::atoi(arguments[++k]);
      auto expression = laws::Expression::parse(arguments[++k]);
      if (!expression || axis < 0 || axis >= discovery::axis_count) {
        return false;
      }
      const std::vector<double> constants(expression->free_constants(), 1.0);
      request.forms.push_back({axis, std::move(*expression), constants});
    } else if (word == "--discover" || word == "--catalogue" || word == "--stepwise" || word == "--process") {
      request.way = word;
    } else if (!word.starts_with("-")) {
      request.files.push_back(word);
    } else {
      return false;
    }
  }
  return !request.files.empty();
}

}  // namespace

int main(int count, char** values) {
  try {
    const std::span<char*> arguments(values, static_cast<std::size_t>(count));
    Request request;
    if (!parse(arguments, request)) {
      fmt::print(stderr,
                 "usage: selfcal_discovery_answer RECORDING [RECORDING...] "
                 "[--discover | --catalogue | --stepwise | --process | --form AXIS EXPRESSION ... | --among FILE] "
                 "[--plan FILE]\n");
      return 2;
    }
    return answer(request);
  } catch (const std::exception& problem) {
    fmt::print(stderr, "selfcal_discovery_answer: {}\n", problem.what());
    return 5;
  }
}
