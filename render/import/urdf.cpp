#include "render/import/urdf.h"

#include "render/film/shapes.h"
#include "render/import/mapping.h"
#include "render/picture/mesh.h"
#include "sim/base/spatial.h"
#include "sim/base/words.h"
#include "sim/scene/units.h"

#include <fmt/format.h>
#include <pugixml.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

namespace flexframe::imports {
namespace {

using sim::Pose;

struct Joint {
  std::string name, type, parent, child, mimic;
  Pose origin;
  sim::Vec3 axis = sim::Vec3::UnitX();
  double multiplier = 1.0, offset = 0.0;
  sim::VecX values;  // nt, rad or m
};

class Robot {
 public:
  Robot(const std::filesystem::path& path, const Table& table, double length_unit, double angle_unit)
      : path_(path), table_(table), length_unit_(length_unit), angle_unit_(angle_unit) {
    const pugi::xml_parse_result result = document_.load_file(path.c_str());
    if (!result) fail(fmt::format("is no whole XML file: {} at byte {}", result.description(), result.offset));
    robot_ = document_.child("robot");
    if (!robot_) fail("is no URDF file: its first element must be <robot>");
    for (const pugi::xml_node& material : robot_.children("material"))
      if (const auto color = material.child("color"))
        colors_[material.attribute("name").as_string()] = numbers(color, "rgba", 4, {0.7, 0.7, 0.7, 1.0});
  }

  sim::Results read() {
    for (const pugi::xml_node& link : robot_.children("link"))
      if (!links_.emplace(name_of(link), link).second) fail(fmt::format("link '{}' is there twice", name_of(link)));
      else order_.push_back(name_of(link));
    for (const pugi::xml_node& joint : robot_.children("joint")) read_joint(joint);
    sim::Results results;
    results.title = robot_.attribute("name").as_string(path_.stem().c_str());
    results.times = table_.times;
    move_joints(results);
    const std::string root = find_root();
    place(root, root_poses(root), results, 0);
    std::sort(results.bodies.begin(), results.bodies.end(), [&](const auto& a, const auto& b) { return rank(a.name) < rank(b.name); });
    for (sim::ResultBody& body : results.bodies) add_shapes(links_.at(body.name), body, results);
    std::erase_if(results.bodies, [&](const sim::ResultBody& body) { return body.surface.triangles.rows() == 0; });
    if (results.bodies.empty()) fail("no link has a visual shape that can be drawn");
    return results;
  }

 private:
  [[noreturn]] void fail(const std::string& message) const { throw InputError(fmt::format("{}: {}", path_.string(), message)); }
  std::string name_of(const pugi::xml_node& node) const {
    std::string name = node.attribute("name").as_string();
    if (name.empty() || name.find('/') != std::string::npos) fail(fmt::format("a <{}> has no name, or one with '/'", node.name()));
    return name;
  }
  long rank(const std::string& name) const { return std::find(order_.begin(), order_.end(), name) - order_.begin(); }

  // Numbers of an attribute, separated by blanks.
  std::vector<double> numbers(const pugi::xml_node& node, const char* attribute, size_t count, std::vector<double> otherwise) const {
    const pugi::xml_attribute found = node.attribute(attribute);
    if (!found) return otherwise;
    std::vector<double> out;
    const std::string text = found.as_string();
    for (const char *at = text.data(), *end = at + text.size(); at < end;) {
      if (*at == ' ' || *at == '\t' || *at == '\n' || *at == '+') {
        ++at;
        continue;
      }
      double value = 0.0;
      const auto [next, error] = std::from_chars(at, end, value);
      if (error != std::errc() || !std::isfinite(value)) break;
      out.push_back(value);
      at = next;
    }
    if (out.size() != count) fail(fmt::format("<{}> has {}=\"{}\"; {} numbers are needed", node.name(), attribute, text, count));
    return out;
  }
  sim::Vec3 vector(const pugi::xml_node& node, const char* attribute, const sim::Vec3& otherwise) const {
    const std::vector<double> v = numbers(node, attribute, 3, {otherwise.x(), otherwise.y(), otherwise.z()});
    return {v[0], v[1], v[2]};
  }
  // xyz and rpy: roll about x, then pitch about y, then yaw about z, axes that stay.
  Pose origin_of(const pugi::xml_node& node) const {
    const pugi::xml_node origin = node.child("origin");
    const sim::Vec3 rpy = vector(origin, "rpy", sim::Vec3::Zero());
    TurnWriting writing;
    writing.form = TurnForm::euler;
    writing.fixed_axes = true;
    return {to_quaternion(writing, {rpy.x(), rpy.y(), rpy.z()}, "").toRotationMatrix(), vector(origin, "xyz", sim::Vec3::Zero())};
  }

