#include "estimator/diagnosis/data/attribution.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// A gimbal good to 1 deg at both ends, sensors misaligned and mis-scaled by up to 1 deg.
constexpr double angle_sigma = 2.0 * units::degree;
constexpr double prior_of_a_fault = 20.0, prior_of_a_detail = 1.0, prior_of_upside_down = 10.0;
constexpr double most_by_latitude = 15.0;  // the site may be wrong as well
constexpr double rival_misfit = 9.2;       // odds of 1 to 100
constexpr double contradicts = 2.25;       // mean square beyond which two witnesses do not agree

const std::vector<ReadOutOrder>& all_read_out_orders() {
  static const std::vector<ReadOutOrder> all = [] {
    constexpr int all_ways = 32;
    std::vector<ReadOutOrder> orders;
    orders.reserve(all_ways);
    for (int k = 0; k < all_ways; ++k) {
      orders.push_back({(k & 1) != 0, (k & 2) != 0 ? -1 : 1, (k & 4) != 0 ? -1 : 1, (k & 8) != 0, (k & 16) != 0});
    }
    return orders;
  }();
  return all;
}

// A triad's axes, and the rotation that takes its attitude to that of b: where the axes are a mirror image of the right
// ones the increments are those of the opposite sense, in axes that are rotated.
struct Frame {
  Matrix3 to_b;     // truth = to_b * measured
  Matrix3 rotated;  // proper
  bool mirrored;
  explicit Frame(const AxisOrder& order) : to_b(order.matrix().transpose()), mirrored(to_b.determinant() < 0.0) {
    rotated = mirrored ? Matrix3(-to_b) : to_b;
  }
  Matrix3 C_ib(const SensedRest& rest) const {
    return rotated * (mirrored ? rest.C_ib_mirrored : rest.C_ib) * rotated.transpose();
  }
  Matrix3 turn(const SensedTurn& t) const {
    return matrix_from_rotation_vector(rotated * (mirrored ? t.by_gyros_mirrored : t.by_gyros));
  }
};

double angle_between(const Vector3& a, const Vector3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

double squared(double angle, double sigma) { return angle * angle / (sigma * sigma); }

double turns_misfit(const Witnesses& w, const Frame& gyros, const ReadOutOrder& read_out) {
  double sum = 0.0;
  for (const SensedTurn& t : w.turns) {
    const Matrix3 by_gimbal = read_out.C_vb(t.from).transpose() * read_out.C_vb(t.to);
    sum += squared(Eigen::AngleAxisd(by_gimbal.transpose() * gyros.turn(t)).angle(), angle_sigma);
  }
  return sum;
}

double gravity_by_gyros_misfit(const Witnesses& w, const std::vector<Matrix3>& C_ib, const Matrix3& accel_to_b) {
  double sum = 0.0;
  for (std::size_t k = 1; k < w.rests.size(); ++k) {
    const Vector3 before = C_ib[k - 1] * accel_to_b * w.rests[k - 1].force;
    const Vector3 after = C_ib[k] * accel_to_b * w.rests[k].force;
    const double turned = earth::rotation_rate * (w.rests[k].middle_s - w.rests[k - 1].middle_s);
    sum += squared(angle_between(before, after), std::hypot(angle_sigma, turned));
  }
  return sum;
}

struct GravityByReadOut {
  double misfit = 0.0;
  bool upside_down = false;
};

GravityByReadOut gravity_by_read_out(const Witnesses& w, const Matrix3& accel_to_b, const ReadOutOrder& read_out) {
  std::vector<Vector3> up;
  Vector3 mean = Vector3::Zero();
  for (const SensedRest& r : w.rests) {
    up.emplace_back(read_out.C_vb(r.angles) * (accel_to_b * r.force).normalized());
    mean += up.back();
  }
  GravityByReadOut result;
  for (const Vector3& u : up) {
    result.misfit += squared(angle_between(u, mean), angle_sigma);
  }
  result.upside_down = mean.y() < -0.5 * static_cast<double>(up.size());
  return result;
}

// The Earth's rate, one vector in space, and drifts: what the dwells' mean rates leave of both.
struct EarthByGyros {
  double square = 0.0;  // (rad/s)^2, sum
  Vector3 rate = Vector3::Zero();
};

EarthByGyros earth_by_gyros(const Witnesses& w, const Frame& gyros, const std::vector<Matrix3>& C_ib) {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  // The rate in space has about the size of the Earth's, the drifts any.
  const double weak = 1e-3;
  Matrix6 normal = Matrix6::Zero();
  normal.topLeftCorner<3, 3>().diagonal().setConstant(weak);
  normal.bottomRightCorner<3, 3>().diagonal().setConstant(1e-9);
  Vector6 right = Vector6::Zero();
  for (std::size_t k = 0; k < w.rests.size(); ++k) {
    Eigen::Matrix<double, 3, 6> row;
    row << C_ib[k].transpose(), Matrix3::Identity();
    normal += row.transpose() * row;
    right += row.transpose() * (gyros.to_b * w.rests[k].rate);
  }
  const Vector6 fit = normal.ldlt().solve(right);
  EarthByGyros result;
  result.rate = fit.head<3>();
  for (std::size_t k = 0; k < w.rests.size(); ++k) {
    const Vector3 left = gyros.to_b * w.rests[k].rate - C_ib[k].transpose() * result.rate - fit.tail<3>();
    result.square += left.squaredNorm();
  }
  return result;
}

double sensed_latitude(const Witnesses& w, const std::vector<Matrix3>& C_ib, const Vector3& rate,
                       const Matrix3& accel_to_b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < w.rests.size(); ++k) {
    const Vector3 up = C_ib[k] * (accel_to_b * w.rests[k].force);
    sum += 0.5 * std::numbers::pi - angle_between(rate, up);
  }
  return sum / static_cast<double>(w.rests.size());
}

