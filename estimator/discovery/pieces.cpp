#include "estimator/discovery/pieces.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/discovery/effect_columns.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {
namespace {

// After a turn, s: a creep of 5 s and longer is followed to a few per cent; every further 60 s.
constexpr std::array<double, 6> dwell_edges_s = {0.0, 4.0, 10.0, 20.0, 36.0, 64.0};
constexpr double later_step_s = 60.0;
constexpr double least_piece_s = 2.0;
constexpr int parts_of_turn = 6, least_parts_of_turn = 2;

void cut_dwell(double start_s, double end_s, int dwell, bool coarse, std::vector<Piece>& pieces) {
  std::vector<double> edges;
  for (std::size_t k = 0; k < dwell_edges_s.size(); k += coarse ? 2 : 1) {
    edges.push_back(start_s + dwell_edges_s[k]);
  }
  double next_s = edges.back() + later_step_s;
  while (next_s < end_s) {
    edges.push_back(next_s);
    next_s += (coarse ? 2.0 : 1.0) * later_step_s;
  }
  while (edges.size() > 1 && edges.back() > end_s - least_piece_s) {
    edges.pop_back();
  }
  edges.push_back(end_s);
  for (std::size_t k = 0; k + 1 < edges.size(); ++k) {
    pieces.push_back({edges[k], edges[k + 1], dwell, false});
  }
}

std::vector<Piece> cut(const std::vector<diagnosis::Turn>& turns, double start_s, double duration_s, int parts,
                       bool coarse) {
  std::vector<Piece> pieces;
  double from = 0.0;
  int dwell = 0;
  for (const diagnosis::Turn& turn : turns) {
    const double begin = turn.start_s - start_s, end = turn.end_s - start_s;
    if (begin > from) {
      cut_dwell(from, begin, dwell, coarse, pieces);
    }
    ++dwell;
    for (int k = 0; k < parts; ++k) {
      pieces.push_back({begin + (end - begin) * k / parts, begin + (end - begin) * (k + 1) / parts, dwell, true});
    }
    from = end;
  }
  if (duration_s > from) {
    cut_dwell(from, duration_s, dwell, coarse, pieces);
  }
  return pieces;
}

class PieceSource : public ColumnSource {
 public:
  PieceSource(const LawMotion& motion, PieceSums& result) : motion_(motion), result_(result) {}

  int count() const override { return axis_count * static_cast<int>(result_.pieces.size()); }
  bool block_ends_before(std::size_t sample) const override { return motion_.context().divides(sample); }
  int active(double time_s) const override { return axis_count * static_cast<int>(piece_at(time_s) + 1); }

  void block(const SensorBlock& block, Eigen::Ref<Eigen::Matrix3Xd> velocity,
             Eigen::Ref<Eigen::Matrix3Xd> angle) override {
    const StretchNodes stretch = motion_.of(block);
    for (std::size_t k = 0; k < stretch.nodes.size(); ++k) {
      const std::size_t piece = piece_at(stretch.nodes[k].time_s);
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Index at = axis_count * static_cast<Eigen::Index>(piece) + axis;
        angle(axis, at) += stretch.nodes[k].dt * unit_of(axis);
        velocity(axis, at + 3) += stretch.nodes[k].dt * unit_of(axis + 3);
      }
      result_.nodes.push_back(stretch.nodes[k]);
      result_.piece_of.push_back(static_cast<int>(piece));
      rows_.push_back(stretch.channels.row(static_cast<Eigen::Index>(k)));
    }
  }