  void read_joint(const pugi::xml_node& node) {
    Joint joint;
    joint.name = name_of(node);
    joint.type = node.attribute("type").as_string();
    joint.parent = node.child("parent").attribute("link").as_string();
    joint.child = node.child("child").attribute("link").as_string();
    static const std::vector<std::string> types = {"revolute", "continuous", "prismatic", "fixed"};
    if (std::find(types.begin(), types.end(), joint.type) == types.end())
      fail(fmt::format("joint '{}' is of the type {}; allowed: {}", joint.name, sim::quote(joint.type), sim::list_words(types)));
    for (const std::string* link : {&joint.parent, &joint.child})
      if (!links_.count(*link)) fail(fmt::format("joint '{}' names the link {}, which does not exist", joint.name, sim::quote(*link)));
    joint.origin = origin_of(node);
    joint.axis = vector(node.child("axis"), "xyz", sim::Vec3::UnitX());
    if (!(joint.axis.norm() > 0.0)) fail(fmt::format("joint '{}' has an axis of length 0", joint.name));
    joint.axis.normalize();
    const pugi::xml_node mimic = node.child("mimic");
    joint.mimic = mimic.attribute("joint").as_string();
    joint.multiplier = numbers(mimic, "multiplier", 1, {1.0})[0];
    joint.offset = numbers(mimic, "offset", 1, {0.0})[0];
    for (const Joint& other : joints_)
      if (other.name == joint.name) fail(fmt::format("joint '{}' is there twice", joint.name));
    joints_.push_back(std::move(joint));
  }

  // The column of a joint in rad or m, zero where it has none.
  void move_joints(sim::Results& results) {
    std::vector<std::string> still;
    std::set<std::string> used;
    for (Joint& joint : joints_) {
      joint.values = sim::VecX::Zero(table_.times.size());
      if (joint.type == "fixed" || !joint.mimic.empty()) continue;
      const Column* column = table_.find(joint.name);
      if (!column) {
        still.push_back(joint.name);
        continue;
      }
      used.insert(column->name);
      const sim::Dimension wanted = joint.type == "prismatic" ? sim::Dimension{.metre = 1} : sim::Dimension{.radian = 1};
      double factor = joint.type == "prismatic" ? length_unit_ : angle_unit_;
      if (!column->unit.empty()) {
        const auto unit = sim::parse_unit(column->unit);
        if (!unit || !sim::fits(unit->dimension, wanted))
          throw InputError(fmt::format("{}: column {} has the unit {}; {} is needed", table_.file, sim::quote(column->name),
                                       sim::quote(column->unit), joint.type == "prismatic" ? "a length" : "an angle"));
        factor = unit->factor;
      }
      joint.values = factor * table_.series(*column);
    }
    if (used.empty() && !still.empty() && !table_.columns.empty())
      throw InputError(
          fmt::format("{}: no column is named after a joint of {}; joints: {}", table_.file, path_.string(), sim::list_words(still)));
    for (Joint& joint : joints_) {
      if (joint.mimic.empty()) continue;
      const auto lead = std::find_if(joints_.begin(), joints_.end(), [&](const Joint& j) { return j.name == joint.mimic; });
      if (lead == joints_.end() || !lead->mimic.empty())
        fail(fmt::format("joint '{}' mimics {}, which is no joint that moves itself", joint.name, sim::quote(joint.mimic)));
      joint.values = (joint.multiplier * lead->values.array() + joint.offset).matrix();
    }
    if (!still.empty()) results.statistics.notes.tell("", fmt::format("joints without a column stay at 0: {}", sim::list_words(still)));
    for (const Column& column : table_.columns)
      if (column.index >= 0 && sim::VecX(table_.values.col(column.index)).allFinite())
        results.outputs.push_back({column.name, column.unit, table_.series(column)});
  }

  std::string find_root() const {
    std::set<std::string> children;
    for (const Joint& joint : joints_)
      if (!children.insert(joint.child).second) fail(fmt::format("link '{}' hangs on two joints", joint.child));
    std::vector<std::string> roots;
    for (const std::string& link : order_)
      if (!children.count(link)) roots.push_back(link);
    if (roots.size() != 1) fail(fmt::format("has {} links without a parent ({}); one is needed", roots.size(), sim::list_words(roots)));
    return roots.front();
  }