// All that depends on two of the three, computed once for every pair.
class Tables {
 public:
  Tables(const Witnesses& w, const earth::Position& site) : w_(w), site_(site) {
    for (const AxisOrder& order : all_axis_orders()) {
      frames_.emplace_back(order);
      std::vector<Matrix3>& C_ib = attitudes_.emplace_back();
      for (const SensedRest& r : w.rests) {
        C_ib.push_back(frames_.back().C_ib(r));
      }
      earth_.push_back(earth_by_gyros(w, frames_.back(), C_ib));
    }
    see_the_earth();
    fill();
  }

  std::size_t read_outs() const { return w_.gimbal ? all_read_out_orders().size() : 1; }
  Explanation at(std::size_t g, std::size_t a, std::size_t r) const {
    Explanation e{all_axis_orders()[g], all_axis_orders()[a], all_read_out_orders()[r]};
    const double angles = turns_[g][r] + gravity_gyros_[g][a] + gravity_read_out_[a][r].misfit;
    e.squared = angles / static_cast<double>(observations_);
    const bool same = g == a;
    const int faults =
        (same ? (g != right_ ? 1 : 0) : (g != right_ ? 1 : 0) + (a != right_ ? 1 : 0)) + (e.read_out.right() ? 0 : 1);
    const int details = e.gyros.changed() + (same ? 0 : e.accelerometers.changed()) + e.read_out.changed();
    e.misfit = angles + earth_misfit_[g] + latitude_[g][a] + prior_of_a_fault * faults + prior_of_a_detail * details +
               (gravity_read_out_[a][r].upside_down ? prior_of_upside_down : 0.0);
    return e;
  }

 private:
  // Noise of a dwell's mean rate: what the best account leaves, and never below 5 % of the Earth's rate.
  void see_the_earth() {
    double least = HUGE_VAL;
    for (const EarthByGyros& e : earth_) {
      least = std::min(least, e.square);
    }
    const auto freedom = static_cast<double>(3 * w_.rests.size()) - 6.0;
    const double noise = freedom > 0.0 ? std::sqrt(least / freedom) : HUGE_VAL;
    rate_sigma_ = std::max(0.05 * earth::rotation_rate, noise);
    earth_visible_ = rate_sigma_ < 0.3 * earth::rotation_rate;
  }

  void fill() {
    const std::vector<AxisOrder>& orders = all_axis_orders();
    for (std::size_t g = 0; g < orders.size(); ++g) {
      right_ = orders[g].right() ? g : right_;
      earth_misfit_.push_back(std::isfinite(rate_sigma_) ? earth_[g].square / (rate_sigma_ * rate_sigma_) : 0.0);
      turns_.emplace_back();
      gravity_gyros_.emplace_back();
      gravity_read_out_.emplace_back();
      latitude_.emplace_back();
      for (std::size_t r = 0; r < read_outs(); ++r) {
        const ReadOutOrder& read_out = all_read_out_orders()[r];
        turns_[g].push_back(w_.gimbal ? turns_misfit(w_, frames_[g], read_out) : 0.0);
        gravity_read_out_[g].push_back(w_.gimbal ? gravity_by_read_out(w_, frames_[g].to_b, read_out)
                                                 : GravityByReadOut{});
      }
      for (std::size_t a = 0; a < orders.size(); ++a) {
        const Matrix3& to_b = frames_[a].to_b;
        gravity_gyros_[g].push_back(gravity_by_gyros_misfit(w_, attitudes_[g], to_b));
        constexpr double latitude_sigma = 5.0 * units::degree;
        const double off = sensed_latitude(w_, attitudes_[g], earth_[g].rate, to_b) - site_.latitude;
        latitude_[g].push_back(earth_visible_ ? std::min(most_by_latitude, squared(off, latitude_sigma)) : 0.0);
      }
    }
    observations_ = std::max<std::size_t>(1, w_.rests.size() - 1 + (w_.gimbal ? w_.turns.size() + w_.rests.size() : 0));
  }

