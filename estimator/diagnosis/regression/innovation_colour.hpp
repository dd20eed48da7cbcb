// Innovations that are not white: an autoregression of each axis, and rows from which it was taken.
//
// A coarse quantum and the sensors' own lines leave more than white noise holds: sampled once an interval, a line far above the
// filter's rate falls to a slow one. Yule and Walker's equations give the autoregression, Schwarz's criterion its order; rows filtered
// by it are white again, and a regression on them has the sigma that the noise allows (Cochrane and Orcutt, J. Am. Stat.
// Assoc. 44, 1949).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace selfcal::diagnosis {

// Of innovations x in units of their predicted sigma: x_k = sum phi_i x_{k-i} + sigma e_k, e white of unit variance.
struct AxisColour {
  std::vector<double> phi;
  double sigma = 1.0;   // of what the epochs before do not tell
  double spread = 1.0;  // of x itself
};

using InnovationColour = std::array<AxisColour, 3>;  // north, up, east

bool is_white(const InnovationColour& colour);

// Rows: epoch by epoch, north, up, east. `segment` [epochs]: the dwell or rotation that an epoch belongs to; its mean and
// slope are taken for something else than noise. White (no phi, sigma 1) where there are too few epochs.
InnovationColour colour_of(const Eigen::VectorXd& innovations, const std::vector<std::size_t>& segment);

// Columns [rows x n] in units of white noise; the first epochs of an axis, which have too few before them, are divided by `spread`.
void whiten(const InnovationColour& colour, Eigen::Ref<Eigen::MatrixXd> rows);
// The other way: x of white rows.
Eigen::VectorXd with_colour(const InnovationColour& colour, const Eigen::VectorXd& white);
// log-likelihood of x = that of its white rows + this.
double log_determinant(const InnovationColour& colour, Eigen::Index rows);
// Whitens one column and returns by how much its log-likelihood differs from that of white rows as they were.
double whitened_gain(const InnovationColour& colour, Eigen::VectorXd& rows);

}  // namespace selfcal::diagnosis
