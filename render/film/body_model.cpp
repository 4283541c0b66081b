#include "render/film/body_model.h"

#include "interp/faces.h"
#include "interp/known.h"
#include "interp/scalars.h"
#include "render/film/known_shapes.h"
#include "render/film/rigid_mesh.h"
#include "render/film/shapes.h"
#include "render/picture/colormap.h"
#include "render/picture/edges.h"
#include "render/picture/shells.h"
#include "sim/base/error.h"
#include "sim/base/words.h"
#include "sim/bodies/beam_pieces.h"
#include "sim/scene/section.h"
#include "sim/scene/section_stress.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>

namespace flexframe::film {
namespace {

// "[0.8, 0.2, 0.1]" or "#cc3311".
std::optional<glm::vec3> parse_color(const std::string& text) {
  glm::vec3 color(0.0f);
  if (text.size() == 7 && text[0] == '#') {
    for (int i = 0; i < 3; ++i) {
      unsigned value = 0;
      const char* from = text.data() + 1 + 2 * static_cast<std::ptrdiff_t>(i);
      if (std::from_chars(from, from + 2, value, 16).ptr != from + 2) return std::nullopt;
      color[i] = static_cast<float>(value) / 255.0f;
    }
    return color;
  }
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') return std::nullopt;
  const char *at = text.data() + 1, *end = text.data() + text.size() - 1;
  for (int i = 0; i < 3; ++i) {
    while (at < end && (*at == ' ' || (i > 0 && *at == ','))) ++at;
    const auto [next, error] = std::from_chars(at, end, color[i]);
    if (error != std::errc() || !(color[i] >= 0.0f && color[i] <= 1.0f)) return std::nullopt;
    at = next;
  }
  return at == end ? std::optional(color) : std::nullopt;
}

interp::Nodes nodes_of(const sim::ResultBody& body) {
  interp::Nodes nodes;
  nodes.positions.resize(static_cast<Eigen::Index>(body.nodes.size()), 3);
  for (size_t k = 0; k < body.nodes.size(); ++k) {
    nodes.positions.row(static_cast<Eigen::Index>(k)) = body.nodes[k].origin.transpose();
    nodes.names.push_back(body.nodes[k].name);
  }
  nodes.rotations = nodes.finite = body.rotation.size() > 0;
  for (Eigen::Index k = 0; k < body.node_shear.rows(); ++k) {
    const auto shear = body.node_shear.row(k);
    interp::Mat3 in_body = interp::Mat3::Zero();
    in_body.bottomRightCorner<2, 2>() << shear[0], shear[1], shear[2], shear[3];
    nodes.shear.push_back(in_body);
  }
  return nodes;
}

// Stress modes of the nodes that have them, at the vertices.
interp::ModeColumns map_stress(const sim::ResultBody& body, const BodyModel& model) {
  interp::Points nodes(static_cast<Eigen::Index>(body.stress_nodes.size()), 3);
  for (size_t k = 0; k < body.stress_nodes.size(); ++k)
    nodes.row(static_cast<Eigen::Index>(k)) = body.nodes[body.stress_nodes[k]].origin.transpose();
  return interp::ModeColumns(interp::map_scalars(nodes, model.view(), 6, body.node_stress));
}

// Whether the node displacements are node_phi q, seen from the body frame (no second-order part), judged on up to 16 samples over the whole
// run.
bool linear_in_modes(const sim::ResultBody& body) {
  if (body.node_phi.size() == 0 || body.q.cols() != body.node_phi.cols()) return false;
  const Eigen::Index nt = body.q.rows(), step = std::max<Eigen::Index>(1, nt / 16);
  double largest = 0.0, difference = 0.0;
  for (Eigen::Index i = 0; i < nt; i += step) {
    const sim::VecX u = body.displacement.row(i).transpose();
    largest = std::max(largest, u.cwiseAbs().maxCoeff());
    sim::VecX linear = body.node_phi * body.q.row(i).transpose();
    if (body.held_position.rows() > 0) {
      const sim::Pose held = held_pose(body, {i, 0.0});
      for (size_t k = 0; k < body.nodes.size(); ++k) {
        auto at = linear.segment<3>(3 * static_cast<Eigen::Index>(k));
        at = (held.R * (body.nodes[k].origin + at) + held.p - body.nodes[k].origin).eval();
      }
    }
    difference = std::max(difference, (linear - u).cwiseAbs().maxCoeff());
  }
  // Mode columns are kept in single precision; a difference below that is none.
  return difference <= 1e-6 * largest;
}

// What the nodes do, for the choice of the map: their modes, or some samples of the run.
interp::NodeMotions motions_of(const sim::ResultBody& body) {
  constexpr Eigen::Index some = 8;
  interp::NodeMotions known;
  if (body.node_phi.size() > 0 && (body.rotation.size() == 0 || body.node_psi.size() > 0)) {
    known.displacement = body.node_phi;
    if (body.rotation.size() > 0) known.rotation = body.node_psi;
    return known;
  }
  known.linear = false;
  const Eigen::Index nt = body.displacement.rows(), count = std::min(nt, some);
  known.displacement.resize(body.displacement.cols(), count);
  if (body.rotation.size() > 0) known.rotation.resize(body.rotation.cols(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index row = count > 1 ? k * (nt - 1) / (count - 1) : 0;
    known.displacement.col(k) = body.displacement.row(row).transpose();
    if (body.rotation.size() > 0) known.rotation.col(k) = body.rotation.row(row).transpose();
  }
  return known;
}

// The file's mesh where the scene puts it. What no face uses is not seen, and must not count for colours, cameras and extremes.
render::Mesh placed_mesh(const std::string& file, const sim::MeshPlacement& place) {
  render::Mesh mesh = render::read_mesh(file);
  render::drop_unused_positions(mesh);
  const auto moved = [&](const glm::dvec3& p) {
    const sim::Vec3 q = place.axes * (place.scale * sim::Vec3(p.x, p.y, p.z)) + place.position;
    return glm::dvec3(q.x(), q.y(), q.z());
  };
  if (place.scale != 1.0 || place.position != sim::Vec3::Zero() || place.axes != sim::Mat3::Identity())
    for (glm::dvec3& p : mesh.positions) p = moved(p);
  return mesh;
}

// Half heights of a section along y and z, m.
Eigen::Vector2d half_sizes(const sim::Section& section) {
  if (section.outline.empty()) return Eigen::Vector2d::Constant(std::sqrt(section.area / M_PI));
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : section.outline.front()) box.extend(p);
  return 0.5 * box.sizes();
}

// A straight beam of one section made one of changing sections (each stretched to the sizes there) and curved axis.
void shape_beam(const sim::BeamDef& beam, bool sections, render::Mesh& mesh) {
  if (beam.stations.empty() && !beam.axis) return;
  const Eigen::Vector2d first = half_sizes(beam.section);
  std::map<double, std::pair<Eigen::Vector2d, sim::Pose>> places;
  for (glm::dvec3& p : mesh.positions) {
    const double s = std::clamp(p.x / beam.length, 0.0, 1.0);
    const auto [at, fresh] = places.try_emplace(s);
    if (fresh) {
      at->second.first = sections ? Eigen::Vector2d(half_sizes(sim::section_at(beam, s)).cwiseQuotient(first)) : Eigen::Vector2d::Ones();
      const int piece = sim::locate_piece(beam, s).first;
      at->second.second.R = sim::piece_pose(beam, piece).R * sim::tangent_in_piece(beam, piece, s);
      at->second.second.p = sim::place_on_axis(beam, s);
    }
    const auto& [stretch, pose] = at->second;
    const sim::Vec3 moved = pose.p + pose.R * sim::Vec3(0.0, stretch.x() * p.y, stretch.y() * p.z);
    p = {moved.x(), moved.y(), moved.z()};
  }
}

// More nodes than these are drawn as points: joining them takes a time that goes with the square.
constexpr size_t most_joined_nodes = 3000;

// The surface that came with the results; triangles of one colour are one material.
render::Mesh surface_mesh(const sim::ResultBody& body) {
  const sim::ResultSurface& surface = body.surface;
  std::vector<glm::dvec3> points;
  std::vector<glm::ivec3> triangles;
  for (const auto& p : surface.points.rowwise()) points.emplace_back(p.x(), p.y(), p.z());
  for (const auto& t : surface.triangles.rowwise()) triangles.emplace_back(t.x(), t.y(), t.z());
  render::Mesh mesh = render::make_mesh(std::move(points), std::move(triangles), body.name);
  std::map<std::array<double, 3>, int> materials;
  for (Eigen::Index k = 0; k < surface.colors.rows(); ++k) {
    const auto c = surface.colors.row(k);
    const auto [at, fresh] = materials.try_emplace({c[0], c[1], c[2]}, static_cast<int>(materials.size()));
    if (fresh && at->second > 0) mesh.materials.emplace_back();
    if (fresh) mesh.materials.back().look.color = {c[0], c[1], c[2]};
    mesh.triangle_material[k] = at->second;
  }
  if (mesh.materials.size() > 1) render::compute_shading_points(mesh, {}, render::MeshOptions{}.crease_angle);
  return mesh;
}

// The finite elements' own surface.
render::Mesh element_mesh(const sim::BodySurface& surface, const std::string& name) {
  std::vector<glm::dvec3> points;
  std::vector<glm::ivec3> triangles;
  for (const auto& p : surface.points.rowwise()) points.emplace_back(p.x(), p.y(), p.z());
  const Eigen::MatrixX3i corners = sim::surface_triangles(surface);
  for (const auto& t : corners.rowwise()) triangles.emplace_back(t.x(), t.y(), t.z());
  return render::make_mesh(std::move(points), std::move(triangles), name);
}

render::Mesh mesh_of(const sim::ResultBody& body, const BodyDrawing& drawing, const BodyLook& look, bool stress, int index,
                     const std::optional<sim::BodySurface>& known) {
  const sim::BodyDef* def = drawing.def;
  if (!body.mesh.empty()) return placed_mesh(body.mesh, def ? def->mesh_placement : sim::MeshPlacement{});
  if (body.surface.triangles.rows() > 0) return surface_mesh(body);
  if (known) return element_mesh(*known, body.name);
  if (def && !def->shapes.empty()) return make_shapes_mesh(def->shapes, look.shape_colors, body.name);
  if (body.kind == "beam" && body.length > 0.0) {
    const auto* beam = def ? std::get_if<sim::BeamDef>(&def->kind) : nullptr;
    std::vector<double> stations;
    for (const sim::ResultNode& node : body.nodes) stations.push_back(beam && beam->axis ? 0.0 : node.origin.x());
    render::Mesh mesh = make_beam_mesh(look.diameter ? sim::make_section("circle", {{"diameter", *look.diameter}}) : body.section,
                                       body.length, stations, body.name, stress);
    if (beam) shape_beam(*beam, !look.diameter, mesh);
    return mesh;
  }
  // A modal body shows its nodes, joined; any other gets a solid of plausible measures.
  if (!body.nodes.empty()) {
    std::vector<glm::dvec3> points;
    for (const sim::ResultNode& node : body.nodes) points.emplace_back(node.origin.x(), node.origin.y(), node.origin.z());
    const bool apart = std::any_of(points.begin(), points.end(), [&](const glm::dvec3& p) { return p != points.front(); });
    if (!apart || points.size() > most_joined_nodes) return {};
    return make_lattice_mesh(points, 0.004 * drawing.size, body.name);
  }
  const auto* rigid = def ? std::get_if<sim::RigidDef>(&def->kind) : nullptr;
  return make_rigid_mesh(rigid ? *rigid : sim::RigidDef{}, drawing.places, drawing.size, index, body.name);
}

// The point of the outline in the direction of (y, z) from the centroid; where that ray meets none (the centroid lies outside), the point
// furthest that way.
Eigen::Vector2d on_outline(const sim::Section& section, double y, double z) {
  const Eigen::Vector2d d = Eigen::Vector2d(y, z).normalized();
  if (!(d.squaredNorm() > 0.5)) return {0.0, 0.0};
  double reach = -1.0;
  Eigen::Vector2d furthest = Eigen::Vector2d::Zero();
  const std::vector<Eigen::Vector2d>& loop = section.outline.front();
  for (size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d &a = loop[i], side = loop[(i + 1) % loop.size()] - a;
    if (a.dot(d) > furthest.dot(d)) furthest = a;
    const double across = d.x() * side.y() - d.y() * side.x();
    if (across == 0.0) continue;
    const double along = (a.x() * side.y() - a.y() * side.x()) / across, share = (a.x() * d.y() - a.y() * d.x()) / across;
    if (share >= 0.0 && share <= 1.0) reach = std::max(reach, along);
  }
  return reach > 0.0 ? Eigen::Vector2d(reach * d) : furthest;
}

// Where the vertices of a beam lie in its sections and between its stations.
BeamStress make_beam_stress(const sim::ResultBody& body, const sim::BeamDef& beam, bool bar, const std::vector<float>& rest) {
  BeamStress stress;
  stress.youngs_modulus = beam.material.youngs_modulus;
  stress.shear_modulus = 0.5 * beam.material.youngs_modulus / (1.0 + beam.material.poisson);
  const sim::VecX& x = body.strain_stations;
  std::map<std::pair<double, double>, sim::SectionPoint> points;  // the rings of a swept beam repeat theirs
  for (size_t i = 0; i + 2 < rest.size(); i += 3) {
    BeamStress::Vertex v;
    Eigen::Vector2d p(static_cast<double>(rest[i + 1]), static_cast<double>(rest[i + 2]));
    if (bar) p = on_outline(body.section, p.x(), p.y());
    const auto [known, fresh] = points.try_emplace({p.x(), p.y()});
    if (fresh) known->second = sim::section_point(body.section, p.x(), p.y(), beam.material.poisson);
    v.at = known->second;
    // Single precision of the mesh: a vertex as near as that to a station stands on it.
    const double at = std::clamp(static_cast<double>(rest[i]), x[0], x[x.size() - 1]), near = 1e-6 * body.length;
    const double* const above = std::upper_bound(x.data(), x.data() + x.size(), at + near);
    const auto next = static_cast<int>(std::min<std::ptrdiff_t>(above - x.data(), x.size() - 1));
    v.station = std::max(0, next - 1);
    const double width = x[next] - x[v.station];
    v.share = width > 0.0 ? std::clamp((at - x[v.station]) / width, 0.0, 1.0) : 0.0;
    if (v.station > 0 && at - x[v.station] <= near && x[v.station] - x[v.station - 1] <= near) v.other = v.station - 1;
    stress.vertices.push_back(v);
  }
  return stress;
}

// The beam that has a strain at every point of its sections, or null.
const sim::BeamDef* strained_beam(const sim::ResultBody& body, const sim::BodyDef* def) {
  const auto* beam = def ? std::get_if<sim::BeamDef>(&def->kind) : nullptr;
  const bool known = beam && beam->stations.empty() && !beam->axis && sim::has_stress(body.section) && body.strain_stations.size() > 1;
  return known ? beam : nullptr;
}

// sqrt(e^2 + 3/4 g^2) of lengthening e and shear g: what the principal strains of a surface are together (interp::compute_strain). As
// von Mises' of the normal part e and the shear part g/2, where what transverse forces shear is E/G = 2 (1 + nu) times what they bend.
BeamStress make_beam_strain(const sim::ResultBody& body, const sim::BeamDef& beam, bool bar, const std::vector<float>& rest) {
  BeamStress strain = make_beam_stress(body, beam, bar, rest);
  strain.youngs_modulus = 1.0;
  strain.shear_modulus = 0.5;
  for (BeamStress::Vertex& v : strain.vertices) v.at.force *= 1.0 + beam.material.poisson;
  return strain;
}

// Rings of a swept beam that is thinner than a 150th of the machine, a few pixels of a usual picture; else none.
std::vector<std::vector<int>> spine_of(const render::Mesh& mesh, double size) {
  double across = 0.0;
  for (const glm::dvec3& p : mesh.positions) across = std::max({across, std::abs(p.y), std::abs(p.z)});
  std::vector<std::vector<int>> rings;
  if (across > size / 300.0) return rings;
  std::map<double, std::vector<int>> by_station;
  for (size_t i = 0; i < mesh.positions.size(); ++i) by_station[mesh.positions[i].x].push_back(static_cast<int>(i));
  for (auto& [x, ring] : by_station) rings.push_back(std::move(ring));
  return rings;
}

constexpr double crease_angle = 46.0;  // degrees; bevels of 45 have a light edge and need no dark one

// The flagged edges once each; none of a mesh that is all creases, such as a scan or a foam.
std::vector<BodyModel::Crease> crease_lines(const std::vector<std::uint8_t>& flags, const render::Mesh& mesh) {
  std::map<std::pair<int, int>, BodyModel::Crease> lines;
  for (size_t t = 0; t < flags.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      if (!(flags[t] >> k & 1)) continue;
      const int a = mesh.triangle_points[t][k], b = mesh.triangle_points[t][(k + 1) % 3];
      const auto [line, fresh] = lines.try_emplace(std::minmax({mesh.point_position[a], mesh.point_position[b]}),
                                                   BodyModel::Crease{a, b, static_cast<int>(t), -1});
      if (!fresh) line->second.other = static_cast<int>(t);
    }
  std::vector<BodyModel::Crease> out;
  if (flags.size() > 5000 && lines.size() > flags.size() / 4) return out;
  for (const auto& [ends, line] : lines) out.push_back(line);
  return out;
}

// Or the warning that says why there is none.
void set_beam_stress(const sim::ResultBody& body, const sim::BodyDef* def, const BodyLook& look, BodyModel& model) {
  const auto warn = [&](const std::string& text) { model.refused.push_back(text); };
  const auto* beam = def ? std::get_if<sim::BeamDef>(&def->kind) : nullptr;
  if (!beam) return warn("the results do not contain the scene, so that its material is unknown: not coloured by stress");
  if (!beam->stations.empty() || beam->axis)
    return warn("a beam of changing section or curved axis is not coloured by stress; take the output 'stress' at a place of it");
  if (!sim::has_stress(body.section))
    return warn(
        fmt::format("a section of shape '{}' has moments but no outline, so that no point of it has a stress: not coloured by stress",
                    body.section.shape));
  if (body.strain_stations.size() < 2)
    return warn(
        "the results hold no strains of its sections (made by an older version or another program): not coloured by stress; simulate "
        "again");
  model.beam_stress = make_beam_stress(body, *beam, look.diameter.has_value(), model.rest);
  if (body.load_strain.size() > 0) return;
  for (const std::string& effect : body.unstrained)
    warn(
        fmt::format("effect '{}' is off and the run was not made for pictures of stress: its colours do not include stress from {}; "
                    "simulate again with [render] color_by = \"stress\", or add \"{}\" to 'effects'",
                    effect, effect == "axial" ? "forces along it" : "torques about it", effect));
}

}  // namespace

BodyLook read_body_look(const sim::BodyDef& body, const std::string& file) {
  BodyLook look;
  for (size_t i = 0; i < body.shapes.size(); ++i) {
    const std::string& text = body.shapes[i].color;
    look.shape_colors.push_back(text.empty() ? std::nullopt : parse_color(text));
    if (!text.empty() && !look.shape_colors.back())
      throw sim::InputError(
          fmt::format("{}:{}: [[body]] '{}': shape {}: key 'color' must be [r, g, b] with numbers from 0 to 1 or \"#rrggbb\", found {}",
                      file, body.line, body.name, i + 1, sim::quote(text)));
  }
  const std::vector<std::string> words = {"color", "opacity",  "visible",   "ghost",       "ghost_color",
                                          "edges", "diameter", "thickness", "yield_stress"};
  for (const auto& [word, text] : body.drawing) {
    const auto refuse = [&](const std::string& message) {
      throw sim::InputError(fmt::format("{}:{}: [[body]] '{}': {}", file, body.line, body.name, message));
    };
    const auto color = [&](const std::string& key, const std::string& value) {
      const std::optional<glm::vec3> parsed = parse_color(value);
      if (!parsed) refuse(fmt::format("'{}' must be [r, g, b] with numbers from 0 to 1 or \"#rrggbb\", found {}", key, sim::quote(value)));
      return parsed;
    };
    const auto choice = [&](const std::string& key, const std::string& value, const std::vector<std::string>& known) {
      const auto found = std::find(known.begin(), known.end(), value);
      if (found == known.end())
        refuse(fmt::format("'drawing.{}' is {}{}; allowed: {}", key, sim::quote(value), sim::did_you_mean(value, known),
                           sim::list_words(known)));
      return found - known.begin();
    };
    if (word == "shown") continue;  // from where the deformation is seen: in the results
    if (word == "color") {
      look.color = color(word, text);
    } else if (word == "ghost_color") {
      look.ghost_color = color("drawing.ghost_color", text);
    } else if (word == "ghost") {
      look.ghost = static_cast<GhostStyle>(choice(word, text, {"body", "mesh", "none"}));
    } else if (word == "edges") {
      look.edges = static_cast<EdgeLines>(choice(word, text, {"false", "true", "creases"}));
    } else if (word == "diameter") {
      double diameter = 0.0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), diameter);
      if (error != std::errc() || end != text.data() + text.size() || !(diameter > 0.0 && diameter < 1e9))
        refuse(fmt::format("'drawing.diameter' must be a length > 0 in m, found {}", sim::quote(text)));
      if (!std::holds_alternative<sim::BeamDef>(body.kind) || body.mesh) refuse("'drawing.diameter' is for beams without a mesh");
      look.diameter = diameter;
    } else if (word == "thickness") {
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), look.thickness);
      if (error != std::errc() || end != text.data() + text.size() || !(look.thickness > 0.0 && look.thickness < 1e9))
        refuse(fmt::format("'drawing.thickness' must be a length > 0 in m, found {}", sim::quote(text)));
    } else if (word == "yield_stress") {
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), look.yield_stress);
      if (error != std::errc() || end != text.data() + text.size() || !(look.yield_stress > 0.0 && look.yield_stress < 1e15))
        refuse(fmt::format("'drawing.yield_stress' must be a stress > 0 in Pa, found {}", sim::quote(text)));
    } else if (word == "opacity") {
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), look.opacity);
      if (error != std::errc() || end != text.data() + text.size() || !(look.opacity > 0.0f && look.opacity <= 1.0f))
        refuse(fmt::format("'drawing.opacity' must be a number > 0, at most 1, found {}", sim::quote(text)));
    } else if (word == "visible") {
      if (text != "true" && text != "false") refuse(fmt::format("'drawing.visible' must be true or false, found {}", sim::quote(text)));
      look.visible = text == "true";
    } else {
      refuse(fmt::format("key 'drawing.{}' is unknown{}; allowed: {}", word, sim::did_you_mean(word, words), sim::list_words(words)));
    }
  }
  return look;
}

