// The diagnosis for people: what it comes to, then the figures.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/effect_words.hpp"
#include "daemon/estimate/left_out.hpp"
#include "daemon/estimate/quantity_text.hpp"
#include "daemon/estimate/summary.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/law_file/law_file.hpp"
#include "tools/cli/diagnose_output.hpp"
#include "tools/cli/finding_text.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::Adequacy;
using diagnosis::Diagnosis;
using diagnosis::Finding;
using diagnosis::Located;

constexpr std::size_t most_places = 8, most_places_in_brief = 3, most_values_in_brief = 6;

std::string adequacy_text(const Diagnosis& d) {
  std::string text = fmt::format("{:<8}{:>9}  {:>15}  {}\n", "", "NIS", "largest misfit", "innovations");
  for (const Adequacy* a : {&d.before, &d.after}) {
    text += fmt::format("{:<8}{:>9}  {:>9} sigma  {}\n", a == &d.before ? "before" : "after", number_text(a->nis),
                        number_text(a->largest_sigma), innovations_text(*a));
  }
  return text;
}

bool is_line(const Finding& finding) { return finding.parameters.size() == 2 && finding.parameters[1].unit == "Hz"; }

// An engine makes dozens: one line each, the strongest first.
std::string vibration_text(std::vector<Finding> lines) {
  constexpr std::size_t most_lines = 8;
  std::stable_sort(lines.begin(), lines.end(),
                   [](const Finding& a, const Finding& b) { return a.significance > b.significance; });
  std::string text = fmt::format("  {}: {}, {} of them{}\n", lines.front().effect, effect_words(lines.front().effect),
                                 lines.size(), lines.size() > most_lines ? ", the strongest:" : ":");
  for (std::size_t i = 0; i < std::min(most_lines, lines.size()); ++i) {
    const diagnosis::FindingParameter &size = lines[i].parameters[0], &frequency = lines[i].parameters[1];
    text += fmt::format("    {:<8} {:>6} Hz  {:>6} {:<5} {:>6} sigma\n", size.name, number_text(frequency.value),
                        number_text(size.value), size.unit, number_text(lines[i].significance));
  }
  return text;
}

std::string findings_text(const char* head, const std::vector<Finding>& findings) {
  if (findings.empty()) {
    return {};
  }
  constexpr std::size_t told_singly = 3;
  std::vector<Finding> lines, others;
  for (const Finding& finding : findings) {
    (is_line(finding) ? lines : others).push_back(finding);
  }
  if (lines.size() <= told_singly) {
    others = findings;
    lines.clear();
  }
  std::string text = fmt::format("\n{}:\n", head);
  for (const Finding& finding : others) {
    text += finding_text(finding);
  }
  return text + (lines.empty() ? std::string() : vibration_text(lines)) + symbols_text(findings);
}

// What the equations leave of what they explain.
std::string remainder_text(const Diagnosis& d) {
  if (!d.remainder) {
    return {};
  }
  std::string text =
      fmt::format("\nremainder: {:.2g} % of the misfit, {} sigma; the sigma of the 24 holds what it may do to them\n",
                  100.0 * d.remainder->share, number_text(d.remainder->sigma));
  for (const diagnosis::FormLeft& f : d.remainder->forms) {
    text += fmt::format("  {:>5.2g} %  {} differs from its equation: {}\n", 100.0 * f.share, f.effect, f.words);
  }
  if (!d.remainder->places.empty()) {
    const Located& first = d.remainder->places.front();
    text += fmt::format("  largest in {}: {} {}, {} sigma\n", first.words, number_text(first.size),
                        first.axis.starts_with("gyro") ? "deg/h" : "ug", number_text(first.significance));
  }
  return text;
}

// Laws that explain the recording in the place of what is named.
std::string instead_text(const Diagnosis& d) {
  if (!d.instead) {
    return {};
  }
  std::vector<std::string_view> names;
  for (const diagnosis::Effect* name : d.instead->names) {
    names.emplace_back(name->id);
  }
  std::string text = fmt::format("\nin the place of {}, odds {:.2g} against it; the sigma of the 24 holds both:\n",
                                 fmt::join(names, " and "), d.instead->odds);
  for (const diagnosis::LawsInstead::Law& law : d.instead->laws) {
    const std::string size = with_sigma(law.coefficient, law.sigma, std::string(unit_of_axis(law.place)));
    text += law.process.empty() ? fmt::format("  {}  ({}) * {}\n", law.axis, size, law.expression)
                                : fmt::format("  {}  {}, {}\n", law.axis, law.process, size);
  }
  return text;
}

