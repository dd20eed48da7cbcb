#include "tests/discovery/rivals.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimator/discovery/dictionary.hpp"
#include "estimator/discovery/law_motion.hpp"

namespace selfcal::discovery_trial {
namespace {

using namespace discovery;

constexpr int axes = 6;
constexpr int most_functions = 6;

struct Apparent {
  Eigen::VectorXd bias, weight;  // [pieces] in unit_of(axis), and one over its variance
};

Apparent apparent(const PieceSums& sums, int axis) {
  const auto n = sums.piece_dt.size();
  Apparent a{Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
  for (Eigen::Index p = 0; p < n; ++p) {
    const Eigen::Index k = p * axes + axis;
    a.weight(p) = std::max(0.0, sums.sums.information(k, k));
    a.bias(p) = a.weight(p) > 0.0 ? sums.sums.score(k) / a.weight(p) : 0.0;
  }
  return a;
}

struct Fit {
  double square = 0.0;
  Eigen::VectorXd value;
};

Fit weighted(const Eigen::MatrixXd& X, const Apparent& a) {
  const Eigen::VectorXd root = a.weight.cwiseSqrt();
  const Eigen::MatrixXd A = root.asDiagonal() * X;
  const Eigen::VectorXd y = root.cwiseProduct(a.bias);
  Eigen::MatrixXd G = A.transpose() * A;
  G.diagonal() *= 1.0 + 1e-9;
  const Eigen::VectorXd value = G.ldlt().solve(A.transpose() * y);
  return {(y - A * value).squaredNorm(), value};
}

}  // namespace

std::vector<RivalLaw> stepwise(const PieceSums& sums, const laws::VariableSet& available) {
  const Dictionary dictionary = make_dictionary(sums, available);
  const double price = std::log(static_cast<double>(sums.piece_dt.size() * axes));
  std::array<Apparent, axes> all;
  std::array<Eigen::MatrixXd, axes> chosen;  // a constant first: the bias
  std::array<std::vector<int>, axes> taken;
  std::array<Fit, axes> fits;
  for (int axis = 0; axis < axes; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    all[k] = apparent(sums, axis);
    chosen[k] = Eigen::MatrixXd::Ones(sums.piece_dt.size(), 1);
    fits[k] = weighted(chosen[k], all[k]);
  }
  for (int step = 0; step < most_functions; ++step) {
    double best_fall = price;
    int best_axis = -1, best_function = -1;
    for (int axis = 0; axis < axes; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      const Eigen::VectorXd root = all[k].weight.cwiseSqrt();
      const Eigen::MatrixXd A = root.asDiagonal() * chosen[k];
      const Eigen::MatrixXd Q = A.householderQr().householderQ() * Eigen::MatrixXd::Identity(A.rows(), A.cols());
      Eigen::VectorXd r = root.cwiseProduct(all[k].bias);
      r -= Q * (Q.transpose() * r);
      for (std::size_t f = 0; f < dictionary.functions.size(); ++f) {
        Eigen::VectorXd x = root.cwiseProduct(dictionary.means.col(static_cast<Eigen::Index>(f)));
        const double before = x.squaredNorm();
        x -= Q * (Q.transpose() * x);
        const double left = x.squaredNorm();
        const double fall = left > 1e-6 * before ? std::pow(x.dot(r), 2.0) / left : 0.0;
        if (fall > best_fall) {
          best_fall = fall;
          best_axis = axis;
          best_function = static_cast<int>(f);
        }
      }
    }
    if (best_axis < 0) {
      break;
    }
    const auto k = static_cast<std::size_t>(best_axis);
    chosen[k].conservativeResize(Eigen::NoChange, chosen[k].cols() + 1);
    chosen[k].rightCols<1>() = dictionary.means.col(best_function);
    taken[k].push_back(best_function);
    fits[k] = weighted(chosen[k], all[k]);
  }
  std::vector<RivalLaw> laws;
  for (int axis = 0; axis < axes; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    for (std::size_t c = 0; c < taken[k].size(); ++c) {
      const Function& function = dictionary.functions[static_cast<std::size_t>(taken[k][c])];
      const auto expression = laws::Expression::parse(dictionary.pattern(function));
      const std::vector<double> constants(expression->free_constants(), function.constant);
      laws.push_back({axis, expression->text(constants),
                      fits[k].value(static_cast<Eigen::Index>(c) + 1) / dictionary.scale(taken[k][c])});
    }
  }
  return laws;
}

namespace {

struct Feature {
  std::string text;
  double centre = 0.0, scale = 1.0;
  Eigen::VectorXd value;  // [pieces] standardised
};

std::vector<Feature> features(const PieceSums& sums, const laws::VariableSet& available) {
  std::vector<Feature> all;
  for (const char* text :
       {"fx", "fy", "fz", "wx", "wy", "wz", "sin(outer)", "cos(outer)", "sin(inner)", "cos(inner)", "so", "si", "t"}) {
    const auto expression = laws::Expression::parse(text);
    if ((expression->variables() & ~available).any()) {
      continue;
    }
    Feature f{text, 0.0, 1.0, sums.means(expression->evaluate(sums.channels, {}))};
    f.centre = f.value.mean();
    f.scale = std::sqrt((f.value.array() - f.centre).square().mean());
    if (f.scale > 1e-9) {
      f.value = (f.value.array() - f.centre) / f.scale;
      all.push_back(std::move(f));
    }
  }
  return all;
}

double distance_squared(const std::vector<Feature>& features, Eigen::Index a, Eigen::Index b) {
  double sum = 0.0;
  for (const Feature& f : features) {
    sum += std::pow(f.value(a) - f.value(b), 2.0);
  }
  return sum;
}

// Farthest points first.
std::vector<Eigen::Index> inducing(const std::vector<Feature>& features, Eigen::Index pieces, std::size_t count) {
  std::vector<Eigen::Index> points = {0};
  while (points.size() < count) {
    Eigen::Index farthest = 0;
    double most = -1.0;
    for (Eigen::Index p = 0; p < pieces; ++p) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Eigen::Index q : points) {
        nearest = std::min(nearest, distance_squared(features, p, q));
      }
      if (nearest > most) {
        most = nearest;
        farthest = p;
      }
    }
    points.push_back(farthest);
  }
  return points;
}

std::string bell(const std::vector<Feature>& features, Eigen::Index centre, double length) {
  std::string text;
  for (const Feature& f : features) {
    text += fmt::format("{}(({}-({:.5g}))/{:.5g})**2", text.empty() ? "" : "+", f.text,
                        f.centre + f.scale * f.value(centre), f.scale * length * std::sqrt(2.0));
  }
  return "exp(-(" + text + "))";
}

}  // namespace

