#include "tools/cli/run_progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daemon/estimate/quantity_text.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::cli {
namespace {

bool has_estimate(const RunProgressView& view) {
  return view.sigma.size() == sensor_parameters.size() && view.tolerance.size() == sensor_parameters.size();
}

std::vector<std::string> estimate_parts(const RunProgressView& view) {
  std::size_t met = 0, worst = 0;
  for (std::size_t i = 0; i < view.sigma.size(); ++i) {
    met += view.sigma[i] <= view.tolerance[i] ? 1 : 0;
    if (view.sigma[i] / view.tolerance[i] > view.sigma[worst] / view.tolerance[worst]) {
      worst = i;
    }
  }
  std::vector<std::string> parts = {fmt::format("{} of {} known", met, view.sigma.size())};
  if (met < view.sigma.size()) {
    parts.push_back(fmt::format("{} {} of {} {}", sensor_parameters[worst].name, number_text(view.sigma[worst]),
                                number_text(view.tolerance[worst]), sensor_parameters[worst].unit));
  }
  return parts;
}

}  // namespace

std::string clock_text(double seconds) {
  const long whole = std::lround(std::max(0.0, seconds));
  const long hours = whole / 3600, minutes = whole / 60 % 60, rest = whole % 60;
  return hours > 0 ? fmt::format("{}:{:02}:{:02}", hours, minutes, rest) : fmt::format("{}:{:02}", minutes, rest);
}

std::string progress_line(unsigned long long run, const RunProgressView& view, int columns) {
  std::vector<std::string> parts;
  if (!view.link_up) {
    parts.emplace_back("LINK LOST");
  }
  if (view.state == "rotating") {
    if (view.left_s >= 0.0) {
      parts.push_back(clock_text(view.left_s) + " left");
    }
    parts.push_back(fmt::format("position {} of {}", view.position, view.positions));
  }
  if (view.state == "estimating" && view.pass > 0) {
    parts.push_back(fmt::format("pass {} {:.0f} %", view.pass, 100.0 * view.pass_fraction));
  }
  if ((view.state == "rotating" || view.state == "estimating") && has_estimate(view)) {
    const std::vector<std::string> more = estimate_parts(view);
    parts.insert(parts.end(), more.begin(), more.end());
  }
  if (view.state == "rotating" || view.state == "draining") {
    parts.push_back(fmt::format("page {} of {}", view.pages_pulled, view.pages_expected));
  }
  const auto width = static_cast<std::size_t>(std::max(columns, 0));
  std::string line = fmt::format("run {}: {}", run, view.words);
  for (const std::string& part : parts) {
    if (line.size() + 2 + part.size() <= width) {
      line += ", " + part;
    }
  }
  return line.substr(0, width);
}

}  // namespace selfcal::cli