bool knows_stress(const sim::ResultBody& body) {
  return body.node_stress.size() > 0 || body.node_von_mises.size() > 0 || body.strain_stations.size() > 1;
}

interp::MeshView BodyModel::view() const {
  return {Eigen::Map<const interp::Points>(mesh.positions.empty() ? nullptr : &mesh.positions[0].x,
                                           static_cast<Eigen::Index>(mesh.positions.size()), 3),
          Eigen::Map<const interp::Triangles>(mesh.triangles.empty() ? nullptr : &mesh.triangles[0].x,
                                              static_cast<Eigen::Index>(mesh.triangles.size()), 3)};
}

namespace {

// The one material that all triangles of a mesh file have, not the reader's own that none has; the first where they have several.
const render::MeshMaterial& chief_material(const render::Mesh& mesh) {
  const std::vector<int>& of = mesh.triangle_material;
  const bool one = !of.empty() && std::all_of(of.begin(), of.end(), [&](int m) { return m == of.front(); });
  return mesh.materials[one ? static_cast<size_t>(of.front()) : 0];
}

// Of the materials that triangles have: the largest opacity, and whether there are others.
std::pair<float, bool> opacity_of(const render::Mesh& mesh) {
  float least = 1.0f, largest = 0.0f;
  for (const int m : mesh.triangle_material) {
    least = std::min(least, mesh.materials[static_cast<size_t>(m)].opacity);
    largest = std::max(largest, mesh.materials[static_cast<size_t>(m)].opacity);
  }
  return mesh.triangle_material.empty() ? std::pair(1.0f, false) : std::pair(largest, least < largest);
}

// Drawn places are single precision in the body's frame. A thousandth of the mesh is a pixel of a picture that it fills.
std::string coarse_steps(const render::Mesh& mesh) {
  const render::Bounds box = render::compute_bounds(mesh);
  const double far = std::max(glm::length(box.lower), glm::length(box.upper)), size = glm::length(box.upper - box.lower);
  const double step = render::single_precision * far;
  if (!(step > 1e-3 * size)) return {};
  return fmt::format(
      "its mesh, {:.3g} m large, lies {:.3g} m from the origin of the body's frame and is drawn in steps of {:.2g} m: let the "
      "frame lie near it, as mesh = {{ file, position }} does",
      size, far, step);
}

// Colour and finish: the scene's, the category's, the file's, or by kind.
void set_material(const sim::ResultBody& body, const BodyLook& look, const RenderSettings& settings, int index, BodyModel& model) {
  const render::Mesh& mesh = model.mesh;
  const bool from_file = !body.mesh.empty() && !mesh.materials.empty();
  model.material = mesh.materials.empty() ? render::Material{} : from_file ? chief_material(mesh).look : mesh.materials.front().look;
  model.opacity = look.opacity * (from_file ? opacity_of(mesh).first : 1.0f);
  if (settings.color_by == ColorBy::body) model.material.color = render::category_color(index);
  else if (body.kind == "rigid" && body.mesh.empty())
    model.material = {.color = {0.42f, 0.46f, 0.52f}, .roughness = 0.4f, .metallic = 0.2f};
  // Steel, where nothing says what it is of.
  const bool unknown = body.mesh.empty() || (mesh.materials.size() == 1 && mesh.materials.front().name == "DefaultMaterial");
  if (settings.studio && unknown && settings.color_by != ColorBy::body) {
    model.material.metallic = 0.65f;
    model.material.roughness = 0.36f;
    if (!body.mesh.empty() || body.kind != "rigid") model.material.color = {0.60f, 0.63f, 0.67f};
  }
  if (body.surface.colors.rows() > 0 && settings.color_by != ColorBy::body) model.material.color = mesh.materials.front().look.color;
  if (body.color.size() == 3 && settings.color_by != ColorBy::body) model.material.color = {body.color[0], body.color[1], body.color[2]};
  if (look.color) model.material.color = *look.color;
}

// Columns per elastic coordinate, then of inertia and weight where they count.
sim::MatX stress_columns(const sim::MatX& stress, const sim::MatX& load_stress, bool loads) {
  sim::MatX field(stress.rows(), stress.cols() + (loads ? 12 : 0));
  field.leftCols(stress.cols()) = stress;
  if (loads && load_stress.size() > 0) field.rightCols(12) = load_stress;
  else if (loads) field.rightCols(12).setZero();
  return field;
}

// Stress of the vertices: the first that each point of the surface has, then fields in which those points that have another one show it.
void map_surface_stress(const sim::BodySurface& known, const std::vector<interp::FaceFoot>& feet, BodyModel& model) {
  const sim::MatX first = stress_columns(known.stress, known.load_stress, model.stress_of_loads),
                  others = stress_columns(known.other_stress, known.other_load_stress, model.stress_of_loads);
  model.stress = interp::map_field(feet, 6, first);
  // The n-th other stress of every point that has as many.
  std::vector<int> turn(known.other_points.size(), 0);
  int most = 0;
  for (size_t k = 0; k < turn.size(); ++k) {
    if (k > 0 && known.other_points[k] == known.other_points[k - 1]) turn[k] = turn[k - 1] + 1;
    most = std::max(most, turn[k] + 1);
  }
  for (int n = 0; n < most; ++n) {
    sim::MatX field = first;
    std::vector<bool> has(static_cast<size_t>(known.points.rows()), false);
    for (size_t k = 0; k < turn.size(); ++k) {
      if (turn[k] != n) continue;
      has[static_cast<size_t>(known.other_points[k])] = true;
      field.middleRows(6 * Eigen::Index{known.other_points[k]}, 6) = others.middleRows(6 * static_cast<Eigen::Index>(k), 6);
    }
    BodyModel::OtherStress& other = model.other_stress.emplace_back();
    std::vector<interp::FaceFoot> own;
    for (size_t v = 0; v < feet.size(); ++v) {
      bool moved = false;
      for (size_t k = 0; k < static_cast<size_t>(feet[v].count); ++k)
        moved = moved || (has[static_cast<size_t>(feet[v].point[k])] && feet[v].value[k] != 0.0);
      if (!moved) continue;
      other.vertices.push_back(static_cast<int>(v));
      own.push_back(feet[v]);
    }
    other.stress = interp::map_field(own, 6, field);
  }
}

// By the shapes that the body's file knows. False: its mesh is something else.
bool map_shapes(const sim::ResultBody& body, const sim::BodySurface& known, const RenderSettings& settings, BodyModel& model) {
  const interp::FaceMesh faces = face_mesh(known);
  std::string why, note;
  const auto feet = feet_on_surface(faces, model.view(), why, note);
  if (!why.empty()) model.warnings.push_back(why);
  if (!feet) return false;
  if (!note.empty()) model.warnings.push_back(note);
  model.modes = interp::map_displacement(faces, *feet, known.phi);
  if (settings.color_by == ColorBy::map_error) model.doubt = interp::map_doubt(faces, *feet, known.phi);
  if (settings.color_by == ColorBy::strain || settings.color_by == ColorBy::stress) model.welded = interp::weld_rows(model.view());
  if (settings.color_by == ColorBy::stress) {
    if (known.stress.size() > 0) {
      model.stress_of_loads = settings.inertia && known.load_stress.size() > 0;
      map_surface_stress(known, *feet, model);
      if (settings.inertia && known.load_stress.size() == 0)
        model.warnings.push_back(
            "its file was made by an older version: stress of inertia and weight that its modes leave out is not in the colours; reduce it "
            "again");
      if (render::Mesh surface = element_mesh(known, body.name);
          known.other_points.empty() && !render::turn_shells_outwards(surface).closed)
        model.warnings.push_back(
            "its elements are shells: their stress is that of the face to which their normals point; reduce it again for the larger of "
            "both");
    } else
      model.warnings.push_back(
          "no stress modes are known (flexframe reduce --stress): not coloured by stress; color_by = \"strain\" needs none");
  }
  if (!linear_in_modes(body)) {
    // What is left beyond the modes has no rotations of its own.
    interp::Nodes nodes = nodes_of(body);
    nodes.rotations = false;
    try {
      model.map = interp::make_map(nodes, model.view());
    } catch (const interp::MapError&) {
      model.warnings.emplace_back("its nodes are too few to carry displacements of second order to the mesh: left out of the pictures");
    }
  }
  return true;
}

// What carries the motion of the nodes to the mesh, and what colours by strain or stress need.
void map_nodes(const sim::ResultBody& body, const BodyDrawing& drawing, const BodyLook& look, const RenderSettings& settings,
               const std::optional<sim::BodySurface>& known, BodyModel& model) {
  if (!model.vertex_nodes.empty()) {
    if (settings.color_by == ColorBy::stress && body.node_von_mises.size() == 0)
      model.warnings.push_back("its results hold no stress: not coloured by stress; color_by = \"strain\" needs none");
    else if (settings.color_by == ColorBy::stress && settings.stress != StressMeasure::von_mises)
      model.warnings.push_back(fmt::format("its results hold von Mises stress only: not coloured by stress = \"{}\"",
                                           stress_words()[static_cast<size_t>(settings.stress)]));
    if (settings.color_by == ColorBy::strain) model.welded = interp::weld_rows(model.view());
    return;
  }
  interp::Options options;
  options.scheme = settings.scheme;
  options.thickness = look.thickness;
  const interp::Nodes nodes = nodes_of(body);
  std::vector<std::string> map_warnings;
  if (settings.color_by == ColorBy::strain && body.kind == "modal" && settings.inertia)
    model.warnings.push_back(
        "strain is that of its modes and of the mesh's flat triangles: without what the modes leave out of inertia and weight, rough at "
        "edges; stress (flexframe reduce --stress -o BODY.h5) has neither fault");
  try {
    if (known && map_shapes(body, *known, settings, model)) return;
    // Error bars need the map itself, not only what it makes of the modes.
    if (linear_in_modes(body) && settings.color_by != ColorBy::map_error) {
      interp::CachedModes mapped = interp::cached_modes(nodes, model.view(), options, body.node_phi, body.node_psi, settings.cache);
      model.modes = std::move(mapped.columns);
      model.mode_doubt = std::move(mapped.doubt);
      model.from_cache = mapped.from_cache;
      map_warnings = std::move(mapped.report.warnings);
    } else {
      model.map = interp::make_map_for(nodes, model.view(), options, motions_of(body));
      map_warnings = model.map->report.warnings;
      if (settings.color_by == ColorBy::strain && body.node_phi.size() > 0 && body.node_phi.cols() == body.q.cols())
        model.strain_modes = interp::cached_modes(nodes, model.view(), options, body.node_phi, body.node_psi, settings.cache).columns;
      if (settings.color_by == ColorBy::map_error) {
        model.error_bar.emplace(*model.map, model.view());
        if (!model.error_bar->known())
          map_warnings.emplace_back("its nodes are too few to tell the error of the map: not coloured by map_error");
      }
    }
  } catch (const interp::InputError& e) {
    throw interp::InputError(fmt::format("body '{}': {}", body.name, e.what()));
  } catch (const interp::MapError& e) {
    throw interp::MapError(fmt::format("body '{}': {}", body.name, e.what()));
  }
  for (std::string& warning : map_warnings) model.warnings.push_back(std::move(warning));
  if (settings.color_by == ColorBy::strain || settings.color_by == ColorBy::stress)
    model.welded = model.map ? model.map->welded : interp::weld_rows(model.view(), options);
  if (settings.color_by == ColorBy::strain && body.kind == "beam") {
    const sim::BeamDef* beam = strained_beam(body, drawing.def);
    if (beam) model.beam_strain = make_beam_strain(body, *beam, look.diameter.has_value(), model.rest);
    else
      model.refused.emplace_back(
          "its section's strains are not known (changing section, curved axis, shape 'general', or results without their scene): its "
          "colours by strain are those of the drawn mesh, rough at its edges and ends, and wrong where it twists");
  }
  if (settings.color_by == ColorBy::stress) {
    if (body.node_stress.size() > 0) {
      model.stress = map_stress(body, model);
      if (settings.inertia)
        model.warnings.push_back(fmt::format(
            "stress is known at {} nodes and interpolated between them, which blunts peaks, and what its modes leave out of inertia and "
            "weight is not in it: a body file with its elements' shapes has both (flexframe reduce --stress -o BODY.h5)",
            body.stress_nodes.size()));
    } else if (body.kind == "beam") set_beam_stress(body, drawing.def, look, model);
    else if (body.kind == "modal")
      model.warnings.push_back(
          "no stress modes are known (flexframe reduce --stress): not coloured by stress; color_by = \"strain\" needs none");
  }
}

}  // namespace

