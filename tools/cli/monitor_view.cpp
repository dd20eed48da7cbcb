#include "tools/cli/monitor_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace selfcal::cli {
namespace {

using Style = ScreenLine::Style;

constexpr std::size_t most_events = 50;
constexpr int bar_cells = 5;
constexpr double widest_ratio = 100.0;  // sigma/tolerance at which a bar is empty

std::string bar(double share, int cells) {
  const int full = static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * cells));
  return std::string(static_cast<std::size_t>(full), '#') + std::string(static_cast<std::size_t>(cells - full), '-');
}

double share(double part, double whole) { return whole > 0.0 ? part / whole : 0.0; }

// accel_misalignment_yx -> accel misal. yx: fifteen characters at most.
std::string short_name(std::string name) {
  const auto replace = [&name](const std::string& from, const std::string& to) {
    if (const auto at = name.find(from); at != std::string::npos) {
      name.replace(at, from.size(), to);
    }
  };
  replace("misalignment", "misal.");
  replace("scale_pos", "scale+");
  replace("scale_neg", "scale-");
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

// Empty at a hundred times the tolerance, full at the tolerance.
std::string closing_bar(double sigma, double tolerance) {
  if (!(tolerance > 0.0) || !(sigma > 0.0)) {
    return std::string(bar_cells, ' ');
  }
  return bar(1.0 - std::log10(sigma / tolerance) / std::log10(widest_ratio), bar_cells);
}

std::string parameter_cell(const selfcal_lcm::estimate& e, std::size_t k) {
  const double tolerance = k < e.tolerance.size() ? e.tolerance[k] : 0.0;
  return fmt::format("{:<15}{:>8.3g} {:<6} {}{}", short_name(e.name[k]), e.sigma[k], e.unit[k],
                     closing_bar(e.sigma[k], tolerance), tolerance > 0.0 && e.sigma[k] <= tolerance ? " in" : "   ");
}

std::string estimate_words(const selfcal_lcm::estimate& e) {
  std::string words = e.running != 0 ? fmt::format("on {:.0f} s of data", e.data_s)
                                     : fmt::format("pass {} [{}] {:.0f} %", e.pass_number, bar(e.pass_fraction, 10),
                                                   100.0 * e.pass_fraction);
  words += fmt::format(", {} of {} within tolerance", e.tolerances_met, e.count);
  if (e.running != 0 && e.met_at_s >= 0.0) {
    words += fmt::format(", all at {:.0f} s", e.met_at_s);
  }
  return words;
}

std::string minutes_and_seconds(double seconds) {
  const long whole = std::lround(std::max(0.0, seconds));
  return fmt::format("{}:{:02} min", whole / 60, whole % 60);
}

void add_ins(const std::string& name, const MonitorState::Ins& ins, std::vector<ScreenLine>& lines) {
  if (!ins.status) {
    lines.push_back({Style::faint, name + ": no status heard yet"});
    return;
  }
  const selfcal_lcm::ins_status& s = *ins.status;
  const bool link = s.link_up != 0;
  lines.push_back({link ? Style::title : Style::bad,
                   fmt::format("{} {}: {}, run {}{}", s.ins, s.serial, s.state, s.run, link ? "" : "   LINK LOST")});
  if (!s.verdict.empty()) {
    lines.push_back({Style::plain, "verdict   " + s.verdict});
  }
  lines.push_back(
      {Style::plain, fmt::format("schedule  [{}] position {} of {}, {} left", bar(share(s.position, s.positions), 20),
                                 s.position, s.positions, minutes_and_seconds(s.time_left_s))});
  lines.push_back(
      {Style::plain, fmt::format("gimbal    outer {:8.2f} deg   inner {:8.2f} deg", s.outer_deg, s.inner_deg)});
  lines.push_back({s.lost_frames > 0 ? Style::bad : Style::plain,
                   fmt::format("transfer  [{}] page {} of {}, {} written, {} frames lost",
                               bar(share(s.pages_pulled, s.pages_expected), 20), s.pages_pulled, s.pages_expected,
                               s.pages_written, s.lost_frames)});
}

void add_estimate(const MonitorState::Ins& ins, std::vector<ScreenLine>& lines) {
  if (!ins.estimate) {
    lines.push_back({Style::faint, "estimate  none yet"});
    return;
  }
  const selfcal_lcm::estimate& e = *ins.estimate;
  lines.push_back({e.tolerances_met == e.count ? Style::good : Style::plain, "estimate  " + estimate_words(e)});
  lines.push_back({Style::faint, fmt::format("{:<15}{:>8} {:<6} {:<8}  {:<15}{:>8} {:<6} {}", "parameter", "sigma",
                                             "unit", "target", "parameter", "sigma", "unit", "target")});
  const std::size_t half = (e.name.size() + 1) / 2;
  for (std::size_t k = 0; k < half; ++k) {
    std::string text = parameter_cell(e, k);
    if (k + half < e.name.size()) {
      text += "  " + parameter_cell(e, k + half);
    }
    lines.push_back({Style::plain, text});
  }
}

std::string short_line(const MonitorState::Ins& ins, const std::string& name) {
  if (!ins.status) {
    return name;
  }
  const selfcal_lcm::ins_status& s = *ins.status;
  return fmt::format("{} {}: {}, position {} of {}{}", name, s.serial, s.state, s.position, s.positions,
                     s.link_up != 0 ? "" : ", LINK LOST");
}

// What stands first, then the latest events, as many as there is room for.
void add_alarms(const MonitorState& state, std::size_t room, std::vector<ScreenLine>& lines) {
  if (room == 0) {
    return;
  }
  if (state.standing.empty() && state.events.empty()) {
    lines.push_back({Style::faint, "no alarms"});
    return;
  }
  for (const auto& [unused, words] : state.standing) {
    if (room > 0) {
      lines.push_back({Style::bad, "ALARM " + words});
      --room;
    }
  }
  const std::size_t shown = std::min(room, state.events.size());
  for (std::size_t k = state.events.size() - shown; k < state.events.size(); ++k) {
    lines.push_back({Style::plain, "event " + state.events[k]});
  }
}

}  // namespace

