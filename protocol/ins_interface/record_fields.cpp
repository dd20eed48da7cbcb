#include "protocol/ins_interface/record_fields.hpp"

#include <array>

#include "protocol/ins_interface/coefficients.hpp"

namespace selfcal::ins {
namespace {

using F = FieldType;

constexpr std::array state_fields{
    RecordField{"state", F::u8, 1, "0 starting, 1 idle, 2 rotating, 3 complete, 4 aborted, 5 failed, 6 checking"},
    RecordField{"faults", F::u8, 1, "bits: 1 gimbal, 2 sensor, 4 FLASH, 8 coefficients (no valid slot)"},
    RecordField{"in_force", F::u8, 1, "slot of the coefficients in force: 0 factory, 1 A, 2 B"},
    RecordField{"coefficients_version", F::u32, 1, "of the set in force"},
    RecordField{"coefficients_crc", F::u32, 1, "CRC-32C of the set in force"},
    RecordField{"run_id", F::u32, 1, "latest self-calibration; 0: none"},
    RecordField{"power_cycles", F::u32, 1, "counts every power-on"}};
constexpr std::array schedule_fields{RecordField{"positions", F::u8, 1, "number of positions, 1 to 255"},
                                     RecordField{"rotation_ms", F::u32, 1, "from one position to the next"},
                                     RecordField{"outer_mdeg", F::i32, 1, "of each position, within one turn", true},
                                     RecordField{"inner_mdeg", F::i32, 1, "of each position, within one turn", true},
                                     RecordField{"dwell_ms", F::u32, 1, "at each position", true}};
constexpr std::array site_fields{RecordField{"latitude_deg", F::f64, 1, "WGS-84, -90 to 90"},
                                 RecordField{"longitude_deg", F::f64, 1, "-360 to 360"},
                                 RecordField{"height_m", F::f64, 1, "above the ellipsoid, -1000 to 20,000"}};
constexpr std::array directory_fields{
    RecordField{"run_id", F::u32, 1, "latest run"},
    RecordField{"first_page", F::u32, 1, "older ones were overwritten by the ring"},
    RecordField{"pages_written", F::u32, 1, "pages first_page to pages_written - 1 can be uploaded"},
    RecordField{"pages_expected", F::u32, 1, "of the whole schedule"},
    RecordField{"samples", F::u64, 1, "written so far"},
    RecordField{"complete", F::u8, 1, "1: no more will come"}};
constexpr std::array sample_format_fields{
    RecordField{"sample_rate_hz", F::f64, 1, "of the IMU, 0.5 to 20,000"},
    RecordField{"delta_theta_lsb_rad", F::f64, 1, "rad per count of an angle increment, 1e-13 to 1e-3"},
    RecordField{"delta_v_lsb_mps", F::f64, 1, "m/s per count of a velocity increment, 1e-11 to 0.1"},
    RecordField{"gimbal_lsb_rad", F::f64, 1, "rad per count of a gimbal read-out, 1e-9 to 0.1"},
    RecordField{"page_bytes", F::u32, 1, "bytes of a page, 4096"},
    RecordField{"samples_per_page", F::u16, 1, "samples of a full page, 1 to 145"}};
constexpr std::array run_fields{RecordField{"state", F::u8, 1, "as in StateRecord"},
                                RecordField{"faults", F::u8, 1, "as in StateRecord"},
                                RecordField{"position", F::u8, 1, "1 is the first; 0: not in a schedule"},
                                RecordField{"run_id", F::u32, 1, ""}, RecordField{"pages_written", F::u32, 1, ""}};
constexpr std::array navigation_request_fields{
    RecordField{"duration_s", F::u32, 1, "of the INS's own time"},
    RecordField{"compensation", F::u8, 1, "0: the factory's set; 1 or 2: what is in force"}};
constexpr std::array navigation_result_fields{
    RecordField{"done", F::u8, 1, "1: over"}, RecordField{"elapsed_s", F::f64, 1, ""},
    RecordField{"north_m", F::f64, 1, "computed less known position"}, RecordField{"east_m", F::f64, 1, "the same"},
    RecordField{"max_horizontal_m", F::f64, 1, "largest so far"}};
constexpr std::array coefficients_fields{
    RecordField{"magic", F::text, 4, "\"SCCO\""},
    RecordField{"format", F::u16, 1, "1"},
    RecordField{"reserved", F::zero, 2, "0"},
    RecordField{"version", F::u32, 1, "counts up with every calibration; 0: factory"},
    RecordField{"date_s", F::i64, 1, "of the calibration, s since 1970 UTC"},
    RecordField{"author", F::text, author_bytes, "ASCII, filled with zero bytes"},
    RecordField{"value", F::f64, coefficient_count, "the 24 in their order, SI units"},
    RecordField{"reserved", F::zero, 12, "0"},
    RecordField{"crc", F::u32, 1, "CRC-32C of the 256 bytes before"}};

constexpr std::array layouts{
    RecordLayout{"StateRecord", "what the INS is doing", state_fields},
    RecordLayout{"ScheduleRecord", "the rotation; the last three fields once for each position", schedule_fields},
    RecordLayout{"SiteRecord", "where the INS is", site_fields},
    RecordLayout{"Coefficients", "a set of the 24", coefficients_fields},
    RecordLayout{"DirectoryRecord", "the raw-data pages of the latest run", directory_fields},
    RecordLayout{"SampleFormatRecord", "what the counts of the raw data are worth", sample_format_fields},
    RecordLayout{"RunRecord", "result of selfCalibration", run_fields},
    RecordLayout{"NavigationCheckRequest", "start of navigationCheck: free-inertial navigation at rest",
                 navigation_request_fields},
    RecordLayout{"NavigationCheckRecord", "result of navigationCheck: how far it drifted", navigation_result_fields}};

}  // namespace

std::span<const RecordLayout> record_layouts() { return layouts; }

std::string_view name(FieldType type) {
  switch (type) {
    case F::u8: return "u8";
    case F::u16: return "u16";
    case F::u32: return "u32";
    case F::u64: return "u64";
    case F::i32: return "i32";
    case F::i64: return "i64";
    case F::f64: return "f64";
    case F::text: return "text";
    case F::zero: return "zero";
  }
  return "";
}

std::size_t bytes(const RecordField& field) {
  switch (field.type) {
    case F::u16: return 2 * field.count;
    case F::u32:
    case F::i32: return 4 * field.count;
    case F::u64:
    case F::i64:
    case F::f64: return 8 * field.count;
    case F::u8:
    case F::text:
    case F::zero: return field.count;
  }
  return 0;
}

}  // namespace selfcal::ins
