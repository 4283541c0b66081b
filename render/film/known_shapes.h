// Bodies whose file holds the shapes of their finite elements' surface (flexframe reduce -o BODY.h5): their mesh is moved by the elements'
// own shape functions (interp/faces.h) instead of the kernel map between some nodes.
#pragma once

#include "interp/faces.h"
#include "sim/bodies/body_file.h"
#include "sim/results/results.h"
#include "sim/scene/scene.h"

#include <optional>
#include <string>
#include <vector>

namespace flexframe::film {

// The surface in the body's file, where the scene names one that has it and its coordinates are those of the results. why: a sentence where
// the file should have been used and cannot be (damaged, changed since the simulation).
std::optional<sim::BodySurface> known_surface(const sim::ResultBody& body, const sim::BodyDef* def, std::string& why);

interp::FaceMesh face_mesh(const sim::BodySurface& surface);

// Where the vertices of a mesh hang on the surface; none where the mesh is another thing than the surface (a vertex farther from it than a
// tenth of its size): why says so.
std::optional<std::vector<interp::FaceFoot>> feet_on_surface(const interp::FaceMesh& faces, const interp::MeshView& mesh, std::string& why,
                                                             std::string& note);

}  // namespace flexframe::film
