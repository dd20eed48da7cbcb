// The gate: whether a result may be written to an INS without the operator's reason, and the objections to it.
//
// One function answers, once for each result. Its answer is stored with the result; the run, the JSON document, the
// table, the page, an amendment, LCM and D-Bus read the stored answer and never ask again with less knowledge.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "estimator/passes/calibration.hpp"

namespace selfcal {

namespace diagnosis {
struct Diagnosis;
}
namespace discovery {
struct Discovery;
}

// |value| beyond which a parameter is implausible for this type of INS, in the units of sensor_parameters.
using Limits = std::array<std::optional<double>, sensor_parameter_count>;

// What an objection is about, most important first: each makes those after it worth less.
enum class ObjectionKind {
  data_fault,        // the recording itself is faulty
  unexplained,       // recording and model differ, and nothing in the catalogue explains it
  inconsistent,      // recording and model differ
  not_converged,     // the passes did not settle
  nothing_to_amend,  // an amendment of a recording in which no equation was named
  implausible,       // beyond what such sensors can have
  beyond_limit,      // beyond the operator's limit
  undetermined,      // sigma above the tolerance
};

struct Objection {
  ObjectionKind kind{};
  std::string words;   // one clause: "gyro_scale_y not determined: sigma 80.2 ppm, tolerance 3 ppm"
  int parameter = -1;  // index into sensor_parameters; -1: it is about the whole recording
};

struct Gate {
  std::vector<Objection> objections;  // most important first

  bool acceptable() const { return objections.empty(); }
  // No objection speaks against this value: neither one of its own nor one against the whole recording.
  bool usable(int parameter) const;
  std::vector<std::string> words() const;
};

// Of the 24 alone.
Gate judge(const CalibrationResult& result, const ParameterVector& tolerance, const Limits& limits);

// Of the 24 as fitted together with what a diagnosis named in the recording of run `amends`. `beyond`: what was found where the
// catalogue explains nothing; where several recordings confirm it, `result` holds it too.
Gate judge_amended(const CalibrationResult& result, const ParameterVector& tolerance, const Limits& limits,
                   const diagnosis::Diagnosis& diagnosis, long long amends,
                   const discovery::Discovery* beyond = nullptr);

}  // namespace selfcal
