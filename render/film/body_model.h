// What stays the same of a body over a sequence of pictures: its mesh, the map from nodes to vertices, colours.
//
// The mesh is the scene's file, or made from the section (beams) or from mass and inertia (rigid bodies). The map is built once:
// for a modal body whose node displacements are linear in q the mode columns, otherwise the kernel map of the nodal series.
#pragma once

#include "interp/error_bar.h"
#include "interp/exaggerate.h"
#include "interp/map.h"
#include "interp/modes.h"
#include "interp/surface.h"
#include "render/film/detail.h"
#include "render/film/motion.h"
#include "render/film/rigid_mesh.h"
#include "render/film/settings.h"
#include "render/picture/mesh.h"
#include "render/picture/picture.h"
#include "sim/results/results.h"
#include "sim/scene/scene.h"
#include "sim/scene/section_stress.h"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace flexframe::film {

// How exaggerated copies of a body are drawn: as a translucent body, as the lines of its mesh, not at all.
enum class GhostStyle { body, mesh, none };

// Words of a body's drawing = {...} and color.
struct BodyLook {
  std::optional<glm::vec3> color;  // color = [r, g, b] or "#rrggbb"
  float opacity = 1.0f;
  bool visible = true;
  GhostStyle ghost = GhostStyle::body;
  std::optional<glm::vec3> ghost_color;                // default: the body's colours
  std::optional<EdgeLines> edges;                      // default: of [render]
  double yield_stress = 0.0;                           // Pa; 0: that of [render], if any
  double thickness = 0.0;                              // m, of the wall that its mesh shows, for the elastic surface; 0: by the mesh
  std::optional<double> diameter;                      // m: a beam is drawn as a bar of this diameter; default: by its section
  std::vector<std::optional<glm::vec3>> shape_colors;  // of the scene's shapes
};

// Throws sim::InputError naming file, line, body, word and what is allowed.
BodyLook read_body_look(const sim::BodyDef& body, const std::string& file);

// What the stress of a beam's vertices is made of (sim/section_stress.h).
struct BeamStress {
  struct Vertex {
    sim::SectionPoint at;
    // Between which stations, and how far; a second pair where section forces jump at the vertex: the larger stress is drawn.
    int station = 0, other = -1;
    double share = 0.0;
  };
  double youngs_modulus = 0.0, shear_modulus = 0.0;  // Pa
  std::vector<Vertex> vertices;
};

struct BodyModel {
  std::string name;
  render::Mesh mesh;                  // no triangles: drawn as markers at its nodes
  std::vector<glm::uvec3> triangles;  // of shading points
  std::vector<DetailLevel> levels;    // coarser ones, where they are many
  std::vector<glm::vec3> colors;      // per shading point where the mesh has vertex colours or several materials, else empty
  render::Material material;
  double yield_stress = 0.0;  // Pa: its colours by stress are shares of it
  float opacity = 1.0f;
  bool shares_of_yield = false;  // some body's are: those without a yield stress are grey
  bool flexible = false;         // elastic displacements move its vertices
  GhostStyle ghost = GhostStyle::body;
  std::optional<glm::vec3> ghost_color;
  EdgeLines edges = EdgeLines::none;
  std::vector<std::uint8_t> edge_flags;  // of the triangles; empty: all edges
  // EdgeLines::creases: shading points at both ends of each line and the triangles that meet there; -1: only one.
  struct Crease {
    int a = 0, b = 0, triangle = 0, other = -1;
  };
  std::vector<Crease> creases;
  bool by_length = false;  // colours by a vector's length or by stress: faces so coarse that corners do not tell what lies between
  std::vector<std::vector<int>> spine;  // of a thin beam: the positions of each ring of its mesh, from end to end
  bool closed = false;                  // back faces need not be drawn
  bool visible = true;
  interp::NormalLayout normals;
  std::vector<float> rest;                          // 3 M
  std::vector<glm::vec3> rest_normals;              // per shading point
  std::vector<int> vertex_nodes;                    // the node that each vertex is, of a surface of the results' own; else
  std::optional<interp::Map> map;                   // nodal series, or
  std::optional<interp::ModeColumns> modes;         // of a body whose nodes are linear in its coordinates
  std::optional<interp::ModeColumns> strain_modes;  // colour by strain of a body with coordinates whose motion is a nodal series
  std::optional<interp::ModeColumns> doubt;         // colour by map_error where the elements' shapes are known (interp/faces.h), else
  std::optional<interp::ErrorBar> error_bar;        // of other bodies
  std::optional<interp::ModeDoubt> mode_doubt;      // of `modes` by the kernel map
  bool from_cache = false;                          // the modes were read from RenderSettings::cache
  std::vector<int> welded;                          // colour by strain: vertices at one place have one number
  std::optional<interp::ModeColumns>
      stress;  // colour by stress of a modal body that knows its stress modes: 6 M rows, xx yy zz xy yz xz of each vertex, Pa
  // What vertices have besides: on a shell's other face, in other plates that meet there; what is largest of all is shown.
  struct OtherStress {
    std::vector<int> vertices;
    interp::ModeColumns stress;  // 6 rows a vertex
  };
  std::vector<OtherStress> other_stress;
  bool stress_of_loads = false;           // its last columns are of sim::InertiaLoads, what the modes leave out
  sim::Vec3 gravity = sim::Vec3::Zero();  // m/s^2, world
  std::optional<BeamStress> beam_stress;  // colour by stress of a beam, or
  std::optional<BeamStress> beam_strain;  // by strain: as stress whose moduli are one, see make_beam_strain; else strains are the mesh's
  std::shared_ptr<const interp::Corotated> corotated;
  std::vector<std::string> warnings;  // what was chosen or mended
  std::vector<std::string> refused;   // what was asked for and cannot be shown

