#include "render/film/gltf.h"

#include "render/base/base64.h"
#include "render/film/shape_basis.h"
#include "sim/base/error.h"

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

namespace flexframe::film {
namespace {

using Json = nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little, "glTF data are little-endian");

// Component types and buffer targets of the specification, sections 3.6.2.2 and 5.11.5.
constexpr int type_float = 5126, type_unsigned = 5125, target_vertices = 34962, target_indices = 34963;

struct Writer {
  std::vector<std::uint8_t> data;
  Json views = Json::array(), accessors = Json::array();

  // Appends an array; returns the accessor's index. target 0: animation data.
  int add(const void* bytes, size_t count, size_t components, int type, const char* shape, int target) {
    const size_t size = count * components * 4;
    if (data.size() + size > std::numeric_limits<std::uint32_t>::max())
      throw FileError("the sequence needs more than 4 GiB, which glTF cannot hold: export fewer pictures");
    Json view = {{"buffer", 0}, {"byteOffset", data.size()}, {"byteLength", size}};
    if (target != 0) view["target"] = target;
    views.push_back(view);
    accessors.push_back({{"bufferView", views.size() - 1}, {"componentType", type}, {"count", count}, {"type", shape}});
    data.resize(data.size() + size);
    if (size > 0) std::memcpy(data.data() + data.size() - size, bytes, size);
    return static_cast<int>(accessors.size()) - 1;
  }

  int add_vectors(std::span<const glm::vec3> v, bool bounds) {
    const int index = add(v.data(), v.size(), 3, type_float, "VEC3", target_vertices);
    if (bounds && !v.empty()) {
      glm::vec3 low = v[0], high = v[0];
      for (const glm::vec3& p : v) low = glm::min(low, p), high = glm::max(high, p);
      accessors.back()["min"] = {low.x, low.y, low.z};
      accessors.back()["max"] = {high.x, high.y, high.z};
    }
    return index;
  }

  int add_times(const std::vector<float>& t) {
    const int index = add(t.data(), t.size(), 1, type_float, "SCALAR", 0);
    accessors.back()["min"] = {t.front()};
    accessors.back()["max"] = {t.back()};
    return index;
  }
};

struct Document {
  Writer writer;
  Json nodes = Json::array(), meshes = Json::array(), materials = Json::array(), cameras = Json::array();
  Json samplers = Json::array(), channels = Json::array();
  int times = -1;
};

float linear(float srgb) { return srgb <= 0.04045f ? srgb / 12.92f : std::pow((srgb + 0.055f) / 1.055f, 2.4f); }

int add_material(Document& d, const std::string& name, const render::Material& look, float opacity, bool two_sided) {
  Json material = {{"name", name},
                   {"pbrMetallicRoughness",
                    {{"baseColorFactor", {linear(look.color.r), linear(look.color.g), linear(look.color.b), opacity}},
                     {"metallicFactor", look.metallic},
                     {"roughnessFactor", look.roughness}}}};
  if (opacity < 1.0f) material["alphaMode"] = "BLEND";
  if (two_sided) material["doubleSided"] = true;
  d.materials.push_back(material);
  return static_cast<int>(d.materials.size()) - 1;
}

void add_channel(Document& d, int node, const char* path, int values) {
  d.samplers.push_back({{"input", d.times}, {"interpolation", "LINEAR"}, {"output", values}});
  d.channels.push_back({{"sampler", d.samplers.size() - 1}, {"target", {{"node", node}, {"path", path}}}});
}

// Translation and rotation of a pose; poses are rigid.
void split_pose(const glm::dmat4& pose, glm::vec3& position, glm::vec4& rotation, const glm::vec4* before) {
  position = glm::vec3(pose[3]);
  const glm::dquat q = glm::normalize(glm::quat_cast(glm::dmat3(pose)));
  rotation = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z), static_cast<float>(q.w)};
  // Neighbours on the same half of the sphere, for viewers that do not see to it.
  if (before && glm::dot(*before, rotation) < 0.0f) rotation = -rotation;
}

