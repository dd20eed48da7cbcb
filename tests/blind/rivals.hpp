// What others do, on the same recordings: to be measured against.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::blind {

struct RivalAnswers {
  // Portmanteau test and size of the innovations of the 24-parameter fit, at the same false-alarm rate; no names.
  bool whiteness_alarms = false;
  // Forward selection of effects by the fall of the BIC, one linear fit, no correction for their number.
  std::vector<std::string> bic_names;
  // All effects estimated together always, prior of ten typical sizes; those beyond 3 sigma count as its claims.
  std::vector<std::string> always_on_names;
  ParameterVector always_on_value = ParameterVector::Zero();
  ParameterVector always_on_sigma = ParameterVector::Zero();
};

RivalAnswers ask_rivals(const ImuData& data, const diagnosis::Diagnosis& diagnosis, double false_alarm_rate);

}  // namespace selfcal::blind
