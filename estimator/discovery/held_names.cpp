#include "estimator/discovery/held_names.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "estimator/discovery/column_shares.hpp"
#include "estimator/discovery/explanation_cost.hpp"
#include "estimator/discovery/process.hpp"
#include "estimator/discovery/shortlist.hpp"

namespace selfcal::discovery {
namespace {

constexpr std::size_t shortlist_size = 12;  // functions whose constants are refined over the pieces
constexpr double of_pieces = 1.02;          // pieces stand for a law to a per cent or so

// Normal equations of two recordings, which have nothing between them, one behind the other.
void append(const BesidePieces& more, BesidePieces& all) {
  const Eigen::Index n = all.score.size(), m = more.score.size();
  const Eigen::Index pieces = all.with_pieces.rows(), of_more = more.with_pieces.rows();
  BesidePieces both;
  both.information = Eigen::MatrixXd::Zero(n + m, n + m);
  both.information.topLeftCorner(n, n) = all.information;
  both.information.bottomRightCorner(m, m) = more.information;
  both.with_pieces = Eigen::MatrixXd::Zero(pieces + of_more, n + m);
  both.with_pieces.topLeftCorner(pieces, n) = all.with_pieces;
  both.with_pieces.bottomRightCorner(of_more, m) = more.with_pieces;
  both.score.resize(n + m);
  both.score.head(n) = all.score;
  both.score.tail(m) = more.score;
  all = std::move(both);
}

laws::VariableSet available_in_all(const std::vector<std::unique_ptr<Scene>>& scenes) {
  laws::VariableSet available = scenes.front()->motion.available();
  for (const auto& scene : scenes) {
    available &= scene->motion.available();
  }
  return available;
}

}  // namespace

// Which columns stay and which are held against something else, and what these make of the residual.
struct HeldNames::Columns {
  std::vector<int> stay;
  Eigen::VectorXd in;      // [columns] size of what is in the recording again
  Eigen::VectorXd score;   // [columns] with it
  double square = 0.0;     // with it
  double by_others = 0.0;  // fall of the square by what stays
  // And by the names that are in again: as they were named, or of several recordings with one coefficient in all of them, as laws have.
  double by_names = 0.0;
};

HeldNames::HeldNames(const UnexplainedRest& less, std::stop_token stop, const Progress& progress)
    : stop_(std::move(stop)), scenes_(scenes_of(less.recordings())) {
  if (progress) {
    progress("names against laws");
  }
  std::vector<double> sizes;
  std::vector<PieceSums> all;
  for (const UnitEffect& effect : less.effects()) {
    names_.push_back(effect.effect);
  }
  for (std::size_t r = 0; r < scenes_.size(); ++r) {
    Scene& scene = *scenes_[r];
    terms_.emplace_back();
    for (std::size_t name = 0; name < names_.size(); ++name) {
      const UnitEffect& effect = less.effects()[name];
      if (effect.on_recording(r)) {
        terms_.back().push_back(effect.on[r]);
        sizes.insert(sizes.end(), effect.on[r].size.begin(), effect.on[r].size.end());
        sizes.resize(sizes.size() + (effect.on[r].constant_free ? 1 : 0), 0.0);
        for (std::size_t k = 0; name_of_.size() < sizes.size(); ++k) {
          name_of_.push_back(name);
          within_.push_back(k);
        }
      }
    }
    EffectColumns of_names(scene.context, terms_.back());
    BesidePieces beside;
    all.push_back(sum_over_pieces(scene.motion, scene.input, scene.trace, of_names, beside, stop_,
                                  pieces_of_each(scenes_.size())));
    scene.table = all.back();
    append(beside, beside_);
  }
  size_ = Eigen::Map<const Eigen::VectorXd>(sizes.data(), static_cast<Eigen::Index>(sizes.size()));
  sums_ = join(std::move(all));
  dictionary_ = make_dictionary(sums_, available_in_all(scenes_));
  model_ = std::make_unique<PieceModel>(sums_, dictionary_);
}

HeldNames::Columns HeldNames::columns(const std::vector<bool>& out) const {
  Columns c;
  c.in = Eigen::VectorXd::Zero(size_.size());
  for (Eigen::Index k = 0; k < size_.size(); ++k) {
    if (out[name_of_[static_cast<std::size_t>(k)]]) {
      c.in(k) = size_(k);
    } else {
      c.stay.push_back(static_cast<int>(k));
    }
  }
  const Eigen::MatrixXd& G = beside_.information;
  c.score = beside_.score + G * c.in;
  c.square = sums_.sums.square + 2.0 * c.in.dot(beside_.score) + c.in.dot(G * c.in);
  const auto by_what_stays = [&](const Eigen::VectorXd& score) {
    return c.stay.empty() ? 0.0 : gain_of(G(c.stay, c.stay), score(c.stay));
  };
  c.by_others = by_what_stays(c.score);
  c.by_names = scenes_.size() > 1 ? with_one_physics(out, c.score) - c.by_others
                                  : c.square - c.by_others - (sums_.sums.square - by_what_stays(beside_.score));
  return c;
}

double HeldNames::with_one_physics(const std::vector<bool>& out, const Eigen::VectorXd& score) const {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<Eigen::Index>> one;  // columns of a coefficient
  for (std::size_t k = 0; k < name_of_.size(); ++k) {
    const std::size_t own = name_of_.size() + k;  // of what stays each recording has its own
    one[{name_of_[k], out[name_of_[k]] ? within_[k] : own}].push_back(static_cast<Eigen::Index>(k));
  }
  Eigen::MatrixXd place = Eigen::MatrixXd::Zero(score.size(), static_cast<Eigen::Index>(one.size()));
  Eigen::Index at = 0;
  for (const auto& [coefficient, columns] : one) {
    place(columns, at++).setOnes();
  }
  return gain_of(place.transpose() * beside_.information * place, place.transpose() * score);
}

void HeldNames::look_at(const Columns& c) {
  model_->look_at(sums_.sums.score + beside_.with_pieces * c.in, c.square);
  model_->choose(beside_.with_pieces(Eigen::all, c.stay), beside_.information(c.stay, c.stay), c.score(c.stay));
}

double HeldNames::by_names(const std::vector<bool>& out) const { return columns(out).by_names; }

double HeldNames::jumps_beyond(const std::vector<bool>& out, const std::function<bool(int)>& allowed) {
  const Columns c = columns(out);
  look_at(c);
  double gain = 0.0;
  for (int axis = 0; axis < axis_count; ++axis) {
    if (allowed(axis)) {
      const ProcessFit jumps = fit_process(*model_, sums_, ProcessKind::jump_per_turn, axis);
      gain += std::max(0.0, 2.0 * (jumps.log_likelihood_gain - std::log(process_count)) - cost_of_a_size(dwells()));
    }
  }
  return gain - c.by_names;
}

double HeldNames::most_beyond(const std::vector<bool>& out, double least, const std::function<bool(int)>& allowed) {
  const Columns c = columns(out);
  look_at(c);
  std::vector<LawTerm> laws;
  std::vector<std::vector<std::size_t>> alone;
  double over_pieces = 0.0;
  for (Candidate& candidate : Shortlist(sums_, dictionary_).best(*model_, shortlist_size)) {
    if (!allowed(candidate.term.axis)) {
      continue;
    }
    over_pieces = std::max(over_pieces, candidate.gain);
    alone.push_back({laws.size()});
    laws.push_back(std::move(candidate.term));
  }
  if (alone.empty() || of_pieces * over_pieces - c.by_names < least) {
    return of_pieces * over_pieces - c.by_names;
  }
  const std::vector<double> exact = beyond(out, laws, alone);
  return *std::max_element(exact.begin(), exact.end());
}

std::vector<double> HeldNames::beyond(const std::vector<bool>& out, const std::vector<LawTerm>& laws,
                                      const std::vector<std::vector<std::size_t>>& choices) const {
  const Columns c = columns(out);
  Eigen::Index n = 0, at = 0;
  Eigen::MatrixXd G;
  Eigen::VectorXd b;
  for (std::size_t r = 0; r < scenes_.size(); ++r) {
    const Scene& scene = *scenes_[r];
    LawColumns of_laws(scene.motion, scene.table, laws, true);
    EffectColumns of_names(scene.context, terms_[r]);
    TwoSources both(of_laws, of_names);
    const ColumnSums sums = run_columns(scene.input, scene.trace, both, stop_);
    if (r == 0) {
      n = of_laws.count();
      G = Eigen::MatrixXd::Zero(n + size_.size(), n + size_.size());
      G.bottomRightCorner(size_.size(), size_.size()) = beside_.information;
      b = Eigen::VectorXd::Zero(n + size_.size());
      b.tail(size_.size()) = c.score;
    }
    const Eigen::Index m = of_names.count();
    const Eigen::MatrixXd cross = sums.information.topRightCorner(n, m);
    G.topLeftCorner(n, n) += sums.information.topLeftCorner(n, n);
    G.block(0, n + at, n, m) = cross;
    G.block(n + at, 0, m, n) = cross.transpose();
    b.head(n) += sums.score.head(n) + cross * c.in.segment(at, m);
    at += m;
  }
  std::vector<int> first_constant;  // [laws] columns: derivatives stand behind all laws
  int columns = static_cast<int>(laws.size());
  for (const LawTerm& term : laws) {
    first_constant.push_back(columns);
    columns += static_cast<int>(term.constants.size());
  }
  std::vector<double> all;
  for (const std::vector<std::size_t>& choice : choices) {
    std::vector<int> with;
    for (const std::size_t law : choice) {
      with.push_back(static_cast<int>(law));
      for (int k = 0; k < static_cast<int>(laws[law].constants.size()); ++k) {
        with.push_back(first_constant[law] + k);
      }
    }
    for (const int k : c.stay) {
      with.push_back(static_cast<int>(n) + k);
    }
    all.push_back(gain_of(G(with, with), b(with)) - c.by_others - c.by_names);
  }
  return all;
}

}  // namespace selfcal::discovery