BodyModel make_body_model(const sim::ResultBody& body, const BodyDrawing& drawing, const RenderSettings& settings, int index) {
  const sim::BodyDef* def = drawing.def;
  const double size = drawing.size;
  BodyModel model;
  model.name = body.name;
  const BodyLook look = def ? read_body_look(*def, "scene") : BodyLook{};
  model.visible = look.visible;
  model.ghost = look.ghost;
  model.ghost_color = look.ghost_color;
  model.gravity = drawing.gravity;
  model.yield_stress = look.yield_stress > 0.0 ? look.yield_stress : settings.yield_stress;
  model.edges = look.edges.value_or(settings.edges);
  std::string why;
  const std::optional<sim::BodySurface> known =
      settings.scheme == interp::Scheme::automatic ? known_surface(body, def, why) : std::optional<sim::BodySurface>();
  const bool by_section = settings.color_by == ColorBy::stress ? body.strain_stations.size() > 0
                                                               : settings.color_by == ColorBy::strain && strained_beam(body, def);
  model.mesh = mesh_of(body, drawing, look, by_section, index, known);
  const render::Mesh& mesh = model.mesh;
  model.warnings = mesh.warnings;
  model.refused = mesh.faults;
  if (!why.empty()) model.refused.push_back(why);
  if (body.mesh.empty()) model.vertex_nodes = body.surface.nodes;

  const bool colored_file = !body.mesh.empty() || body.surface.colors.rows() > 0;
  const bool own_colors = colored_file && body.color.empty() && !look.color && settings.color_by != ColorBy::body;
  set_material(body, look, settings, index, model);
  const bool shapes = def && !def->shapes.empty() && body.mesh.empty() && body.surface.triangles.rows() == 0;
  if (shapes) model.mesh.materials.front().look = model.material;
  if (mesh.triangles.empty()) return model;

  const render::Shells shells = render::turn_shells_outwards(model.mesh);
  model.closed = shells.closed;
  if (shells.turned > 0)
    model.warnings.push_back(fmt::format("{} inside out and turned", shells.turned == 1
                                                                         ? std::string("a closed part of its mesh is")
                                                                         : fmt::format("{} closed parts of its mesh are", shells.turned)));

  // Shading points: what is drawn.
  for (const glm::ivec3& t : mesh.triangle_points) model.triangles.emplace_back(t);
  const size_t points = mesh.point_position.size();
  if (own_colors && !mesh.colors.empty()) {
    for (int p : mesh.point_position) model.colors.push_back(mesh.colors[p]);
  } else if ((own_colors || (shapes && settings.color_by != ColorBy::body)) && mesh.materials.size() > 1) {
    // Shapes without a colour of their own have the body's.
    for (size_t i = 0; shapes && i < look.shape_colors.size(); ++i)
      if (!look.shape_colors[i]) model.mesh.materials[i + 1].look = model.material;
    model.colors.assign(points, model.material.color);
    for (size_t k = 0; k < mesh.triangle_points.size(); ++k)
      for (int c = 0; c < 3; ++c) model.colors[mesh.triangle_points[k][c]] = mesh.materials[mesh.triangle_material[k]].look.color;
  }
  for (const glm::dvec3& p : mesh.positions)
    for (int c = 0; c < 3; ++c) model.rest.push_back(static_cast<float>(p[c]));
  if (const std::string coarse = coarse_steps(mesh); !coarse.empty()) model.refused.push_back(coarse);

  if (body.kind == "beam" && body.mesh.empty() && body.surface.triangles.rows() == 0) model.spine = spine_of(mesh, size);
  if (!body.mesh.empty() && opacity_of(mesh).first == 0.0f)
    model.refused.emplace_back("its materials have no opacity ('d' 0 or 'Tr' 1 of the MTL file): it is not seen");
  if (!body.mesh.empty() && opacity_of(mesh).second)
    model.warnings.push_back(fmt::format("its materials differ in opacity ('d' of the MTL file): all of it is drawn with the largest, {:g}",
                                         opacity_of(mesh).first));

  std::vector<int> corner_position, corner_group;
  for (size_t k = 0; k < mesh.triangles.size(); ++k)
    for (int c = 0; c < 3; ++c) {
      corner_position.push_back(mesh.triangles[k][c]);
      corner_group.push_back(mesh.point_group[mesh.triangle_points[k][c]]);
    }
  model.normals = interp::make_normal_layout(std::move(corner_position), std::move(corner_group), mesh.normal_groups);
  if (model.edges == EdgeLines::mesh) model.edge_flags = mesh.triangle_edges;
  if (model.edges == EdgeLines::creases && model.spine.empty()) {
    std::vector<glm::vec3> positions;
    for (const int p : mesh.point_position) positions.emplace_back(mesh.positions[p]);
    model.creases = crease_lines(render::compute_feature_edges(positions, model.triangles, crease_angle), mesh);
  }
  interp::PointsF group_normals;
  interp::compute_normals(model.normals, model.rest, group_normals);
  for (int g : mesh.point_group) model.rest_normals.emplace_back(group_normals(g, 0), group_normals(g, 1), group_normals(g, 2));

  // The map of an elastic body; a body whose nodes never move is drawn as a rigid one.
  // A pure twist turns the nodes on the axis and moves none; a rod that carries without stretching has stress all the same.
  const auto moves = [](const auto& values) { return values.size() > 0 && values.cwiseAbs().maxCoeff() > 0.0; };
  const bool carries = (by_section || settings.color_by == ColorBy::stress) && moves(body.load_strain);
  model.flexible = !body.nodes.empty() && (moves(body.displacement) || moves(body.rotation) || carries);
  if (!model.flexible) return model;
  map_nodes(body, drawing, look, settings, known, model);
  if (settings.corotated) model.corotated = std::make_shared<const interp::Corotated>(model.view());
  return model;
}