  std::vector<Pose> root_poses(const std::string& root) const {
    std::vector<Pose> poses(table_.times.size());
    if (!table_.find(root + ".x")) return poses;
    const auto value = [&](const char* ending) {
      const Column* column = table_.find(root + ending);
      if (!column) throw InputError(fmt::format("{}: lacks the column {}{} of the first link's motion", table_.file, root, ending));
      return table_.series(*column);
    };
    const sim::VecX x = value(".x"), y = value(".y"), z = value(".z"), w = value(".qw"), a = value(".qx"), b = value(".qy"),
                    c = value(".qz");
    TurnWriting writing;
    writing.form = TurnForm::quaternion;
    for (size_t i = 0; i < poses.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      poses[i].p = length_unit_ * sim::Vec3(x[k], y[k], z[k]);
      poses[i].R =
          to_quaternion(writing, {w[k], a[k], b[k], c[k]}, fmt::format("{}: the orientation of {} ", table_.file, root)).toRotationMatrix();
    }
    return poses;
  }

  void place(const std::string& link, const std::vector<Pose>& poses, sim::Results& results, int depth) {
    if (depth > static_cast<int>(order_.size())) fail("its joints form a circle");
    sim::ResultBody body;
    body.name = link;
    body.kind = "rigid";
    body.position.resize(std::ssize(poses), 3);
    body.orientation.resize(std::ssize(poses), 4);
    for (size_t i = 0; i < poses.size(); ++i) {
      const sim::Quat q = sim::Quat(poses[i].R).normalized();
      body.position.row(static_cast<Eigen::Index>(i)) = poses[i].p.transpose();
      body.orientation.row(static_cast<Eigen::Index>(i)) << q.w(), q.x(), q.y(), q.z();
    }
    keep_hemisphere(body.orientation);
    results.bodies.push_back(std::move(body));
    for (const Joint& joint : joints_) {
      if (joint.parent != link) continue;
      std::vector<Pose> child(poses.size());
      for (size_t i = 0; i < poses.size(); ++i) {
        const double value = joint.values[static_cast<Eigen::Index>(i)];
        Pose motion;
        if (joint.type == "prismatic") motion.p = value * joint.axis;
        else if (joint.type != "fixed") motion.R = sim::rotation_exp(value * joint.axis);
        child[i] = sim::compose(sim::compose(poses[i], joint.origin), motion);
      }
      place(joint.child, child, results, depth + 1);
    }
  }

  // The file of package://PACKAGE/PATH or PATH, looked for beside the URDF file and in the folders above it.
  std::filesystem::path find_mesh(std::string name) const {
    const bool package = name.starts_with("package://");
    for (const char* start : {"package://", "file://"})
      if (name.starts_with(start)) name = name.substr(std::string_view(start).size());
    const std::string inside = package && name.find('/') != std::string::npos ? name.substr(name.find('/') + 1) : name;
    for (std::filesystem::path folder = std::filesystem::absolute(path_).parent_path();; folder = folder.parent_path()) {
      for (const std::string& way : {name, inside})
        if (std::filesystem::is_regular_file(folder / way)) return folder / way;
      if (folder == folder.parent_path()) return {};
    }
  }

