// The answer by poses in some ten lines: what was found first, then the numbers of each axis, then what is open.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "daemon/estimate/quantity_text.hpp"
#include "tools/cli/folded_text.hpp"
#include "tools/cli/head_output.hpp"
#include "tools/cli/poses_attitude_output.hpp"
#include "tools/cli/poses_output.hpp"
#include "tools/cli/poses_words.hpp"
#include "tools/cli/rest_output.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::PoseDiagnosis;
using diagnosis::PoseEffect;
using diagnosis::PoseParameter;
using diagnosis::Sensors;

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string heading(const PoseDiagnosis& d) {
  const bool stands = d.sensors == Sensors::gyros;  // nothing says which way up
  std::string text = d.means ? fmt::format("{}, a mean each", counted(static_cast<std::size_t>(d.poses), "pose"))
                             : fmt::format("{}, {:.0f} of {:.0f} s",
                                           counted(static_cast<std::size_t>(d.poses), stands ? "stand" : "pose"),
                                           d.static_seconds, d.duration_s);
  if (d.by_poses && d.sensors == Sensors::both && !d.means) {
    text += fmt::format(", {} between them", counted(static_cast<std::size_t>(d.turns), "usable turn"));
  }
  if (d.force_at_rest_g > 0.0) {
    text += fmt::format("; |f| {:.4f} g", d.force_at_rest_g);
  }
  return text + "\n";
}

std::string cell(double value, double sigma) {
  const QuantityText t = quantity_text(value, sigma);
  return fmt::format("{} +- {}", t.value, t.sigma);
}

double log10_of(double log_p) { return log_p / std::log(10.0); }

// What does half and more of the same over these poses, in their order; empty where nothing does.
std::string confounded_clause(const PoseDiagnosis& d, const PoseEffect& e) {
  std::vector<std::string> others;
  for (const diagnosis::Confounded& c : d.confounded) {
    const diagnosis::Effect* other = c.effect == e.effect ? c.with : c.with == e.effect ? c.effect : nullptr;
    if (other != nullptr) {
      others.push_back(fmt::format("{} does {:.0f} % of the same", other->id, 100.0 * c.shared));
    }
  }
  return others.empty() ? std::string() : fmt::format("; in this order of the poses {}", fmt::join(others, ", "));
}

// Behind a gyro's own unit; a drift is told per second, as the log's times are.
std::string per_what(const diagnosis::Effect& effect) {
  const std::string& unit = effect.parameters.front().unit;
  const std::string own = "deg/h", per = unit.starts_with(own) ? unit.substr(own.size()) : std::string();
  return per == "/h" ? "/s" : per;
}

// Its id, how sure, and its largest coefficient.
std::string effect_words(const PoseEffect& e, double unit, const std::string& unit_name) {
  std::size_t largest = 0;
  for (std::size_t k = 0; k < e.value.size(); ++k) {
    largest = std::abs(e.value[k]) > std::abs(e.value[largest]) ? k : largest;
  }
  std::string words = fmt::format("{} (log10 p {:.1f})", e.effect->id, log10_of(e.log_p));
  if (!e.value.empty()) {
    words += fmt::format(", most in {}: {}", e.parameters[largest],
                         with_sigma(e.value[largest] / unit, e.sigma[largest] / unit, unit_name));
  }
  return words;
}

// One line an effect.
std::string effect_line(const PoseDiagnosis& d, const PoseEffect& e, double unit, const std::string& unit_name) {
  std::string words = effect_words(e, unit, unit_name);
  std::vector<std::string> rivals = diagnosis::ids_of(e.equivalent);
  if (e.may_be_flicker) {
    rivals.emplace_back("a bias that wanders by itself");
  }
  if (e.may_be_earth) {
    rivals.emplace_back("the Earth's rate, with --latitude and all turns it would show");
  }
  if (!rivals.empty()) {
    words += fmt::format("; or as well {}", fmt::join(rivals, ", "));
  }
  return lines_of(e.may_be_flicker ? "drifts:" : "named:", words + confounded_clause(d, e));
}

// The experiment that parts what is named from what does the same.
std::string what_decides(const PoseDiagnosis& d) {
  bool order = false, wanders = false;
  for (const PoseEffect& e : d.gyro_named) {
    order |= !e.equivalent.empty() || !confounded_clause(d, e).empty();
    wanders |= e.may_be_flicker;
  }
  for (const PoseEffect& e : d.accel_named) {
    order |= !e.equivalent.empty();
  }
  return order || wanders
             ? lines_of("decides:", fmt::format("the same poses once more{}{}", order ? " in another order" : "",
                                                wanders ? ", just switched on" : ""))
             : std::string();
}

