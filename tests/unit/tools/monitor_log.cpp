// monitor_log FILE POSITIONS: what the daemon says in a run of 19 positions, up to the end of the one given, as an LCM
// log. With all 19 the run is over. The figures are made up, but each follows from the position (comments).
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <selfcal_lcm/alarm.hpp>
#include <selfcal_lcm/estimate.hpp>
#include <selfcal_lcm/ins_status.hpp>
#include <selfcal_lcm/service_status.hpp>
#include <vector>

#include "estimator/geometry/sensor_parameters.hpp"

namespace {

using namespace selfcal;

constexpr int positions = 19;
constexpr double dwell_s = 150.0, rotation_s = 5.0;

template <typename Message>
void write(lcm::LogFile& log, const std::string& channel, const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  static std::int64_t number = 0;
  lcm::LogEvent event{};
  event.eventnum = number;
  event.timestamp = 1000 * ++number;  // a message a millisecond: whole runs replay in a moment
  event.channel = channel;
  event.datalen = static_cast<std::int32_t>(bytes.size());
  event.data = bytes.data();
  log.writeEvent(&event);
}

selfcal_lcm::ins_status status_at(int position) {
  selfcal_lcm::ins_status m{};
  m.schema = 2;
  m.ins = "bench";
  m.serial = "SN-0042";
  m.verdict = position < positions ? "" : "Not written: 12 of the 24 parameters are not determined to tolerance.";
  m.state = position < positions ? "rotating" : "completed";
  m.run = 7;
  m.link_up = 1;
  m.outer_deg = 90.0 * (position % 4);
  m.inner_deg = -90.0;
  m.position = position;
  m.positions = positions;
  m.time_left_s = (positions - position) * (dwell_s + rotation_s);
  m.pages_pulled = 100 * position;
  m.pages_written = 100 * position;
  m.pages_expected = 100 * positions;
  return m;
}

// Every sigma falls evenly, on a logarithmic scale, from 100 times its tolerance before the first position to a
// tenth of it (odd parameters) or to ten times it (even ones) at the end.
selfcal_lcm::estimate estimate_at(int position) {
  selfcal_lcm::estimate m{};
  m.schema = 2;
  m.ins = "bench";
  m.run = 7;
  m.count = sensor_parameter_count;
  m.running = position < positions ? 1 : 0;
  m.pass_number = position < positions ? 0 : 4;
  m.pass_fraction = position < positions ? 0.0 : 1.0;
  m.data_s = position * dwell_s;
  m.met_at_s = -1.0;
  m.finish_in_s = -1.0;
  for (std::size_t k = 0; k < sensor_parameters.size(); ++k) {
    const double end = k % 2 == 0 ? 0.1 : 10.0;
    m.name.emplace_back(sensor_parameters[k].name);
    m.unit.emplace_back(sensor_parameters[k].unit);
    m.value.push_back(0.0);
    m.tolerance.push_back(10.0);
    m.sigma.push_back(10.0 * 100.0 * std::pow(end / 100.0, static_cast<double>(position) / positions));
    m.tolerances_met += m.sigma.back() <= m.tolerance.back() ? 1 : 0;
  }
  return m;
}

selfcal_lcm::alarm alarm(const std::string& text, bool standing) {
  selfcal_lcm::alarm m{};
  m.schema = 1;
  m.ins = "bench";
  m.run = 7;
  m.standing = standing ? 1 : 0;
  m.text = text;
  return m;
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) {
    fmt::print(stderr, "usage: monitor_log FILE POSITIONS\n");
    return 2;
  }
  const int last = std::atoi(words[2]);
  lcm::LogFile log(words[1], "w");
  if (!log.good()) {
    fmt::print(stderr, "monitor_log: {} cannot be written\n", words[1]);
    return 3;
  }
  selfcal_lcm::service_status service{};
  service.schema = 1;
  service.software = "1.0";
  service.instruments = 1;
  for (int position = 1; position <= last; ++position) {
    service.runs_in_progress = position < positions ? 1 : 0;
    service.uptime_s = position * (dwell_s + rotation_s);
    write(log, "SELFCAL_SERVICE", service);
    write(log, "SELFCAL_INS_bench", status_at(position));
    write(log, "SELFCAL_ESTIMATE_bench", estimate_at(position));
    if (position == 5) {
      write(log, "SELFCAL_ALARM", alarm("the link is lost", true));
    }
    if (position == 12) {
      write(log, "SELFCAL_ALARM", alarm("the link is lost", false));
    }
  }
  return 0;
}
