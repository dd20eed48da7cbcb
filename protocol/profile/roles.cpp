#include "protocol/profile/roles.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace selfcal::profile {
namespace {

using F = RoleField;
using Words = std::string_view;

constexpr std::array<Words, 7> states{"starting", "idle", "rotating", "complete", "aborted", "failed", "checking"};
constexpr std::array<Words, 3> slots{"factory", "a", "b"};
constexpr std::array<Words, 2> answers{"no", "yes"};

constexpr std::array state_fields{
    F{"state", "", true, "what the INS is doing", states},
    F{"faults", "", false, "bits: 1 gimbal, 2 sensor, 4 FLASH, 8 coefficients (no valid slot)"},
    F{"in_force", "", false, "slot of the coefficients in force", slots},
    F{"coefficients_version", "", false, "of the set in force"},
    F{"coefficients_crc", "", false, "checksum of the set in force"},
    F{"run_id", "", true, "latest self-calibration; 0: none"},
    F{"power_cycles", "", true, "counts every power-on"},
    F{"gimbal_moving", "", false, "1: the gimbal turns"},
    F{"outer", "deg", false, "gimbal angle"},
    F{"inner", "deg", false, "gimbal angle"}};
constexpr std::array move_fields{F{"outer", "mdeg", true, "of the position"},
                                 F{"inner", "mdeg", true, "of the position"}};
constexpr std::array schedule_fields{
    F{"positions", "", true, "number of positions"}, F{"rotation", "ms", true, "from one position to the next"},
    F{"outer", "mdeg", true, "of each position", {}, 1, true},
    F{"inner", "mdeg", true, "of each position", {}, 1, true}, F{"dwell", "ms", true, "at each position", {}, 1, true}};
constexpr std::array site_fields{F{"latitude", "deg", true, "WGS-84"}, F{"longitude", "deg", true, "WGS-84"},
                                 F{"height", "m", true, "above the ellipsoid"}};
constexpr std::array directory_fields{
    F{"run_id", "", true, "latest run"},
    F{"first_page", "", false, "older ones were overwritten by the ring"},
    F{"pages_written", "", true, "pages first_page to pages_written - 1 can be uploaded"},
    F{"pages_expected", "", false, "of the whole schedule"},
    F{"samples", "", true, "written so far"},
    F{"complete", "", true, "no more will come", answers}};
constexpr std::array sample_format_fields{
    F{"sample_rate", "Hz", true, "of the IMU"},
    F{"angle_per_count", "rad", true, "of an angle increment"},
    F{"velocity_per_count", "m/s", true, "of a velocity increment"},
    F{"gimbal_per_count", "rad", false, "of a gimbal read-out that is told in counts"},
    F{"page_bytes", "", false, "bytes of a page"},
    F{"samples_per_page", "", false, "samples of a full page"}};
constexpr std::array set_fields{F{"version", "", true, "counts up with every calibration; 0: factory"},
                                F{"date", "s", false, "of the calibration, since 1970 UTC"},
                                F{"author", "", false, "who calibrated", {}, 1, false, true},
                                F{"values", "", false, "all 24 in their order", {}, 24}};
constexpr std::array run_id_fields{F{"run_id", "", true, "the number by which the run's data are known again"}};
constexpr std::array run_fields{F{"state", "", true, "as in state", states}, F{"faults", "", false, "as in state"},
                                F{"position", "", true, "1 is the first; 0: not in a schedule"},
                                F{"run_id", "", true, "the run's number"}, F{"pages_written", "", false, "so far"}};
constexpr std::array commit_fields{F{"checksum", "", false, "the one that the set's record holds"}};
constexpr std::array check_start_fields{F{"duration", "s", true, "of the INS's own time"},
                                        F{"compensation", "", false, "the set that is navigated with", slots}};
constexpr std::array check_fields{F{"done", "", true, "over", answers}, F{"elapsed", "s", true, "so far"},
                                  F{"north", "m", false, "computed less known position"},
                                  F{"east", "m", false, "computed less known position"},
                                  F{"max_horizontal", "m", true, "largest so far"}};
constexpr std::array page_fields{F{"samples", "", true, "in this page"},
                                 F{"run_id", "", true, "whose page it is"},
                                 F{"sequence", "", true, "page of the run, from 0"},
                                 F{"first_sample", "", false, "its number in the run, from 0"},
                                 F{"temperature", "degC", false, "of the IMU"},
                                 F{"flags", "", false, "bits: 1 last of the run, 2 a sensor saturated"},
                                 F{"delta_theta", "", true, "angle increments x y z, counts", {}, 3, true},
                                 F{"delta_v", "", true, "velocity increments x y z, counts", {}, 3, true},
                                 F{"outer", "rad", true, "gimbal read-out, counts or an angle", {}, 1, true},
                                 F{"inner", "rad", true, "gimbal read-out, counts or an angle", {}, 1, true}};

constexpr std::array roles{
    RecordRole{"state", "what the INS is doing", state_fields},
    RecordRole{"schedule", "the rotation", schedule_fields, false},
    RecordRole{"move", "a position that the gimbal is told by itself", move_fields, false},
    RecordRole{"site", "where the INS is", site_fields, false},
    RecordRole{"directory", "the raw-data pages of the latest run", directory_fields},
    RecordRole{"sample_format", "what the counts of the raw data are worth", sample_format_fields},
    RecordRole{"coefficients", "a set of the 24", set_fields},
    RecordRole{"rotate.start", "option of the routine that rotates", run_id_fields},
    RecordRole{"rotate.result", "result of the routine that rotates", run_fields},
    RecordRole{"commit.start", "option of the routine that puts a set in force", commit_fields, false},
    RecordRole{"navigation_check.start", "option of the navigation check", check_start_fields, false},
    RecordRole{"navigation_check.result", "result of the navigation check", check_fields, false},
    RecordRole{"page", "a page of raw data", page_fields}};

constexpr double pi = 3.14159265358979323846;
constexpr std::array unit_table{Unit{"", "number", 1},
                                Unit{"1", "number", 1},
                                Unit{"ppm", "number", 1e-6},
                                Unit{"%", "number", 1e-2},
                                Unit{"rad", "angle", 1},
                                Unit{"mrad", "angle", 1e-3},
                                Unit{"urad", "angle", 1e-6},
                                Unit{"deg", "angle", pi / 180},
                                Unit{"mdeg", "angle", pi / 180e3},
                                Unit{"arcmin", "angle", pi / 10800},
                                Unit{"arcsec", "angle", pi / 648e3},
                                Unit{"turn", "angle", 2 * pi},
                                Unit{"s", "time", 1},
                                Unit{"ms", "time", 1e-3},
                                Unit{"us", "time", 1e-6},
                                Unit{"min", "time", 60},
                                Unit{"m", "length", 1},
                                Unit{"km", "length", 1e3},
                                Unit{"cm", "length", 1e-2},
                                Unit{"mm", "length", 1e-3},
                                Unit{"Hz", "frequency", 1},
                                Unit{"rad/s", "rate", 1},
                                Unit{"deg/s", "rate", pi / 180},
                                Unit{"deg/h", "rate", pi / 648e3},
                                Unit{"m/s", "velocity", 1},
                                Unit{"mm/s", "velocity", 1e-3},
                                Unit{"m/s^2", "acceleration", 1},
                                Unit{"g", "acceleration", 9.80665},
                                Unit{"mg", "acceleration", 9.80665e-3},
                                Unit{"ug", "acceleration", 9.80665e-6},
                                Unit{"degC", "temperature", 1}};

}  // namespace

std::span<const RecordRole> record_roles() { return roles; }

const RecordRole& record_role(std::string_view table) {
  const auto found = std::ranges::find(roles, table, &RecordRole::table);
  if (found == roles.end()) {
    std::abort();
  }
  return *found;
}

std::span<const Unit> units() { return unit_table; }

const Unit* find_unit(std::string_view name) {
  const auto found = std::ranges::find(unit_table, name, &Unit::name);
  return found == unit_table.end() ? nullptr : &*found;
}

}  // namespace selfcal::profile