// What comes nearest to a misfit of the accelerometers, with its largest coefficient where that is one in g.
std::string nearest_words(const PoseEffect& e) {
  constexpr double mg = 1e-3;
  const std::string& unit = e.effect->parameters.front().unit;
  return ", nearest " + (unit.starts_with("ug") ? effect_words(e, mg, "mg" + unit.substr(2))
                                                : fmt::format("{} (log10 p {:.1f})", e.effect->id, log10_of(e.log_p)));
}

std::string findings(const PoseDiagnosis& d, const ReadingUnits& shown) {
  std::string text;
  for (const PoseEffect& e : d.gyro_named) {
    text += effect_line(d, e, shown.gyro, shown.gyro_name + per_what(*e.effect));
  }
  for (const PoseEffect& e : d.accel_named) {
    text += effect_line(d, e, e.effect->parameters.front().si_per_unit, e.effect->parameters.front().unit);
  }
  if (d.settling) {
    text += lines_of("named:", fmt::format("accel_relaxation (log10 p {:.1f}): settling after each turn with {:.0f} s",
                                           log10_of(d.settling->log_p), d.settling->tau_s));
  }
  if (d.accel_jump) {
    const auto& [from_pose, to_pose, from_s, to_s, size, sigma] = *d.accel_jump;
    text += lines_of("misfit:",
                     fmt::format("between poses {} and {} ({:.0f} to {:.0f} s) the accelerometers' bias jumps by "
                                 "{}/{}/{} mg, which no effect of the catalogue does: give both parts by "
                                 "themselves",
                                 from_pose, to_pose, from_s, to_s, cell(1e3 * size.x(), 1e3 * sigma.x()),
                                 cell(1e3 * size.y(), 1e3 * sigma.y()), cell(1e3 * size.z(), 1e3 * sigma.z())));
  } else if (d.by_poses && !d.accel_adequate) {
    const std::string near = d.accel_tried.empty() ? std::string() : nearest_words(d.accel_tried.front());
    text += lines_of("misfit:", fmt::format("bias, scale and misalignment of the accelerometers leave {:.2f} mg rms{}",
                                            1e3 * d.accel_rms_g, near));
  }
  for (const diagnosis::BiasJump& j : d.gyro_jumps) {
    text += lines_of("jump:", fmt::format("{} {:.0f} s the gyros' bias is another by {:.3g}/{:.3g}/{:.3g} "
                                          "{}: give both parts by themselves",
                                          j.gap ? "behind the gap at" : "from", j.time_s, j.size.x() / shown.gyro,
                                          j.size.y() / shown.gyro, j.size.z() / shown.gyro, shown.gyro_name));
  }
  text += what_decides(d);
  if (!d.forces_of_another_zero.empty()) {
    const auto [least, most] = std::minmax_element(d.forces_of_another_zero.begin(), d.forces_of_another_zero.end());
    text += lines_of("zero:",
                     fmt::format("at rest the accelerometers read {:.2f} to {:.2f} g, as if set to zero in a pose: "
                                 "their bias is told from there",
                                 *least, *most));
  }
  if (!d.gyros_contradict.empty()) {
    text += lines_of("misfit:", d.gyros_contradict);
  }
  if (d.accel_reversed) {
    text += lines_of(
        "reversed:",
        "all accelerometers, as the Earth's rate shows: they read acceleration, or the axes of both triads are "
        "a mirror image, as where one of an order or sign was made to fit; or the latitude has the other sign");
  }
  if (text.empty() && d.by_poses && !names_nonlinearity(d)) {
    text = d.accel_tested || d.sensors == Sensors::accelerometers
               ? "nothing named beyond bias, scale factor and misalignment\n"
               : "nothing named; nonlinearity of the accelerometers is not tested by these poses\n";
  }
  return text;
}

// What is not used of the log.
std::string left_out(const PoseDiagnosis& d) {
  std::string text;
  if (!d.left_out.empty()) {
    double seconds = 0.0;
    for (const diagnosis::LeftOut& out : d.left_out) {
      seconds += out.last_s - out.first_s;
    }
    const diagnosis::LeftOut& first = d.left_out.front();
    text += lines_of("left out:", fmt::format("{} of {:.1f} s in all, the first at {:.1f} s: {}",
                                              counted(d.left_out.size(), "part"), seconds, first.first_s, first.words));
  }
  if (d.spikes > 0) {
    text += fmt::format("spikes: {} that no motion makes, taken out\n", counted(d.spikes, "reading"));
  }
  std::vector<std::string> axes;
  for (const diagnosis::Clipping& c : d.clipped) {
    axes.push_back(
        fmt::format("{} {} in {}", c.gyro ? "gyro" : "accelerometer", "xyz"[c.axis], counted(c.samples, "sample")));
  }
  return axes.empty() ? text : text + wrapped("clipped:", axes, ",");
}