  void finish() {
    result_.channels.resize(static_cast<Eigen::Index>(rows_.size()), static_cast<Eigen::Index>(laws::variable_count));
    result_.piece_dt = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(result_.pieces.size()));
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      result_.channels.row(static_cast<Eigen::Index>(k)) = rows_[k];
      result_.piece_dt(result_.piece_of[k]) += result_.nodes[k].dt;
    }
  }

 private:
  using Row = Eigen::Array<double, 1, static_cast<int>(laws::variable_count)>;

  std::size_t piece_at(double t) const {
    const auto after = std::upper_bound(result_.pieces.begin(), result_.pieces.end(), t,
                                        [](double value, const Piece& piece) { return value < piece.end_s; });
    return std::min(static_cast<std::size_t>(after - result_.pieces.begin()), result_.pieces.size() - 1);
  }

  const LawMotion& motion_;
  PieceSums& result_;
  std::vector<Row> rows_;
};

}  // namespace

std::size_t pieces_of_each(std::size_t recordings) {
  constexpr std::size_t most_of_all = 840;
  return std::min(most_pieces, most_of_all / recordings);
}

double unit_of(int axis) { return axis < 3 ? units::degree_per_hour : units::micro_g; }

std::vector<Piece> cut_into_pieces(const diagnosis::RecordingContext& context, std::size_t most) {
  const ImuData& data = context.data();
  const double start_s = data.time_s.front() - 1.0 / data.sample_rate_hz;
  const double duration_s = data.time_s.back() - start_s;
  std::vector<Piece> pieces;
  for (const bool coarse : {false, true}) {
    for (int parts = parts_of_turn; parts >= least_parts_of_turn; parts -= 2) {
      pieces = cut(context.turns(), start_s, duration_s, parts, coarse);
      if (pieces.size() <= most) {
        return pieces;
      }
    }
  }
  return pieces;
}

Eigen::VectorXd PieceSums::means(const Eigen::Ref<const Eigen::ArrayXd>& on_nodes) const {
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(piece_dt.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    mean(piece_of[k]) += on_nodes(static_cast<Eigen::Index>(k)) * nodes[k].dt;
  }
  return (piece_dt.array() > 0.0).select(mean.array() / piece_dt.array().max(1e-12), 0.0);
}

Eigen::MatrixXd PieceSums::information(int axis, int other_axis) const {
  const auto n = static_cast<Eigen::Index>(pieces.size());
  return sums.information(Eigen::seqN(axis, n, axis_count), Eigen::seqN(other_axis, n, axis_count));
}

Eigen::VectorXd PieceSums::score(int axis) const {
  return sums.score(Eigen::seqN(axis, static_cast<Eigen::Index>(pieces.size()), axis_count));
}

PieceSums sum_over_pieces(const LawMotion& motion, const PassInput& input, const PassTrace& trace,
                          std::span<const EffectTerm> effects, const std::stop_token& stop, std::size_t most) {
  PieceSums result;
  result.pieces = cut_into_pieces(motion.context(), most);
  PieceSource source(motion, result);
  result.sums = run_beside(effects, motion.context(), input, trace, source, stop);
  source.finish();
  return result;
}

PieceSums sum_over_pieces(const LawMotion& motion, const PassInput& input, const PassTrace& trace, ColumnSource& beside,
                          BesidePieces& sums, const std::stop_token& stop, std::size_t most) {
  PieceSums result;
  result.pieces = cut_into_pieces(motion.context(), most);
  PieceSource source(motion, result);
  TwoSources both(beside, source);
  ColumnSums all = run_columns(input, trace, both, stop);
  source.finish();
  const int n = beside.count(), pieces = source.count();
  sums = {all.information.topLeftCorner(n, n), all.information.bottomLeftCorner(pieces, n), all.score.head(n)};
  all.information = all.information.bottomRightCorner(pieces, pieces).eval();
  all.score = all.score.tail(pieces).eval();
  all.shift = all.shift.rightCols(pieces).eval();
  result.sums = std::move(all);
  return result;
}

