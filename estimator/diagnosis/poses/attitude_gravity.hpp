// Accelerometers by the direction of gravity that an attitude gives in poses: equation (A5) of attitude.hpp. Private to this folder.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/poses/attitude_fit.hpp"
#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

struct GravityFit {
  std::string why_not;  // empty: done
  int poses = 0;
  Matrix3 B = Matrix3::Identity();           // K C_bm, raw per m/s^2
  Vector3 bias = Vector3::Zero();            // raw
  Vector3 up = Vector3::UnitZ();             // in r, of unit length
  Eigen::Matrix<double, 14, 14> covariance;  // B by columns, bias, two angles of `up`; 95 % of it lie within 1.96 sigma
  Eigen::Matrix<double, 3, 2> across;        // directions of the two angles
  double rms = 0.0;                          // raw, an axis
  double raw_per_si = 1.0;                   // nominal
};

GravityFit fit_gravity(const PoseInput& input, const Knots& knots, const AttitudeFit& gyros,
                       const std::vector<Pose>& poses);

}  // namespace selfcal::diagnosis
