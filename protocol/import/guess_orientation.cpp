#include "protocol/import/guess_orientation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"
#include "protocol/import/guess_axes.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::import {
namespace {

std::string other_ways(std::size_t count) {
  return count == 1 ? "one other way may" : fmt::format("{} other ways", count);
}

constexpr double good_gravity = 0.98;  // |mean direction|^2: accelerometer errors of some per cent
constexpr double good_turns = 0.95;    // of the sum of squares: scale factors off by ten per cent
constexpr double fair_turns = 0.5;     // by hand: the accelerometers see every jerk

class Finder {
 public:
  Finder(const OrientationInput& input, std::vector<Remark>& remarks) : in_(input), remarks_(remarks) {}

  Orientation find() {
    const auto samples =
        in_.interval_s ? static_cast<std::size_t>(std::clamp(0.25 / *in_.interval_s, 4.0, 2000.0)) : 25;
    block_ = samples;
    const bool by_gimbal = in_.gimbal[0] != nullptr && in_.gimbal[1] != nullptr && find_by_gimbal();
    if (!by_gimbal) {
      find_by_gravity();
    }
    settle_sign(by_gimbal);
    return out_;
  }

 private:
  void say(const char* key, std::string text) { remarks_.push_back({key, std::move(text), false}); }
  void doubt(const char* key, std::string text) { remarks_.push_back({key, std::move(text), true}); }

  std::array<std::vector<double>, 2> angles(double unit) const {
    std::array<std::vector<double>, 2> all{*in_.gimbal[0], *in_.gimbal[1]};
    for (auto& column : all) {
      for (double& value : column) {
        value *= unit;
      }
    }
    return all;
  }

  struct Way {
    std::string unit;
    bool swapped = false;
    Motion motion;
    std::optional<AxisFit> gyro, accelerometer;
    double score() const { return (gyro ? gyro->explained : 0.0) + (accelerometer ? accelerometer->explained : 0.0); }
  };

  // Unit and order of the read-outs that gravity and gyros bear out best.
  bool find_by_gimbal() {
    std::vector<Way> ways;
    std::vector<std::string> unit_names{"deg", "rad"};
    if (!in_.gimbal_unit.empty()) {
      unit_names = {in_.gimbal_unit};
    }
    for (const std::string& unit : unit_names) {
      const Motion motion = find_motion(in_.gyro, in_.accelerometer,
                                        angles(find_unit(unit).value_or(Unit{{}, Quantity::angle, 1.0}).si), block_);
      const std::vector<Rest> rests = rests_of(motion);
      for (const bool swapped : {false, true}) {
        Way way;
        way.unit = unit;
        way.swapped = swapped;
        way.motion = motion;
        way.gyro = gyros_by_gimbal(motion, turns_of(motion, rests), swapped);
        way.accelerometer = accelerometers_by_gimbal(rests, swapped);
        ways.push_back(std::move(way));
      }
    }
    std::stable_sort(ways.begin(), ways.end(), [](const Way& a, const Way& b) { return a.score() > b.score() + 1e-9; });
    const Way& best = ways.front();
    if (!best.gyro || !best.accelerometer) {
      say("gimbal.outer", "the gimbal hardly turns: nothing is seen of its order and unit");
      out_.gimbal_unit = best.unit;
      doubt("gimbal", "too few positions: order, unit and signs of the read-outs cannot be checked");
      return false;
    }
    out_.moves = true;
    out_.swapped = best.swapped;
    out_.gimbal_unit = best.unit;
    motion_ = best.motion;
    if (!tell_gimbal(ways)) {
      return false;
    }
    choose_axes(*best.gyro, *best.accelerometer);
    return true;
  }

  // Whether the read-outs fit at all.
  bool tell_gimbal(const std::vector<Way>& ways) {
    const Way& best = ways.front();
    const double gravity = best.accelerometer->explained;
    const double turns = best.gyro->explained;
    if (gravity < good_gravity || turns < good_turns) {
      doubt("gimbal",
            fmt::format(
                "read-outs do not fit the sensors: at best gravity keeps {:.1f} % of its size in the base's axes, and "
                "the gyros show {:.1f} % of the turns; offsets of the read-outs, another gimbal, or angles not in "
                "degrees or radians",
                100.0 * std::sqrt(gravity), 100.0 * turns));
      return false;
    }
    for (std::size_t k = 1; k < ways.size(); ++k) {
      const bool alike = ways[k].score() > best.score() - 0.02;
      if (alike && ways[k].unit != best.unit) {
        doubt("gimbal.unit", fmt::format("{} or {}: both fit", best.unit, ways[k].unit));
      } else if (alike && ways[k].swapped != best.swapped && !in_.gimbal_named) {
        doubt("gimbal.outer", "which read-out is the outer axis: both ways fit");
      }
    }
    if (in_.gimbal_named && best.swapped) {
      doubt("gimbal.outer", "the names of outer and inner contradict the sensors: the other way round fits better");
    }
    say("gimbal.unit", fmt::format("{}; in the base's axes gravity keeps {:.2f} % of its size over {} positions",
                                   best.unit, 100.0 * std::sqrt(gravity), best.accelerometer->seen));
    return true;
  }

