// Vocabulary types of the simulation. SI units throughout; column vectors; matrices column-major (Eigen's default).
#pragma once

#include <Eigen/Dense>

#include <stdexcept>
#include <string>

extern template class Eigen::PartialPivLU<Eigen::MatrixXd>;  // in eigen_solvers.cpp

namespace flexframe::sim {

using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using VecX = Eigen::VectorXd;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using MatX = Eigen::MatrixXd;
using Mat3X = Eigen::Matrix3Xd;
using Mat6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Quat = Eigen::Quaterniond;

// Bad input: the message names file, line, key, what was found and what is allowed. The program exits with 2.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A computation that could not be done: the message says what failed, when, and what to change. The program exits with 1.
struct SimulationError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace flexframe::sim
