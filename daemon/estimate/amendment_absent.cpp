// A service without the diagnosis: see analysis.hpp.
#include <fmt/format.h>

#include "daemon/estimate/amendment_job.hpp"

namespace selfcal {

EstimateJob amendment_job(AmendmentRequest request) {
  return [run = request.amends.run](const EstimateProgress&, const std::stop_token&) -> Expected<Estimate> {
    return fail(ErrorKind::usage, fmt::format("run {} cannot be amended: this service is built without the diagnosis; "
                                              "`tools/setup programs` builds it whole",
                                              run));
  };
}

}  // namespace selfcal
