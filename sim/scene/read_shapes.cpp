// shapes = [{ shape = "box", ... }, ...] of a rigid body, and the mesh's place in the body frame.
#include "sim/base/spatial.h"
#include "sim/base/words.h"
#include "sim/scene/rotation_input.h"
#include "sim/scene/scene_input.h"
#include "sim/scene/units.h"

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

using Words = std::vector<std::string>;

const Words shape_words{"box", "plate", "cylinder", "disc", "capsule", "sphere", "link", "spring", "gear"};  // in the order of ShapeKind

// What a solid may be told beside what all have. From one point to another, or along z of its own frame.
Words shape_keys(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::box:
      return {"size"};
    case ShapeKind::plate:
      return {"size", "thickness"};
    case ShapeKind::cylinder:
      return {"radius", "inner_radius", "length", "from", "to"};
    case ShapeKind::disc:
      return {"radius", "inner_radius", "thickness"};
    case ShapeKind::capsule:
      return {"radius", "length", "from", "to"};
    case ShapeKind::sphere:
      return {"radius"};
    case ShapeKind::link:
      return {"from", "to", "width", "thickness", "hole", "axis"};
    case ShapeKind::spring:
      return {"from", "to", "length", "radius", "wire", "turns"};
    case ShapeKind::gear:
      return {"radius", "teeth", "thickness", "inner_radius"};
  }
  return {};
}

// A point of the body: 3 numbers, or one of its frames.
Vec3 read_point(const TableReader& reader, std::string_view key, const std::map<std::string, Vec3>& frames) {
  const TomlValue& value = reader.required(key);
  if (value.type != TomlValue::Type::text || value.text.starts_with('[')) return reader.vector3(key, "m");
  if (value.text == "origin") return Vec3::Zero();
  if (const auto found = frames.find(value.text); found != frames.end()) return found->second;
  Words known{"origin"};
  for (const auto& frame : frames) known.push_back(frame.first);
  const std::string hint = did_you_mean(value.text, known);
  reader.fail(key, fmt::format("must be 3 numbers or a frame of the body, found {}{}{} its frames are {}", quote(value.text), hint,
                               hint.empty() ? ";" : "", list_words(known)));
}

