#include "estimator/diagnosis/poses/rest_equations.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

class Equations {
 public:
  Equations(const RestBlocks& blocks, bool gyro) : blocks_(blocks), gyro_(gyro) {
    for (const Effect& effect : catalogue()) {
      add(effect);
    }
    add_of_temperature();
    add_jump();
  }
  std::vector<RestCandidate> all;

 private:
  void add(const Effect& effect);
  void add_of_temperature();
  void add_jump();
  // One column, unscaled; empty: none, or several unknowns.
  Eigen::VectorXd column(const Effect& effect, double constant, const Vector3& u) const;
  // Less the means of the poses: of the unit length that `length` says, 0 where nothing changes.
  Eigen::VectorXd centred(Eigen::VectorXd column, double& length) const;

  const RestBlocks& blocks_;
  bool gyro_;
};

Eigen::VectorXd Equations::centred(Eigen::VectorXd column, double& length) const {
  const double size = column.norm();
  for (std::size_t pose = 0; pose <= blocks_.pose.back(); ++pose) {
    double sum = 0.0, count = 0.0;
    for (Eigen::Index i = 0; i < column.size(); ++i) {
      const bool own = blocks_.pose[static_cast<std::size_t>(i)] == pose;
      sum += own ? column(i) : 0.0;
      count += own ? 1.0 : 0.0;
    }
    for (Eigen::Index i = 0; i < column.size(); ++i) {
      column(i) -= blocks_.pose[static_cast<std::size_t>(i)] == pose ? sum / count : 0.0;
    }
  }
  constexpr double changes = 1e-9;
  length = column.norm() > changes * size ? column.norm() : 0.0;
  return length > 0.0 ? Eigen::VectorXd(column / length) : Eigen::VectorXd(column);
}

Eigen::VectorXd Equations::column(const Effect& effect, double constant, const Vector3& u) const {
  const auto count = static_cast<Eigen::Index>(effect.parameters.size());
  Eigen::VectorXd values(blocks_.rows());
  for (Eigen::Index i = 0; i < blocks_.rows(); ++i) {
    EffectContext c;
    c.dt = blocks_.times.block_s;
    c.start_s = blocks_.times.middle_s(i) - 0.5 * c.dt;
    c.end_s = c.start_s + c.dt;
    c.angle = c.rate = c.rate_change = c.field_b = Vector3::Zero();
    c.u = u;
    c.force = units::standard_gravity * u;
    c.velocity = c.force * c.dt;
    c.C_nb = Matrix3::Identity();
    c.duration_s = blocks_.duration_s;
    c.temperature = blocks_.temperature.size() > 0 ? blocks_.temperature(i) - blocks_.temperature.mean() : 0.0;
    Eigen::Matrix3Xd velocity = Eigen::Matrix3Xd::Zero(3, count), angle = velocity;
    effect.sensor(c, constant, velocity, angle);
    const Eigen::RowVectorXd row = (gyro_ ? angle : velocity).row(0) / c.dt;
    values(i) = row(0);
    if (count != 3 || row.tail(2).cwiseAbs().maxCoeff() > 0.0) {
      return {};
    }
  }
  return values;
}

// How many tests columns that resemble each other are worth: (sum sqrt(l))^2 / sum l of their correlation (Galwey 2009).
double worth(const Eigen::MatrixXd& columns) {
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(columns.transpose() * columns).eigenvalues().cwiseMax(0.0);
  const double roots = values.cwiseSqrt().sum();
  return std::max(1.0, roots * roots / values.sum());
}

// From a fiftieth of the log to three quarters of it: shorter ones leave few blocks, longer ones are ramps.
std::vector<double> time_constants(double duration_s) {
  constexpr double from = 0.02, step = 1.26;
  constexpr std::size_t steps = 16;
  std::vector<double> all = {from * duration_s};
  while (all.size() < steps) {
    all.push_back(step * all.back());
  }
  return all;
}

void Equations::add(const Effect& effect) {
  const bool measured = effect.temperature == TemperatureUse::measured;
  if (effect.sensor == nullptr || effect.needs_heading || effect.needs_gimbal || effect.since_turns ||
      effect.constant.kind == EffectConstant::Kind::spectrum ||
      effect.triad != (gyro_ ? Triad::gyro : Triad::accelerometer) || (measured && blocks_.temperature.size() == 0)) {
    return;
  }
  const bool family = effect.constant.kind == EffectConstant::Kind::grid;
  const std::vector<double> constants = family ? time_constants(blocks_.duration_s) : std::vector<double>{NAN};
  RestCandidate c;
  double middle = 0.0;
  const Eigen::VectorXd typical = column(effect, constants[constants.size() / 2], Vector3::Ones());
  if (typical.size() == 0 || centred(typical, middle).norm() < 0.5) {
    return;
  }
  for (RestCandidate& known : all) {
    constexpr double same = 1.0 - 1e-9;
    if (known.columns.cols() == static_cast<Eigen::Index>(constants.size()) &&
        std::abs(known.columns.col(static_cast<Eigen::Index>(constants.size() / 2)).dot(centred(typical, middle))) >
            same) {
      known.twins.push_back(effect.id);
      return;
    }
  }
  c.columns.resize(blocks_.rows(), static_cast<Eigen::Index>(constants.size()));
  for (std::size_t k = 0; k < constants.size(); ++k) {
    double length = 0.0;
    c.columns.col(static_cast<Eigen::Index>(k)) = centred(column(effect, constants[k], Vector3::Ones()), length);
    c.length.push_back(length);
  }
  c.constant = constants;
  c.is_linear = measured;
  const EffectParameter& p = effect.parameters.front();
  c.equation = {&effect, effect.id, p.unit, p.si_per_unit, "", 1.0, measured};
  if (measured) {
    c.equation.raw_per = "/degC";
  } else if (!family) {
    c.equation.raw_per = "/h";
    c.equation.raw_per_factor = 1.0 / units::hour;
  }
  c.tests = worth(c.columns);
  all.push_back(std::move(c));
}

