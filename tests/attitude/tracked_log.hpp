// A sensor that is turned and put down again beside something that measures its attitude, from first principles: shares the estimator's types of
// input and nothing else.
#pragma once

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "estimator/diagnosis/poses/poses.hpp"

namespace selfcal::attitude_trial {

// What is drawn; units SI, an axis.
struct Truth {
  Eigen::Matrix3d M = Eigen::Matrix3d::Identity();  // gyros, in b
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();  // accelerometers, upper triangular: b is their frame
  Eigen::Quaterniond C_bm = Eigen::Quaterniond::Identity();
  Eigen::Vector3d bias = Eigen::Vector3d::Zero(), slope = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ(), earth = Eigen::Vector3d::Zero();  // in r
  double delay_s = 0.003, drift = 20e-6;
  double gyro_asd = 7.85e-5, walk_asd = 0.0, accel_asd = 9e-4;
  double attitude_sigma = 3e-4, attitude_keeps = 0.0;
};

struct Course {
  double rate_hz = 100.0, attitude_hz = 60.0;
  int stops = 12;
  double rest_s = 3.0, move_s = 4.0;
  Eigen::Vector3d axes = Eigen::Vector3d::Ones();  // of the turns: how much about each of b
  bool rests = true;
};

struct TrackedLog {
  diagnosis::PoseInput input;  // with one reading of the attitude
  std::vector<Eigen::Quaterniond> true_q_rm;
  Eigen::Vector3d mean_bias = Eigen::Vector3d::Zero();
};

Truth drawn_truth(std::mt19937_64& random);
TrackedLog drawn_log(const Truth& truth, const Course& course, std::mt19937_64& random);

}  // namespace selfcal::attitude_trial
