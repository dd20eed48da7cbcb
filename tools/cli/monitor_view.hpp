// What `selfcal monitor` shows, as lines of text: no terminal, no LCM connection.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <selfcal_lcm/alarm.hpp>
#include <selfcal_lcm/estimate.hpp>
#include <selfcal_lcm/ins_status.hpp>
#include <selfcal_lcm/service_status.hpp>
#include <string>
#include <vector>

namespace selfcal::cli {

// The latest of everything heard.
struct MonitorState {
  struct Ins {
    std::optional<selfcal_lcm::ins_status> status;
    std::optional<selfcal_lcm::estimate> estimate;
  };
  std::optional<selfcal_lcm::service_status> service;
  std::map<std::string, Ins> instruments;       // by name
  std::map<std::string, std::string> standing;  // alarms that stand, by INS and words
  std::deque<std::string> events;               // alarms that were events, newest last

  void take(const selfcal_lcm::alarm& message);
};

struct ScreenLine {
  enum class Style { plain, title, good, bad, faint } style = Style::plain;
  std::string text;  // ASCII, at most `columns` long
};

// Exactly `rows` lines: the service, one INS in full (the `selected`th), the others in a line each, the verdict of a run that has ended, the
// 24 sigma closing on their tolerance in two columns ("in": within it; whether they may be used the verdict says), the
// alarms, the keys. From 80 x 24 on everything is there; below, the end is cut.
std::vector<ScreenLine> monitor_screen(const MonitorState& state, std::size_t selected, int columns, int rows);

// One message as one line, for output that is no terminal.
std::string message_line(const selfcal_lcm::service_status& message);
std::string message_line(const selfcal_lcm::ins_status& message);
std::string message_line(const selfcal_lcm::estimate& message);
std::string message_line(const selfcal_lcm::alarm& message);

}  // namespace selfcal::cli
