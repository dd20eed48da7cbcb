#include "estimator/diagnosis/regression/multiplicity.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace selfcal::diagnosis {
namespace {

constexpr Eigen::Index draws = 10000, batch = 500;
// Statistics below this many sigma of their own spread are never the smallest p-value of a draw that matters.
constexpr double worth_a_look = 2.5;

// Independent standard normals, the same on every machine.
class Normals {
 public:
  void fill(Eigen::MatrixXd& m) {
    for (Eigen::Index k = 0; k < m.size(); k += 2) {
      const double radius = std::sqrt(-2.0 * std::log(uniform()));
      const double angle = 2.0 * std::numbers::pi * uniform();
      m.data()[k] = radius * std::cos(angle);
      if (k + 1 < m.size()) {
        m.data()[k + 1] = radius * std::sin(angle);
      }
    }
  }

 private:
  double uniform() { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1.0p-53; }
  std::mt19937_64 engine_{20260501};
};

// One candidate as quadratic forms of its score.
struct Form {
  Eigen::Index first = 0, count = 0;
  Eigen::MatrixXd root;      // delta_chi2 = |root * score|^2
  Eigen::VectorXd variance;  // of the scores; 0: not seen
};

Form form_of(const Evidence& e, const Candidate& c) {
  Form f{c.first, c.count, {}, {}};
  const Eigen::MatrixXd G = e.information.block(c.first, c.first, c.count, c.count);
  f.root = visible_root(G);
  f.variance = G.diagonal();
  for (Eigen::Index k = 0; k < c.count; ++k) {
    f.variance(k) = f.variance(k) > least_information ? f.variance(k) : 0.0;
  }
  return f;
}

double smallest_log_p(const std::vector<Form>& forms, const Eigen::VectorXd& score) {
  double smallest = 0.0, single = 0.0;
  for (const Form& f : forms) {
    const auto own = score.segment(f.first, f.count);
    for (Eigen::Index k = 0; k < f.count; ++k) {
      if (f.variance(k) > 0.0) {
        single = std::max(single, own(k) * own(k) / f.variance(k));
      }
    }
    const auto rank = static_cast<double>(f.root.rows());
    const double delta_chi2 = (f.root * own).squaredNorm();
    if (rank > 1.0 && delta_chi2 > rank + worth_a_look * std::sqrt(2.0 * rank)) {
      smallest = std::min(smallest, log_chi_squared_tail(delta_chi2, rank));
    }
  }
  return std::min(smallest, log_chi_squared_tail(single, 1.0));
}

}  // namespace

double effective_tests(const Evidence& e, const std::vector<Candidate>& candidates, double alpha) {
  Eigen::Index columns = 0;
  std::vector<Form> forms;
  for (const Candidate& c : candidates) {
    columns = std::max<Eigen::Index>(columns, c.first + c.count);
    forms.push_back(form_of(e, c));
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(e.information.topLeftCorner(columns, columns));
  const Eigen::MatrixXd root = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  Normals normals;
  Eigen::MatrixXd white(columns, batch), scores(columns, batch);
  std::vector<double> smallest;
  for (Eigen::Index done = 0; done < draws; done += batch) {
    normals.fill(white);
    scores.noalias() = root * white;
    for (Eigen::Index k = 0; k < batch; ++k) {
      smallest.push_back(smallest_log_p(forms, scores.col(k)));
    }
  }
  const auto at = smallest.begin() + static_cast<std::ptrdiff_t>(alpha * static_cast<double>(draws));
  std::nth_element(smallest.begin(), at, smallest.end());
  return std::max(1.0, alpha / std::exp(*at));
}

}  // namespace selfcal::diagnosis