// A node that moves along pose(picture); no channel for what stands still.
template <class Pose>
int add_moving_node(Document& d, const std::string& name, int mesh, int count, Pose&& pose) {
  std::vector<glm::vec3> positions(count);
  std::vector<glm::vec4> rotations(count);
  bool moves = false, turns = false;
  for (size_t k = 0; k < positions.size(); ++k) {
    split_pose(pose(static_cast<int>(k)), positions[k], rotations[k], k > 0 ? &rotations[k - 1] : nullptr);
    moves = moves || positions[k] != positions[0];
    turns = turns || rotations[k] != rotations[0];
  }
  const glm::vec3 p = positions[0];
  const glm::vec4 r = rotations[0];
  Json node = {{"name", name}, {"translation", {p.x, p.y, p.z}}, {"rotation", {r.x, r.y, r.z, r.w}}};
  if (mesh >= 0) node["mesh"] = mesh;
  d.nodes.push_back(node);
  const int index = static_cast<int>(d.nodes.size()) - 1;
  if (moves) add_channel(d, index, "translation", d.writer.add(positions.data(), positions.size(), 3, type_float, "VEC3", 0));
  if (turns) add_channel(d, index, "rotation", d.writer.add(rotations.data(), rotations.size(), 4, type_float, "VEC4", 0));
  return index;
}

int add_triangles(Document& d, std::span<const glm::uvec3> triangles) {
  return d.writer.add(triangles.data(), 3 * triangles.size(), 1, type_unsigned, "SCALAR", target_indices);
}

// Morph weights, `targets` in a row for each picture.
struct Morph {
  int targets = 0;
  std::vector<float> weights;
};

// A mesh node of a body, named after the body or its scale.
void add_body_node(Document& d, const Animation& animation, const sim::ResultBody& body, Json mesh, const std::string& name,
                   const Morph& morph) {
  const auto& [targets, weights] = morph;
  mesh["name"] = name;
  if (targets > 0) mesh["weights"] = std::vector<float>(weights.begin(), weights.begin() + targets);
  d.meshes.push_back(mesh);
  const auto pose = [&](int k) { return body_pose(body, find_sample(animation.results->times, picture_time(animation, k))); };
  const int node = add_moving_node(d, name, static_cast<int>(d.meshes.size()) - 1, animation.count, pose);
  if (targets > 0) add_channel(d, node, "weights", d.writer.add(weights.data(), weights.size(), 1, type_float, "SCALAR", 0));
}

void add_body(Document& d, const Animation& animation, int b, double scale, const GltfExtras& extras, GltfReport& report) {
  const BodyModel& model = animation.bodies[b];
  const sim::ResultBody& body = animation.results->bodies[b];
  const auto pose = [&](int k) { return body_pose(body, find_sample(animation.results->times, picture_time(animation, k))); };
  if (model.mesh.triangles.empty()) {
    report.notes.push_back(fmt::format("body '{}' has no mesh: only its frame moves", body.name));
    add_moving_node(d, body.name, -1, animation.count, pose);
    return;
  }

  std::vector<glm::vec3> positions;
  for (int p : model.mesh.point_position) positions.emplace_back(model.mesh.positions[p]);
  Json attributes = {{"POSITION", d.writer.add_vectors(positions, true)}, {"NORMAL", d.writer.add_vectors(model.rest_normals, false)}};
  if (!model.colors.empty()) {
    std::vector<glm::vec3> colors;
    for (const glm::vec3& c : model.colors) colors.emplace_back(linear(c.r), linear(c.g), linear(c.b));
    attributes["COLOR_0"] = d.writer.add_vectors(colors, false);
  }
  render::Material material = model.material;
  if (!model.colors.empty()) material.color = glm::vec3(1.0f);
  Json primitive = {{"attributes", attributes},
                    {"indices", add_triangles(d, model.triangles)},
                    {"material", add_material(d, body.name, material, model.opacity, !model.closed)}};
  Json mesh = {{"name", body.name}};

  // Deformation: targets are differences of positions and normals at a weight of 1 m, scaled to what the sequence reaches.
  Morph morph;
  auto& [targets, weights] = morph;
  if (model.flexible) {
    const ShapeBasis basis = make_shape_basis(animation, b);
    targets = static_cast<int>(basis.shapes.cols());
    report.error = std::max(report.error, scale * basis.error);
    Json list = Json::array();
    BodyMemory memory;
    std::vector<glm::vec3> moved, normals;
    std::vector<double> sizes;
    for (int k = 0; k < targets; ++k) {
      const float size =
          std::max(basis.weights.row(k).cwiseAbs().maxCoeff() * static_cast<float>(scale), std::numeric_limits<float>::min());
      sizes.push_back(size);
      memory.displacement.assign(basis.shapes.col(k).data(), basis.shapes.col(k).data() + basis.shapes.rows());
      update_surface(model, size, false, memory, moved, normals);
      for (size_t i = 0; i < moved.size(); ++i) moved[i] -= positions[i], normals[i] -= model.rest_normals[i];
      list.push_back({{"POSITION", d.writer.add_vectors(moved, true)}, {"NORMAL", d.writer.add_vectors(normals, false)}});
    }
    if (targets > 0) {
      primitive["targets"] = list;
      for (int picture = 0; picture < animation.count; ++picture)
        for (int k = 0; k < targets; ++k) weights.push_back(static_cast<float>(basis.weights(k, picture) * scale / sizes[k]));
    }
  }
  mesh["primitives"] = Json::array({primitive});
  add_body_node(d, animation, body, mesh, body.name, morph);
  report.morph_targets += targets;
  if (!extras.ghosts || targets == 0 || model.ghost == GhostStyle::none || !(scale > 0.0)) return;
  // The same arrays once more in a pale material, with larger weights.
  constexpr float ghost_opacity = 0.38f;
  for (const double ghost : animation.scales) {
    if (ghost == animation.scales.front()) continue;
    primitive["material"] = add_material(d, body.name + " ghost", material, ghost_opacity * model.opacity, !model.closed);
    mesh["primitives"] = Json::array({primitive});
    Morph larger = morph;
    for (float& weight : larger.weights) weight = static_cast<float>(weight * ghost / scale);
    add_body_node(d, animation, body, mesh, fmt::format("{} x {:g}", body.name, ghost), larger);
  }
}

