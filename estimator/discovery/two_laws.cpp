#include "estimator/discovery/two_laws.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <utility>

namespace selfcal::discovery {
namespace {

constexpr std::size_t functions_each = 400;  // of an axis
constexpr std::size_t values_each = 3;       // of the constant of a pattern
constexpr std::size_t pairs_fitted = 8;
// Of the information of one of two functions: what the other must leave, or they are one.
constexpr double least_apart = 0.02;

// A function, or the two that a wave of any phase is made of, on an axis: columns that carry information 1 each and none together.
struct Member {
  Ranked ranked;
  Eigen::Index first = 0, columns = 1;
};

struct Pool {
  std::vector<Member> members;  // by axis
  Eigen::MatrixXd information;  // of all columns
  Eigen::VectorXd score;
};

std::vector<Ranked> chosen_for_pool(const PieceModel& model, const Dictionary& dictionary, std::size_t each_axis) {
  std::array<std::map<std::string, std::size_t>, axis_count> values;
  std::array<std::vector<Ranked>, axis_count> all;
  for (const Ranked& ranked : model.rank(dictionary.functions.size() * axis_count)) {
    const auto f = static_cast<std::size_t>(ranked.axis);
    const Function& function = dictionary.functions[static_cast<std::size_t>(ranked.function)];
    if (all[f].size() < each_axis && values[f][dictionary.pattern(function)]++ < values_each) {
      all[f].push_back(ranked);
    }
  }
  std::vector<Ranked> joined;
  for (const std::vector<Ranked>& of_axis : all) {
    joined.insert(joined.end(), of_axis.begin(), of_axis.end());
  }
  return joined;
}

Pool pool_of(const PieceModel& model, const Dictionary& dictionary, std::size_t each_axis) {
  Pool pool;
  std::array<std::vector<int>, axis_count> functions;
  Eigen::Index count = 0;
  for (const Ranked& ranked : chosen_for_pool(model, dictionary, each_axis)) {
    const int partner = dictionary.functions[static_cast<std::size_t>(ranked.function)].partner;
    auto& of_axis = functions[static_cast<std::size_t>(ranked.axis)];
    of_axis.push_back(ranked.function);
    if (partner >= 0) {
      of_axis.push_back(partner);
    }
    pool.members.push_back({ranked, count, partner < 0 ? 1 : 2});
    count += pool.members.back().columns;
  }
  std::array<Eigen::MatrixXd, axis_count> means;
  for (std::size_t f = 0; f < axis_count; ++f) {
    means[f] = dictionary.means(Eigen::all, functions[f]).cast<double>();
  }
  std::tie(pool.information, pool.score) = model.project(means);
  const auto whiten = [&](const Member& m) {
    const Eigen::MatrixXd own = pool.information.block(m.first, m.first, m.columns, m.columns);
    const Eigen::LLT<Eigen::MatrixXd> root(own);
    if (root.info() != Eigen::Success || root.rcond() < 1e-9) {
      return false;
    }
    const Eigen::MatrixXd whitening = Eigen::MatrixXd(root.matrixL()).inverse();
    const Eigen::MatrixXd rows = whitening * pool.information.middleRows(m.first, m.columns);
    pool.information.middleRows(m.first, m.columns) = rows;
    const Eigen::MatrixXd columns = pool.information.middleCols(m.first, m.columns) * whitening.transpose();
    pool.information.middleCols(m.first, m.columns) = columns;
    const Eigen::VectorXd score = whitening * pool.score.segment(m.first, m.columns);
    pool.score.segment(m.first, m.columns) = score;
    return true;
  };
  std::erase_if(pool.members, [&](const Member& m) { return !whiten(m); });
  return pool;
}

// What both gain together; 0 where they are one.
double gain_of(const Pool& pool, const Member& a, const Member& b) {
  using Shared = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 2, 2>;
  using Score = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 2, 1>;
  const Shared shared = pool.information.block(a.first, b.first, a.columns, b.columns);
  const Score of_a = pool.score.segment(a.first, a.columns);
  const Score rest = pool.score.segment(b.first, b.columns) - shared.transpose() * of_a;
  const Shared apart = Shared::Identity(b.columns, b.columns) - shared.transpose() * shared;
  const double determinant = apart.determinant();
  if (determinant <= least_apart) {
    return 0.0;
  }
  if (b.columns == 1) {
    return of_a.squaredNorm() + rest(0) * rest(0) / determinant;
  }
  return of_a.squaredNorm() +
         (apart(1, 1) * rest(0) * rest(0) - 2.0 * apart(0, 1) * rest(0) * rest(1) + apart(0, 0) * rest(1) * rest(1)) /
             determinant;
}

double cost_of(const Ranked& ranked) { return 0.5 * ranked.gain - ranked.merit; }

}  // namespace

std::vector<RankedPair> rank_pairs(const PieceModel& model, const Dictionary& dictionary, std::size_t each_axis) {
  const Pool pool = pool_of(model, dictionary, each_axis);
  std::vector<RankedPair> all;
  for (std::size_t i = 0; i < pool.members.size(); ++i) {
    const Ranked& first = pool.members[i].ranked;
    RankedPair best{first, first, 0.0};
    for (std::size_t j = i + 1; j < pool.members.size(); ++j) {
      const Ranked& second = pool.members[j].ranked;
      const double merit = 0.5 * gain_of(pool, pool.members[i], pool.members[j]) - cost_of(first) - cost_of(second);
      if (merit > best.merit) {
        best = {first, second, merit};
      }
    }
    if (best.merit > 0.0) {
      all.push_back(best);
    }
  }
  std::sort(all.begin(), all.end(), [](const RankedPair& x, const RankedPair& y) { return x.merit > y.merit; });
  return all;
}

std::optional<SearchState> two_laws(std::span<const LawRecording> recordings, PieceModel& model,
                                    const Dictionary& dictionary, const Shortlist& shortlist, double false_alarm_rate,
                                    const std::stop_token& stop) {
  model.choose({});
  std::vector<RankedPair> pairs = rank_pairs(model, dictionary, functions_each);
  pairs.resize(std::min(pairs.size(), pairs_fitted));
  std::optional<SearchState> best;
  for (const RankedPair& pair : pairs) {
    if (stop.stop_requested()) {
      break;
    }
    SearchState state;
    std::vector<LawTerm> terms;
    for (const Candidate& c : shortlist.refined(model, pair.first, pair.second)) {
      terms.push_back(c.term);
      state.costs.push_back(c.cost);
    }
    state.fit = fit_laws(recordings, terms, constant_rounds, stop);
    state.terms = state.fit.terms;
    bool both = state.terms.size() == terms.size();
    for (std::size_t k = 0; both && k < terms.size(); ++k) {
      both = stands(state.fit, k) && log_p_of_law(state.fit.gain[k], state.terms[k].constants.size(), state.costs[k]) <
                                         std::log(false_alarm_rate);
    }
    if (both && (!best || log_posterior_of_laws(state) > log_posterior_of_laws(*best))) {
      best = std::move(state);
    }
  }
  return best;
}

}  // namespace selfcal::discovery
