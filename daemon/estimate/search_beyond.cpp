#include "daemon/estimate/search_beyond.hpp"

#include <utility>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "estimator/discovery/kept_names.hpp"
#include "estimator/discovery/names_beside_laws.hpp"

namespace selfcal {

tl::expected<BeyondSearch, std::string> search_beyond(std::span<const discovery::DiagnosedRecording> unit,
                                                      const diagnosis::DiagnosisOptions& of_catalogue,
                                                      const discovery::DiscoveryOptions& of_laws,
                                                      diagnosis::Diagnosis& first,
                                                      const discovery::Progress& progress) {
  auto rest = discovery::UnexplainedRest::of(unit, of_laws.stop);
  if (!rest) {
    return tl::unexpected(rest.error());
  }
  discovery::LawSearch search(rest->recordings(), of_laws, progress);
  if (unit.size() == 1) {
    if (auto both = discovery::names_beside_laws(unit.front().data, first, rest->recordings().front(), search.fitted(),
                                                 of_catalogue, of_laws, progress)) {
      first = std::move(both->diagnosis);
      return BeyondSearch{std::move(both->rest), std::move(both->laws)};
    }
    if (auto alone = discovery::laws_in_place_of_names(unit.front().data, first, rest->recordings().front(),
                                                       search.fitted(), of_laws, progress)) {
      replace_process(alone->diagnosis, alone->laws);
      if (alone->diagnosis.unexplained) {
        first = std::move(alone->diagnosis);
        return BeyondSearch{std::move(alone->rest), std::move(alone->laws)};
      }
    }
  }
  discovery::Discovery told = search.told();
  BeyondSearch answer{std::move(*rest), std::move(told)};
  replace_process(first, answer.found);
  if (unit.size() == 1 &&
      discovery::say_what_was_rejected(answer.rest.recordings().front(), first, answer.found, of_laws.stop)) {
    discovery::keep_rejected_names(first, answer.found);
    answer.said_by_catalogue = true;
  }
  return answer;
}

}  // namespace selfcal
