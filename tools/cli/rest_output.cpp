#include "tools/cli/rest_output.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/quantity_text.hpp"
#include "estimator/geometry/units.hpp"
#include "tools/cli/folded_text.hpp"

namespace selfcal::cli {
namespace {

using Json = nlohmann::ordered_json;
using diagnosis::Rest;
using diagnosis::RestAmplitude;
using diagnosis::RestAxis;
using diagnosis::RestEquation;
using diagnosis::RestTerm;

constexpr double arcmin = units::degree / 60.0;

// What readings of an axis are told in: name of the unit, and raw units in one of it.
struct Unit {
  std::string name;
  double raw = 1.0;
};

Unit of_mean(const Rest& rest, bool gyro) {
  return !rest.si ? Unit{"raw", 1.0} : gyro ? Unit{"deg/h", units::degree_per_hour} : Unit{"mg", 1e3 * units::micro_g};
}
Unit of_density(const Rest& rest, bool gyro) {
  return !rest.si ? Unit{"raw*sqrt(s)", 1.0}
         : gyro   ? Unit{"deg/sqrt(h)", units::degree_per_sqrt_hour}
                  : Unit{"ug/sqrt(Hz)", units::micro_g_per_sqrt_hz};
}
Unit of_deviation(const Rest& rest, bool gyro) {
  return !rest.si ? Unit{"raw", 1.0} : gyro ? Unit{"deg/h", units::degree_per_hour} : Unit{"ug", units::micro_g};
}
Unit of_walk(const Rest& rest, bool gyro) {
  const double per_sqrt_h = 1.0 / std::sqrt(units::hour);
  return !rest.si ? Unit{"raw/sqrt(h)", per_sqrt_h}
         : gyro   ? Unit{"deg/h/sqrt(h)", units::degree_per_hour * per_sqrt_h}
                  : Unit{"ug/sqrt(h)", units::micro_g * per_sqrt_h};
}
Unit of_coefficient(const Rest& rest, const RestEquation& e) {
  return rest.si ? Unit{e.unit, e.si_per_unit} : Unit{fmt::format("raw{}", e.raw_per), e.raw_per_factor};
}

Json amplitude_json(const Rest& rest, const RestAmplitude& a) {
  const Unit unit = of_coefficient(rest, a.equation);
  Json j = {
      {"effect", a.equation.id}, {"value", a.value / unit.raw}, {"sigma", a.sigma / unit.raw}, {"unit", unit.name}};
  if (!std::isnan(a.constant)) {
    j[a.equation.jumps ? "at_s" : "tau_s"] = a.constant;
    j[a.equation.jumps ? "at_sigma_s" : "tau_sigma_s"] = a.constant_sigma;
  }
  return j;
}

Json term_json(const Rest& rest, const RestTerm& term) {
  Json j = amplitude_json(rest, term.found);
  j["log10_p"] = term.log_p / std::log(10.0);
  j["share"] = term.share;
  j["as_well"] = Json::array();
  for (const RestAmplitude& a : term.as_well) {
    j["as_well"].push_back(amplitude_json(rest, a));
  }
  j["not_told_apart_at_rest"] = term.twins;
  if (term.tilt != RestTerm::Tilt::none) {
    j["tilt_of_the_base"] = term.tilt == RestTerm::Tilt::open ? "open" : "excluded";
  }
  return j;
}

Json axis_json(const Rest& rest, const RestAxis& a) {
  const Unit mean = of_mean(rest, a.gyro), white = of_density(rest, a.gyro), least = of_deviation(rest, a.gyro);
  Json j = {{"sensor", a.gyro ? "gyro" : "accelerometer"},
            {"axis", std::string(1, "xyz"[a.axis])},
            {"mean", {{"value", a.mean / mean.raw}, {"sigma", a.mean_sigma / mean.raw}, {"unit", mean.name}}},
            {"white_noise", {{"value", a.white_asd / white.raw}, {"unit", white.name}}},
            {"bias_instability",
             {{"value", a.instability / least.raw},
              {"unit", least.name},
              {"tau_s", a.instability_tau_s},
              {"bound", a.instability_is_bound}}}};
  if (!std::isnan(a.walk)) {
    const Unit walk = of_walk(rest, a.gyro);
    j["random_walk"] = {{"value", a.walk / walk.raw}, {"sigma", a.walk_sigma / walk.raw}, {"unit", walk.name}};
  }
  if (a.quantum > 0.0) {
    j["quantum"] = a.quantum / mean.raw;
  }
  if (a.swing > 0.0) {
    j["swings"] = {{"amplitude", a.swing / mean.raw}, {"frequency_hz", a.swing_hz}, {"unit", mean.name}};
  }
  j["rms"] = a.rms / mean.raw;
  j["rms_left"] = a.rms_left / mean.raw;
  j["drifts"] = Json::array();
  for (const RestTerm& t : a.terms) {
    j["drifts"].push_back(term_json(rest, t));
  }
  return j;
}

// "12.34 +- 0.05"
std::string figure(double value, double sigma, double raw) {
  const QuantityText t = quantity_text(value / raw, sigma / raw);
  return fmt::format("{} +- {}", t.value, t.sigma);
}

std::string heading(const Rest& rest, bool gyro) {
  const bool walks = std::any_of(rest.axes.begin(), rest.axes.end(),
                                 [gyro](const RestAxis& a) { return a.gyro == gyro && !std::isnan(a.walk); });
  return fmt::format("{:<14} {:>11} {:>18}  least Allan{}, {}{}\n", gyro ? "gyros" : "accelerometers",
                     fmt::format("mean, {}", of_mean(rest, gyro).name),
                     fmt::format("white, {}", of_density(rest, gyro).name), walks ? "" : " dev.",
                     of_deviation(rest, gyro).name, walks ? "; walk /sqrt(h)" : "");
}

std::string noise_text(const Rest& rest, const RestAxis& a) {
  const Unit mean = of_mean(rest, a.gyro), white = of_density(rest, a.gyro), least = of_deviation(rest, a.gyro);
  std::string text = fmt::format("  {} {:>22} {:>18.3g}  {}{:.3g} at {:.3g} s", "xyz"[a.axis],
                                 figure(a.mean, a.mean_sigma, mean.raw), a.white_asd / white.raw,
                                 a.instability_is_bound ? "<" : "", a.instability / least.raw, a.instability_tau_s);
  if (!std::isnan(a.walk)) {
    const Unit walk = of_walk(rest, a.gyro);
    text += fmt::format("; {}", figure(a.walk, a.walk_sigma, walk.raw));
  }
  return text + (a.quantum > 0.0 ? fmt::format("; quantum {:.2g} {}\n", a.quantum / mean.raw, mean.name) : "\n");
}

std::string label(const RestAmplitude& a) {
  return a.equation.id + (std::isnan(a.constant) || a.equation.jumps ? "" : " (warming up)");
}

// One equation on the axes that show it, wrapped at 80 columns.
struct Line {
  std::string label, unit;
  std::vector<std::string> figures;
  std::string text() const {
    constexpr std::size_t columns = 80, indent = 6;
    std::string all = fmt::format("  {}, {}:", label, unit);
    std::size_t used = all.size();
    for (const std::string& words : figures) {
      const std::string next = fmt::format("{}{}", words, &words == &figures.back() ? "" : ",");
      const bool fits = used + 1 + next.size() <= columns;
      all += fits ? fmt::format(" {}", next) : fmt::format("\n{:{}}{}", "", indent, next);
      used = fits ? used + 1 + next.size() : indent + next.size();
    }
    return all + "\n";
  }
};

void add(const Rest& rest, const RestAxis& axis, const RestAmplitude& a, std::vector<Line>& lines) {
  const Unit unit = of_coefficient(rest, a.equation);
  const std::string name = label(a);
  auto line = std::find_if(lines.begin(), lines.end(), [&name](const Line& l) { return l.label == name; });
  if (line == lines.end()) {
    lines.push_back({name, unit.name, {}});
    line = lines.end() - 1;
  }
  line->figures.push_back(fmt::format("{} {}{}", "xyz"[axis.axis], figure(a.value, a.sigma, unit.raw),
                                      std::isnan(a.constant) ? ""
                                                             : fmt::format(" {} {} s", a.equation.jumps ? "at" : "in",
                                                                           figure(a.constant, a.constant_sigma, 1.0))));
}

// What explains the log as well on these axes, by the equation that speaks for it.
struct Named {
  Line line;
  std::vector<std::string> as_well;
  std::vector<std::string> twins;
};

std::vector<Named> named_of(const Rest& rest) {
  std::vector<Line> leaders;
  std::vector<Named> all;
  for (const RestAxis& axis : rest.axes) {
    for (const RestTerm& t : axis.terms) {
      add(rest, axis, t.found, leaders);
    }
  }
  for (const Line& line : leaders) {
    Named named{line, {}, {}};
    for (const RestAxis& axis : rest.axes) {
      for (const RestTerm& t : axis.terms) {
        if (label(t.found) != line.label) {
          continue;
        }
        for (const RestAmplitude& other : t.as_well) {
          if (std::find(named.as_well.begin(), named.as_well.end(), label(other)) == named.as_well.end()) {
            named.as_well.push_back(label(other));
          }
        }
        for (const std::string& twin : t.twins) {
          named.twins.push_back(fmt::format("{} on {}", twin, "xyz"[axis.axis]));
        }
      }
    }
    all.push_back(std::move(named));
  }
  return all;
}

// What would tell the members of a class apart.
std::string parting_text(const Rest& rest) {
  bool any = false, temperature = false;
  for (const RestAxis& a : rest.axes) {
    for (const RestTerm& t : a.terms) {
      for (const RestAmplitude& other : t.as_well) {
        any = true;
        temperature |= other.equation.of_temperature || t.found.equation.of_temperature;
      }
    }
  }
  return !any          ? std::string()
         : temperature ? "confounded, temperature and time go together: a second ramp the other way tells\n"
                       : "confounded: a longer log, or a channel of the temperature, tells\n";
}

// What of the accelerometers may be the base's.
std::string tilt_text(const Rest& rest) {
  std::string text;
  bool open = false, excluded = false;
  for (const RestAxis& a : rest.axes) {
    for (const RestTerm& t : a.terms) {
      open |= t.tilt == RestTerm::Tilt::open;
      excluded |= t.tilt == RestTerm::Tilt::excluded;
    }
  }
  text += open ? "    or a tilt of the base: the gyros do not exclude it\n" : "";
  return text + (excluded ? "    no tilt of the base: the gyros do not turn then\n" : "");
}

// Tilts that gyros and gravity both show.
std::string motion_text(const Rest& rest) {
  std::string text;
  for (const diagnosis::RestTilt& t : rest.tilts) {
    text += lines_of(
        "the", fmt::format("base tilts by {:.3g} arcmin at {:.0f} s, and the gyros by {} of it: no error of a sensor",
                           t.angle / arcmin, t.time_s, figure(t.share, t.sigma, 1.0)));
  }
  if (rest.base_tilt) {
    text += fmt::format("the base tilts to and fro by {:.3g} arcmin, in means of 10 s, as gyros and gravity show\n",
                        rest.base_tilt->range / arcmin);
  }
  return text;
}

// Axes that swing, wrapped.
std::string swing_text(const Rest& rest) {
  Line line{"swings beside the white noise", "a line or a motion of the base", {}};
  for (const RestAxis& a : rest.axes) {
    if (a.swing > 0.0) {
      const Unit unit = of_mean(rest, a.gyro);
      line.figures.push_back(fmt::format("{} {} by {:.2g} {} at {:.3g} Hz", a.gyro ? "gyro" : "accelerometer",
                                         "xyz"[a.axis], a.swing / unit.raw, unit.name, a.swing_hz));
    }
  }
  return line.figures.empty() ? std::string() : line.text();
}

std::string drift_text(const Rest& rest) {
  std::string text;
  for (const Named& named : named_of(rest)) {
    text += named.line.text();
    std::string rivals;
    for (const std::string& other : named.as_well) {
      rivals += fmt::format("{}{}", rivals.empty() ? "    or as well " : ", ", other);
    }
    text += rivals.empty() ? rivals : rivals + "\n";
    if (!named.twins.empty()) {
      text += fmt::format("    the same at rest: {}\n", fmt::join(named.twins, ", "));
    }
  }
  return text + tilt_text(rest) + parting_text(rest);
}

}  // namespace

bool drifts(const Rest& rest) {
  return std::any_of(rest.axes.begin(), rest.axes.end(), [](const RestAxis& a) { return !a.terms.empty(); });
}

Json rest_json(const Rest& rest) {
  Json axes = Json::array();
  for (const RestAxis& a : rest.axes) {
    axes.push_back(axis_json(rest, a));
  }
  Json tilts = Json::array();
  for (const diagnosis::RestTilt& t : rest.tilts) {
    tilts.push_back({{"at_s", t.time_s},
                     {"arcmin", t.angle / arcmin},
                     {"of_it_by_gyros", {{"value", t.share}, {"sigma", t.sigma}}}});
  }
  Json base = {{"jumps", tilts}};
  if (rest.base_tilt) {
    base["range_arcmin"] = rest.base_tilt->range / arcmin;
    base["correlation"] = rest.base_tilt->correlation;
  }
  return {{"blocks", rest.blocks},
          {"block_s", rest.block_s},
          {"drift_tested", rest.drift_tested},
          {"temperature_degC", rest.coldest ? Json{*rest.coldest, *rest.warmest} : Json()},
          {"base", base},
          {"axes", axes}};
}

std::string rest_table(const Rest& rest) {
  std::string text;
  for (const bool gyro : {true, false}) {
    bool first = true;
    for (const RestAxis& a : rest.axes) {
      if (a.gyro == gyro) {
        text += (first ? heading(rest, gyro) : std::string()) + noise_text(rest, a);
        first = false;
      }
    }
  }
  return text + swing_text(rest);
}

std::string rest_findings(const Rest& rest) {
  const char* nothing = rest.tilts.empty() && !rest.base_tilt
                            ? "nothing drifts by more than slow noise makes: nothing named\n"
                            : "beside it nothing drifts by more than slow noise makes: nothing named\n";
  return !rest.drift_tested ? "drift: not asked about, the rest is too short\n"
                            : motion_text(rest) + (drifts(rest) ? "beside slow noise, named:\n" + drift_text(rest)
                                                                : std::string(nothing));
}

std::string rest_text(const Rest& rest) {
  std::string text = fmt::format("means over {} blocks of {:.3g} s", rest.blocks, rest.block_s);
  text += rest.coldest ? fmt::format("; {:.1f} to {:.1f} degC\n", *rest.coldest, *rest.warmest) : "\n";
  return text + rest_table(rest) + rest_findings(rest);
}

}  // namespace selfcal::cli