  // The mesh as the kernel map sees it; valid as long as this body model.
  interp::MeshView view() const;
};

// What a body is drawn by beside its results.
struct BodyDrawing {
  const sim::BodyDef* def = nullptr;      // what the scene says of the body, or null
  double size = 1.0;                      // m, extent of the machine, for bodies that have no measure of their own
  std::vector<HoldingPlace> places;       // of a rigid body
  sim::Vec3 gravity = sim::Vec3::Zero();  // m/s^2, world
};
// Throws render::MeshError, interp::InputError, interp::MapError, sim::InputError.
BodyModel make_body_model(const sim::ResultBody& body, const BodyDrawing& drawing, const RenderSettings& settings, int index);

// Whether the results of a body hold what its stress is made of.
bool knows_stress(const sim::ResultBody& body);

// Buffers of one body, reused from picture to picture.
struct BodyMemory {
  interp::Points node_displacement, node_rotation;
  std::vector<double> q, load_strain;
  std::vector<float> displacement;       // 3 M, in scale
  std::vector<float> doubt;              // 3 M
  std::vector<float> scaled, positions;  // 3 M
  interp::PointsF group_normals;
};

// What strains a beam at a moment: elastic coordinates, and loads without deformation (load_strains; empty: none).
struct BeamState {
  const sim::ResultBody& body;
  std::span<const double> q, load_strain;
};

// Stress of a beam's vertices, Pa.
void beam_stresses(const BeamStress& stress, const BeamState& state, StressMeasure measure, std::span<float> out);

// The same as three numbers a vertex, linear in the state, whose length is the von Mises stress, Pa. Where section forces jump at a vertex
// those of its first side count.
void beam_stress_vectors(const BeamStress& stress, const BeamState& state, std::span<float> out);

// Displacement of the vertices in scale, 3 M floats in memory.displacement.
void update_displacement(const BodyModel& model, const sim::ResultBody& body, const SamplePlace& place, BodyMemory& memory);

// What the map may be wrong by at the vertices, m (RenderSettings::color_by map_error); empty where nothing tells it.
void map_error(const BodyModel& model, const sim::ResultBody& body, const SamplePlace& place, BodyMemory& memory, std::vector<float>& out);

// Warning that the mesh may be off by more than a twentieth of its deflection between the nodes in the motion that the results hold, or
// that nothing tells how far; empty: neither, or the elements' own shapes move it.
std::string doubtful_map(const BodyModel& model, const sim::Results& results, const sim::ResultBody& body);

// Positions and normals of the shading points with the displacement scaled; memory.displacement must be up to date.
void update_surface(const BodyModel& model, double scale, bool with_corotated, BodyMemory& memory, std::vector<glm::vec3>& positions,
                    std::vector<glm::vec3>& normals);

}  // namespace flexframe::film