// The path of a frame over the run.
void add_trace(Document& d, const Animation& animation, const FramePlace& trace) {
  constexpr int line_strip = 3;
  std::vector<glm::vec3> points;
  for (int k = 0; k < animation.count; ++k) {
    const SamplePlace at = find_sample(animation.results->times, picture_time(animation, k));
    points.emplace_back(place_pose(*animation.results, trace, at, animation.scales.front())[3]);
  }
  const std::string name = trace.body < 0 ? "trace" : "trace of " + animation.results->bodies[trace.body].name;
  const Json primitive = {
      {"attributes", {{"POSITION", d.writer.add_vectors(points, true)}}},
      {"mode", line_strip},
      {"material", add_material(d, name, {.color = {0.75f, 0.2f, 0.1f}, .roughness = 1.0f, .metallic = 0.0f}, 1.0f, true)}};
  d.meshes.push_back({{"name", name}, {"primitives", Json::array({primitive})}});
  d.nodes.push_back({{"name", name}, {"mesh", d.meshes.size() - 1}});
}

void add_symbol(Document& d, const Animation& animation, const JointSymbol& symbol) {
  const sim::ResultJoint& joint = animation.results->joints[symbol.joint];
  const Json attributes = {{"POSITION", d.writer.add_vectors(symbol.positions, true)},
                           {"NORMAL", d.writer.add_vectors(symbol.normals, false)}};
  const render::Material look = symbol_material(animation.settings);
  d.meshes.push_back({{"name", joint.name},
                      {"primitives", Json::array({{{"attributes", attributes},
                                                   {"indices", add_triangles(d, symbol.triangles)},
                                                   {"material", add_material(d, joint.name, look, 1.0f, true)}}})}});
  add_moving_node(d, joint.name, static_cast<int>(d.meshes.size()) - 1, animation.count, [&](int k) {
    return joint_pose(joint,
                      find_sample(animation.results->times, symbol.fixed ? animation.results->times[0] : picture_time(animation, k)));
  });
}

void add_camera(Document& d, const Animation& animation) {
  const render::Camera& c = animation.camera;
  const double distance = glm::length(c.position - c.target),
               aspect = double(animation.settings.size.width) / animation.settings.size.height;
  if (!(distance > 0.0)) return;
  Json camera;
  if (c.projection == render::Projection::orthographic)
    camera = {{"type", "orthographic"},
              {"orthographic",
               {{"xmag", 0.5 * c.height * aspect}, {"ymag", 0.5 * c.height}, {"znear", 1e-3 * distance}, {"zfar", 1e3 * distance}}}};
  else
    camera = {{"type", "perspective"},
              {"perspective", {{"yfov", glm::radians(double(c.fov))}, {"aspectRatio", aspect}, {"znear", 1e-3 * distance}}}};
  d.cameras.push_back(camera);
  // A glTF camera looks along its -z axis, y up.
  const glm::dvec3 z = glm::normalize(c.position - c.target), x = glm::normalize(glm::cross(glm::dvec3(c.up), z));
  const glm::dquat q = glm::quat_cast(glm::dmat3(x, glm::cross(z, x), z));
  d.nodes.push_back(
      {{"name", "camera"}, {"camera", 0}, {"translation", {c.position.x, c.position.y, c.position.z}}, {"rotation", {q.x, q.y, q.z, q.w}}});
}

