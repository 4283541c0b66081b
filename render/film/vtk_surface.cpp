#include "render/film/vtk_surface.h"

#include "render/film/survey.h"

#include <cmath>

namespace flexframe::film {
namespace {

bool has_scalars(ColorBy by) { return by == ColorBy::strain || by == ColorBy::mode; }

// Whether the body model knows stresses.
bool has_stress(const BodyModel& model, const sim::ResultBody& body) {
  return model.stress || model.beam_stress || (!model.vertex_nodes.empty() && body.node_von_mises.size() > 0);
}

// What colours by `by` are made of, a number (or, of vectors, three) a vertex.
void append_values(const Animation& animation, size_t b, double t, ColorBy by, const BodyMemory& memory, std::vector<float>& out) {
  const BodyModel& model = animation.bodies[b];
  RenderSettings settings = animation.settings;
  settings.color_by = by;
  settings.stress = StressMeasure::von_mises;
  ScalarMemory work;
  work.wanted = by == ColorBy::velocity;
  std::vector<float> scalars;
  update_scalars({model, *animation.results, b, settings, false}, t, memory, work, scalars);
  std::vector<float>& values = by == ColorBy::velocity ? work.components : scalars;
  values.resize((by == ColorBy::velocity ? 3 : 1) * model.mesh.positions.size(), 0.0f);
  for (float& value : values)
    if (!std::isfinite(value)) value = 0.0f;
  out.insert(out.end(), values.begin(), values.end());
}

void add_body(const Animation& animation, size_t b, double t, double scale, BodyMemory& memory, VtkSurface& out) {
  const BodyModel& model = animation.bodies[b];
  const sim::ResultBody& body = animation.results->bodies[b];
  if (!model.visible || model.mesh.triangles.empty()) return;
  const SamplePlace place = find_sample(animation.results->times, t);
  const glm::dmat4 pose = body_pose(body, place);
  const glm::dmat3 turn(pose);
  if (model.flexible) update_displacement(model, body, place, memory);
  const auto first = static_cast<std::int64_t>(out.points.size() / 3);
  const ColorBy by = animation.settings.color_by;
  if (has_scalars(by)) append_values(animation, b, t, by, memory, out.scalars);
  append_values(animation, b, t, ColorBy::velocity, memory, out.velocity);
  if (has_stress(model, body)) append_values(animation, b, t, ColorBy::stress, memory, out.stress);
  else out.stress.resize(out.stress.size() + model.mesh.positions.size(), 0.0f);
  for (size_t v = 0; v < model.mesh.positions.size(); ++v) {
    const glm::dvec3 u = model.flexible
                             ? glm::dvec3(memory.displacement[3 * v], memory.displacement[3 * v + 1], memory.displacement[3 * v + 2])
                             : glm::dvec3(0.0);
    const glm::dvec3 p = glm::dvec3(pose * glm::dvec4(model.mesh.positions[v] + scale * u, 1.0)), d = turn * u;
    for (int c = 0; c < 3; ++c) {
      out.points.push_back(p[c]);
      out.displacement.push_back(static_cast<float>(d[c]));
    }
  }
  for (const glm::ivec3& triangle : model.mesh.triangles) {
    for (int c = 0; c < 3; ++c) out.corners.push_back(first + triangle[c]);
    out.body.push_back(static_cast<std::int32_t>(b));
  }
}

}  // namespace

bool has_stress(const Animation& animation) {
  for (size_t b = 0; b < animation.bodies.size(); ++b)
    if (has_stress(animation.bodies[b], animation.results->bodies[b])) return true;
  return false;
}

const std::string& scalar_name(const Animation& animation) { return color_by_words()[static_cast<size_t>(animation.settings.color_by)]; }

VtkSurface vtk_surface(const Animation& animation, double t, double scale, BodyMemory& memory) {
  VtkSurface out;
  for (size_t b = 0; b < animation.bodies.size(); ++b) add_body(animation, b, t, scale, memory, out);
  if (!has_stress(animation)) out.stress.clear();
  return out;
}

double output_at(const sim::Results& results, const sim::ResultOutput& output, double t) {
  const SamplePlace at = find_sample(results.times, t);
  const double value = output.values[at.index];
  return at.share > 0.0 ? value + at.share * (output.values[at.index + 1] - value) : value;
}

}  // namespace flexframe::film
