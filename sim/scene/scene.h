// The scene as plain data: exactly what the scene file says (SCENE.md), checked for itself, not yet a mechanism.
// Vectors and rotations as in the file; SI units. `line` is the line of the table in the file, for messages.
#pragma once

#include "sim/base/types.h"

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace flexframe::sim {

class SpaceCurve;    // curve.h
class TimeFunction;  // table.h

enum class Method { automatic, adams, bdf, erk, dirk, ida, exponential };
// Their words, in this order; the word of one.
inline const std::vector<std::string>& method_words() {
  static const std::vector<std::string> words{"auto", "adams", "bdf", "erk", "dirk", "ida", "exponential"};
  return words;
}
inline const char* method_name(Method method) { return method_words()[static_cast<std::size_t>(method)].c_str(); }

// An accuracy asked of the pictures: no drawn vertex farther than this from where it belongs. Kept by render/film/picture_accuracy, which
// knows cameras and maps.
struct PictureAccuracy {
  double value = 0.0;   // m on the drawn body (exaggerated as drawn), or pixels
  bool pixels = false;  // of the picture
  std::string words;    // as given: "0.5 px"
};

struct SimulationSettings {
  double duration = 0.0;                            // s, > 0
  double output_rate = 1000.0;                      // samples per second
  Vec3 gravity = Vec3::Zero();                      // m/s^2
  std::optional<double> tolerance;                  // relative local error, default 1e-6
  std::optional<double> accuracy;                   // asked error of the outputs relative to their range; excludes tolerance
  std::optional<PictureAccuracy> picture_accuracy;  // instead of `accuracy`
  std::optional<double> max_steps;                  // a run that would take more steps ends with a sentence; none: default_max_steps
  Method method = Method::automatic;
  bool static_start = false;  // start = "static": from static equilibrium of the whole mechanism
};

// Steps that a run may take where nobody says otherwise.
inline constexpr double default_max_steps = 5e6;

// Points of a function; file: where they came from, empty: the scene.
struct TableDef {
  std::filesystem::path file;
  std::vector<double> x, y;
  std::optional<double> period;
};

// Cross-section in the body's yz plane, coordinates from the centroid. Made by sim/scene/section.h.
struct Section {
  std::string shape;                   // circle tube rectangle box i u t l general
  std::map<std::string, double> size;  // the numbers given, by name, m
  double area = 0.0;                   // m^2
  double iy = 0.0, iz = 0.0;           // second moments of area about y (bending xz) and z (bending xy), m^4
  double iyz = 0.0;                    // int y z dA, m^4
  double j = 0.0;                      // torsion constant, m^4
  double shear_y = 0.0,
         shear_z = 0.0;   // shear correction factors (area factor k), 0 where unknown: 1/k is what a force along y slides along y
  double shear_yz = 0.0;  // of both directions that 1/k of what a force along one of them slides along the other
  std::vector<std::vector<Eigen::Vector2d>>
      outline;  // closed loops (y, z): outer first, holes after; empty: drawn as a circle of equal area
};

// A section at a place of a beam. Between two of one shape its sizes change linearly; two at one place are a step.
struct SectionStation {
  double at = 0.0;  // x/L
  Section section;
};

struct Material {
  double density = 0.0;         // kg/m^3
  double youngs_modulus = 0.0;  // Pa
  double poisson = 0.3;         // -
};

enum class BeamModel { finite_element, modal, mixed, lumped };
enum class Boundary { clamped_free, supported_supported, supported_free, free_free, clamped_clamped, clamped_supported };

struct Damping {
  std::vector<double> ratio;           // one number: all modes; several: per mode
  double mass = 0.0, stiffness = 0.0;  // Rayleigh: De = mass Me + stiffness Ke
};

// Effects asked for; automatic = "auto" (the default).
struct EffectChoice {
  bool automatic = true;
  std::vector<std::string> names;    // axial bending_xy bending_xz torsion stiffening shear gyroscopic damping ...
  std::vector<std::string> without;  // left out, whatever else says that they are on
};

// What the program chose for a beam beyond the scene's words; no reader sets it.
struct ProgramChoice {
  bool effects = false;           // EffectChoice::names are what a requested accuracy or the motion needs, not the scene's
  std::string held_by;            // joint whose loop holds the beam's length (held_lengths.h): automatic effects count axial in
  bool complete_inertia = false;  // the truncated kinetic energy did not last (complete_inertia.h)
  // Above 0: nothing but weight bends the beam (idle_bending.h), and automatic effects go without bending. The lowest frequency at which it
  // bends, rad/s.
  double first_bending = 0.0;
};

struct FlexibleInitial {
  std::vector<double> q, qd;  // elastic coordinates and rates, empty: zero
  bool static_start = false;  // start from static equilibrium
};

struct RigidDef {
  double mass = 0.0;
  Vec6 inertia = Vec6::Zero();  // xx yy zz xy xz yz about the centre of mass (tensor elements), kg m^2
  Vec3 centre_of_mass = Vec3::Zero();
  std::map<std::string, Vec3> frames;  // name -> position in the body frame (axes parallel)
};

struct BeamDef {
  double length = 0.0;
  Section section;
  std::vector<SectionStation> stations;    // sections along the beam, ascending; empty: `section` throughout
  std::shared_ptr<const SpaceCurve> axis;  // curved: in the body frame, from its origin along x; null: straight
  Material material;
  BeamModel model = BeamModel::finite_element;
  Boundary boundary = Boundary::clamped_free;
  int elements = 10;                              // per volume for mixed
  int volumes = 5;                                // mixed
  std::optional<int> keep_modes;                  // finite elements: only this many lowest eigenmodes of each direction; none: all
  std::optional<int> keep_axial, keep_torsion;    // with keep_modes: of these directions fewer; none: keep_modes
  bool keep_static = true;                        // and the static deflections by loads
  bool keep_inertia = false;                      // and those by the inertia of motions of the joints
  std::map<std::string, std::vector<int>> modes;  // modal: direction -> ordinal numbers (1-based)
  bool curvature_coupling = false;                // lumped: neighbour coupling (Chudnovsky et al. 2006)
  EffectChoice effects;
  Damping damping;
  std::map<std::string, double> frames;  // name -> x/L in [0, 1]
  FlexibleInitial initial;
  bool all_elements = false;  // finite elements: the scene gives or asks for their coordinates one by one
  ProgramChoice chosen;
};

struct ModalDef {
  std::filesystem::path file;  // SID file, absolute or relative to the scene file (resolved)
  EffectChoice effects;
  Damping damping;
  FlexibleInitial initial;
};

// Chudnovsky et al. 2006 eq. 5, 6: eta'' + 2 Gamma eta' + Omega eta = Sigma u, y = Theta eta. u and y run over the ports, a port after the
// other: force x y z (and torque x y z), displacement x y z (and rotation x y z), all in the body frame.
struct StateSpaceDef {
  std::filesystem::path file;       // where the matrices came from, empty: the scene
  MatX gamma, omega, sigma, theta;  // n x n, n x n, n x 3p or 6p, 3p or 6p x n
  std::vector<std::string> ports;   // p names of rigid.frames
  RigidDef rigid;
  FlexibleInitial initial;
};

// A solid of simple form on a rigid body. Along z of its own frame where it has an axis; `from` and `to` give that frame to those that
// reach from one point to another. Zero: not given, or chosen by what draws it.
enum class ShapeKind { box, plate, cylinder, disc, capsule, sphere, link, spring, gear };
struct ShapeDef {
  ShapeKind kind = ShapeKind::box;
  Vec3 size = Vec3::Zero();      // box; plate: length, width, thickness; m
  double radius = 0.0;           // m; of a gear wheel: of its pitch circle
  double inner_radius = 0.0;     // m, bore of cylinder, disc, gear wheel
  double length = 0.0;           // m, along z: cylinder, disc, gear wheel; capsule, link, spring: between the ends
  double width = 0.0;            // m, of a link: diameter of its eyes
  double thickness = 0.0;        // m, of a link
  double hole = 0.0;             // m, of a link: diameter of the holes in its eyes
  double wire = 0.0;             // m, of a spring: radius of its wire
  int turns = 8, teeth = 0;      // spring; gear wheel
  Vec3 position = Vec3::Zero();  // of its frame in the body, m
  Mat3 axes = Mat3::Identity();  // of its frame, body axes
  double density = 0.0;          // kg/m^3
  std::string color;             // word of the renderer, empty: the body's
};

// How a mesh file lies in the body frame: vertex = position + axes * scale * what the file says.
struct MeshPlacement {
  double scale = 1.0;
  Vec3 position = Vec3::Zero();  // m
  Mat3 axes = Mat3::Identity();
};

struct BodyDef {
  std::string name;
  int line = 0;
  std::variant<RigidDef, BeamDef, ModalDef, StateSpaceDef> kind;
  std::optional<std::filesystem::path> mesh;  // Wavefront mesh in the body frame (resolved)
  MeshPlacement mesh_placement;
  std::map<std::string, Mat3> frame_axes;      // name -> axes of a turned frame in the body's, columns; of a beam in its section's
  std::vector<ShapeDef> shapes;                // rigid: what it looks like, and where asked for what it weighs
  std::map<std::string, std::string> drawing;  // further drawing words, kept as text for the renderer (colour, ...)
};

// "ground", "ground.frame", "body" or "body.frame", split; frame empty: the body's own frame.
struct FrameRef {
  std::string body, frame;
};

// The last three are no words of the scene file: joints of small rotation vectors inside lumped beams, and the slide along a curve that
// carries the point of a point-on-curve joint.
enum class JointKind {
  weld,
  revolute,
  prismatic,
  cylindrical,
  universal,
  spherical,
  planar,
  free,
  screw,
  point_on_line,
  point_on_plane,
  distance,
  constant_velocity,
  point_on_curve,
  pin_slot,
  flexure,
  flexure_pair,
  curve_slide
};

struct Spring {
  double stiffness = 0.0, damping = 0.0, rest = 0.0, preload = 0.0;
};
struct Friction {
  double coefficient = 0.0;
  double normal_force = 0.0;
  bool reaction = false;                     // normal_force = "reaction"
  double radius = 1.0;                       // m: rotary joints: torque = coefficient * normal_force * radius
  std::optional<double> static_coefficient;  // default: coefficient
  std::optional<double> regularised;         // velocity scale of the regularised law; none: exact stick-slip events
};
struct Stop {
  std::optional<double> lower, upper;
  double stiffness = 0.0, damping = 0.0;
};

struct JointInitial {
  std::optional<std::vector<double>> value, rate;
  std::optional<std::vector<double>> guess;  // instead of value: where the assembly of loops begins
};

struct JointDef {
  std::string name;
  int line = 0;
  JointKind kind = JointKind::weld;
  FrameRef parent, child;
  Vec3 axis = Vec3::UnitZ();                // unit, in the parent frame
  Vec3 position = Vec3::Zero();             // of the parent joint frame relative to the parent frame, m
  Vec3 rotation = Vec3::Zero();             // axis-angle, rad, likewise
  double pitch = 0.0;                       // screw, m/rad
  double length = 0.0;                      // distance joint, m
  std::shared_ptr<const SpaceCurve> curve;  // point-on-curve joint, in the parent joint frame
  JointInitial initial;
  std::string motion;                    // expression of t, empty: free (or a table)
  std::optional<TableDef> motion_table;  // value against t
  std::optional<Spring> spring;
  std::optional<Friction> friction;
  std::optional<Stop> stop;
};

// user: what a function of the program that drives the simulation says (sim/simulation.h); no word of scene files.
enum class ForceKind { force, torque, spring_damper, distributed, bushing, drag, contact, user };

// A frame as a user's force sees it: time (s), its place (m) and axes (columns: its x, y, z) in the world, its velocity (m/s) and angular
// velocity (rad/s) in world axes.
struct FrameMoment {
  double t = 0.0;
  Vec3 position = Vec3::Zero();
  Mat3 rotation = Mat3::Identity();
  Vec3 velocity = Vec3::Zero();
  Vec3 angular_velocity = Vec3::Zero();
};
// What it answers: force (N) at the frame's origin and torque (Nm), world axes.
struct UserWrench {
  Vec3 force = Vec3::Zero();
  Vec3 torque = Vec3::Zero();
};
// Called in every evaluation of the equations of motion: the same answer for the same question, and as smooth as an integrator likes it.
using UserForce = std::function<UserWrench(const FrameMoment&)>;

// A number that the program which drives a simulation sets while it runs (sim/simulation.h); elsewhere it keeps its first value.
struct InputDef {
  std::string name;
  int line = 0;
  double value = 0.0;  // at the start
};

// What an expression reads beside t.
struct Reading {
  enum Kind { output, block, length, rate } kind = output;  // length, rate: of the spring or actuator itself
  std::string name;                                         // as the expression writes it
  int index = 0;                                            // of Scene::outputs or Scene::blocks
  int component = 0;                                        // of its columns
};

// A point, sphere or cylinder on frame `on` against a plane, sphere or curve on frame `from`, or a curve on `on` against a plane.
struct ContactDef {
  double radius = 0.0;                      // m, 0: a point
  bool cylinder = false;                    // about `axis`, in the axes of `on`; its ends are `width` apart
  bool own_curve = false;                   // the curve is the body's own, convex, against a plane
  Vec3 axis = Vec3::UnitZ();                // unit
  double width = 0.0;                       // m
  double from_radius = 0.0;                 // m, of the sphere; 0: a plane or a curve
  std::shared_ptr<const SpaceCurve> curve;  // profile in the xy plane of `from` (own_curve: of `on`), the same all along its z
  Vec3 normal = Vec3::UnitZ();              // unit, of the plane, in the axes of `from`
  double stiffness = 0.0;                   // N/m^exponent
  double exponent = 1.0;                    // 1.5: Hertz
  double damping = 0.0;                     // D, s/m: force k d^n (1 + D d'); with a restitution its c (dynamics/contacts.h)
  double restitution = 1.0;                 // instead of damping; 1: none is lost
  double friction = 0.0;                    // coefficients
  double static_friction = 0.0;             // >= friction
  double tangential_stiffness = 0.0, tangential_damping = 0.0;  // N/m, N s/m: while it sticks
};

struct ForceDef {
  std::string name;  // may be empty
  int line = 0;
  ForceKind kind = ForceKind::force;
  FrameRef on;
  FrameRef from{"ground", ""};     // spring-damper, bushing: the other end
  Vec3 direction = Vec3::UnitZ();  // unit
  bool follower = false;           // frame = "body"
  std::string value = "0";         // expression of t: N, Nm, or N/m (distributed)
  std::string driven;              // the same with names of inputs in it; empty: it names none
  UserForce user;                  // kind user
  std::optional<TableDef> table;   // instead of value: against t, or against the coordinate of table_joint
  std::string table_joint;
  std::vector<Reading> reads;            // of value; empty: it depends on t alone
  std::string rest;                      // spring-damper: expression of t in place of spring.rest
  bool cable = false;                    // spring-damper that only pulls: all it does stands in `value`
  std::vector<FrameRef> through;         // cable: frames that it passes between `from` and `on`
  double drag = 0.0, square_drag = 0.0;  // drag: N s/m, N s^2/m^2
  Vec3 wind = Vec3::Zero();              // drag: m/s, world axes
  std::optional<ContactDef> contact;
  Spring spring;                                                          // spring-damper
  Vec6 bushing_stiffness = Vec6::Zero(), bushing_damping = Vec6::Zero();  // translations then rotations
};

enum class Quantity {
  position,
  velocity,
  acceleration,
  rotation,
  angular_velocity,
  displacement,
  value,
  rate,
  reaction,
  q,
  qd,
  energy,
  kinetic,
  strain,
  potential,
  distance,
  distance_rate,
  angle,
  length,
  length_rate,
  force,
  power,
  spring_force,
  stop_force,
  friction_force,
  section_force,
  stress,
  work,
  output,     // of a block
  expression  // of other columns
};

// Factor times a coordinate of a joint, or times a function of it.
struct CouplingTerm {
  std::string joint;
  int coordinate = 0;
  double factor = 0.0;
  std::shared_ptr<const TimeFunction> of;          // null: the coordinate itself
  std::optional<std::pair<double, double>> range;  // of the coordinate, where the function's table ends
};

// The sum of its terms keeps the value that it has at the start, or `value`. The kinds of the scene are all of this form; a rope has its
// length between the frames that it passes in the sum.
struct CouplingDef {
  std::string name;
  int line = 0;
  std::vector<CouplingTerm> terms;
  std::vector<FrameRef> through;  // rope
  std::optional<double> value;
};

// x' = A x + B u, y = C x + D u; sampled: x+ = A x + B u at every period, y held in between.
struct BlockDef {
  std::string name;
  int line = 0;
  std::vector<std::string> inputs;          // expressions
  std::vector<std::string> driven;          // the same with names of inputs in them; empty: they name none
  std::vector<std::vector<Reading>> reads;  // of each
  MatX A, B, C, D;
  VecX initial;
  double sample = 0.0;  // s, 0: continuous
};

enum class ReactionFrame { world, parent, child };

struct OutputDef {
  std::string name;
  int line = 0;
  FrameRef of;  // a frame, body, joint (frame empty) or "system"
  Quantity quantity = Quantity::position;
  std::optional<FrameRef> relative_to;         // frame outputs: seen from this frame, in its axes; none: from the world
  ReactionFrame frame = ReactionFrame::world;  // axes of a reaction's components
  std::vector<std::string> shown_from;         // displacement: frames of the body from which it is measured instead of its key `shown`
  std::string description;                     // as given, or empty
  std::string expression;                      // quantity expression: of other columns and t
  std::string unit;                            // likewise
  double size = 0.0;  // what its errors are measured against, in its unit; 0: its range (histories.h). No reader sets it
};

// An expression's text with the values of inputs, to the last bit, in place of their names.
std::string with_inputs(std::string_view text, const std::vector<InputDef>& inputs);

struct Scene {
  std::filesystem::path file;
  std::string text;  // the file's text
  std::string title;
  SimulationSettings simulation;
  std::map<std::string, Vec3> ground_frames;  // [ground] frames: name -> place in the world, m
  std::map<std::string, Mat3> ground_axes;    // of those that are turned: name -> axes in the world, columns
  std::vector<InputDef> inputs;
  std::vector<BodyDef> bodies;
  std::vector<JointDef> joints;
  std::vector<ForceDef> forces;
  std::vector<OutputDef> outputs;
  std::vector<CouplingDef> couplings;
  std::vector<BlockDef> blocks;
  // [render] color_by = "stress" or "strain": results then hold what forces along beams and torques about them strain where no deformation
  // tells it.
  bool colored_by_stress = false;
  std::vector<std::string> doubts;  // of what may be read in two ways how it is read, for warnings
};

// Axes of a frame in its body, of a beam in its section, on ground in the world: columns; those of the body where the scene turns no frame
// of that name.
inline Mat3 frame_axes(const BodyDef& body, const std::string& frame) {
  const auto at = body.frame_axes.find(frame);
  return at == body.frame_axes.end() ? Mat3(Mat3::Identity()) : at->second;
}
inline Mat3 frame_axes(const Scene& scene, const FrameRef& ref) {
  if (ref.body == "ground")
    if (const auto at = scene.ground_axes.find(ref.frame); at != scene.ground_axes.end()) return at->second;
  for (const BodyDef& body : scene.bodies)
    if (body.name == ref.body) return frame_axes(body, ref.frame);
  return Mat3::Identity();
}

}  // namespace flexframe::sim
