// A recording laid over a simulation of it: where do they differ by more than chance allows recordings of this length?
//
// Each curve is an estimate from the recording, the same from the simulation, and the band in which the recording's would lie
// with 95 % if both were draws of one noise. Both estimates scatter; the band is about the simulation's and holds both.
#pragma once

#include <string>
#include <vector>

#include "estimator/models/imu_data.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal::report {

enum class OverlayKind { spectrum, allan, innovations, histogram };
constexpr int overlay_kind_count = 4;

struct OverlayPoint {
  double x = 0.0, recording = 0.0, simulation = 0.0;
  double low = 0.0, high = 0.0;  // 95 %
  double sigma = 0.0;            // by how much the recording's is off
  bool inside() const { return low <= recording && recording <= high; }
};

struct OverlayCurve {
  OverlayKind kind = OverlayKind::spectrum;
  std::string id, title, x_label, x_unit, y_label, y_unit;
  bool log = true;
  std::vector<OverlayPoint> points;
};

struct OverlayJudgement {
  OverlayKind kind = OverlayKind::spectrum;
  int points = 0, inside = 0;
  double independent = 0.0;        // of the points: what neighbours do not share
  double least_share = 0.0;        // below it chance once in a hundred times
  std::vector<std::string> worst;  // where they differ, the worst first; empty where they agree
  double share() const { return points > 0 ? static_cast<double>(inside) / points : 1.0; }
  bool agrees() const { return share() >= least_share; }
};

struct Overlay {
  std::vector<OverlayCurve> curves;
  std::vector<OverlayJudgement> judgements;  // one a kind that has points
  bool agrees() const;
};

// The recording's and the simulation's innovations are those of the same noise: of `recording`'s calibration, or where a coarse quantum
// colours them as the diagnosis fits it, both about the point where passes in that noise end.
Overlay lay_over(const ImuData& recording, const CalibrationResult& of_recording, const ImuData& simulation,
                 const CalibrationResult& of_simulation);

const char* name_of(OverlayKind kind);

}  // namespace selfcal::report
