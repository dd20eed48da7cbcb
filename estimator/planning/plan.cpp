#include "estimator/planning/plan.hpp"

#include <algorithm>

#include "estimator/passes/consistency.hpp"
#include "estimator/planning/remedy.hpp"
#include "estimator/planning/schedule_model.hpp"

namespace selfcal {

bool Plan::meets_tolerances() const {
  return std::all_of(determined.begin(), determined.end(), [](bool d) { return d; });
}

Plan predict(const Schedule& schedule, const Installation& installation) {
  ScheduleModel model(installation);
  UdFilter filter = model.start();
  Plan plan;
  plan.duration_s = schedule.duration_s();
  double time = 0.0;
  for (std::size_t i = 0; i < schedule.positions.size(); ++i) {
    if (i > 0) {
      model.move(filter, schedule.positions[i - 1], schedule.positions[i], schedule.rotation_s);
      time += schedule.rotation_s;
    }
    model.dwell(filter, schedule.positions[i], schedule.dwell_s[i]);
    time += schedule.dwell_s[i];
    plan.history.push_back({time, ScheduleModel::sigma(filter)});
  }
  plan.sigma = ScheduleModel::sigma(filter);
  plan.covariance = ScheduleModel::covariance(filter);
  for (int i = 0; i < sensor_parameter_count; ++i) {
    plan.determined[static_cast<std::size_t>(i)] = plan.sigma(i) <= installation.tolerance(i);
  }
  plan.undetermined = undetermined_directions(plan.covariance, installation.tolerance);
  add_remedies(plan.undetermined, plan.covariance, installation);
  return plan;
}

}  // namespace selfcal
