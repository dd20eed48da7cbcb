#include "protocol/import/motion.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimator/geometry/angles.hpp"
#include "protocol/import/median.hpp"

namespace selfcal::import {
namespace {

double quantile(std::vector<double>& values, double part) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

Vector3 median_rate(const std::vector<Block>& blocks, double samples, bool quiet_only) {
  Vector3 all = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (const Block& block : blocks) {
      if (!quiet_only || block.quiet) {
        values.push_back(block.gyro[k] / samples);
      }
    }
    all[k] = values.empty() ? 0.0 : median(std::move(values));
  }
  return all;
}

// Blocks in which the gyros do not turn. Rest and turning differ by orders of magnitude; the border is their geometric mean.
bool mark_quiet(Motion& motion) {
  constexpr double least_contrast = 30.0;
  const auto samples = static_cast<double>(motion.samples);
  const Vector3 centre = median_rate(motion.blocks, samples, false);
  std::vector<double> activity;
  for (const Block& block : motion.blocks) {
    activity.push_back((block.gyro / samples - centre).norm());
  }
  std::vector<double> sorted = activity;
  const double calm = std::max(quantile(sorted, 0.2), 1e-300);
  const double moving = quantile(sorted, 0.995);
  const bool turns = moving > least_contrast * calm;
  const double border = turns ? std::sqrt(calm * moving) : std::numeric_limits<double>::infinity();
  double still = 0.0;
  std::array<double, 2> range{};
  for (std::size_t axis = 0; motion.has_gimbal && axis < 2; ++axis) {
    const auto [least, most] =
        std::minmax_element(motion.blocks.begin(), motion.blocks.end(),
                            [axis](const Block& a, const Block& b) { return a.to[axis] < b.to[axis]; });
    range[axis] = most->to[axis] - least->to[axis];
  }
  constexpr double still_part = 2e-3;  // of a gimbal's range, within a block
  still = still_part * std::max(range[0], range[1]);
  for (std::size_t k = 0; k < motion.blocks.size(); ++k) {
    Block& block = motion.blocks[k];
    const double moved = std::max(std::abs(block.to[0] - block.from[0]), std::abs(block.to[1] - block.from[1]));
    block.quiet = activity[k] < border && (!motion.has_gimbal || moved <= still);
  }
  return turns;
}

}  // namespace

Motion find_motion(const TriadColumns& gyro, const TriadColumns& accel,
                   const std::optional<std::array<std::vector<double>, 2>>& gimbal, std::size_t samples) {
  Motion motion;
  motion.samples = samples;
  motion.has_gimbal = gimbal.has_value();
  std::array<std::vector<double>, 2> angle;
  for (std::size_t axis = 0; gimbal && axis < 2; ++axis) {
    angle[axis] = unwrapped((*gimbal)[axis]);
  }
  const std::size_t rows = gyro.column[0]->size();
  for (std::size_t first = 0; first + samples <= rows; first += samples) {
    Block block;
    block.row = first;
    for (std::size_t row = first; row < first + samples; ++row) {
      block.gyro += gyro.at(row);
      block.accel += accel.at(row) / static_cast<double>(samples);
    }
    for (std::size_t axis = 0; gimbal && axis < 2; ++axis) {
      block.from[axis] = angle[axis][first == 0 ? 0 : first - 1];
      block.to[axis] = angle[axis][first + samples - 1];
    }
    // A spoilt sample spoils its block only.
    if (block.gyro.allFinite() && block.accel.allFinite()) {
      motion.blocks.push_back(block);
    }
  }
  if (!motion.blocks.empty()) {
    motion.turns = mark_quiet(motion);
    motion.bias = median_rate(motion.blocks, static_cast<double>(samples), true);
  }
  return motion;
}

std::vector<Rest> rests_of(const Motion& motion) {
  constexpr std::size_t fewest = 4;  // blocks: the first and the last may still move
  std::vector<Rest> rests;
  const std::vector<Block>& blocks = motion.blocks;
  for (std::size_t first = 0; first < blocks.size();) {
    std::size_t last = first;
    while (last < blocks.size() && blocks[last].quiet) {
      ++last;
    }
    if (last - first >= fewest) {
      Rest rest;
      rest.first = first;
      rest.last = last;
      const auto count = static_cast<double>(last - first - 2);
      for (std::size_t k = first + 1; k + 1 < last; ++k) {
        rest.accel += blocks[k].accel / count;
        rest.gyro += blocks[k].gyro / (count * static_cast<double>(motion.samples));
        for (std::size_t axis = 0; axis < 2; ++axis) {
          rest.gimbal[axis] += blocks[k].to[axis] / count;
        }
      }
      rests.push_back(rest);
    }
    first = last + 1;
  }
  return rests;
}

