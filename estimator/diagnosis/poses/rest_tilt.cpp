#include "estimator/diagnosis/poses/rest_tilt.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/noise/base_tilt.hpp"

namespace selfcal::diagnosis {
namespace {

class Tilts {
 public:
  Tilts(const PoseInput& input, const Pose& longest, const RestBlocks& blocks, Rest& rest)
      : input_(input),
        longest_(longest),
        block_s_(blocks.times.block_s),
        rest_(rest),
        up_(longest.accel.normalized()),
        g_(longest.accel.norm()) {}

  void judge() {
    rest_.base_tilt = course();
    std::vector<double> done;
    for (const RestAxis& axis : rest_.axes) {
      for (const RestTerm& term : axis.terms) {
        const double at = term.found.constant;
        const auto same = [&](double before) { return std::abs(before - at) < block_s_; };
        if (!axis.gyro && term.found.equation.jumps && std::none_of(done.begin(), done.end(), same)) {
          done.push_back(at);
          judge_jump(at);
        }
      }
    }
    for (RestAxis& axis : rest_.axes) {
      for (RestTerm& term : axis.terms) {
        if (!axis.gyro && !term.found.equation.jumps && across(axis.axis)) {
          term.tilt = rest_.base_tilt ? RestTerm::Tilt::seen : RestTerm::Tilt::open;
        }
      }
      std::erase_if(axis.terms, [](const RestTerm& term) { return term.tilt == RestTerm::Tilt::seen; });
    }
  }

 private:
  bool across(int axis) const {
    constexpr double upright = 0.9;
    return std::abs(up_(axis)) < upright;
  }

  // By sums over a second: a log of hours at 1 kHz is not held twice.
  std::optional<BaseTilt> course() const {
    std::vector<std::array<double, 3>> angle, velocity;
    const double rate_hz = sample_rate(input_);
    const auto samples = static_cast<std::size_t>(std::max(1.0, std::floor(rate_hz)));
    for (std::size_t first = longest_.first; first + samples <= longest_.last; first += samples) {
      Vector3 turn = Vector3::Zero(), push = Vector3::Zero();
      for (std::size_t i = first; i < first + samples; ++i) {
        turn += at(input_.gyro, i) * (input_.gyro_unit / rate_hz);
        push += at(input_.accel, i) / rate_hz;
      }
      angle.push_back({turn.x(), turn.y(), turn.z()});
      velocity.push_back({push.x(), push.y(), push.z()});
    }
    ImuData data;
    data.sample_rate_hz = rate_hz / static_cast<double>(samples);
    data.delta_theta = angle;
    data.delta_v = velocity;
    return base_tilt(data, {{.last = angle.size()}});
  }

  // The jumps of all axes at this time are one.
  void judge_jump(double at_s) {
    std::vector<RestTerm*> terms;
    Vector3 jump = Vector3::Zero();
    for (RestAxis& axis : rest_.axes) {
      for (RestTerm& term : axis.terms) {
        if (!axis.gyro && term.found.equation.jumps && std::abs(term.found.constant - at_s) < block_s_) {
          terms.push_back(&term);
          jump(axis.axis) += term.found.value;
        }
      }
    }
    const Vector3 turn = jump.cross(up_) / g_;
    constexpr double most_upright = 0.5;
    if (turn.norm() * g_ < most_upright * jump.norm()) {
      return;  // gravity's size does not change
    }
    const auto [share, sigma] = share_of_gyros(at_s, turn);
    constexpr double sure = 3.0, scale = 0.25;  // scale factors, and what of the turn lies outside
    const bool seen = share > sure * sigma && std::abs(share - 1.0) < std::max(sure * sigma, scale);
    const bool excluded = share + sure * sigma < 1.0 - scale && std::abs(share) < sure * sigma;
    for (RestTerm* term : terms) {
      term->tilt = seen ? RestTerm::Tilt::seen : excluded ? RestTerm::Tilt::excluded : RestTerm::Tilt::open;
      term->tilt_angle = turn.norm();
    }
    if (seen) {
      rest_.tilts.push_back({at_s, turn.norm(), share, sigma});
    }
  }

  // What the gyros turn about this axis within a block on either side, beside their mean in two blocks before and behind: over the turn's size.
  std::pair<double, double> share_of_gyros(double at_s, const Vector3& turn) const {
    const Vector3 axis = turn.normalized();
    const double begin = input_.time_s.front();
    double inside = 0.0, inside_s = 0.0, around = 0.0, around_s = 0.0;
    for (std::size_t i = std::max<std::size_t>(1, longest_.first); i < longest_.last; ++i) {
      const double away = std::abs(input_.time_s[i] - begin - at_s), dt = input_.time_s[i] - input_.time_s[i - 1];
      const double rate = at(input_.gyro, i).dot(axis) * input_.gyro_unit;
      if (away < block_s_) {
        inside += rate * dt;
        inside_s += dt;
      } else if (away < 3.0 * block_s_) {
        around += rate * dt;
        around_s += dt;
      }
    }
    if (!(around_s > 0.0) || !(inside_s > 0.0)) {
      return {0.0, HUGE_VAL};
    }
    double white = 0.0;  // density's square about this axis
    for (const RestAxis& a : rest_.axes) {
      white += a.gyro ? std::pow(axis(a.axis) * a.white_asd * input_.gyro_unit, 2) : 0.0;
    }
    const double turned = inside - around * inside_s / around_s;
    const double sigma = std::sqrt(white * (inside_s + inside_s * inside_s / around_s));
    return {turned / turn.norm(), sigma / turn.norm()};
  }

  const PoseInput& input_;
  const Pose& longest_;
  double block_s_;
  Rest& rest_;
  Vector3 up_;
  double g_;
};

}  // namespace

void judge_tilt(const PoseInput& input, const std::vector<Pose>& poses, const RestBlocks& blocks, Rest& rest) {
  const bool all = std::all_of(input.gyro_axes.begin(), input.gyro_axes.end(), [](bool there) { return there; });
  if (rest.si && input.sensors == Sensors::both && all) {
    Tilts(input, poses[blocks.longest], blocks, rest).judge();
  }
}

}  // namespace selfcal::diagnosis
