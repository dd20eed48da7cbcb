// Which unit makes of a number what physics says that it is.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/import/motion.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::import {

struct UnitFit {
  std::string unit;
  bool increments = false;
  double off = 0.0;                 // |ln(seen / expected)|
  std::vector<std::string> rivals;  // others that fit about as well: "deg, increments"
};

// What the names say: a unit, or only that they are increments.
struct UnitClaim {
  std::string unit;
  bool increments = false;
};

// Gyros: RAD_PER_SAMPLE is what a count stands for in a sample, seen in the turns. nullopt: no unit within a quarter.
std::optional<UnitFit> gyro_unit(double rad_per_sample, double interval_s, const UnitClaim& claim);

// Accelerometers: SIZE is the size of gravity in counts. nullopt: no unit within 8 %.
std::optional<UnitFit> accelerometer_unit(double size, double interval_s, const UnitClaim& claim);

// ln: a scale error of an instrument in a unit that no name says. Whole numbers are likely to be counts: 1024 of MMA8451's
// are 1 g, 16.4 of MPU-6050's 1 deg/s.
double nearness(const TriadColumns& triad);

struct TemperatureFit {
  std::string unit;  // "C", "K", "F"
  std::string words;
  bool doubt = false;
};
// Of a column with this mean; CLAIMED may be empty.
// `whole`: all values are whole numbers: 293 may be a register's 29.3 degC as well as 20 degC in K.
// `counts`: the sensors beside it are counts.
TemperatureFit temperature_unit(double mean, const std::string& claimed, bool whole, bool counts);

// Units (s, ms, us, ns) in which times with this interval make 1 Hz to 20 kHz, the likeliest first.
std::vector<std::string> time_units(double interval);
// The same of a whole log: not by what the interval leaves open, where in one unit alone the stamps are since 1970 of this century, or where in
// one of them the log is over within a second and its stamps are no whole numbers.
std::vector<std::string> time_units_of(const std::vector<long double>& stamps, double interval);

// The same of Xsens' SampleTimeFine, which counts 100us in some instruments and us in others, at 2 Hz to 5 kHz.
std::vector<std::string> xsens_time_units(double interval);

}  // namespace selfcal::import