namespace {

double measure_of(const sim::SectionStress& s, StressMeasure measure) {
  const double half = 0.5 * s.normal, radius = std::hypot(half, s.shear);
  switch (measure) {
    case StressMeasure::von_mises:
      break;
    case StressMeasure::tresca:
      return 2.0 * radius;
    case StressMeasure::max_principal:
      return half + radius;
    case StressMeasure::min_principal:
      return half - radius;
  }
  return std::sqrt(s.normal * s.normal + 3.0 * s.shear * s.shear);
}

}  // namespace

namespace {

// Section strains at the stations of a beam.
class StationStrains {
 public:
  explicit StationStrains(const BeamState& state)
      : body_(state.body),
        last_(static_cast<int>(body_.strain_stations.size()) - 1),
        strains_(4 * static_cast<size_t>(body_.strain_stations.size()), 0.0) {
    for (Eigen::Index i = 0; i < body_.section_strain.rows(); ++i)
      strains_[static_cast<size_t>(body_.section_strain(i, 0))] +=
          body_.section_strain(i, 2) * state.q[static_cast<size_t>(body_.section_strain(i, 1))];
    const size_t stations = strains_.size() / 4;
    for (size_t k = 0; k < state.load_strain.size(); ++k)
      strains_[4 * (k % stations) + (body_.unstrained[k / stations] == "axial" ? 0 : 3)] += state.load_strain[k];
  }
  Eigen::Map<const sim::SectionStrains> station(int k) const {
    return Eigen::Map<const sim::SectionStrains>(strains_.data() + 4 * static_cast<std::ptrdiff_t>(k));
  }
  // What transverse forces change the curvatures by between two stations.
  Eigen::Vector2d bend_rates(int from, int to) const {
    const double width = body_.strain_stations[to] - body_.strain_stations[from];
    return width > 1e-6 * body_.length ? Eigen::Vector2d((station(to) - station(from)).segment<2>(1) / width)
                                       : Eigen::Vector2d(Eigen::Vector2d::Zero());
  }
  // At a vertex: strains and rates of its first side.
  std::pair<sim::SectionStrains, Eigen::Vector2d> at(const BeamStress::Vertex& v) const {
    const int next = std::min(v.station + 1, last_);
    sim::SectionStrains e = station(v.station);
    if (v.share > 0.0) e += v.share * (station(next) - e);
    return {e, bend_rates(next == v.station ? std::max(0, next - 1) : v.station, next)};
  }