  // Turning the base's and the sensor's axes by half a turn about one of them changes the signs of read-outs and axes and
  // nothing else: of the four ways the one with the fewest signs is taken.
  void choose_axes(const AxisFit& gyro, const AxisFit& accelerometer) {
    // Where several fit alike: axes as they stand, and both triads alike, as in one box.
    const Matrix3 gyro_axes =
        gyro.fits(Matrix3::Identity()) && gyro.sign > 0.0 ? Matrix3(Matrix3::Identity()) : gyro.matrix();
    const Matrix3 proper = gyro_axes * gyro.sign;
    const Matrix3 accel = accelerometer.fits(proper) ? gyro_axes : accelerometer.rotation;
    double most = -10.0;
    constexpr double signs[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    for (const auto& s : signs) {
      const Matrix3 half_turn = Vector3(s[0], s[1], s[2]).asDiagonal();
      const double trace = (half_turn * gyro_axes).trace() + (half_turn * accel).trace();
      if (trace > most + 1e-9) {
        most = trace;
        out_.gyro = half_turn * gyro_axes;
        out_.accelerometer = half_turn * accel;
        out_.signs = {s[2], s[1]};  // outer turns about z, inner about y: reversed where the axis is
      }
    }
    if (gyro.explained > good_turns) {
      out_.rad_per_sample = gyro.scale;
    }
    if (!gyro.alike.empty()) {
      doubt("gyro.axes",
            fmt::format("{} fit the turns as well: too few axes are turned about", other_ways(gyro.alike.size())));
    }
    if (!accelerometer.alike.empty()) {
      doubt("accelerometer.axes",
            fmt::format("{} fit gravity as well: too few positions", other_ways(accelerometer.alike.size())));
    }
    say("gyro.axes", fmt::format("{}: {} turns of the gimbal show it", axes_words(out_.gyro), gyro.seen));
    say("gimbal.signs",
        "signs of read-outs and axes belong together; three other ways to call the axes fit as well and mean the same");
  }

  // No gimbal, or one that tells nothing: how the gyros turn the specific force.
  void find_by_gravity() {
    const auto samples = in_.interval_s ? static_cast<std::size_t>(std::clamp(0.08 / *in_.interval_s, 2.0, 400.0)) : 8;
    const Motion quick = find_motion(in_.gyro, in_.accelerometer, std::nullopt, samples);
    motion_ = find_motion(in_.gyro, in_.accelerometer, std::nullopt, block_);
    const std::vector<Rest> rests = rests_of(motion_);
    auto fit = quick.turns ? gyros_by_gravity(quick) : std::nullopt;
    if (fit && fit->explained < good_turns) {
      // By hand: the rests are smooth, the turns are not.
      const auto slow = gyros_from_rest_to_rest(in_.gyro, motion_, rests, fit->scale);
      fit = slow && slow->explained > fit->explained ? slow : fit;
    }
    out_.moves = out_.moves || gravity_turns();
    out_.turns = quick.turns;
    if (in_.axes_by_format) {
      return;
    }
    if (!fit || fit->explained < fair_turns || !gravity_turns()) {
      const char* why = quick.turns       ? "what turns does not show in the accelerometers"
                        : gravity_turns() ? "no turn stands out of what moves"
                                          : "nothing turns";
      doubt("gyro.axes", fmt::format("taken as they stand; {}, so that order and signs cannot be checked", why));
      if (quick.turns && !out_.moves && !in_.on_a_table) {
        doubt("gimbal", "the gyros show turns and gravity none: disturbed, or turned about the vertical");
      }
      return;
    }
    out_.rad_per_sample = fit->scale;
    if (fit->sign < 0.0) {
      // Left-handed among each other: one axis of both is reversed, nothing says which.
      const Matrix3 mirror = Vector3(1.0, 1.0, -1.0).asDiagonal();
      out_.accelerometer = mirror;
      out_.gyro = mirror * fit->rotation;
      doubt("gyro.axes", "left-handed axes: one axis of both triads is reversed, taken to be z");
    } else {
      out_.gyro = fit->fits(Matrix3::Identity()) ? Matrix3(Matrix3::Identity()) : fit->rotation;
      say("gyro.axes", fmt::format("{}: so they turn the specific force ({:.1f} % explained over {} steps)",
                                   axes_words(out_.gyro), 100.0 * fit->explained, fit->seen));
    }
    if (!fit->alike.empty()) {
      doubt("gyro.axes",
            fmt::format("{} explain the turning of the specific force as well", other_ways(fit->alike.size())));
    }
  }

  // Directions of the specific force, smoothed over blocks, differ by more than a parked vehicle's.
  bool gravity_turns() const {
    constexpr double least = 0.1;  // rad
    std::size_t turned = 0;
    const Vector3 first = motion_.blocks.empty() ? Vector3::UnitX() : motion_.blocks[motion_.blocks.size() / 2].accel;
    for (const Block& block : motion_.blocks) {
      turned += block.accel.normalized().cross(first.normalized()).norm() > least ? 1 : 0;
    }
    return turned * 50 > motion_.blocks.size();  // a knock is no turn
  }

  // What order and signs of the gyros say of the accelerometers instead; nothing where both stand as they are.
  std::string other_triad() const {
    if (out_.gyro.isIdentity() || !out_.accelerometer.isIdentity()) {
      return {};
    }
    const Matrix3 inverse = out_.gyro.transpose();
    return fmt::format(", or with the gyros as they stand and these as {}",
                       axes_words(inverse.trace() < 0.0 ? Matrix3(-inverse) : inverse));
  }

  // Turns do not show whether all three accelerometers are reversed; the Earth's rate does.
  void settle_sign(bool by_gimbal) {
    const std::string axes = axes_words(out_.accelerometer);
    std::optional<EarthRate> earth;
    if (out_.rad_per_sample && in_.interval_s) {
      earth = earth_rate(rests_of(motion_), out_.gyro, *out_.rad_per_sample / *in_.interval_s, out_.accelerometer,
                         by_gimbal, out_.swapped);
      if (by_gimbal) {
        earth = earth_with_signs();
      }
    }
    constexpr double certain = 6.0;  // sigma
    const bool seen = earth && std::abs(earth->sine_of_latitude) > certain * earth->sigma && earth->sigma < 0.05 &&
                      std::abs(earth->sine_of_latitude) < 1.1;
    if (in_.axes_by_format) {
      return;
    }
    if (!seen) {
      return doubt(
          "accelerometer.axes",
          fmt::format(
              "{}: an axis that points up is taken to read +g; were all three reversed, turns would show the same{}",
              axes, by_gimbal ? std::string() : other_triad()));
    }
    const double latitude = std::asin(std::clamp(earth->sine_of_latitude, -1.0, 1.0)) / units::degree;
    if (!in_.latitude_deg) {
      if (earth->sine_of_latitude < 0.0) {
        out_.accelerometer = -out_.accelerometer;
      }
      return doubt(
          "accelerometer.axes",
          fmt::format(
              "{}: the Earth's rate shows a latitude of {:.1f} deg north, or all three are reversed in the south",
              axes_words(out_.accelerometer), std::abs(latitude)));
    }
    const double expected = std::sin(*in_.latitude_deg * units::degree);
    const double off =
        std::min(std::abs(earth->sine_of_latitude - expected), std::abs(-earth->sine_of_latitude - expected));
    if (off > std::max(0.05, certain * earth->sigma) || std::abs(expected) < 0.1) {
      return doubt(
          "accelerometer.axes",
          fmt::format("{}: the Earth's rate shows a latitude of {:.1f} deg, {} is given: unit of the gyros, time, or "
                      "site",
                      axes, latitude, *in_.latitude_deg));
    }
    if (earth->sine_of_latitude * expected < 0.0) {
      out_.accelerometer = -out_.accelerometer;
    }
    say("accelerometer.axes",
        fmt::format("{}: an axis that points up reads +g, since the Earth's rate shows {:.1f} deg of latitude",
                    axes_words(out_.accelerometer), earth->sine_of_latitude * expected < 0.0 ? -latitude : latitude));
  }

  // The read-outs' signs belong to the chosen axes.
  std::optional<EarthRate> earth_with_signs() const {
    std::vector<Rest> rests = rests_of(motion_);
    for (Rest& rest : rests) {
      rest.gimbal[out_.swapped ? 1 : 0] *= out_.signs[0];
      rest.gimbal[out_.swapped ? 0 : 1] *= out_.signs[1];
    }
    return earth_rate(rests, out_.gyro, *out_.rad_per_sample / *in_.interval_s, out_.accelerometer, true, out_.swapped);
  }

  const OrientationInput& in_;
  std::vector<Remark>& remarks_;
  std::size_t block_ = 25;
  Motion motion_;
  Orientation out_;
};

}  // namespace

std::string axes_words(const Matrix3& axes) {
  constexpr std::string_view letters = "xyz";
  std::string words;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      if (axes(k, j) != 0.0) {
        words += fmt::format("{}{} = {}{}", words.empty() ? "" : ", ", letters[static_cast<std::size_t>(k)],
                             axes(k, j) < 0.0 ? "-" : "", letters[static_cast<std::size_t>(j)]);
      }
    }
  }
  return words;
}

Orientation find_orientation(const OrientationInput& input, std::vector<Remark>& remarks) {
  return Finder(input, remarks).find();
}

void set_axes(const Matrix3& axes, TriadMap& triad) {
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      if (axes(k, j) != 0.0) {
        triad.axes[static_cast<std::size_t>(k)] = {j, axes(k, j)};
      }
    }
  }
}

}  // namespace selfcal::import
