#include "estimator/diagnosis/data/axes.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "estimator/diagnosis/data/attribution.hpp"
#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/rotation.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

std::string number(const char* format, double a, double b = 0.0, double c = 0.0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

// ---- in words

std::string read_out_names(const ReadOutOrder& order) {
  const bool outer = order.outer_sign < 0 || order.outer_degrees, inner = order.inner_sign < 0 || order.inner_degrees;
  return order.swapped || outer == inner ? "read-outs gimbal_outer_rad and gimbal_inner_rad"
         : outer                         ? "read-out gimbal_outer_rad"
                                         : "read-out gimbal_inner_rad";
}

std::string read_out_words(const ReadOutOrder& order) {
  const bool both =
      order.swapped || (order.outer_sign < 0 || order.outer_degrees) == (order.inner_sign < 0 || order.inner_degrees);
  std::string what, mend;
  const auto add = [&](const std::string& fault, const std::string& cure) {
    what += (what.empty() ? "" : " and ") + fault;
    mend += (mend.empty() ? "" : ", then ") + cure;
  };
  const auto which = [&](bool outer, bool inner) -> std::string {
    const std::string of_the = order.swapped ? "new " : "";
    return outer && inner ? (both ? "both" : "it") : !both ? "it" : of_the + (outer ? "outer" : "inner") + " one";
  };
  if (order.swapped) {
    add("swapped", "exchange them");
  }
  if (order.outer_sign < 0 || order.inner_sign < 0) {
    add("reversed", std::string("negate ").append(which(order.outer_sign < 0, order.inner_sign < 0)));
  }
  if (order.outer_degrees || order.inner_degrees) {
    add("in degrees",
        std::string("multiply ").append(which(order.outer_degrees, order.inner_degrees)).append(" by pi/180"));
  }
  std::string text("the ");
  text.append(read_out_names(order)).append(both ? " are " : " is ").append(what);
  return text.append(": gyros and accelerometers agree with each other; ").append(mend);
}

std::string triad_words(const std::string& triad, const AxisOrder& order) {
  const std::string name = order.name();
  return triad + ": " + order.words() + (name.empty() ? "" : " (" + name + ")");
}

// What is wrong and its mend; `gimbal`: there are read-outs to agree with.
std::string words_of(const Explanation& e, bool gimbal) {
  switch (e.odd()) {
    case Witness::read_out: return read_out_words(e.read_out);
    case Witness::imu:
      return std::string("the IMU's axes: ")
          .append(triad_words("gyros and accelerometers", e.gyros))
          .append(": they agree with each other and not with the gimbal; ")
          .append(e.gyros.mend())
          .append(" in both");
    case Witness::gyros:
      return triad_words("gyros", e.gyros) +
             (gimbal ? ": accelerometers and gimbal agree with each other; "
                     : ", by where gravity points after turns; ") +
             e.gyros.mend();
    case Witness::accelerometers:
      return triad_words("accelerometers", e.accelerometers) +
             (gimbal ? ": gyros and gimbal agree with each other; " : ", by where gravity points after turns; ") +
             e.accelerometers.mend();
    default: break;
  }
  std::string text = "more than one is wrong:";
  if (!e.gyros.right() && e.gyros == e.accelerometers) {
    text += triad_words(" gyros and accelerometers", e.gyros) + " (" + e.gyros.mend() + " in both);";
  } else {
    text += e.gyros.right() ? "" : triad_words(" gyros", e.gyros) + " (" + e.gyros.mend() + ");";
    text += e.accelerometers.right()
                ? ""
                : triad_words(" accelerometers", e.accelerometers) + " (" + e.accelerometers.mend() + ");";
  }
  text += e.read_out.right() ? "" : std::string(" ").append(read_out_words(e.read_out));
  return text;
}

// What is wrong, without reason and mend.
std::string brief_words(const Explanation& e) {
  std::string text;
  const auto add = [&text](const std::string& one) { text.append(text.empty() ? "" : ", ").append(one); };
  if (e.gyros == e.accelerometers && !e.gyros.right()) {
    add(std::string("IMU ").append(e.gyros.words()).append(" in both triads"));
  } else {
    if (!e.gyros.right()) {
      add(std::string("gyros ").append(e.gyros.words()));
    }
    if (!e.accelerometers.right()) {
      add(std::string("accelerometers ").append(e.accelerometers.words()));
    }
  }
  if (!e.read_out.right()) {
    const std::string words = read_out_words(e.read_out);
    add(words.substr(0, words.find(':')));
  }
  return text;
}

DataFault fault_of(const std::vector<Explanation>& all, bool gimbal, std::size_t samples) {
  const Explanation& best = all.front();
  const ReadOutOrder& r = best.read_out;
  const bool axes = !best.gyros.ordered() || !best.accelerometers.ordered() || r.swapped;
  const bool signs = !best.gyros.right() || !best.accelerometers.right() || r.outer_sign < 0 || r.inner_sign < 0;
  DataFault fault{axes ? "wrong_axes" : signs ? "wrong_sign" : "wrong_scale", words_of(best, gimbal), 0, samples};
  const std::vector<Explanation> rivals = rivals_of_best(all);
  if (!rivals.empty()) {
    fault.words.append(" (these turns do not tell it from: ").append(brief_words(rivals.front()));
    if (rivals.size() > 1) {
      fault.words.append(", and ").append(std::to_string(rivals.size() - 1)).append(" more");
    }
    fault.words += ")";
  }
  return fault;
}

// ---- do the witnesses agree

struct TurnFit {
  Matrix3 measured;  // M: measured turn = M * the gimbal's, along b
  Matrix3 seen;      // projection on the directions about which it turned
};

std::optional<TurnFit> fit_turns(const Witnesses& w) {
  Matrix3 cross = Matrix3::Zero(), normal = Matrix3::Zero();
  for (const SensedTurn& t : w.turns) {
    cross += t.by_gyros * t.by_gimbal.transpose();
    normal += t.by_gimbal * t.by_gimbal.transpose();
  }
  const Eigen::JacobiSVD<Matrix3> svd(normal, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.singularValues()(0) == 0.0) {
    return std::nullopt;
  }
  Vector3 inverse = Vector3::Zero();
  Matrix3 seen = Matrix3::Zero();
  for (int k = 0; k < 3; ++k) {
    if (svd.singularValues()(k) > 0.05 * svd.singularValues()(0)) {
      inverse(k) = 1.0 / svd.singularValues()(k);
      seen += svd.matrixV().col(k) * svd.matrixV().col(k).transpose();
    }
  }
  return TurnFit{cross * svd.matrixV() * inverse.asDiagonal() * svd.matrixU().transpose(), seen};
}

constexpr double plausible_turn = 0.05;  // gimbal good to 1 deg in 90, sensors to 1 deg
constexpr double least_turn = 0.3;       // rad: less is no turn of a gimbal

// A read-out that stands still while the gyros turn has no turns to fit.
bool turns_agree(const Witnesses& w) {
  const std::optional<TurnFit> fit = fit_turns(w);
  if (fit && (fit->measured - fit->seen).cwiseAbs().maxCoeff() > plausible_turn) {
    return false;
  }
  return std::none_of(w.turns.begin(), w.turns.end(), [&](const SensedTurn& t) {
    return t.by_gyros.norm() > least_turn && t.by_gimbal.norm() < 0.1 * t.by_gyros.norm();
  });
}

// rms over g of how gravity, turned back by the gyros, differs from one dwell to the next.
double gravity_scatter(const std::vector<SensedRest>& dwells) {
  double differences = 0.0, square = 0.0;
  for (std::size_t k = 1; k < dwells.size(); ++k) {
    const Vector3 before = dwells[k - 1].C_ib * dwells[k - 1].force;
    differences += 0.5 * (dwells[k].C_ib * dwells[k].force - before).squaredNorm();
    square += dwells[k].force.squaredNorm();
  }
  return std::sqrt(differences / square);
}

// Gravity, turned back by the gyros, must point the same way in one dwell and the next, but for the 15 deg/h of the Earth.
bool gravity_agrees(const std::vector<SensedRest>& dwells) {
  constexpr double inconsistent = 0.15;  // half an hour on the Earth, a gimbal off by degrees
  constexpr double longest_s = 1200.0;
  return dwells.size() < 2 ||
         (dwells.back().middle_s - dwells.front().middle_s) / static_cast<double>(dwells.size() - 1) > longest_s ||
         gravity_scatter(dwells) <= inconsistent;
}

// By the gimbal. Vehicles stand on their wheels.
bool upside_down(const Witnesses& w) {
  double up = 0.0;
  for (const SensedRest& r : w.rests) {
    up += (gimbal_matrix(r.angles.outer, r.angles.inner) * r.force.normalized()).y();
  }
  return w.gimbal && !w.rests.empty() && up < -0.5 * static_cast<double>(w.rests.size());
}

// ---- what no signed permutation explains

std::string span_words(const Witnesses& w) {
  double outer = 0.0, inner = 0.0;
  for (const SensedTurn& t : w.turns) {
    outer = std::max(outer, std::abs(t.to.outer - t.from.outer));
    inner = std::max(inner, std::abs(t.to.inner - t.from.inner));
  }
  constexpr double still = 0.05;
  if (outer < still && inner < still) {
    return "the read-outs gimbal_outer_rad and gimbal_inner_rad stand still while gyros and accelerometers turn";
  }
  if (outer < still || inner < still) {
    return std::string("the read-out ") + (outer < still ? "gimbal_outer_rad" : "gimbal_inner_rad") +
           " stands still while gyros and accelerometers, which agree with each other, turn about its axis";
  }
  return "the read-outs gimbal_outer_rad and gimbal_inner_rad contradict gyros and accelerometers, which agree with "
         "each other";
}

DataFault gyro_scale(const Matrix3& M, std::size_t samples, const std::string& whose) {
  const Vector3 of = M.diagonal();
  const double all = of.mean();
  std::string words = number("gyros x, y, z make %.3f, %.3f, %.3f of the turns of the gimbal", of(0), of(1), of(2));
  constexpr double same = 0.03;
  for (const auto& [factor, unit] :
       {std::pair(180.0 / std::numbers::pi, "they are in degrees: multiply by pi/180"),
        std::pair(std::numbers::pi / 180.0, "they were divided by 180/pi: multiply by it")}) {
    if (std::abs(all / factor - 1.0) < same && (of.array() / all - 1.0).abs().maxCoeff() < same) {
      words += std::string("; ") + unit;
    }
  }
  return {"wrong_scale", words + whose, 0, samples};
}

DataFault unexplained(const Witnesses& w, std::size_t samples) {
  const Witness odd = w.gimbal ? pair_misfit(w).odd() : Witness::several;
  if (odd == Witness::read_out) {
    return {"wrong_read_out", span_words(w), 0, samples};
  }
  const std::optional<TurnFit> fit = w.gimbal ? fit_turns(w) : std::nullopt;
  if (fit && (fit->measured - fit->seen).cwiseAbs().maxCoeff() > plausible_turn && odd != Witness::accelerometers) {
    const Matrix3& M = fit->measured;
    Matrix3 beside = M;
    beside.diagonal().setZero();
    const std::string whose = odd == Witness::gyros ? "; accelerometers and gimbal agree with each other"
                                                    : "; gyros or read-outs, these turns do not tell which";
    if (beside.cwiseAbs().maxCoeff() <= plausible_turn * M.diagonal().cwiseAbs().maxCoeff() &&
        M.diagonal().minCoeff() > 0.0) {
      return gyro_scale(M, samples, whose);
    }
    char text[200];
    std::snprintf(text, sizeof text,
                  "gyros against gimbal: turns along b come out as [%.3f %.3f %.3f; %.3f %.3f %.3f; %.3f %.3f %.3f]",
                  M(0, 0), M(0, 1), M(0, 2), M(1, 0), M(1, 1), M(1, 2), M(2, 0), M(2, 1), M(2, 2));
    return {"wrong_axes", text + whose, 0, samples};
  }
  return {"wrong_axes",
          number("accelerometers against gyros: gravity wanders by %.0f deg from dwell to dwell",
                 std::asin(std::min(1.0, gravity_scatter(w.rests))) / units::degree),
          0, samples};
}

bool witnesses_agree(const Witnesses& w, std::size_t samples, const earth::Position& site,
                     std::vector<DataFault>& faults) {
  const bool turns = !w.gimbal || turns_agree(w);
  const bool upside = turns && upside_down(w);
  if (turns && gravity_agrees(w.rests) && !upside) {
    return true;
  }
  const std::vector<Explanation> all = explain(w, site);
  constexpr double explained = 9.0;  // mean square of what is left: 6 deg
  if (all.empty() || all.front().odd() == Witness::none || all.front().squared > explained) {
    faults.push_back(unexplained(w, samples));
  } else {
    faults.push_back(fault_of(all, w.gimbal, samples));
    if (upside && all.front().odd() == Witness::accelerometers) {
      faults.back().words += " (the base would be upside down)";
    }
  }
  return false;
}

// ---- site

struct SensedEarth {
  Vector3 drift;
  double latitude = 0.0, sigma = 0.0;  // rad; of the scatter from dwell to dwell
};

// Mean rates of dwells are w_k = C_k' w + drift, w the Earth's in space; with gravity's direction in the same dwell the
// latitude is the arc sine of their product. None where dwells are few or alike, or the base sways.
std::optional<SensedEarth> sense_earth(const std::vector<SensedRest>& dwells) {
  constexpr std::size_t enough = 6;
  constexpr double told_apart = 0.1;  // of the information that dwells all about have
  constexpr double steady = 0.05 * earth::rotation_rate;
  Matrix6 normal = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  for (const SensedRest& r : dwells) {
    Eigen::Matrix<double, 3, 6> row;
    row << r.C_ib.transpose(), Matrix3::Identity();
    normal += row.transpose() * row;
    right += row.transpose() * r.rate;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(normal);
  const auto n = static_cast<double>(dwells.size());
  if (dwells.size() < enough || solver.eigenvalues()(0) < told_apart * n) {
    return std::nullopt;
  }
  const Vector6 fit = solver.eigenvectors() * solver.eigenvalues().cwiseInverse().asDiagonal() *
                      (solver.eigenvectors().transpose() * right);
  const Vector3 rate = fit.head<3>();
  SensedEarth sensed{fit.tail<3>()};
  double misfit = 0.0, square = 0.0;
  for (const SensedRest& r : dwells) {
    const Vector3 own = r.C_ib.transpose() * rate;
    misfit += (r.rate - own - sensed.drift).squaredNorm() / n;
    const double angle = std::asin(std::clamp(own.normalized().dot(r.force.normalized()), -1.0, 1.0));
    sensed.latitude += angle / n;
    square += angle * angle / n;
  }
  if (misfit > steady * steady || std::abs(rate.norm() - earth::rotation_rate) > steady) {
    return std::nullopt;
  }
  const double scatter = std::max(0.0, square - sensed.latitude * sensed.latitude);
  sensed.sigma = std::sqrt((scatter + misfit / (earth::rotation_rate * earth::rotation_rate)) / n);
  return sensed;
}

void latitude_by_gyros(const ImuData& data, const std::vector<Segment>& segments, bool upright,
                       std::vector<DataFault>& faults) {
  constexpr double plausible = 0.5 * units::degree, sigmas = 6.0;
  constexpr int rounds = 3;  // a drift of 1 deg/h turns the attitude by as much
  std::optional<SensedEarth> sensed = SensedEarth{Vector3::Zero()};
  for (int round = 0; round < rounds && sensed; ++round) {
    sensed = sense_earth(gather_witnesses(data, segments, sensed->drift).rests);
  }
  if (sensed && std::abs(sensed->latitude - data.site.latitude) > std::max(plausible, sigmas * sensed->sigma)) {
    // Accelerometers that are all reversed take up for down: only a base that stands on its wheels tells them from a
    // site beyond the equator.
    const bool beyond_equator =
        std::abs(sensed->latitude + data.site.latitude) < std::max(plausible, sigmas * sensed->sigma);
    faults.push_back(
        {"wrong_site",
         number("gravity and the Earth's rate as sensed stand as at latitude %.2f deg (+- %.2f), the "
                "site's is %.2f deg",
                sensed->latitude / units::degree, sensed->sigma / units::degree, data.site.latitude / units::degree) +
             (beyond_equator && !upright ? "; or as likely: all accelerometers are reversed; negate x, y, z" : ""),
         0, data.size()});
  }
}

// ---- scale

// What each accelerometer makes of gravity, by the dwells: sum of a_i f_i^2 = g^2, shares 1 / sqrt(a_i). None where they are few or
// alike, or where no three factors make it.
std::optional<Vector3> share_of_gravity(const std::vector<Vector3>& forces, double gravity) {
  constexpr std::size_t enough = 6;
  constexpr double told_apart = 0.05, made = 0.02;
  Matrix3 normal = Matrix3::Zero();
  Vector3 right = Vector3::Zero();
  for (const Vector3& f : forces) {
    const Vector3 squares = f.cwiseAbs2() / (gravity * gravity);
    normal += squares * squares.transpose();
    right += squares;
  }
  const Vector3 scale = normal.diagonal().cwiseSqrt();
  if (forces.size() < enough || scale.minCoeff() <= 0.0) {
    return std::nullopt;
  }
  const Matrix3 alike = scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal();
  const Vector3 a = normal.ldlt().solve(right);
  if (Eigen::SelfAdjointEigenSolver<Matrix3>(alike).eigenvalues()(0) < told_apart || a.minCoeff() <= 0.0) {
    return std::nullopt;
  }
  for (const Vector3& f : forces) {
    if (std::abs(std::sqrt(a.dot(f.cwiseAbs2())) / gravity - 1.0) > made) {
      return std::nullopt;
    }
  }
  return Vector3(a.cwiseSqrt().cwiseInverse());
}

// Mean size of the specific force in dwells against normal gravity; sensors are within 5000 ppm.
void gravity_size(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  const double expected = earth::normal_gravity(data.site.latitude, data.site.height);
  double sum = 0.0;
  std::vector<Vector3> forces;
  for (const Segment& s : segments) {
    if (s.rotation || s.last <= s.first) {
      continue;
    }
    Vector3 velocity = Vector3::Zero();
    for (std::size_t i = s.first; i < s.last; ++i) {
      velocity += Eigen::Map<const Vector3>(data.delta_v[i].data());
    }
    forces.emplace_back(velocity * data.sample_rate_hz / static_cast<double>(s.last - s.first));
    sum += forces.back().norm();
  }
  constexpr double plausible = 0.015;
  const double mean = forces.empty() ? expected : sum / static_cast<double>(forces.size());
  if (std::abs(mean / expected - 1.0) > plausible) {
    std::string words = number("specific force at rest is %.5f m/s^2, gravity there is %.5f m/s^2", mean, expected);
    if (const auto share = share_of_gravity(forces, expected)) {
      words += number("; accelerometers x, y, z make %.3f, %.3f, %.3f of it", (*share)(0), (*share)(1), (*share)(2));
    }
    faults.push_back({"wrong_scale", std::move(words), 0, data.size()});
  }
}

}  // namespace

void find_wrong_axes(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  const Witnesses w = gather_witnesses(data, segments);
  if (!w.rests.empty() && witnesses_agree(w, data.size(), data.site, faults)) {
    double up = 0.0;
    for (const SensedRest& r : w.rests) {
      up += (gimbal_matrix(r.angles.outer, r.angles.inner) * r.force.normalized()).y();
    }
    latitude_by_gyros(data, segments, w.gimbal && up > 0.5 * static_cast<double>(w.rests.size()), faults);
  }
  gravity_size(data, segments, faults);
}

bool read_outs_in_degrees(const ImuData& data) {
  constexpr double two_turns = 4.0 * std::numbers::pi;
  const auto beyond = [](std::span<const double> angles) {
    const auto [low, high] = std::minmax_element(angles.begin(), angles.end());
    return !angles.empty() && *high - *low > two_turns;
  };
  return beyond(data.gimbal_outer) || beyond(data.gimbal_inner);
}

}  // namespace selfcal::diagnosis
