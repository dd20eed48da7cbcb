#include "tests/discovery/rivals.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimator/discovery/dictionary.hpp"
#include "estimator/discovery/piece_model.hpp"

namespace selfcal::discovery_trial {
namespace {

using namespace discovery;

constexpr int axes = 6;
constexpr int most_functions = 6;

}  // namespace

PieceSums with_states_held(const LawMotion& motion, PassInput input) {
  constexpr double known = 1e-6;  // of what is known before
  input.prior.position *= known;
  input.prior.velocity *= known;
  input.prior.attitude *= known;
  input.prior.parameter_sigma *= known;
  return sum_over_pieces(motion, input, trace_pass(input));
}

std::vector<RivalLaw> stepwise(const PieceSums& sums, const laws::VariableSet& available) {
  Dictionary dictionary = make_dictionary(sums, available);
  for (Function& f : dictionary.functions) {
    f.cost = 0.0;
    f.partner = -1;
  }
  const double price = std::log(sums.sums.rows);
  PieceModel model(sums, dictionary);
  struct Taken {
    int axis = 0, function = 0;
  };
  std::vector<Taken> taken;
  std::vector<Eigen::VectorXd> columns;
  for (int step = 0; step < most_functions; ++step) {
    const std::vector<Ranked> best = model.rank(1);
    if (best.empty() || best.front().gain < price) {
      break;
    }
    taken.push_back({best.front().axis, best.front().function});
    columns.push_back(model.column(best.front().axis, dictionary.means.col(best.front().function).cast<double>()));
    model.choose(columns);
  }
  const auto n = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd X(sums.sums.score.size(), n);
  for (Eigen::Index k = 0; k < n; ++k) {
    X.col(k) = columns[static_cast<std::size_t>(k)];
  }
  Eigen::MatrixXd G = X.transpose() * sums.sums.information * X;
  G.diagonal() *= 1.0 + 1e-9;
  const Eigen::VectorXd size =
      n > 0 ? Eigen::VectorXd(G.ldlt().solve(X.transpose() * sums.sums.score)) : Eigen::VectorXd();
  std::vector<RivalLaw> laws;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Taken& t = taken[static_cast<std::size_t>(k)];
    const Function& function = dictionary.functions[static_cast<std::size_t>(t.function)];
    const auto expression = laws::Expression::parse(dictionary.pattern(function));
    const std::vector<double> constants(expression->free_constants(), function.constant);
    laws.push_back({t.axis, expression->text(constants), size(k) / dictionary.scale(t.function)});
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
    const Eigen::MatrixXd G = sums.information(axis, axis);
    const Eigen::VectorXd score = sums.score(axis);
    double best = 0.0, best_length = 0.0;  // of the criterion, against noise alone
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
        const Eigen::MatrixXd A = Kmm / variance + K.transpose() * G * K;
        const Eigen::LLT<Eigen::MatrixXd> llt(A), prior(Kmm / variance);
        if (llt.info() != Eigen::Success || prior.info() != Eigen::Success) {
          continue;
        }
        const Eigen::VectorXd b = K.transpose() * score;
        const Eigen::VectorXd size = llt.solve(b);
        const double log_determinants =
            2.0 * (llt.matrixLLT().diagonal().array().log().sum() - prior.matrixLLT().diagonal().array().log().sum());
        const double criterion = log_determinants - b.dot(size) + 2.0 * std::log(sums.sums.rows);
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
