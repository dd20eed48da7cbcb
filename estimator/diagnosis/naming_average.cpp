// What averaging.hpp needs of the recording: columns for the constants of what is chosen.
#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/averaging.hpp"
#include "estimator/diagnosis/naming.hpp"

namespace selfcal::diagnosis {
namespace {

// Constants beside a chosen effect's own: so many sigmas of the logarithm apart, further out by a share of the distance.
constexpr double constants_apart = 0.5, constants_spread = 0.25;
constexpr double furthest_apart = 0.5;  // of the logarithm

// Constants that a chosen effect may have beside its own, in order: close where the likelihood's curvature says, for it may
// be anything but a parabola out to the ends of the catalogue's grid and a factor of 2 beyond. A frequency is sharp: its
// derivative will do.
std::vector<double> constants_about(const Chosen& chosen) {
  const std::span<const double> grid = chosen.candidate.effect->constant.grid;
  if (grid.empty()) {
    return {};
  }
  const auto [smallest, largest] = std::minmax_element(grid.begin(), grid.end());
  const double own = chosen.candidate.constant;
  const double down = std::log(own / (0.5 * *smallest)), up = std::log(2.0 * *largest / own);
  const double apart = chosen.constant_sigma > 0.0 ? constants_apart * chosen.constant_sigma / own : furthest_apart;
  std::vector<double> all = {own};
  for (double offset = 0.0; offset < std::max(down, up);) {
    offset += std::min(std::max(apart, constants_spread * offset), furthest_apart);
    if (offset < down) {
      all.insert(all.begin(), own * std::exp(-offset));
    }
    if (offset < up) {
      all.push_back(own * std::exp(offset));
    }
  }
  return all;
}

}  // namespace

// Further columns for the chosen effects' constants: derivatives by the logarithm, and others in the constant's place.
void Naming::append_constants() {
  struct Appended {
    Chosen* chosen;
    double width;  // of the difference that makes the derivative
    std::vector<double> constants;
  };
  std::vector<Candidate> more;
  std::vector<Appended> all;
  Eigen::Index rows = 0, columns = 0;
  for (Chosen& chosen : chosen_) {
    const Candidate& c = chosen.candidate;
    if (std::isnan(c.constant)) {
      continue;
    }
    // A frequency may shift the phase by an eighth of a radian over the recording.
    const bool frequency = c.effect->constant.kind == EffectConstant::Kind::spectrum;
    const double h = frequency ? 0.02 / (c.constant * model_.rows().time_s.back()) : 0.05;
    more.push_back({c.effect, c.constant * std::exp(h), 0, 0});
    more.push_back({c.effect, c.constant * std::exp(-h), 0, 0});
    all.push_back({&chosen, 2.0 * h, constants_about(chosen)});
    for (const double constant : all.back().constants) {
      more.push_back({c.effect, constant, 0, 0});
    }
    const auto beside = static_cast<Eigen::Index>(all.back().constants.size());
    rows += c.count * (1 + beside);
    columns += c.count * (2 + beside);
  }
  if (all.empty()) {
    return;
  }
  Eigen::MatrixXd combine = Eigen::MatrixXd::Zero(rows, columns);
  const Eigen::Index at = model_.rows().columns.cols();
  Eigen::Index row = 0, column = 0;
  for (const Appended& a : all) {
    const Candidate& c = a.chosen->candidate;
    const Eigen::Index count = c.count, beside = count * std::ssize(a.constants);
    const Eigen::MatrixXd difference = Eigen::MatrixXd::Identity(count, count) / a.width;
    combine.block(row, column, count, count) = difference;
    combine.block(row, column + count, count, count) = -difference;
    combine.block(row + count, column + 2 * count, beside, beside).setIdentity();
    a.chosen->derivative = static_cast<int>(at + row);
    int first = static_cast<int>(at + row + count);
    a.chosen->constants.clear();
    for (const double constant : a.constants) {
      a.chosen->constants.push_back({c.effect, constant, first, c.count});
      first += c.count;
    }
    row += count + beside;
    column += 2 * count + beside;
  }
  model_.append(context_, point_, more, combine);
  size_forms();
}

void Naming::average() {
  append_constants();
  Averages averages = average_explanations(evidence(), model_.rows().shift, chosen_, model_.candidates());
  chosen_ = std::move(averages.chosen);
  averaged_ = averages.shift;
  spread_ = averages.shift_covariance;
}

}  // namespace selfcal::diagnosis
