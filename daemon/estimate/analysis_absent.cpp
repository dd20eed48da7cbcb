// A program without the diagnosis: see analysis.hpp and amendment_job.hpp.
#include "daemon/estimate/analysis.hpp"

namespace selfcal {

Cause cause_of(const ImuData&, const diagnosis::DiagnosisOptions&,
               const std::function<void(const std::string& step)>&) {
  return {std::nullopt, "this program is built without the diagnosis; `tools/setup programs` builds it", std::nullopt};
}

std::string words_in_catalogue(std::string_view) { return {}; }

}  // namespace selfcal