std::optional<Vector3> centre_of_gravity_sphere(const TriadColumns& gyro, const TriadColumns& accel) {
  constexpr std::size_t samples = 25;
  const std::vector<Rest> rests = rests_of(find_motion(gyro, accel, std::nullopt, samples));
  constexpr Eigen::Index fewest = 6;
  const auto rows = static_cast<Eigen::Index>(rests.size());
  if (rows < fewest) {
    return std::nullopt;
  }
  // Of one size already: no zero to look for.
  double least_size = std::numeric_limits<double>::infinity();
  double most_size = 0.0;
  for (const Rest& rest : rests) {
    least_size = std::min(least_size, rest.accel.norm());
    most_size = std::max(most_size, rest.accel.norm());
  }
  constexpr double alike = 1.1;
  if (most_size < alike * least_size) {
    return std::nullopt;
  }
  // |a|^2 = 2 c . a + (r^2 - |c|^2), linear in the centre c.
  Eigen::MatrixXd A(rows, 4);
  Eigen::VectorXd y(rows);
  double size = 0.0;
  Vector3 mean = Vector3::Zero();
  for (const Rest& rest : rests) {
    mean += rest.accel / static_cast<double>(rests.size());
  }
  for (const Rest& rest : rests) {
    size = std::max(size, (rest.accel - mean).norm());
  }
  for (Eigen::Index k = 0; k < rows; ++k) {
    const Vector3 a = (rests[static_cast<std::size_t>(k)].accel - mean) / size;
    A.row(k) << 2.0 * a.transpose(), 1.0;
    y(k) = a.squaredNorm();
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A);
  qr.setThreshold(0.02);  // directions that span no space fix no centre
  if (qr.rank() < 4) {
    return std::nullopt;
  }
  const Eigen::VectorXd x = qr.solve(y);
  const Vector3 centre = mean + size * x.head<3>();
  const double radius = size * std::sqrt(std::max(0.0, x(3) + x.head<3>().squaredNorm()));
  constexpr double least = 0.2;
  return centre.norm() > least * radius && radius > 0.0 ? std::optional<Vector3>(centre) : std::nullopt;
}

std::vector<Turn> turns_of(const Motion& motion, const std::vector<Rest>& rests) {
  std::vector<Turn> turns;
  for (std::size_t k = 1; k < rests.size(); ++k) {
    Turn turn;
    // From the middle of one rest to the middle of the next: what lags is in it too.
    const Vector3 bias = 0.5 * (rests[k - 1].gyro + rests[k].gyro);
    constexpr std::size_t most = 40;  // blocks of a rest
    const std::size_t first = rests[k - 1].last - std::min(most, (rests[k - 1].last - rests[k - 1].first) / 2);
    const std::size_t last = rests[k].first + std::min(most, (rests[k].last - rests[k].first) / 2);
    for (std::size_t b = first; b < last; ++b) {
      turn.gyro += motion.blocks[b].gyro - static_cast<double>(motion.samples) * bias;
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      turn.from[axis] = rests[k - 1].gimbal[axis];
      turn.by[axis] = rests[k].gimbal[axis] - rests[k - 1].gimbal[axis];
    }
    turns.push_back(turn);
  }
  return turns;
}

double least_contrast(const Motion& motion) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    std::vector<double> off;
    for (const Block& block : motion.blocks) {
      off.push_back(std::abs(block.gyro[k] / static_cast<double>(motion.samples) - motion.bias[k]));
    }
    std::sort(off.begin(), off.end());
    least = std::min(least, off.back() / std::max(off[off.size() / 4], 1e-300));
  }
  return least;
}

double usual_force(const TriadColumns& accel) {
  const Motion motion =
      find_motion(accel, accel, std::nullopt, std::clamp<std::size_t>(accel.column[0]->size() / 2000, 2, 25));
  std::vector<double> size;
  for (const Block& block : motion.blocks) {
    size.push_back(block.accel.norm());
  }
  if (size.empty()) {
    return 0.0;
  }
  const auto middle = size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2);
  std::nth_element(size.begin(), middle, size.end());
  return *middle;
}

}  // namespace selfcal::import
