// What whoever knows all laws that could have been drawn, and how often each is, makes of a recording: no search does better but by luck.
#pragma once

#include <string>
#include <vector>

#include "estimator/discovery/discovery.hpp"
#include "tests/discovery/rivals.hpp"

namespace selfcal::discovery_trial {

struct PossibleForm {
  int axis = 0;
  std::string expression;  // without `?`
};

struct LimitAnswer {
  std::vector<RivalLaw> laws;  // one, or none where no form gains anything
  double gain = 0.0;           // fall of the residuals' square by it
  double carries_over = 0.0;   // probability that it holds elsewhere (estimator/discovery/carry_over.hpp)
  std::size_t likely = 0;      // forms of 1:100 or more against the likeliest
};

// One law is concealed, and each of `forms` is as likely as any other before the data; a form that stands there twice is twice as
// likely. Each is fitted by itself, the 33 states beside it; the one that most probably holds elsewhere is the answer.
LimitAnswer best_of_all(const discovery::UnitRecording& recording, const std::vector<PossibleForm>& forms);

}  // namespace selfcal::discovery_trial