// Those of the 24 that the omission moved by three sigma and more, most first.
std::string corrections_text(const Diagnosis& d, Detail detail) {
  const auto moved = [&](int k) { return std::abs(d.value(k) - d.calibration.value(k)) / d.calibration.sigma(k); };
  std::vector<int> order;
  for (int k = 0; k < sensor_parameter_count; ++k) {
    if (moved(k) >= shown_sigma) {
      order.push_back(k);
    }
  }
  std::sort(order.begin(), order.end(), [&](int a, int b) { return moved(a) > moved(b); });
  if (order.empty()) {
    return {};
  }
  const std::size_t shown = detail == Detail::full ? order.size() : std::min(most_values_in_brief, order.size());
  const std::size_t more = order.size() - shown;
  order.resize(shown);
  std::string text = fmt::format("\ncorrected values of the 24:\n  {:<22}{:>10} {:>10} {:>9}  {:<7}{}\n", "", "without",
                                 "corrected", "sigma", "unit", "moved by");
  for (const int k : order) {
    const SensorParameter& p = sensor_parameters[static_cast<std::size_t>(k)];
    const double sigma = d.sigma(k) / p.si_per_unit;
    const QuantityText after = quantity_text(d.value(k) / p.si_per_unit, sigma);
    text += fmt::format("  {:<22}{:>10} {:>10} {:>9}  {:<7}{} sigma\n", p.name,
                        quantity_text(d.calibration.value(k) / p.si_per_unit, sigma).value, after.value, after.sigma,
                        p.unit, number_text(moved(k)));
  }
  return text + (more > 0 ? fmt::format("  and {} more\n", more) : std::string());
}

// One list, largest first, whatever a place was found by.
std::string places_text(const char* head, std::vector<Located> places, const std::vector<Located>& by,
                        std::size_t most = most_places) {
  places.insert(places.end(), by.begin(), by.end());
  if (places.empty()) {
    return {};
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Located& a, const Located& b) { return a.significance > b.significance; });
  places.resize(std::min(most, places.size()));
  std::string text = fmt::format("\n{}:\n", head);
  for (const Located& l : places) {
    text += fmt::format("  {:>6} sigma  {}\n", number_text(l.significance), l.words);
  }
  return text;
}

// What is found beyond the catalogue stands below, and may leave nothing.
const char* remains_head(const discovery::Discovery* beyond) {
  if (!explains(beyond)) {
    return beyond == nullptr || beyond->laws.empty() ? "what remains, largest first"
                                                     : "what the catalogue leaves, largest first";
  }
  return beyond->left ? "what remains beside the equations, largest first" : "what the catalogue leaves, largest first";
}

std::string suspected_text(const Diagnosis& d, Detail detail) {
  if (d.suspected.empty()) {
    return {};
  }
  std::string text = "\ntoo weak to name:";
  for (const Finding& f : d.suspected) {
    text += detail == Detail::full
                ? fmt::format("\n  {:>6} sigma  {}: {}; would show with {}", number_text(f.significance), f.effect,
                              effect_words(f.effect), f.experiment)
                : fmt::format("\n  {:>6} sigma  {}", number_text(f.significance), f.effect);
  }
  return text + "\n";
}

// What people, wind or a lost count did, where nothing was concluded from it.
std::string disturbed_text(const Diagnosis& d, Detail detail) {
  std::string text;
  if (d.loudest > 1.0) {
    text += fmt::format("the base is shaken: noise of the accelerometers {} times the usual in the loudest tenth\n",
                        number_text(d.loudest));
  }
  if (!d.jumps.empty()) {
    text += "the velocity jumps, by a count that was lost or a knock (mm/s along x, y, z):\n";
  }
  constexpr double milli = 1e3;
  const std::size_t shown = detail == Detail::full ? d.jumps.size() : std::min(most_places_in_brief, d.jumps.size());
  for (const diagnosis::VelocityJump& jump : std::span(d.jumps).first(shown)) {
    text += fmt::format("  {:>6.0f} s ", jump.start_s);
    for (const int axis : {0, 1, 2}) {
      text += fmt::format("  {:>5.2f} +- {:.2f}", milli * jump.size_b(axis), milli * jump.sigma_b(axis));
    }
    text += '\n';
  }
  text += shown < d.jumps.size() ? fmt::format("  and {} more\n", d.jumps.size() - shown) : "";
  return text.empty() ? text : text + "\n";
}

std::string undetectable_text(const Diagnosis& d) {
  if (d.undetectable.empty()) {
    return {};
  }
  std::vector<diagnosis::Undetectable> order = d.undetectable;
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.expected_z > b.expected_z; });
  std::string text = "\nnot visible in this recording at its typical size (sigma to be expected):\n";
  for (const diagnosis::Undetectable& u : order) {
    text += fmt::format("  {:>5}  {}\n", number_text(u.expected_z), u.effect->id);
  }
  return text;
}

}  // namespace

