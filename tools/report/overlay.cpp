#include "tools/report/overlay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "estimator/models/segments.hpp"
#include "estimator/statistics/median.hpp"
#include "tools/report/overlay_innovations.hpp"
#include "tools/report/overlay_noise.hpp"

namespace selfcal::report {
namespace {

constexpr double outside = 0.05;  // of the points of a right simulation
constexpr double chance = 0.01;   // of a right simulation, once a kind
constexpr std::size_t most_told = 5;

// Octaves of the Allan deviation share a third of what they tell; the histogram's bins add up to one.
double independent_of(OverlayKind kind, int points) {
  switch (kind) {
    case OverlayKind::allan: return points / 1.5;
    case OverlayKind::histogram: return std::max(1.0, points - 1.0);
    default: return points;
  }
}

// The smallest share that `n` independent points of 95 % fall below no more often than `chance`.
double least_share(double n) {
  double probability = std::pow(1.0 - outside, n), tail = 1.0 - probability;
  double out = 0.0;
  while (tail > chance && out < n) {
    probability *= (n - out) / (out + 1.0) * outside / (1.0 - outside);
    tail -= probability;
    out += 1.0;
  }
  return 1.0 - out / n;
}

std::string words_of(const OverlayCurve& curve, const OverlayPoint& p) {
  return curve.log ? fmt::format("{} at {:.3g} {}: {:.3g} times the simulation's, {:.1f} sigma", curve.title, p.x,
                                 curve.x_unit, p.recording / p.simulation, std::abs(p.sigma))
                   : fmt::format("{} at {:.3g}: {:.3g} where the simulation has {:.3g}, {:.1f} sigma", curve.title, p.x,
                                 p.recording, p.simulation, std::abs(p.sigma));
}

OverlayJudgement judge(OverlayKind kind, const std::vector<OverlayCurve>& curves) {
  OverlayJudgement j;
  j.kind = kind;
  std::vector<std::pair<double, std::string>> off;
  for (const OverlayCurve& curve : curves) {
    for (const OverlayPoint& p : curve.points) {
      if (curve.kind == kind) {
        ++j.points;
        j.inside += p.inside() ? 1 : 0;
        if (!p.inside()) {
          off.emplace_back(-std::abs(p.sigma), words_of(curve, p));
        }
      }
    }
  }
  j.independent = independent_of(kind, j.points);
  j.least_share = j.points > 0 ? least_share(j.independent) : 0.0;
  if (!j.agrees()) {
    std::sort(off.begin(), off.end());
    for (std::size_t k = 0; k < std::min(most_told, off.size()); ++k) {
      j.worst.push_back(off[k].second);
    }
  }
  return j;
}

double disturbed_seconds(const CalibrationResult& result) {
  double sum = 0.0;
  for (const Disturbance& d : result.noise.disturbed) {
    sum += d.end_s - d.start_s;
  }
  return sum;
}

// Why innovations differ, where seconds of the recording were disturbed: they count for less in it, and a spectrum is the mean of all times.
std::optional<std::string> larger_by_disturbances(const std::vector<OverlayCurve>& curves, const ImuData& recording,
                                                  const CalibrationResult& of_recording,
                                                  const CalibrationResult& of_simulation) {
  const std::vector<Segment> segments = find_segments(recording);
  const auto sizes = std::find_if(curves.begin(), curves.end(), [](const OverlayCurve& c) { return c.id == "sizes"; });
  if (sizes == curves.end() || of_recording.noise.disturbed.empty() ||
      std::any_of(segments.begin(), segments.end(), [](const Segment& s) { return s.rotation; })) {
    return std::nullopt;
  }
  std::vector<double> ratio;
  for (const OverlayPoint& p : sizes->points) {
    ratio.push_back(p.simulation / p.recording);
  }
  if (ratio.empty() || !(median(ratio) > 1.0)) {
    return std::nullopt;
  }
  const double own = disturbed_seconds(of_recording), other = disturbed_seconds(of_simulation);
  const std::string counted =
      other > 0.0 ? fmt::format(
                        "{:.0f} s of the recording and {:.0f} s of the simulation were disturbed and count for "
                        "less",
                        own, other)
                  : fmt::format(
                        "{:.0f} s of the recording were disturbed and count for less; spectra spread what "
                        "shook it over all times",
                        own);
  return fmt::format("{}: in the middle minute the simulation's innovations have {:.1f} times the mean square", counted,
                     median(ratio));
}

}  // namespace

const char* name_of(OverlayKind kind) {
  switch (kind) {
    case OverlayKind::spectrum: return "spectra";
    case OverlayKind::allan: return "Allan deviation";
    case OverlayKind::innovations: return "innovations";
    case OverlayKind::histogram: break;
  }
  return "histogram of the innovations";
}

bool Overlay::agrees() const {
  return std::all_of(judgements.begin(), judgements.end(), [](const OverlayJudgement& j) { return j.agrees(); });
}

Overlay lay_over(const ImuData& recording, const CalibrationResult& of_recording, const ImuData& simulation,
                 const CalibrationResult& of_simulation) {
  Overlay overlay;
  overlay.curves = overlay_spectra(recording, simulation);
  for (auto more : {overlay_allan(recording, simulation),
                    overlay_innovations(recording, of_recording, simulation, of_simulation)}) {
    overlay.curves.insert(overlay.curves.end(), more.begin(), more.end());
  }
  for (int kind = 0; kind < overlay_kind_count; ++kind) {
    OverlayJudgement j = judge(static_cast<OverlayKind>(kind), overlay.curves);
    if (j.kind == OverlayKind::innovations && !j.agrees()) {
      if (const auto why = larger_by_disturbances(overlay.curves, recording, of_recording, of_simulation)) {
        j.worst.push_back(*why);
      }
    }
    if (j.points > 0) {
      overlay.judgements.push_back(j);
    }
  }
  return overlay;
}

}  // namespace selfcal::report