std::vector<RivalLaw> gaussian_process(const PieceSums& sums, const laws::VariableSet& available) {
  constexpr std::size_t points = 10;
  const std::vector<Feature> all = features(sums, available);
  const Eigen::Index n = sums.piece_dt.size();
  const std::vector<Eigen::Index> centres = inducing(all, n, points);
  const auto m = static_cast<Eigen::Index>(centres.size());
  std::vector<RivalLaw> laws;
  for (int axis = 0; axis < axes; ++axis) {
    Apparent a = apparent(sums, axis);
    a.bias.array() -= a.bias.dot(a.weight) / std::max(1e-300, a.weight.sum());  // the bias is fitted anyway
    const double noise_only = a.weight.dot(a.bias.cwiseAbs2());
    double best = noise_only, best_length = 0.0;
    Eigen::VectorXd best_size;
    for (const double length : {0.5, 1.0, 2.0, 4.0}) {
      Eigen::MatrixXd K(n, m), Kmm(m, m);
      for (Eigen::Index c = 0; c < m; ++c) {
        for (Eigen::Index p = 0; p < n; ++p) {
          K(p, c) = std::exp(-0.5 * distance_squared(all, p, centres[static_cast<std::size_t>(c)]) / (length * length));
        }
      }
      for (Eigen::Index c = 0; c < m; ++c) {
        Kmm.row(c) = K.row(centres[static_cast<std::size_t>(c)]);
      }
      Kmm.diagonal().array() += 1e-6;
      for (double variance = 1e-6; variance < 1e8; variance *= 10.0) {  // of the process, in the axis' unit squared
        const Eigen::MatrixXd A = Kmm / variance + K.transpose() * a.weight.asDiagonal() * K;
        const Eigen::LLT<Eigen::MatrixXd> llt(A), prior(Kmm / variance);
        if (llt.info() != Eigen::Success || prior.info() != Eigen::Success) {
          continue;
        }
        const Eigen::VectorXd b = K.transpose() * a.weight.cwiseProduct(a.bias);
        const Eigen::VectorXd size = llt.solve(b);
        const double log_determinants =
            2.0 * (llt.matrixLLT().diagonal().array().log().sum() - prior.matrixLLT().diagonal().array().log().sum());
        const double criterion = noise_only - b.dot(size) + log_determinants + 2.0 * std::log(static_cast<double>(n));
        if (criterion < best) {
          best = criterion;
          best_length = length;
          best_size = size;
        }
      }
    }
    for (Eigen::Index c = 0; best_length > 0.0 && c < m; ++c) {
      laws.push_back({axis, bell(all, centres[static_cast<std::size_t>(c)], best_length), best_size(c)});
    }
  }
  return laws;
}

}  // namespace selfcal::discovery_trial
