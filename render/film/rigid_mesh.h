// What bodies without a mesh file look like: the shapes of the scene, a link between the joints of a rigid body, tubes between the nodes of
// an elastic one. Positions in m in the body frame.
#pragma once

#include "render/picture/mesh.h"
#include "sim/scene/scene.h"

#include <glm/glm.hpp>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace flexframe::film {

// The solids of a scene's `shapes`, one material each; `colors`: a colour for each, none: the first material's.
render::Mesh make_shapes_mesh(std::span<const sim::ShapeDef> shapes, std::span<const std::optional<glm::vec3>> colors,
                              const std::string& name);

// Where something holds a rigid body: joints, springs. axis: of a pin, else zero.
struct HoldingPlace {
  glm::dvec3 at{0.0}, axis{0.0};
};
// At the joints, springs and bushings of a body of the scene, in the body's frame, m; none of a body that is not rigid.
std::vector<HoldingPlace> holding_places(const sim::Scene& scene, const sim::BodyDef& body);

// A rigid body that the scene does not draw. Held at two places: a link from one to the other, with round ends about their pins. Held at
// more: links that join them, or the box of its mass and inertia with bars to them where that box is no rod. Held at one or none: that
// box, with bars to what holds it and to its frames. size: m, of the machine; index: of the body, so that links side by side are not
// equally thick.
render::Mesh make_rigid_mesh(const sim::RigidDef& body, std::span<const HoldingPlace> places, double size, int index,
                             const std::string& name);

// Tubes between neighbouring points, all of them joined; radius in m. Needs two different points at least.
render::Mesh make_lattice_mesh(std::span<const glm::dvec3> points, double radius, const std::string& name);

}  // namespace flexframe::film