// Axes whose z is along `z` and whose x is as near to `x` as that allows.
Mat3 axes_along(const Vec3& z, Vec3 x) {
  if (z.cross(x).norm() < 1e-6) x = std::abs(z.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  Mat3 axes;
  axes.col(2) = z;
  axes.col(0) = (x - z.dot(x) * z).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

// Where the solid lies: between two points, or at its position.
void read_place(const TableReader& reader, const std::map<std::string, Vec3>& frames, ShapeDef& shape) {
  const bool spans = reader.has("from") || reader.has("to") || shape.kind == ShapeKind::link;
  if (!spans) {
    if (shape.kind == ShapeKind::cylinder || shape.kind == ShapeKind::capsule || shape.kind == ShapeKind::spring)
      shape.length = reader.number("length", positive.in("m"));
    shape.position = reader.vector3("position", Vec3::Zero(), "m");
    shape.axes = rotation_exp(read_rotation(reader, "rotation"));
    return;
  }
  for (const char* key : {"position", "rotation", "length"})
    if (reader.has(key)) reader.fail(key, "excludes 'from' and 'to', which say where the solid lies");
  const Vec3 from = read_point(reader, "from", frames), to = read_point(reader, "to", frames);
  shape.length = (to - from).norm();
  if (!(shape.length > 0.0)) reader.fail("to", "is the same point as 'from'");
  shape.position = 0.5 * (from + to);
  const Vec3 axis = reader.direction("axis", Vec3::UnitZ()), along = (to - from) / shape.length;
  if (reader.has("axis") && along.cross(axis).norm() < 1e-6) reader.fail("axis", "of the eyes must not lie along the link");
  shape.axes = axes_along(along, axis);
}

void read_bore(const TableReader& reader, ShapeDef& shape) {
  shape.inner_radius = reader.number("inner_radius", 0.0, not_negative.in("m"));
  if (shape.inner_radius >= shape.radius)
    reader.fail("inner_radius", fmt::format("must be smaller than the radius {}, found {}", shape.radius, shape.inner_radius));
}

void read_sizes(const TableReader& reader, ShapeDef& shape) {
  switch (shape.kind) {
    case ShapeKind::box: {
      const std::vector<double> size = reader.numbers("size", 3, 3, positive.in("m"));
      shape.size = {size[0], size[1], size[2]};
      break;
    }
    case ShapeKind::plate: {
      const std::vector<double> size = reader.numbers("size", 2, 2, positive.in("m"));
      shape.size = {size[0], size[1], reader.number("thickness", positive.in("m"))};
      break;
    }
    case ShapeKind::link:
      shape.width = reader.number("width", 0.16 * shape.length, positive.in("m"));
      shape.thickness = reader.number("thickness", 0.4 * shape.width, positive.in("m"));
      shape.hole = reader.number("hole", 0.45 * shape.width, not_negative.in("m"));
      if (shape.hole >= shape.width)
        reader.fail("hole", fmt::format("must be smaller than the width {}, found {}", shape.width, shape.hole));
      break;
    case ShapeKind::spring:
      shape.radius = reader.number("radius", 0.15 * shape.length, positive.in("m"));
      shape.wire = reader.number("wire", 0.12 * shape.radius, positive.in("m"));
      shape.turns = reader.integer("turns", shape.turns, 1, 1000);
      if (shape.wire >= shape.radius)
        reader.fail("wire",
                    fmt::format("is the wire's radius and must be smaller than the coil's, {}, found {}", shape.radius, shape.wire));
      break;
    case ShapeKind::gear:
    case ShapeKind::disc:
      shape.radius = reader.number("radius", positive.in("m"));
      shape.length = reader.number("thickness", positive.in("m"));
      if (shape.kind == ShapeKind::gear) shape.teeth = reader.integer("teeth", 6, 1000);
      read_bore(reader, shape);
      break;
    case ShapeKind::cylinder:
    case ShapeKind::capsule:
    case ShapeKind::sphere:
      shape.radius = reader.number("radius", positive.in("m"));
      if (shape.kind == ShapeKind::cylinder) read_bore(reader, shape);
      break;
  }
}

}  // namespace

std::vector<ShapeDef> read_shapes(const TableReader& body, const std::map<std::string, Vec3>& frames) {
  std::vector<ShapeDef> shapes;
  const double density = body.has("density") ? body.number("density", positive.in("kg/m^3")) : 0.0;
  int number = 0;
  for (TableReader& reader : body.tables("shapes")) {
    reader.set_label(fmt::format("[[body]] {}: shape {}", quote(body.text("name")), ++number));
    ShapeDef shape;
    shape.kind = static_cast<ShapeKind>(reader.word("shape", shape_words));
    Words keys{"shape", "position", "rotation", "color", "density"};
    const Words own = shape_keys(shape.kind);
    keys.insert(keys.begin() + 1, own.begin(), own.end());
    reader.allow(keys);
    read_place(reader, frames, shape);
    read_sizes(reader, shape);
    shape.density = reader.number("density", density, not_negative.in("kg/m^3"));
    if (const TomlValue* color = reader.find("color")) shape.color = drawing_text(reader, "color", *color);
    shapes.push_back(shape);
  }
  if (body.has("shapes") && shapes.empty()) body.fail("shapes", "is empty; give at least one, or leave the key out");
  return shapes;
}

void read_mesh(const TableReader& body, const std::filesystem::path& folder, BodyDef& out) {
  const TomlValue* value = body.find("mesh");
  if (!value) return;
  if (value->type != TomlValue::Type::table) {
    out.mesh = read_file_path(body, "mesh", folder);
    return;
  }
  const TableReader mesh = *body.table("mesh");
  mesh.allow({"file", "unit", "scale", "position", "rotation"});
  out.mesh = read_file_path(mesh, "file", folder);
  MeshPlacement& place = out.mesh_placement;
  place.scale = mesh.number("scale", 1.0, positive);
  if (mesh.has("unit")) {
    const std::string text = mesh.text("unit");
    const std::optional<Unit> unit = parse_unit(text);
    if (!unit || unit->dimension != Dimension{.metre = 1})
      mesh.fail("unit", fmt::format("must be the file's unit of length, \"mm\" or \"in\" for example, found {}", quote(text)));
    place.scale *= unit->factor;
  }
  place.position = mesh.vector3("position", Vec3::Zero(), "m");
  place.axes = rotation_exp(read_rotation(mesh, "rotation"));
}

}  // namespace flexframe::sim