const PoseParameter* find(const std::vector<PoseParameter>& all, const std::string& name) {
  const auto it = std::find_if(all.begin(), all.end(), [&](const PoseParameter& p) { return p.name == name; });
  return it == all.end() || !it->determined ? nullptr : &*it;
}

struct Row {
  std::string label;
  std::array<std::string, 3> cells;
};

// Without the blanks beside "+-".
std::vector<Row> narrower(std::vector<Row> rows) {
  for (Row& r : rows) {
    for (std::string& c : r.cells) {
      if (const std::size_t at = c.find(" +- "); at != std::string::npos) {
        c.replace(at, 4, "+-");
      }
    }
  }
  return rows;
}

std::string text_of(const std::vector<Row>& rows) {
  std::size_t label = 0;
  std::array<std::size_t, 3> cell{};
  for (const Row& r : rows) {
    label = std::max(label, r.label.size());
    for (std::size_t k = 0; k < cell.size(); ++k) {
      cell[k] = std::max(cell[k], r.cells[k].size());
    }
  }
  constexpr std::size_t indent = 2, wide = 2;
  const bool spread = std::any_of(rows.begin(), rows.end(), [](const Row& r) {
    return std::any_of(r.cells.begin(), r.cells.end(),
                       [](const std::string& c) { return c.find(" +- ") != std::string::npos; });
  });
  if (spread && indent + label + cell[0] + cell[1] + cell[2] + 3 > terminal_columns) {
    return text_of(narrower(rows));
  }
  const std::size_t gap = indent + label + cell[0] + cell[1] + cell[2] + 3 * wide > terminal_columns ? 1 : wide;
  std::string text;
  for (const Row& r : rows) {
    text += fmt::format("{:{}}{:<{}}", "", indent, r.label, label);
    for (std::size_t k = 0; k < cell.size(); ++k) {
      text += fmt::format("{:{}}{:>{}}", "", gap, r.cells[k], cell[k]);
    }
    text += "\n";
  }
  return text;
}

// Raw units in thousands or thousandths, so that a row keeps to the page: 1 for all others.
struct Scaled {
  std::string name;
  double unit = 1.0;
};

Scaled scaled(const std::string& name, double unit, const std::array<double, 3>& values) {
  double largest = 0.0;
  for (const double v : values) {
    largest = std::max(largest, std::abs(v) / unit);
  }
  constexpr double thousand = 3.0;
  const double power =
      largest > 0.0 && std::isfinite(largest) ? thousand * std::floor(std::log10(largest) / thousand) : 0.0;
  if (name != "raw" || power == 0.0 || power == thousand) {
    return {name, unit};
  }
  return {fmt::format("1e{:.0f} raw", power), unit * std::pow(10.0, power)};
}

// Of three parameters; nothing where none of them is determined.
void add_row(const std::vector<PoseParameter>& all, const std::string& label, const std::array<std::string, 3>& names,
             const std::string& name, double unit, std::vector<Row>& rows) {
  std::array<double, 3> values{};
  for (std::size_t k = 0; k < 3; ++k) {
    const PoseParameter* p = find(all, names[k]);
    values[k] = p ? p->value : 0.0;
  }
  const Scaled shown = scaled(name, unit, values);
  Row row{fmt::format("{}, {}", label, shown.name), {}};
  bool any = false;
  for (std::size_t k = 0; k < 3; ++k) {
    const PoseParameter* p = find(all, names[k]);
    row.cells[k] = p ? cell(p->value / shown.unit, p->sigma / shown.unit) : "open";
    any |= p != nullptr;
  }
  if (any) {
    rows.push_back(row);
  }
}

std::array<std::string, 3> of_axes(const std::string& stem) { return {stem + "_x", stem + "_y", stem + "_z"}; }

Row gyro_row(const char* what, const std::array<double, 3>& value, const std::array<double, 3>& sigma,
             const ReadingUnits& shown, const std::array<bool, 3>& axes) {
  const Scaled in = scaled(shown.gyro_short, shown.gyro, value);
  Row row{fmt::format("gyro {}, {}", what, in.name), {}};
  for (std::size_t k = 0; k < 3; ++k) {
    row.cells[k] = axes[k] ? cell(value[k] / in.unit, sigma[k] / in.unit) : "none";
  }
  return row;
}

