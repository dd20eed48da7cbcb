// What the page of a plan shows: a schedule on a time line, gravity in b, and sigma against time; one or two schedules.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "estimator/planning/plan.hpp"

namespace selfcal::report {

struct PlannedSchedule {
  std::string name;
  Schedule schedule;
  Plan plan;
  nlohmann::ordered_json prediction;  // what `selfcal plan --json` says of it
};

nlohmann::ordered_json plan_document(const std::vector<PlannedSchedule>& schedules, const Installation& installation);

}  // namespace selfcal::report