  const Witnesses& w_;
  const earth::Position& site_;
  std::vector<Frame> frames_;
  std::vector<std::vector<Matrix3>> attitudes_;  // of gyros' order, dwell
  std::vector<EarthByGyros> earth_;
  std::vector<double> earth_misfit_;
  std::vector<std::vector<double>> turns_, gravity_gyros_, latitude_;
  std::vector<std::vector<GravityByReadOut>> gravity_read_out_;
  double rate_sigma_ = HUGE_VAL;
  bool earth_visible_ = false;
  std::size_t right_ = 0, observations_ = 1;
};

}  // namespace

int ReadOutOrder::changed() const {
  return (swapped ? 1 : 0) + (outer_sign < 0 ? 1 : 0) + (inner_sign < 0 ? 1 : 0) +
         (outer_degrees && inner_degrees ? 1 : (outer_degrees ? 2 : 0) + (inner_degrees ? 2 : 0));
}

Matrix3 ReadOutOrder::C_vb(const GimbalAngles& read) const {
  const double outer = swapped ? read.inner : read.outer, inner = swapped ? read.outer : read.inner;
  return gimbal_matrix(outer * outer_sign * (outer_degrees ? units::degree : 1.0),
                       inner * inner_sign * (inner_degrees ? units::degree : 1.0));
}

Witness Explanation::odd() const {
  const bool imu = !gyros.right() && gyros == accelerometers;
  const int faults =
      (imu ? 1 : (gyros.right() ? 0 : 1) + (accelerometers.right() ? 0 : 1)) + (read_out.right() ? 0 : 1);
  if (faults != 1) {
    return faults == 0 ? Witness::none : Witness::several;
  }
  return imu                       ? Witness::imu
         : !gyros.right()          ? Witness::gyros
         : !accelerometers.right() ? Witness::accelerometers
                                   : Witness::read_out;
}

std::vector<Explanation> explain(const Witnesses& witnesses, const earth::Position& site) {
  std::vector<Explanation> all;
  if (witnesses.rests.empty()) {
    return all;
  }
  const Tables tables(witnesses, site);
  const std::size_t orders = all_axis_orders().size();
  for (std::size_t g = 0; g < orders; ++g) {
    for (std::size_t a = 0; a < orders; ++a) {
      for (std::size_t r = 0; r < tables.read_outs(); ++r) {
        all.push_back(tables.at(g, a, r));
      }
    }
  }
  constexpr std::ptrdiff_t kept = 200;
  const auto better = [](const Explanation& x, const Explanation& y) { return x.misfit < y.misfit; };
  const auto end = all.begin() + std::min<std::ptrdiff_t>(kept, std::ssize(all));
  std::partial_sort(all.begin(), end, all.end(), better);
  all.erase(end, all.end());
  return all;
}

std::vector<Explanation> rivals_of_best(const std::vector<Explanation>& all) {
  std::vector<Explanation> rivals;
  const auto details = [](const Explanation& e) {
    return e.gyros.changed() + e.accelerometers.changed() + e.read_out.changed();
  };
  for (std::size_t k = 1; k < all.size() && all[k].misfit < all.front().misfit + rival_misfit; ++k) {
    if (all[k].odd() != all.front().odd() || details(all[k]) <= details(all.front())) {
      rivals.push_back(all[k]);
    }
  }
  return rivals;
}

Witness PairMisfit::odd() const {
  const bool turns = gyros_read_out > contradicts, carried = gyros_accelerometers > contradicts,
             still = accelerometers_read_out > contradicts;
  if (turns && carried && still) {
    // Of three contradictions the weakest may follow from the other two's common member.
    const double least = std::min({gyros_read_out, gyros_accelerometers, accelerometers_read_out});
    constexpr double far_below = 0.1;
    if (least > far_below * std::max({gyros_read_out, gyros_accelerometers, accelerometers_read_out})) {
      return Witness::several;
    }
    return least == gyros_read_out         ? Witness::accelerometers
           : least == gyros_accelerometers ? Witness::read_out
                                           : Witness::gyros;
  }
  if (turns && carried) {
    return Witness::gyros;
  }
  if (turns && still) {
    return Witness::read_out;
  }
  return carried && still ? Witness::accelerometers : Witness::several;
}

PairMisfit pair_misfit(const Witnesses& w) {
  const Frame right{AxisOrder{}};
  std::vector<Matrix3> C_ib;
  for (const SensedRest& r : w.rests) {
    C_ib.push_back(r.C_ib);
  }
  const auto per = [](double sum, std::size_t count) { return count > 0 ? sum / static_cast<double>(count) : 0.0; };
  PairMisfit p;
  p.gyros_accelerometers = per(gravity_by_gyros_misfit(w, C_ib, Matrix3::Identity()), w.rests.size() - 1);
  if (w.gimbal) {
    p.gyros_read_out = per(turns_misfit(w, right, {}), w.turns.size());
    p.accelerometers_read_out = per(gravity_by_read_out(w, Matrix3::Identity(), {}).misfit, w.rests.size());
  }
  return p;
}

}  // namespace selfcal::diagnosis
