#include "tools/report/plan_document.hpp"

#include <nlohmann/json.hpp>

#include "estimator/geometry/units.hpp"
#include "tools/report/page.hpp"

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr int points_per_move = 12;  // of the path on the sphere: 7.5 deg apart in a quarter turn

// Direction of gravity (down) in b.
Json gravity_in_b(const GimbalPosition& at, const Installation& installation) {
  const Matrix3 C_nb = attitude_matrix(installation.attitude) *
                       gimbal_matrix(at.outer_deg * units::degree, at.inner_deg * units::degree);
  const Vector3 g_b = C_nb.transpose() * Vector3(0.0, -1.0, 0.0);  // n is north, up, east
  return {rounded(g_b.x()), rounded(g_b.y()), rounded(g_b.z())};
}

// Corners of the time line and points on the way; a move turns both axes evenly here, which its path does not depend on.
Json track(const Schedule& schedule, const Installation& installation) {
  Json time = Json::array(), outer = Json::array(), inner = Json::array(), gravity = Json::array();
  const auto add = [&](double at_s, const GimbalPosition& at) {
    time.push_back(rounded(at_s));
    outer.push_back(rounded(at.outer_deg));
    inner.push_back(rounded(at.inner_deg));
    gravity.push_back(gravity_in_b(at, installation));
  };
  double now = 0.0;
  for (std::size_t k = 0; k < schedule.positions.size(); ++k) {
    const GimbalPosition& here = schedule.positions[k];
    if (k > 0) {
      const GimbalPosition& before = schedule.positions[k - 1];
      for (int step = 1; step < points_per_move; ++step) {
        const double share = static_cast<double>(step) / points_per_move;
        add(now + share * schedule.rotation_s, {before.outer_deg + share * (here.outer_deg - before.outer_deg),
                                                before.inner_deg + share * (here.inner_deg - before.inner_deg)});
      }
      now += schedule.rotation_s;
    }
    add(now, here);
    now += schedule.dwell_s[k];
    add(now, here);
  }
  return {{"time_s", std::move(time)},
          {"outer_deg", std::move(outer)},
          {"inner_deg", std::move(inner)},
          {"gravity_b", std::move(gravity)}};
}

Json positions(const Schedule& schedule, const Installation& installation) {
  Json list = Json::array();
  double now = 0.0;
  for (std::size_t k = 0; k < schedule.positions.size(); ++k) {
    const GimbalPosition& at = schedule.positions[k];
    list.push_back({{"position", k + 1},
                    {"start_s", now},
                    {"dwell_s", schedule.dwell_s[k]},
                    {"outer_deg", at.outer_deg},
                    {"inner_deg", at.inner_deg},
                    {"gravity_b", gravity_in_b(at, installation)}});
    now += schedule.dwell_s[k] + schedule.rotation_s;
  }
  return list;
}

}  // namespace

Json plan_document(const std::vector<PlannedSchedule>& schedules, const Installation& installation) {
  Json document = {{"kind", "plan"},
                   {"installation",
                    {{"roll_deg", installation.attitude.roll / units::degree},
                     {"pitch_deg", installation.attitude.pitch / units::degree},
                     {"heading_deg", installation.attitude.heading / units::degree},
                     {"latitude_deg", installation.site.latitude / units::degree},
                     {"height_m", installation.site.height},
                     {"gyro_arw_deg_per_sqrt_h", installation.gyro_arw / units::degree_per_sqrt_hour},
                     {"accel_vrw_ug_per_sqrt_hz", installation.accel_vrw / units::micro_g_per_sqrt_hz},
                     {"position_sigma_m", installation.position_sigma}}},
                   {"plans", Json::array()}};
  for (const PlannedSchedule& planned : schedules) {
    Json entry = planned.prediction;
    entry["name"] = planned.name;
    entry["track"] = track(planned.schedule, installation);
    entry["positions"] = positions(planned.schedule, installation);
    document["plans"].push_back(std::move(entry));
  }
  return document;
}

}  // namespace selfcal::report