 private:
  const sim::ResultBody& body_;
  int last_ = 0;
  std::vector<double> strains_;
};

}  // namespace

void beam_stress_vectors(const BeamStress& stress, const BeamState& state, std::span<float> out) {
  const StationStrains strains(state);
  for (size_t i = 0; i < stress.vertices.size(); ++i) {
    const BeamStress::Vertex& v = stress.vertices[i];
    const auto [e, rates] = strains.at(v);
    // As sim::stress_at, with the direction of the shear stress.
    const Eigen::Vector2d shear = stress.shear_modulus * e[3] * v.at.torsion + stress.youngs_modulus * (v.at.force * rates);
    out[3 * i] = static_cast<float>(stress.youngs_modulus * (e[0] - v.at.y * e[1] - v.at.z * e[2]));
    out[3 * i + 1] = static_cast<float>(std::numbers::sqrt3 * shear.x());
    out[3 * i + 2] = static_cast<float>(std::numbers::sqrt3 * shear.y());
  }
}

void beam_stresses(const BeamStress& stress, const BeamState& state, StressMeasure measure, std::span<float> out) {
  const StationStrains strains(state);
  for (size_t i = 0; i < stress.vertices.size(); ++i) {
    const BeamStress::Vertex& v = stress.vertices[i];
    const auto [e, e_rates] = strains.at(v);
    const auto value = [&](const sim::SectionStrains& there, const Eigen::Vector2d& rates) {
      return measure_of(sim::stress_at(there, rates, stress.youngs_modulus, stress.shear_modulus, v.at), measure);
    };
    double worst = value(e, e_rates);
    if (v.other >= 0) {
      const double other = value(strains.station(v.other), strains.bend_rates(std::max(0, v.other - 1), v.other));
      worst = measure == StressMeasure::min_principal ? std::min(worst, other) : std::max(worst, other);
    }
    out[i] = static_cast<float>(worst);
  }
}

