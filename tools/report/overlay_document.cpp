#include "tools/report/overlay_document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tools/report/page.hpp"

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

Json judgement_json(const OverlayJudgement& j) {
  return {{"what", name_of(j.kind)},     {"points", j.points},     {"inside", j.inside},
          {"share", rounded(j.share())}, {"expected_share", 0.95}, {"least_share", rounded(j.least_share)},
          {"agrees", j.agrees()},        {"worst", j.worst}};
}

Json curve_json(const OverlayCurve& curve) {
  Json x = Json::array(), recording = Json::array(), simulation = Json::array(), low = Json::array(),
       high = Json::array();
  for (const OverlayPoint& p : curve.points) {
    x.push_back(rounded(p.x));
    recording.push_back(rounded(p.recording));
    simulation.push_back(rounded(p.simulation));
    low.push_back(rounded(p.low));
    high.push_back(rounded(p.high));
  }
  return {{"what", name_of(curve.kind)},
          {"id", curve.id},
          {"title", curve.title},
          {"x", {{"label", curve.x_label}, {"unit", curve.x_unit}, {"log", curve.log && curve.id != "sizes"}}},
          {"y", {{"label", curve.y_label}, {"unit", curve.y_unit}, {"log", curve.log}}},
          {"values", std::move(x)},
          {"recording", std::move(recording)},
          {"simulation", std::move(simulation)},
          {"low", std::move(low)},
          {"high", std::move(high)}};
}

Json summary(const Overlay& overlay) {
  std::string differing, first;
  for (const OverlayJudgement& j : overlay.judgements) {
    if (!j.agrees()) {
      differing += (differing.empty() ? "" : ", ") + std::string(name_of(j.kind));
      first = first.empty() ? j.worst.front() : first;
    }
  }
  if (overlay.judgements.empty()) {
    return {{"standing", "open"},
            {"verdict", "Recording and simulation are too short to be laid over each other."},
            {"cause", ""},
            {"next", ""}};
  }
  if (differing.empty()) {
    return {{"standing", "good"},
            {"verdict", "Recording and simulation agree as far as recordings of this length can tell."},
            {"cause", ""},
            {"next", ""}};
  }
  return {{"standing", "bad"},
          {"verdict", "Recording and simulation differ: " + differing + "."},
          {"cause", first + "."},
          {"next", ""}};
}

}  // namespace

Json overlay_document(const Overlay& overlay, const std::string& recording, const std::string& simulation) {
  Json judgements = Json::array(), curves = Json::array();
  for (const OverlayJudgement& j : overlay.judgements) {
    judgements.push_back(judgement_json(j));
  }
  for (const OverlayCurve& curve : overlay.curves) {
    curves.push_back(curve_json(curve));
  }
  return {{"kind", "overlay"},     {"summary", summary(overlay)},         {"input", {{"name", recording}}},
          {"against", simulation}, {"judgements", std::move(judgements)}, {"curves", std::move(curves)}};
}

std::string overlay_text(const Overlay& overlay) {
  std::string text =
      fmt::format("{:<30}{:>8}{:>18}{:>12}{:>10}\n", "", "points", "inside the band", "expected", "least");
  for (const OverlayJudgement& j : overlay.judgements) {
    text += fmt::format("{:<30}{:>8}{:>16.1f} %{:>10} %{:>8.1f} %  {}\n", name_of(j.kind), j.points, 100.0 * j.share(),
                        95, 100.0 * j.least_share, j.agrees() ? "agrees" : "DIFFERS");
  }
  for (const OverlayJudgement& j : overlay.judgements) {
    for (const std::string& words : j.worst) {
      text += "  " + words + "\n";
    }
  }
  return text;
}

}  // namespace selfcal::report
