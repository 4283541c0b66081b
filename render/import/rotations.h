// Orientations as other programs write them, all to unit quaternions w x y z that turn body axes to world axes: x_world = R x_body.
//
// Compared with scipy.spatial.transform.Rotation in tests/regression/test_import.py: Rotation.from_euler("XYZ") turns about the axes as
// they lie by then (here "body"), from_euler("xyz") about axes that stay (here "fixed").
#pragma once

#include "sim/base/types.h"

#include <array>
#include <string>

namespace flexframe::imports {

enum class TurnForm { none, quaternion, euler, matrix, vector, angle };

struct TurnWriting {
  TurnForm form = TurnForm::none;
  bool scalar_last = false;             // quaternion: x y z w in place of w x y z
  std::string sequence = "xyz";         // euler: the axes in the order in which the angles are given
  bool fixed_axes = false;              // euler: about axes that stay, in place of the axes as they lie by then
  bool by_columns = false;              // matrix: r11 r21 r31 r12 ... in place of r11 r12 r13 r21 ...
  sim::Vec3 axis = sim::Vec3::UnitZ();  // angle: about this axis
  bool world_to_body = false;           // the numbers turn world axes to body axes
};

// How many numbers the form has: 4, 3, 9, 3, 1; 0 for none.
int turn_count(TurnForm form);

// The quaternion of numbers in rad or without unit. what: begins messages ("file: body 'x': "). Throws InputError for a quaternion whose
// norm, or a matrix whose columns, are off by more than 1e-3, and for a matrix that mirrors.
sim::Quat to_quaternion(const TurnWriting& writing, const std::array<double, 9>& numbers, const std::string& what);

// Quaternions of following samples on the same half of the sphere: rows w x y z.
void keep_hemisphere(Eigen::MatrixX4d& orientation);

}  // namespace flexframe::imports
