#include "sim/scene/rotation_input.h"

#include "sim/base/spatial.h"
#include "sim/base/words.h"

#include <fmt/format.h>

namespace flexframe::sim {

Vec3 read_rotation(const TableReader& reader, std::string_view key) {
  const TomlValue* value = reader.find(key);
  if (!value) return Vec3::Zero();
  if (value->type != TomlValue::Type::table) return reader.vector3(key, "rad");
  const TableReader table = *reader.table(key);
  if (table.has("axis")) {
    table.allow({"axis", "angle"});
    return table.number("angle", any_number.in("rad")) * table.direction("axis", Vec3::UnitZ());
  }
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