namespace {

// Means over the pieces of what the 24 multiply on this axis, in each recording by itself, each of information 1.
void add_known(const PieceSums& sums, int axis, std::vector<Eigen::VectorXd>& columns) {
  constexpr double rounding = 1e-13;  // of a column's information before projection
  const auto own = Eigen::seqN(axis, sums.piece_dt.size(), axis_count);
  const Eigen::MatrixXd G = sums.information(axis, axis);
  const auto first = static_cast<Eigen::Index>(axis < 3 ? laws::Variable::wx : laws::Variable::fx);
  for (int recording = 0; recording <= sums.pieces.back().recording; ++recording) {
    for (Eigen::Index k = -1; k < 3; ++k) {
      Eigen::VectorXd means = Eigen::VectorXd::Ones(sums.piece_dt.size());
      if (k >= 0) {
        means = sums.means(sums.channels.col(first + k));
      }
      for (std::size_t p = 0; p < sums.pieces.size(); ++p) {
        means(static_cast<Eigen::Index>(p)) *= sums.pieces[p].recording == recording ? 1.0 : 0.0;
      }
      const double left = means.dot(G * means);
      if (left > rounding * means.cwiseAbs2().dot(G.diagonal())) {
        columns.emplace_back(Eigen::VectorXd::Zero(sums.sums.score.size()));
        columns.back()(own) = means / std::sqrt(left);
      }
    }
  }
}

}  // namespace

Eigen::MatrixXd known_columns(const PieceSums& sums) {
  constexpr double alike = 1e-6;  // a constant rate is a bias, and one force twice another: such directions count once
  std::vector<Eigen::VectorXd> columns;
  for (int axis = 0; axis < axis_count && !sums.pieces.empty(); ++axis) {
    add_known(sums, axis, columns);
  }
  if (columns.empty()) {
    return Eigen::MatrixXd(sums.sums.score.size(), 0);
  }
  Eigen::MatrixXd X(sums.sums.score.size(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    X.col(static_cast<Eigen::Index>(k)) = columns[k];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> information(X.transpose() * (sums.sums.information * X));
  const Eigen::Index apart = (information.eigenvalues().array() > alike).count();  // in ascending order
  return X * information.eigenvectors().rightCols(apart) *
         information.eigenvalues().tail(apart).cwiseSqrt().cwiseInverse().asDiagonal();
}

namespace {

PieceSums one_behind_the_other(const std::vector<PieceSums>& recordings) {
  Eigen::Index columns = 0, nodes = 0, pieces = 0;
  for (const PieceSums& r : recordings) {
    columns += r.sums.score.size();
    nodes += r.channels.rows();
    pieces += r.piece_dt.size();
  }
  PieceSums all;
  all.sums.information = Eigen::MatrixXd::Zero(columns, columns);
  all.sums.score.resize(columns);
  all.channels.resize(nodes, static_cast<Eigen::Index>(laws::variable_count));
  all.piece_dt.resize(pieces);
  columns = nodes = pieces = 0;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const PieceSums& one = recordings[r];
    const int first_dwell = all.pieces.empty() ? 0 : all.pieces.back().dwell + 1;
    const Eigen::Index n = one.sums.score.size();
    all.sums.information.block(columns, columns, n, n) = one.sums.information;
    all.sums.score.segment(columns, n) = one.sums.score;
    all.sums.square += one.sums.square;
    all.sums.rows += one.sums.rows;
    all.sums.log_determinant += one.sums.log_determinant;
    all.channels.middleRows(nodes, one.channels.rows()) = one.channels;
    all.piece_dt.segment(pieces, one.piece_dt.size()) = one.piece_dt;
    all.nodes.insert(all.nodes.end(), one.nodes.begin(), one.nodes.end());
    for (const int piece : one.piece_of) {
      all.piece_of.push_back(piece + static_cast<int>(pieces));
    }
    for (Piece piece : one.pieces) {
      piece.dwell += first_dwell;
      piece.recording = static_cast<int>(r);
      all.pieces.push_back(piece);
    }
    columns += n;
    nodes += one.channels.rows();
    pieces += one.piece_dt.size();
  }
  return all;
}

}  // namespace

PieceSums join(std::vector<PieceSums> recordings) {
  return recordings.size() == 1 ? std::move(recordings.front()) : one_behind_the_other(recordings);
}

}  // namespace selfcal::discovery