namespace {

// Displacements in the frame of the elastic coordinates as the body frame sees them: R (x + u) + p - x.
void see_from_body_frame(const BodyModel& model, const sim::Pose& held, std::vector<float>& displacement) {
  const sim::Mat3 turn = held.R - sim::Mat3::Identity();
  for (size_t i = 0; i + 2 < displacement.size(); i += 3) {
    const sim::Vec3 x(model.rest[i], model.rest[i + 1], model.rest[i + 2]), u(displacement[i], displacement[i + 1], displacement[i + 2]);
    const sim::Vec3 seen = held.R * u + (turn * x + held.p);
    for (size_t a = 0; a < 3; ++a) displacement[i + a] = static_cast<float>(seen[static_cast<Eigen::Index>(a)]);
  }
}

// What the nodes do beyond the modes, by the kernel map.
void add_second_order(const BodyModel& model, const sim::ResultBody& body, const SamplePlace& place, BodyMemory& memory) {
  node_motion(body, place, memory.node_displacement, memory.node_rotation);
  const sim::VecX linear = body.node_phi * Eigen::Map<const sim::VecX>(memory.q.data(), std::ssize(memory.q));
  const sim::Pose held = body.held_position.rows() > 0 ? held_pose(body, place) : sim::Pose{};
  interp::Points rest(memory.node_displacement.rows(), 3);
  for (Eigen::Index k = 0; k < rest.rows(); ++k) {
    const sim::Vec3 x = body.nodes[k].origin, seen = x + memory.node_displacement.row(k).transpose();
    rest.row(k) = (held.R.transpose() * (seen - held.p) - x - linear.segment<3>(3 * k)).transpose();
  }
  memory.scaled.resize(memory.displacement.size());
  interp::apply(*model.map, rest, interp::Points(0, 3), std::span<float>(memory.scaled));
  for (size_t i = 0; i < memory.scaled.size(); ++i) memory.displacement[i] += memory.scaled[i];
}

}  // namespace