void MonitorState::take(const selfcal_lcm::alarm& message) {
  const std::string words = fmt::format("{} run {}: {}", message.ins, message.run, message.text);
  if (message.standing != 0) {
    standing[words] = words;
    return;
  }
  standing.erase(words);
  events.push_back(words);
  if (events.size() > most_events) {
    events.pop_front();
  }
}

std::vector<ScreenLine> monitor_screen(const MonitorState& state, std::size_t selected, int columns, int rows) {
  std::vector<ScreenLine> lines;
  lines.push_back({state.service ? Style::title : Style::faint,
                   state.service ? message_line(*state.service) : std::string("no daemon heard yet")});
  std::size_t number = 0;
  for (const auto& [name, ins] : state.instruments) {
    if (number++ == selected) {
      add_ins(name, ins, lines);
      add_estimate(ins, lines);
    }
  }
  number = 0;
  for (const auto& [name, ins] : state.instruments) {
    if (number++ != selected) {
      lines.push_back({Style::faint, short_line(ins, name)});
    }
  }
  const auto height = static_cast<std::size_t>(std::max(rows, 1));
  const std::size_t last = height - 1;
  add_alarms(state, last > lines.size() ? last - lines.size() : 0, lines);
  lines.resize(last);
  lines.push_back({Style::faint, state.instruments.size() > 1 ? "q quit   Tab next INS" : "q quit"});
  for (ScreenLine& line : lines) {
    line.text.resize(std::min(line.text.size(), static_cast<std::size_t>(std::max(columns, 0))));
  }
  return lines;
}

std::string message_line(const selfcal_lcm::service_status& message) {
  return fmt::format("selfcald {}: {} INS, {} runs in progress, up {:.0f} s", message.software, message.instruments,
                     message.runs_in_progress, message.uptime_s);
}

std::string message_line(const selfcal_lcm::ins_status& message) {
  return fmt::format(
      "{} {}: {}, run {}, position {}/{}, outer {:.2f} deg, inner {:.2f} deg, {:.0f} s left, pages {}/{}{}{}{}",
      message.ins, message.serial, message.state, message.run, message.position, message.positions, message.outer_deg,
      message.inner_deg, message.time_left_s, message.pages_pulled, message.pages_expected,
      message.link_up != 0 ? "" : ", LINK LOST", message.verdict.empty() ? "" : ", verdict: ", message.verdict);
}

std::string message_line(const selfcal_lcm::estimate& message) {
  std::string text = message.ins + ": " + estimate_words(message);
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    text +=
        fmt::format("; {} {:.5g} +- {:.3g} {}", message.name[i], message.value[i], message.sigma[i], message.unit[i]);
  }
  return text;
}

std::string message_line(const selfcal_lcm::alarm& message) {
  return fmt::format("ALARM {}: run {}: {}", message.ins, message.run, message.text);
}

}  // namespace selfcal::cli