// Gyros that see the Earth are told in degrees an hour.
ReadingUnits of_headings(bool si) {
  ReadingUnits shown = units_of(si);
  if (si) {
    shown.gyro = units::degree_per_hour;
    shown.gyro_name = shown.gyro_short = "deg/h";
  }
  return shown;
}

std::string table(const PoseDiagnosis& d, const ReadingUnits& shown) {
  std::vector<Row> rows = {{"", {"x", "y", "z"}}};
  const bool raw_scale = std::any_of(d.accel_parameters.begin(), d.accel_parameters.end(),
                                     [](const PoseParameter& p) { return p.unit == "raw/g"; });
  constexpr double percent = 0.01;
  add_row(d.accel_parameters, "accel. bias", of_axes("bias"), shown.accel_short, shown.accel, rows);
  if (raw_scale) {
    add_row(d.accel_parameters, "accel. 1 g", of_axes("scale"), "raw", 1.0, rows);
  } else {
    add_row(d.accel_parameters, "accel. scale", of_axes("scale"), "%", percent, rows);
  }
  add_row(d.accel_parameters, "accel. xy xz yz", {"misalignment_xy", "misalignment_xz", "misalignment_yz"}, "%",
          percent, rows);
  const bool known = std::any_of(d.gyro_bias_sigma.begin(), d.gyro_bias_sigma.end(), [](double s) { return s != 0.0; });
  if (d.sensors != Sensors::accelerometers && !d.rest && d.poses > 0 && known) {
    const bool si = std::string_view(shown.gyro_short) == "deg/s";
    rows.push_back(gyro_row(d.earth_taken_out ? "bias" : "mean", d.gyro_bias, d.gyro_bias_sigma,
                            d.earth_taken_out ? of_headings(si) : shown, d.gyro_axes));
  }
  if (d.gyro_raw_unit > 0.0) {
    add_row(d.gyro_parameters, "gyro 1 deg/s", of_axes("scale"), "raw", 1.0 / units::degree, rows);
  } else {
    add_row(d.gyro_parameters, "gyro scale", of_axes("scale"), "%", percent, rows);
  }
  return rows.size() > 1 ? text_of(rows) : std::string();
}

// Parameters that stay open, by triad.
std::string open_parameters(const PoseDiagnosis& d) {
  std::vector<std::string> all;
  for (const auto& [triad, parameters] :
       {std::pair{"accel. ", &d.accel_parameters}, std::pair{"gyro ", &d.gyro_parameters}}) {
    for (const PoseParameter& p : *parameters) {
      if (!p.determined) {
        all.push_back(triad + p.name);
      }
    }
  }
  return all.empty() ? std::string() : wrapped("not determined by these poses:", all, ",");
}

std::string turns_words(const PoseDiagnosis& d) {
  if (d.turns == 0) {
    return {};
  }
  constexpr double much = 5.0;
  const bool more = d.direction_by_noise > 0.0 && d.direction_after > much * d.direction_by_noise;
  return fmt::format("turns carry gravity's direction to {:.2f} deg rms{}\n", d.direction_after / units::degree,
                     more ? fmt::format(", the gyros' noise to {:.2g}", d.direction_by_noise / units::degree) : "");
}

std::string turns_line(const PoseDiagnosis& d) {
  const std::string earth =
      d.latitude_seen ? fmt::format("the gyros see the Earth's rate: latitude {:.0f} +- {:.0f} deg{} taken out\n",
                                    *d.latitude_seen / units::degree, d.latitude_seen_sigma / units::degree,
                                    d.earth_taken_out ? " by it," : ", vertical part")
                      : std::string();
  return earth + turns_words(d);
}

