// The recording cut into pieces, and what a bias of every sensor axis in every piece would do to the innovations.
//
// A law is slow against the pieces, so that its signature is the sum of the pieces' signatures times its means over them:
// score and information of any function of time on any axis are a dot product and a quadratic form.
#pragma once

#include <Eigen/Core>
#include <span>
#include <stop_token>
#include <vector>

#include "estimator/discovery/column_pass.hpp"
#include "estimator/discovery/effect_columns.hpp"
#include "estimator/discovery/law_motion.hpp"

namespace selfcal::discovery {

constexpr int axis_count = 6;  // gyro x y z, accelerometer x y z

struct Piece {
  double start_s = 0.0, end_s = 0.0;  // since the start of the recording
  int dwell = 0;                      // number of turns begun before it
  bool turning = false;
  int recording = 0;  // of several
};

// Dwells are cut ever more coarsely after a turn, turns into equal parts. The time of the pass goes with the square of the
// number of pieces.
constexpr std::size_t most_pieces = 280;
// Of each of so many recordings: time and memory go with the square of the number of all, 5,040 columns, 200 MB a matrix.
std::size_t pieces_of_each(std::size_t recordings);
std::vector<Piece> cut_into_pieces(const diagnosis::RecordingContext& context, std::size_t most = most_pieces);

struct PieceSums : NodeTable {
  std::vector<Piece> pieces;
  // Column piece * axis_count + axis, in units of unit_of(axis): of the bias of that axis during that piece.
  ColumnSums sums;
  std::vector<int> piece_of;  // [nodes]
  Eigen::VectorXd piece_dt;   // [pieces] s

  double dwells() const { return pieces.back().dwell + 1.0; }  // of all recordings
  // Mean over each piece of a function given on the nodes, [pieces].
  Eigen::VectorXd means(const Eigen::Ref<const Eigen::ArrayXd>& on_nodes) const;
  // Those columns of one axis.
  Eigen::MatrixXd information(int axis, int other_axis) const;  // [pieces x pieces]
  Eigen::VectorXd score(int axis) const;                        // [pieces]
};

// SI size of one unit of an axis: 1 deg/h, 1 ug.
double unit_of(int axis);

// With the effects projected out, `beside` of UnitRecording.
PieceSums sum_over_pieces(const LawMotion& motion, const PassInput& input, const PassTrace& trace,
                          std::span<const EffectTerm> effects = {}, const std::stop_token& stop = {},
                          std::size_t most = most_pieces);

// Columns that are carried before those of the pieces, n of them.
struct BesidePieces {
  Eigen::MatrixXd information;  // [n x n]
  Eigen::MatrixXd with_pieces;  // [columns of the pieces x n]
  Eigen::VectorXd score;        // [n]
};
// With the columns of `beside`, which are in `sums` then and not in what is returned.
PieceSums sum_over_pieces(const LawMotion& motion, const PassInput& input, const PassTrace& trace, ColumnSource& beside,
                          BesidePieces& sums, const std::stop_token& stop = {}, std::size_t most = most_pieces);

// What the 24 of each recording multiply (one, the rates, the forces, on each axis) as means over the pieces: columns of the
// sums with information I, what the sums do not show left out. The filter takes up a scale factor, and of its means over the
// pieces all but what a rate does within a piece. Beside a law that is a scale factor but for a small part, that is most of it.
Eigen::MatrixXd known_columns(const PieceSums& sums);

// Recordings one behind the other: what the states of each take up is projected out of each by itself, so that information
// between pieces of two is zero. A law's coefficient is then common to all. `sums.shift` and `sums.pass` stay empty. One recording
// stays as it is.
PieceSums join(std::vector<PieceSums> recordings);

}  // namespace selfcal::discovery
