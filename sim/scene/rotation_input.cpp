#include "sim/scene/rotation_input.h"

#include "sim/base/spatial.h"
#include "sim/base/words.h"

#include <fmt/format.h>
#include <Eigen/SVD>

#include <cmath>

namespace flexframe::sim {
namespace {

// The rotation nearest to a matrix whose columns are the turned axes, with the few digits that a person types.
Vec3 matrix_rotation(const TableReader& table) {
  table.allow({"matrix"});
  const MatX given = table.matrix("matrix");
  if (given.rows() != 3 || given.cols() != 3)
    table.fail("matrix", fmt::format("must be 3 rows of 3 numbers, found {} x {}", given.rows(), given.cols()));
  const Mat3 R = given;
  constexpr double digits = 5e-3;
  if (!((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() <= digits))
    table.fail("matrix", "must be a rotation: its columns, the turned axes, are unit vectors normal to one another");
  if (R.determinant() < 0.0) table.fail("matrix", "must be a rotation, found a reflection: exchange two of its columns, or their signs");
  const Eigen::JacobiSVD<Mat3> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return rotation_log(Mat3(svd.matrixU() * svd.matrixV().transpose()));
}

}  // namespace

Vec3 read_rotation(const TableReader& reader, std::string_view key) {
  const TomlValue* value = reader.find(key);
  if (!value) return Vec3::Zero();
  using Type = TomlValue::Type;
  if (value->type != Type::table && value->type != Type::array && !(value->type == Type::text && value->text.starts_with('[')))
    reader.fail(key, fmt::format("must be a rotation: [x, y, z] (a rotation vector, rad), {{ axis, angle }}, {{ euler, angles }}, "
                                 "{{ quaternion }} or {{ matrix }}; found {}",
                                 describe(*value)));
  if (value->type != Type::table) return reader.vector3(key, "rad");
  const TableReader table = *reader.table(key);
  if (table.has("axis")) {
    table.allow({"axis", "angle"});
    return table.number("angle", any_number.in("rad")) * table.direction("axis", Vec3::UnitZ());
  }
  if (table.has("quaternion")) {
    table.allow({"quaternion"});
    const std::vector<double> q = table.numbers("quaternion", 4, 4);
    const double norm = Eigen::Map<const Eigen::Vector4d>(q.data()).stableNorm();
    if (!(norm > 0.0) || !std::isfinite(norm)) table.fail("quaternion", "must be [w, x, y, z] and not zero");
    return rotation_log(Quat(q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm));
  }
  if (table.has("matrix")) return matrix_rotation(table);
  table.allow({"euler", "angles"});
  const std::string letters = table.text("euler");
  const bool good =
      letters.size() == 3 && letters.find_first_not_of("xyz") == std::string::npos && letters[0] != letters[1] && letters[1] != letters[2];
  if (!good)
    table.fail("euler",
               fmt::format("must be three of the letters x, y, z, no two neighbours alike (\"xyz\", \"zxz\"), found {}", quote(letters)));
  const std::vector<double> angles = table.numbers("angles", 3, 3, any_number.in("rad"));
  Quat turn = Quat::Identity();
  for (std::size_t k = 0; k < 3; ++k) turn = turn * Quat(Eigen::AngleAxisd(angles[k], Vec3::Unit(letters[k] - 'x')));
  return rotation_log(turn);
}

}  // namespace flexframe::sim
