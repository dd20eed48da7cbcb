// How a command writes a page: set by the command `report`, which a build without npm lacks.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "estimator/planning/plan.hpp"
#include "protocol/error.hpp"
#include "tools/report/plan_document.hpp"

namespace selfcal::cli {

using PlanPageWriter = Expected<void> (*)(const std::vector<report::PlannedSchedule>&, const Installation&,
                                          const std::filesystem::path&);

// Null where pages cannot be written.
PlanPageWriter& plan_page_writer();

// .html or .pdf: a page rather than a file of another kind.
bool is_page(const std::filesystem::path& file);

}  // namespace selfcal::cli