void Equations::add_of_temperature() {
  const auto linear = std::find_if(all.begin(), all.end(), [](const RestCandidate& c) { return c.is_linear; });
  if (linear == all.end()) {
    return;
  }
  const std::string id = linear->equation.id;
  const double unit = gyro_ ? units::degree_per_hour : units::micro_g;
  const std::string name = gyro_ ? "deg/h" : "ug";
  const Eigen::VectorXd& T = blocks_.temperature;
  const Eigen::VectorXd& t = blocks_.times.middle_s;
  const Eigen::Index n = T.size();
  Eigen::VectorXd rate(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index a = std::max<Eigen::Index>(0, i - 1), b = std::min(n - 1, i + 1);
    rate(i) = (T(b) - T(a)) / (t(b) - t(a));
  }
  const auto push = [&](const Eigen::VectorXd& column, RestEquation equation, bool after) {
    RestCandidate c;
    double length = 0.0;
    c.columns = centred(column, length);
    if (length > 0.0) {
      c.length = {length};
      c.constant = {NAN};
      c.equation = std::move(equation);
      c.after_linear = after;
      all.push_back(std::move(c));
    }
  };
  push((T.array() - T.mean()).square(), {nullptr, id + "_squared", name + "/degC^2", unit, "/degC^2", 1.0, true}, true);
  // A rate that is the channel's noise is none.
  const Eigen::VectorXd bends = T.head(n - 2) - 2.0 * T.segment(1, n - 2) + T.tail(n - 2);
  const double noise = bends.norm() / std::sqrt(6.0 * static_cast<double>(n - 2)) / (M_SQRT2 * blocks_.times.block_s);
  constexpr double times = 5.0;
  if (std::sqrt((rate.array() - rate.mean()).square().mean()) > times * noise) {
    push(rate, {nullptr, id + "_rate", name + "/(degC/h)", unit * units::hour, "/(degC/h)", units::hour, true}, false);
  }
}

// By which an axis counts: the square of its neighbours' usual difference, inverted; 0 where nothing changes.
Eigen::VectorXd weights_of_axes(const Eigen::MatrixXd& readings) {
  const Eigen::Index n = readings.rows();
  const Eigen::MatrixXd steps = (readings.bottomRows(n - 1) - readings.topRows(n - 1)).cwiseAbs();
  Eigen::VectorXd weights(readings.cols());
  for (Eigen::Index axis = 0; axis < readings.cols(); ++axis) {
    const double noise = median({steps.col(axis).begin(), steps.col(axis).end()});
    weights(axis) = noise > 0.0 ? 1.0 / (noise * noise) : 0.0;
  }
  return weights;
}

// Of a block the part that is before a jump within it, by its mean between those of `side` blocks on either side: 0 to 1.
double before_jump(const Eigen::MatrixXd& readings, const Eigen::VectorXd& weights, Eigen::Index block,
                   Eigen::Index side) {
  const Eigen::RowVectorXd early = readings.middleRows(block - side, side).colwise().mean(),
                           late = readings.middleRows(block + 1, side).colwise().mean();
  const Eigen::VectorXd weighted = (late - early).transpose().cwiseProduct(weights);
  const double square = (late - early).dot(weighted);
  return square > 0.0 ? std::clamp((late - readings.row(block)).dot(weighted) / square, 0.0, 1.0) : 0.0;
}

// Within or at the ends of a block that has three beside it on either side in one stand: a block alone is no jump. Where in the block follows
// from its mean.
void Equations::add_jump() {
  constexpr Eigen::Index least = 3;
  const auto pose = [&](Eigen::Index i) { return blocks_.pose[static_cast<std::size_t>(i)]; };
  const Eigen::MatrixXd& readings = gyro_ ? blocks_.gyro : blocks_.accel;
  const Eigen::VectorXd weights = weights_of_axes(readings);
  RestCandidate c;
  std::vector<Eigen::VectorXd> columns;
  for (Eigen::Index i = least; i + least < blocks_.rows(); ++i) {
    if (pose(i - least) == pose(i + least)) {
      const double before = before_jump(readings, weights, i, least);
      Eigen::VectorXd step = Eigen::VectorXd::Zero(blocks_.rows());
      step(i) = 1.0 - before;
      for (Eigen::Index k = i + 1; k < blocks_.rows(); ++k) {
        step(k) = pose(k) == pose(i) ? 1.0 : 0.0;
      }
      double length = 0.0;
      columns.push_back(centred(step, length));
      c.length.push_back(length);
      c.constant.push_back(blocks_.times.middle_s(i) + (before - 0.5) * blocks_.times.block_s);
    }
  }
  if (columns.empty()) {
    return;
  }
  c.columns.resize(blocks_.rows(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    c.columns.col(static_cast<Eigen::Index>(k)) = columns[k];
  }
  c.equation = {nullptr,
                gyro_ ? "gyro_bias_jump" : "accel_bias_jump",
                gyro_ ? "deg/h" : "ug",
                gyro_ ? units::degree_per_hour : units::micro_g,
                "",
                1.0,
                false,
                true};
  c.apart_s = blocks_.times.block_s;
  constexpr double where = 2.0;  // in its block: half a degree of freedom and more
  c.tests = where * worth(c.columns);
  all.push_back(std::move(c));
}

}  // namespace

std::vector<RestCandidate> equations_at_rest(const RestBlocks& blocks, bool gyro) {
  return Equations(blocks, gyro).all;
}

}  // namespace selfcal::diagnosis
