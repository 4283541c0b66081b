// Vocabulary types of the simulation. SI units throughout; column vectors; matrices column-major (Eigen's default) where
// their type does not say otherwise.
#pragma once

#include "sim/base/error.h"

#include <Eigen/Dense>

#include <string>

extern template class Eigen::PartialPivLU<Eigen::MatrixXd>;  // in eigen_solvers.cpp

namespace flexframe::sim {

using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using VecX = Eigen::VectorXd;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using MatX = Eigen::MatrixXd;
// Series that are written and read a row at a time.
using RowsX = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Mat3X = Eigen::Matrix3Xd;
using Mat6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Quat = Eigen::Quaterniond;

using flexframe::ArgumentError;
using flexframe::FileError;
using flexframe::InputError;
using flexframe::SimulationError;

}  // namespace flexframe::sim