void update_displacement(const BodyModel& model, const sim::ResultBody& body, const SamplePlace& place, BodyMemory& memory) {
  memory.displacement.resize(model.rest.size());
  if (!model.vertex_nodes.empty()) {
    node_motion(body, place, memory.node_displacement, memory.node_rotation);
    for (size_t v = 0; v < model.vertex_nodes.size(); ++v)
      for (int a = 0; a < 3; ++a) memory.displacement[3 * v + a] = static_cast<float>(memory.node_displacement(model.vertex_nodes[v], a));
  } else if (model.modes) {
    elastic_coordinates(body, place, memory.q);
    interp::apply_modes(*model.modes, memory.q, memory.displacement, 1);
    if (model.map) add_second_order(model, body, place, memory);
    if (body.held_position.rows() > 0) see_from_body_frame(model, held_pose(body, place), memory.displacement);
  } else {
    node_motion(body, place, memory.node_displacement, memory.node_rotation);
    interp::apply(*model.map, memory.node_displacement, memory.node_rotation, std::span<float>(memory.displacement));
  }
}

void map_error(const BodyModel& model, const sim::ResultBody& body, const SamplePlace& place, BodyMemory& memory, std::vector<float>& out) {
  out.clear();
  if (model.doubt) {
    elastic_coordinates(body, place, memory.q);
    memory.doubt.resize(model.rest.size());
    interp::apply_modes(*model.doubt, memory.q, memory.doubt, 1);
    out.resize(model.rest.size() / 3);
    interp::compute_magnitude(memory.doubt, out);
  } else if (model.error_bar && model.error_bar->known()) {
    node_motion(body, place, memory.node_displacement, memory.node_rotation);
    out.resize(model.rest.size() / 3);
    model.error_bar->evaluate(*model.map, memory.node_displacement, memory.node_rotation, out);
  }
}

