// What a number on the command line may be: every option's range stands here and nowhere else.
#pragma once

#include <cstdint>
#include <limits>

namespace selfcal {

// Ends included.
struct Range {
  double least, most;
  const char* unit;  // "" for a bare number
};

struct WholeRange {
  std::uint64_t least, most;
};

namespace range {

// Sensors and observation. From what no instrument reaches to what is no inertial sensor any more.
inline constexpr Range arw{1e-8, 1e3, "deg/sqrt(h)"};
inline constexpr Range vrw{1e-5, 1e7, "ug/sqrt(Hz)"};
inline constexpr Range position_noise{1e-9, 1e4, "m"};
inline constexpr Range gyro_quantum{0.0, 3600.0, "arcsec"};  // 0: none
inline constexpr Range accel_quantum{0.0, 1.0, "m/s"};
inline constexpr Range gyro_unit{1e-12, 1e6, "rad/s"};

// Schedules; the upper limits are those of a schedule file.
inline constexpr Range dwell{0.1, 86400.0, "s"};
inline constexpr Range rotation{0.1, 3600.0, "s"};
inline constexpr Range longest_schedule{60.0, 86400.0, "s"};

// Site and attitude. At the poles there is no north.
inline constexpr Range latitude{-89.0, 89.0, "deg"};
inline constexpr Range height{-500.0, 9000.0, "m"};
inline constexpr Range angle{-360.0, 360.0, "deg"};

// A recording's; as its check has it.
inline constexpr Range sample_rate{1.0, 20000.0, "Hz"};

// Statistics and passes.
inline constexpr Range false_alarm_rate{1e-6, 0.2, ""};
inline constexpr Range convergence{1e-6, 1.0, ""};
inline constexpr WholeRange passes{3, 99};

inline constexpr WholeRange seed{0, std::numeric_limits<std::uint64_t>::max()};
inline constexpr WholeRange run{1, std::numeric_limits<std::int64_t>::max()};  // as the database numbers them
inline constexpr WholeRange frames{1, std::numeric_limits<std::uint64_t>::max()};
inline constexpr Range waiting{1e-3, 1e8, "s"};
inline constexpr Range interval{1.0, 36500.0, "days"};

// The virtual INS.
inline constexpr Range speed{0.01, 1e5, ""};
inline constexpr Range patience{1.0, 1000.0, ""};
inline constexpr Range turnaround{0.0, 1000.0, "ms"};
inline constexpr WholeRange bit_rate{10'000, 1'000'000};        // ISO 11898-2: nominal
inline constexpr WholeRange data_bit_rate{10'000, 20'000'000};  // data phase, up to CAN SIC XL transceivers

}  // namespace range
}  // namespace selfcal
