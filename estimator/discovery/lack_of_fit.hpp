// Whether a sensor's axis holds more than the laws on it say: a bias of its own at every position and in every turn, beside them.
#pragma once

#include <Eigen/Core>

#include "estimator/discovery/piece_model.hpp"
#include "estimator/discovery/pieces.hpp"

namespace selfcal::discovery {

// [pieces x groups] 1 where the piece is one of the group: of dwells at one position of the gimbal, to 1 deg or so; all pieces of a
// turn.
Eigen::MatrixXd positions(const PieceSums& sums);
Eigen::MatrixXd positions_and_turns(const PieceSums& sums);

// Natural logarithm of the probability that biases of an axis at positions, or at positions and in turns, gain as much where all laws
// are true and fitted (chi squared of as many degrees as the laws and the states leave; two questions, corrected for). It asks for no
// form: where a law is wrong in an unknown way, every position tells, a little each. `model`: of what the laws leave, with the laws and
// their constants chosen. `gained`: fall of the square by the laws, of which a thousandth is not counted.
double log_p_of_lack(const PieceModel& model, const PieceSums& sums, int axis, double gained);

}  // namespace selfcal::discovery
