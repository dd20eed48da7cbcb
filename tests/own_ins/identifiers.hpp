// The numbers of our own INS, for the tests alone: what the programs know of them stands in config/profiles/selfcal.toml.
#pragma once

#include <cstdint>

namespace selfcal::ins {

namespace can_id {
inline constexpr std::uint32_t request = 0x640;     // tester to INS, default; settable
inline constexpr std::uint32_t response = 0x648;    // INS to tester
inline constexpr std::uint32_t functional = 0x7DF;  // tester to all
inline constexpr std::uint32_t status = 0x650;      // INS, periodic: InsState
inline constexpr std::uint32_t gimbal = 0x651;      // INS, periodic: InsGimbal
}  // namespace can_id

namespace did {
inline constexpr std::uint16_t serial_number = 0xF18C;          // ASCII
inline constexpr std::uint16_t software_version = 0xF195;       // ASCII
inline constexpr std::uint16_t state = 0x0200;                  // StateRecord
inline constexpr std::uint16_t schedule = 0x0201;               // ScheduleRecord; writable
inline constexpr std::uint16_t site = 0x0202;                   // SiteRecord; writable
inline constexpr std::uint16_t coefficients_in_force = 0x0210;  // Coefficients, as taken at power-on
inline constexpr std::uint16_t coefficients_inactive = 0x0211;  // Coefficients in the slot not in force; writable
inline constexpr std::uint16_t coefficients_factory = 0x0212;   // Coefficients
inline constexpr std::uint16_t raw_data_directory = 0x0220;     // DirectoryRecord
inline constexpr std::uint16_t sample_format = 0x0221;          // SampleFormatRecord
}  // namespace did

namespace routine {
inline constexpr std::uint16_t self_calibration = 0x0301;     // start: run id u32; stop; result: RunRecord
inline constexpr std::uint16_t erase_inactive = 0x0302;       // start: erase the inactive coefficient slot
inline constexpr std::uint16_t commit_coefficients = 0x0303;  // start: CRC u32 of the record to be made valid
inline constexpr std::uint16_t navigation_check = 0x0304;     // start: NavigationCheckRequest; result: ...Record
}  // namespace routine

}  // namespace selfcal::ins