  // Points and triangles of a visual's geometry in its own frame; colours of a mesh's materials.
  struct Geometry {
    film::Build build;
    std::vector<glm::vec3> colors;
  };
  Geometry geometry_of(const pugi::xml_node& node, const std::string& link, sim::Results& results) const {
    Geometry out;
    const pugi::xml_node box = node.child("box"), cylinder = node.child("cylinder"), sphere = node.child("sphere"),
                         mesh = node.child("mesh");
    const auto size = [&](const pugi::xml_node& of, const char* attribute) {
      const double value = numbers(of, attribute, 1, {0.0})[0];
      if (!(value > 0.0)) fail(fmt::format("link '{}': <{}> needs {} > 0", link, of.name(), attribute));
      return value;
    };
    if (box) {
      const sim::Vec3 edges = vector(box, "size", sim::Vec3::Zero());
      if (!(edges.minCoeff() > 0.0)) fail(fmt::format("link '{}': <box> needs a size > 0", link));
      out.build = film::box(glm::dvec3(0.0), 0.5 * glm::dvec3(edges.x(), edges.y(), edges.z()));
    } else if (cylinder) {
      const double half = 0.5 * size(cylinder, "length");
      out.build = film::cylinder({0.0, 0.0, -half}, {0.0, 0.0, half}, size(cylinder, "radius"));
    } else if (sphere) {
      out.build = film::capsule(glm::dvec3(0.0), size(sphere, "radius"), 0.0);
    } else if (mesh) {
      const std::string name = mesh.attribute("filename").as_string();
      const std::filesystem::path file = find_mesh(name);
      if (file.empty()) {
        results.statistics.notes.warn(
            "", fmt::format("link '{}': its mesh {} is not found beside {} or above: not drawn", link, name, path_.string()));
        return out;
      }
      const sim::Vec3 scale = vector(mesh, "scale", sim::Vec3::Ones());
      const render::Mesh read = render::read_mesh(file);
      for (const glm::dvec3& p : read.positions) out.build.positions.emplace_back(scale.x() * p.x, scale.y() * p.y, scale.z() * p.z);
      out.build.triangles = read.triangles;
      for (size_t k = 0; k < read.triangles.size(); ++k) out.colors.push_back(read.materials[read.triangle_material[k]].look.color);
      // A mirrored mesh turned its triangles inside out.
      if (scale.x() * scale.y() * scale.z() < 0.0)
        for (glm::ivec3& t : out.build.triangles) std::swap(t.y, t.z);
    } else {
      fail(fmt::format("link '{}': a visual has no box, cylinder, sphere or mesh", link));
    }
    return out;
  }

  void add_shapes(const pugi::xml_node& link, sim::ResultBody& body, sim::Results& results) const {
    std::vector<sim::Vec3> points;
    std::vector<Eigen::Vector3i> triangles;
    std::vector<sim::Vec3> colors;
    for (const pugi::xml_node& visual : link.children("visual")) {
      const Geometry geometry = geometry_of(visual.child("geometry"), body.name, results);
      const Pose pose = origin_of(visual);
      const pugi::xml_node material = visual.child("material");
      std::vector<double> color;
      if (const auto known = colors_.find(material.attribute("name").as_string()); known != colors_.end()) color = known->second;
      if (material.child("color")) color = numbers(material.child("color"), "rgba", 4, {});
      const auto first = static_cast<int>(points.size());
      for (const glm::dvec3& p : geometry.build.positions) points.emplace_back(pose.R * sim::Vec3(p.x, p.y, p.z) + pose.p);
      for (size_t k = 0; k < geometry.build.triangles.size(); ++k) {
        const glm::ivec3& t = geometry.build.triangles[k];
        triangles.emplace_back(first + t.x, first + t.y, first + t.z);
        sim::Vec3 c(0.7, 0.7, 0.72);
        if (!color.empty()) c = sim::Vec3(color[0], color[1], color[2]).cwiseMax(0.0).cwiseMin(1.0);
        else if (!geometry.colors.empty()) c = sim::Vec3(geometry.colors[k].r, geometry.colors[k].g, geometry.colors[k].b);
        colors.push_back(c);
      }
    }
    sim::ResultSurface& surface = body.surface;
    surface.points.resize(std::ssize(points), 3);
    surface.triangles.resize(std::ssize(triangles), 3);
    surface.colors.resize(std::ssize(colors), 3);
    for (size_t k = 0; k < points.size(); ++k) surface.points.row(static_cast<Eigen::Index>(k)) = points[k].transpose();
    for (size_t k = 0; k < triangles.size(); ++k) {
      surface.triangles.row(static_cast<Eigen::Index>(k)) = triangles[k].transpose();
      surface.colors.row(static_cast<Eigen::Index>(k)) = colors[k].transpose();
    }
  }

  std::filesystem::path path_;
  const Table& table_;
  double length_unit_, angle_unit_;
  pugi::xml_document document_;
  pugi::xml_node robot_;
  std::map<std::string, std::vector<double>> colors_;
  std::map<std::string, pugi::xml_node> links_;
  std::vector<std::string> order_;
  std::vector<Joint> joints_;
};

}  // namespace

sim::Results read_urdf(const std::filesystem::path& path, const Table& table, double length_unit, double angle_unit) {
  return Robot(path, table, length_unit, angle_unit).read();
}

}  // namespace flexframe::imports