void put_word(std::vector<std::uint8_t>& out, std::uint32_t word) {
  for (int k = 0; k < 4; ++k) out.push_back(static_cast<std::uint8_t>(word >> 8 * k));
}

}  // namespace

std::vector<std::uint8_t> make_gltf(const Animation& animation, double scale, bool binary, GltfReport& report, const GltfExtras& extras) {
  Document d;
  std::vector<float> times;
  times.reserve(animation.count);
  for (int k = 0; k < animation.count; ++k) times.push_back(static_cast<float>(k / animation.settings.frame_rate));
  d.times = d.writer.add_times(times);
  report.pictures = animation.count;

  // The root turns the up of the pictures to y.
  const glm::dvec3 up = glm::normalize(glm::dvec3(animation.camera.up)), axis = glm::cross(up, glm::dvec3(0, 1, 0));
  const double sine = glm::length(axis), cosine = up.y;
  const glm::dquat turn = sine > 1e-12   ? glm::angleAxis(std::atan2(sine, cosine), axis / sine)
                          : cosine > 0.0 ? glm::dquat(1, 0, 0, 0)
                                         : glm::dquat(0, 1, 0, 0);
  d.nodes.push_back({{"name", animation.results->title.empty() ? "flexframe" : animation.results->title},
                     {"rotation", {turn.x, turn.y, turn.z, turn.w}}});
  for (size_t b = 0; b < animation.bodies.size(); ++b)
    if (animation.bodies[b].visible) add_body(d, animation, static_cast<int>(b), scale, extras, report);
  for (const JointSymbol& symbol : animation.symbols) add_symbol(d, animation, symbol);
  if (extras.traces)
    for (const FramePlace& trace : animation.traces) add_trace(d, animation, trace);
  add_camera(d, animation);
  Json children = Json::array();
  for (size_t k = 1; k < d.nodes.size(); ++k) children.push_back(k);
  if (!children.empty()) d.nodes[0]["children"] = children;
  report.nodes = static_cast<int>(d.nodes.size());

  Json buffer = {{"byteLength", d.writer.data.size()}};
  if (!binary) buffer["uri"] = "data:application/octet-stream;base64," + render::base64(d.writer.data);
  Json json = {{"asset", {{"version", "2.0"}, {"generator", "flexframe"}}},
               {"scene", 0},
               {"scenes", Json::array({{{"nodes", {0}}}})},
               {"nodes", d.nodes}};
  if (!d.meshes.empty()) json["meshes"] = d.meshes, json["materials"] = d.materials;
  if (!d.cameras.empty()) json["cameras"] = d.cameras;
  if (!d.channels.empty()) json["animations"] = Json::array({{{"name", "motion"}, {"channels", d.channels}, {"samplers", d.samplers}}});
  json["accessors"] = d.writer.accessors;
  json["bufferViews"] = d.writer.views;
  json["buffers"] = Json::array({buffer});
  std::string text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  if (!binary) return {text.begin(), text.end()};

  // GLB, section 4.4: header, JSON padded with blanks, data padded with zeros.
  text.resize((text.size() + 3) / 4 * 4, ' ');
  d.writer.data.resize((d.writer.data.size() + 3) / 4 * 4, 0);
  const size_t total = 28 + text.size() + d.writer.data.size();
  if (total > std::numeric_limits<std::uint32_t>::max())
    throw FileError("the sequence needs more than 4 GiB, which glTF cannot hold: export fewer pictures");
  std::vector<std::uint8_t> out;
  out.reserve(total);
  for (std::uint32_t word : {0x46546C67u, 2u, static_cast<std::uint32_t>(total), static_cast<std::uint32_t>(text.size()), 0x4E4F534Au})
    put_word(out, word);
  out.insert(out.end(), text.begin(), text.end());
  put_word(out, static_cast<std::uint32_t>(d.writer.data.size()));
  put_word(out, 0x004E4942u);
  out.insert(out.end(), d.writer.data.begin(), d.writer.data.end());
  return out;
}

}  // namespace flexframe::film