namespace {

// Root mean squares over the vertices, m: what the map may be off by, and the deflection; the largest of the run.
struct Off {
  double error = 0.0, deflection = 0.0;
  bool known = true;
};

Off off_by(const BodyModel& model, const sim::Results& results, const sim::ResultBody& body) {
  Off off;
  const Eigen::Index samples = results.times.size();
  BodyMemory memory;
  if (model.mode_doubt && model.mode_doubt->doubt.size() > 0) {
    constexpr Eigen::Index most = 2000;
    const Eigen::Index step = 1 + samples / most;
    for (Eigen::Index i = 0; i < samples; i += step) {
      elastic_coordinates(body, {i, 0.0}, memory.q);
      const Eigen::Map<const Eigen::VectorXd> q(memory.q.data(), std::ssize(memory.q));
      off.error = std::max(off.error, q.dot(model.mode_doubt->doubt * q));
      off.deflection = std::max(off.deflection, q.dot(model.mode_doubt->moved * q));
    }
    off.error = std::sqrt(off.error);
    off.deflection = std::sqrt(off.deflection);
    return off;
  }
  std::optional<interp::MeanError> mean;
  if (!model.mode_doubt) mean.emplace(*model.map, model.view());
  off.known = mean && mean->known();
  constexpr Eigen::Index most = 16;
  const Eigen::Index step = 1 + samples / most;
  for (Eigen::Index i = samples - 1; i >= 0; i -= step) {
    node_motion(body, {i, 0.0}, memory.node_displacement, memory.node_rotation);
    off.deflection = std::max(off.deflection, std::sqrt(memory.node_displacement.squaredNorm() / static_cast<double>(body.nodes.size())));
    if (off.known) off.error = std::max(off.error, mean->evaluate(*model.map, memory.node_displacement, memory.node_rotation));
  }
  return off;
}

}  // namespace

std::string doubtful_map(const BodyModel& model, const sim::Results& results, const sim::ResultBody& body) {
  // Beams are moved by their elements' own shapes. What is a millionth of the body cannot be seen, however much it is exaggerated.
  constexpr double limit = 0.05, unseen = 1e-6;
  if (!model.visible || !model.flexible || body.kind == "beam" || model.mesh.triangles.empty()) return {};
  if (!model.mode_doubt && !(model.map && !model.modes)) return {};
  const Off off = off_by(model, results, body);
  const interp::MeshView view = model.view();
  const double size = (view.vertices.colwise().maxCoeff() - view.vertices.colwise().minCoeff()).norm();
  if (!(off.deflection > unseen * size)) return {};
  const std::string remedy =
      "more nodes where it bends, nodes with rotations, or its elements' own shapes (flexframe reduce -o BODY.h5) move it as it is";
  if (!off.known)
    return fmt::format("its {} nodes are too few to tell how far the mesh is off between them: {}", body.nodes.size(), remedy);
  if (!(off.error > limit * off.deflection)) return {};
  return fmt::format(
      "between its {} nodes the mesh may be off by about {:.2g} % of its deflection (each node predicted from the others): {}",
      body.nodes.size(), std::min(100.0, 100.0 * off.error / off.deflection), remedy);
}

void update_surface(const BodyModel& model, double scale, bool with_corotated, BodyMemory& memory, std::vector<glm::vec3>& positions,
                    std::vector<glm::vec3>& normals) {
  const size_t n = model.rest.size();
  memory.positions.resize(n);
  if (with_corotated && model.corotated && scale != 1.0) {
    memory.scaled.resize(n);
    model.corotated->apply(memory.displacement, scale, memory.scaled);
    for (size_t i = 0; i < n; ++i) memory.positions[i] = model.rest[i] + memory.scaled[i];
  } else {
    const float s = static_cast<float>(scale);
    for (size_t i = 0; i < n; ++i) memory.positions[i] = model.rest[i] + s * memory.displacement[i];
  }
  interp::compute_normals(model.normals, memory.positions, memory.group_normals, 1);

  // From positions and normal groups to shading points.
  const render::Mesh& mesh = model.mesh;
  const size_t points = mesh.point_position.size();
  positions.resize(points);
  normals.resize(points);
  for (size_t p = 0; p < points; ++p) {
    const size_t at = 3 * static_cast<size_t>(mesh.point_position[p]);
    positions[p] = {memory.positions[at], memory.positions[at + 1], memory.positions[at + 2]};
    const int g = mesh.point_group[p];
    normals[p] = {memory.group_normals(g, 0), memory.group_normals(g, 1), memory.group_normals(g, 2)};
  }
}

}  // namespace flexframe::film