std::string read_outs(const diagnosis::ReadOuts& r, const ReadingUnits& shown) {
  std::string text;
  for (const diagnosis::ReadOutAxis& a : r.axes) {
    const Eigen::Index k = main_axis(a);
    const double gain = std::abs(a.response(k));
    const char* sign = a.response(k) < 0.0 ? "-" : "";
    constexpr double any_gain = 2.0;  // beyond it the gyros' unit is not that which was told
    const std::string way = a.steady ? fmt::format("steady rates up to {:.0f} deg/s", a.fastest_deg_per_s)
                                     : std::string(a.oscillates ? "reversals" : "turns");
    std::string words = fmt::format("{} {}: gyro {}{} ", a.rows, way, sign, "xyz"[k]);
    words += gain > any_gain || gain < 1.0 / any_gain
                 ? with_sigma(gain, a.sigma(k), "raw units per rad/s")
                 : "scale " + with_sigma(100.0 * (gain - 1.0), 100.0 * a.sigma(k), "%");
    for (Eigen::Index i = 0; i < 3; ++i) {
      if (i != k && a.sigma(i) > 0.0 && std::isfinite(a.sigma(i))) {  // a log may hold one gyro
        words += fmt::format(", {} {}", "xyz"[i], with_sigma(100.0 * across(a)(i), 100.0 * a.sigma(i), "%"));
      }
    }
    if (a.nonlinearity) {
      const double at_fastest = 100.0 * a.fastest_deg_per_s * units::degree;  // %, of a rate's own part
      words +=
          a.nonlinearity->determined
              ? fmt::format("; nonlinearity named, {} at {:.0f} deg/s",
                            with_sigma(at_fastest * a.nonlinearity->value, at_fastest * a.nonlinearity->sigma, "%"),
                            a.fastest_deg_per_s)
              : std::string("; nonlinearity not seen");
    }
    if (a.turns_alike > 0.0) {
      words += "; " + turns_alike_words(a);
    }
    text += lines_of(a.name + " axis,", words);
  }
  if (r.clock) {
    std::string words = fmt::format("clock: {} s {}", cell(std::abs(r.clock->delay_s), r.clock->delay_sigma_s),
                                    r.clock->delay_s < 0.0 ? "early" : "late");
    if (r.clock->growth_sigma_s > 0.0) {
      words += fmt::format(", {} s more over the log", cell(r.clock->growth_s, r.clock->growth_sigma_s));
      constexpr double told = 3.0;  // sigma
      if (std::abs(r.clock->faster) > told * r.clock->faster_sigma) {
        words += fmt::format("; were it right and the log's not, scales would be {} % {}",
                             cell(100.0 * std::abs(r.clock->faster), 100.0 * r.clock->faster_sigma),
                             r.clock->faster > 0.0 ? "less" : "more");
      }
    }
    text += lines_of("read-outs'", words);
  }
  if (r.tilt && r.tilt->near_vertical) {
    text += fmt::format("{} axis: {} deg off the vertical\n", r.tilt->axis, cell(r.tilt->tilt_deg, r.tilt->sigma_deg));
  }
  const bool steady = std::any_of(r.axes.begin(), r.axes.end(), [](const auto& a) { return a.steady || a.oscillates; });
  if (steady) {
    const auto of = [](const Vector3& v) { return std::array{v.x(), v.y(), v.z()}; };
    const auto there = [&r](Eigen::Index k) { return r.gyro_bias_sigma(k) > 0.0; };
    text +=
        text_of({{"", {"x", "y", "z"}},
                 gyro_row("at rate 0", of(r.gyro_bias), of(r.gyro_bias_sigma), shown, {there(0), there(1), there(2)})});
  }
  return text;
}

// What such a log cannot show: each before its colon.
std::string unseen(const PoseDiagnosis& d) {
  std::vector<std::string> parts;
  for (const std::string& words : d.invisible) {
    parts.push_back(words.substr(0, words.find(':')));
  }
  return parts.empty() ? std::string() : lines_of("not shown:", fmt::format("{}", fmt::join(parts, "; ")));
}

}  // namespace

std::string poses_summary(const PoseDiagnosis& d, bool si) {
  const ReadingUnits shown = units_of(si);
  if (d.dividing_head) {
    return head_text(*d.dividing_head) + unseen(d);
  }
  std::string text = heading(d) + findings(d, shown);
  if (d.read_outs) {
    text += read_outs(*d.read_outs, shown);
  }
  if (d.by_attitude) {
    text += folded(attitude_text(*d.by_attitude, shown));
  }
  if (d.rest) {
    text += rest_findings(*d.rest) + left_out(d) + rest_table(*d.rest);
    if (d.earth_taken_out) {
      text += fmt::format("gyro bias by {} headings, the Earth's rate taken out\n", d.poses) +
              text_of({{"", {"x", "y", "z"}},
                       gyro_row("bias", d.gyro_bias, d.gyro_bias_sigma, of_headings(si), d.gyro_axes)});
    }
  } else {
    text += left_out(d) + table(d, shown) + turns_line(d) + open_parameters(d);
  }
  if (!d.not_by_position.empty()) {
    text += lines_of("no reference:", fmt::format("position at rest: {}", d.not_by_position));
  }
  return text + unseen(d);
}

}  // namespace selfcal::cli