std::string diagnosis_text(const Diagnosis& of_catalogue, const Subject& subject, Detail detail, bool colour,
                           int columns, const discovery::Discovery* beyond) {
  const Diagnosis d = with_laws(of_catalogue, beyond);
  std::string text = summary_text(summary_of(d, subject, beyond), colour, columns);
  if (!d.faults.empty()) {
    text += "\nfaults of the data:\n";
    for (const auto& f : d.faults) {
      text += fmt::format("  {}: {} (first at sample {})\n", f.id, f.words, f.first_sample);
    }
    return text;
  }
  text += '\n';
  if (!d.calibration.left_out.empty()) {
    text += left_out_text(d.calibration) + "\n";
  }
  if (d.attitude_wanders > 0.0) {
    text += fmt::format(
        "the gyros' noise turns the attitude by {} mrad in this recording: weak effects are not looked for\n",
        number_text(1e3 * d.attitude_wanders));
  }
  if (d.read_out_delay) {
    text +=
        fmt::format("read-outs of the gimbal: {:.3g} +- {:.1g} s {} than the gyros; nothing is estimated from them\n\n",
                    std::abs(d.read_out_delay->delay_s), d.read_out_delay->sigma_s,
                    d.read_out_delay->delay_s > 0.0 ? "later" : "earlier");
  }
  text += disturbed_text(d, detail);
  text += adequacy_text(d);
  text += findings_text("left out of the model", d.findings);
  text += remainder_text(d);
  text += instead_text(d);
  // Where nothing explains the recording, nothing corrects the 24.
  if (!d.unexplained || explains(beyond)) {
    text += corrections_text(d, detail);
  }
  if (detail == Detail::brief) {
    const bool open = d.unexplained && !explains(beyond);
    return text + (open ? places_text(remains_head(beyond), d.remaining, d.remaining_by, most_places_in_brief) : "") +
           suspected_text(d, detail);
  }
  if (!d.before.accepted) {
    text += places_text("where recording and the 24 alone differ, largest first", d.located, d.located_by);
  }
  if (d.unexplained) {
    text += findings_text("tried and rejected by what remains", d.rejected);
    text += places_text(remains_head(beyond), d.remaining, d.remaining_by);
  }
  return text + suspected_text(d, detail) + undetectable_text(d);
}

std::string comparison_text(const diagnosis::Comparison& c) {
  const Diagnosis& d = c.diagnosis;
  std::string text = summary_text(summary_of_comparison(c), false) + "\n" + adequacy_text(d);
  text += findings_text("the recording has more of", d.findings);
  if (!d.before.accepted) {
    text += places_text("where recording and simulation differ, largest first", d.located, d.located_by);
  }
  if (!c.in_both.empty()) {
    text += "\nwhat the simulation holds was taken out of both:";
    for (const Finding& f : c.in_both) {
      text += " " + f.effect;
    }
    text += "\n";
  }
  text += "\nthe 24, where they differ by 3 sigma or more:\n";
  int differing = 0;
  for (int k = 0; k < sensor_parameter_count; ++k) {
    if (std::abs(c.difference(k)) >= shown_sigma * c.sigma(k)) {
      const SensorParameter& p = sensor_parameters[static_cast<std::size_t>(k)];
      text += fmt::format("  {:<22} {}\n", p.name,
                          with_sigma(c.difference(k) / p.si_per_unit, c.sigma(k) / p.si_per_unit, std::string(p.unit)));
      ++differing;
    }
  }
  text += differing == 0 ? "  none\n" : "";
  constexpr double noticeable = 0.2 * units::degree;
  if (c.attitude_difference > noticeable) {
    text += fmt::format(
        "attitudes differ by up to {:.2f} deg: what both hold and no name was found for cancels only to that degree\n",
        c.attitude_difference / units::degree);
  }
  return text;
}

Summary summary_of_comparison(const diagnosis::Comparison& c) {
  const Diagnosis& d = c.diagnosis;
  const std::string figures = fmt::format("NIS of the difference {}, largest misfit {} sigma",
                                          number_text(d.before.nis), number_text(d.before.largest_sigma));
  if (!d.mismatch) {
    return {SummaryStanding::good, "Recording and simulation agree.", figures + ".", {}};
  }
  if (d.findings.empty()) {
    return {SummaryStanding::bad,
            "Recording and simulation differ, and nothing in the catalogue explains it.",
            figures + ".",
            {}};
  }
  const Finding& first = d.findings.front();
  return {SummaryStanding::bad,
          fmt::format("Recording and simulation differ by {}.", effect_words(first.effect)),
          fmt::format("{}: {:.0f} sigma; {}, {} with it.", first.effect, first.significance, figures,
                      number_text(d.after.nis)),
          {}};
}

}  // namespace selfcal::cli
