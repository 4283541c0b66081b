// The mechanism: constant data that the equations of motion need, made once from a scene (model_build.h).
//
// Parts are the dynamic bodies (a mixed beam has one a volume). Each part hangs on another part or on ground by one tree joint;
// the remaining joints close loops. Parts on a common loop form a cluster, every other part is a cluster of its own; the recursion of
// dynamics.h runs over clusters (articulated-body algorithm with local constraint embedding: Jain, Multibody Syst Dyn 28, 2012;
// Chignoli, Adrian, Kim, Wensing 2023).
//
// Coordinates: q_all holds, part by part in cluster order, the joint's coordinates and the elastic ones; w_all the rates likewise
// (they differ in number where an orientation is a quaternion). A prescribed joint has no coordinates.
#pragma once

#include "sim/base/notes.h"
#include "sim/base/spatial.h"
#include "sim/bodies/beam.h"
#include "sim/bodies/flexible_body.h"
#include "sim/scene/scene.h"
#include "sim/scene/table.h"

#include <string>
#include <vector>

namespace flexframe::sim {

inline constexpr int ground = -1;

// A frame fixed to a node of a part (node < 0: to the body frame), moved by a constant offset. On ground: offset in world axes.
struct FramePoint {
  int part = ground;
  int node = -1;
  Pose offset;
  std::string node_name;  // of a flexible part's node, until bodies are made
  std::string name;       // "crank.tip", for messages
};

// Kinds whose relative motion coordinates describe; S and the order of coordinates: joint_motion.h.
struct TreeJoint {
  std::string name;
  int scene_joint = -1;  // -1: made by the program (free body, weld inside a beam)
  JointKind kind = JointKind::free;
  bool reversed = false;          // the tree runs from the scene's child to its parent
  int inboard = 0, outboard = 0;  // frames: on the parent part, on this part
  Vec3 axis = Vec3::UnitZ();
  double pitch = 0.0;
  std::shared_ptr<const SpaceCurve> curve;  // curve_slide
  int nq = 0, nv = 0;                       // coordinates and rates (0 where prescribed)
  int motion = -1;                          // index into Model::expressions, -1: free
  std::optional<Spring> spring;             // on every rate of the joint
  std::optional<Friction> friction;
  std::optional<Stop> stop;
  int link = -1;  // of a lumped beam: between its pieces link and link + 1
};

// The frame in which a part's deformation is shown, where it differs from the body frame of its equations of motion: that of the
// boundary which the scene names, found from the root and tip nodes.
struct ShownFrame {
  bool differs = false;
  Boundary boundary = Boundary::clamped_free;
  int root = 0, tip = 0;  // frames of the model
  MatX coordinates;       // n x n: the scene's elastic coordinates from those of the equations of motion
};

struct Part {
  std::string name;
  int scene_body = -1;  // -1: the massless link of a joint that closes a loop and has coordinates
  int piece = 0;        // of the body's chain
  Pose rest_in_body;    // undeformed pose of the part in the body's frame
  FlexibleBody body;
  ShownFrame shown;
  TreeJoint joint;
  int parent = ground;
  int cluster = 0;
  int q0 = 0, v0 = 0;        // first joint coordinate in q_all, first joint rate in w_all
  int eq0 = 0, ev0 = 0;      // first elastic coordinate, first elastic rate
  double load_factor = 0.0;  // length per mass, m/kg: a uniform load per length is a uniform acceleration times this
};

// One scalar closure condition between frames a and b, as a constant direction in the axes of a:
//   translation: e . p,   angle: u . (R b),   distance: (|p|^2 - L^2) / (2 L)     with (R, p) the pose of b in a.
struct ClosureRow {
  enum Kind { translation, angle, distance } kind = translation;
  Vec3 u = Vec3::Zero(), b = Vec3::Zero();
  double length = 0.0;
};

// The springs of a lumped beam (BeamLinks): link i acts on the coordinates of the tree joint of parts[i].
struct Flexure {
  int scene_body = -1;
  BeamLinks links;
  std::vector<int> parts;
  double length = 0.0;           // of the beam, m
  double mass_per_length = 0.0;  // kg/m
  double polar_inertia = 0.0;    // per length, kg m
  Mat3X held;                    // moments in place of the springs' (linearisation about a loaded state), or empty
};

struct LoopJoint {
  std::string name;
  int scene_joint = -1;
  JointKind kind = JointKind::revolute;
  int a = 0, b = 0;  // frames: parent side, child side
  Vec3 axis = Vec3::UnitZ();
  std::vector<ClosureRow> rows;
  std::optional<Spring> spring;
};

// One more closure condition of a cluster, on coordinates of its tree joints: their sum by these factors keeps its value. A rope's length
// along its frames counts too.
struct CouplingRow {
  struct Term {
    int part = 0, rate = 0;  // of the part's joint; a prescribed joint follows its motion
    double factor = 0.0;
    std::shared_ptr<const TimeFunction> of;  // of the coordinate; null: the coordinate itself
  };
  std::string name;
  int scene_coupling = -1;
  std::vector<Term> terms;
  std::vector<int> frames;  // rope: one after the other
  double value = 0.0;
  double scale = 1.0;   // of the scene's factors over these
  bool length = false;  // the residual is one in m, else in rad
};

struct Cluster {
  std::vector<int> parts;   // parents before children
  int parent = ground;      // part outside the cluster that carries it
  int base = 0;             // frame on that part
  std::vector<Pose> entry;  // per part whose parent is outside: pose of its inboard frame in the base frame (identity for the first)
  std::vector<int> loops;   // loop joints closed inside
  std::vector<int> couplings;
  std::vector<int> frames;  // flexible frames that its joints and loops sit on
  int q0 = 0, nq = 0, v0 = 0, nv = 0;
  double size = 1.0;  // m, to scale closure errors
  // Of each rate, m per unit: what a joint moves with arms as long as the cluster (0: an elastic one), and the largest displacement of a
  // node by an elastic one, rotations with such arms (0: a joint's).
  std::vector<double> joint_reach, elastic_reach;
};

// A force or torque on a frame, or a spring-damper between two.
struct Load {
  ForceDef def;
  int on = 0, from = 0;  // frames
  int expression = -1;
  std::shared_ptr<const CubicTable> table;  // value against a joint's coordinate
  int table_part = -1;                      // part whose joint that is
  int function = -1;                        // instead of the expression: of Model::functions
  int rest = -1;                            // expression of a spring's rest
  int contact = -1;                         // place among the contacts
  std::vector<int> path;                    // cable: its frames from `from` to `on`, both included
};

// A quantity of the present state that expressions read: no acceleration, no force.
struct Signal {
  Quantity quantity = Quantity::position;
  int frame = -1, relative_to = -1;  // relative_to -1: the world
  int component = 0;
  std::vector<int> path;    // length and rate of a cable: its frames
  int part = -1, rate = 0;  // value and rate of that part's joint
  int block = -1;           // an output of this block
};

// An expression that reads signals.
struct StateFunction {
  Expression expression;
  std::vector<int> signals;  // in the order of expression.variables()
  std::string owner;         // "force 'drive'", for messages
};

struct Block {
  int scene_block = -1;
  std::vector<int> inputs;  // functions
  MatX A, B, C, D;
  VecX initial;
  double sample = 0.0;  // s, 0: continuous
  int z0 = -1;          // first of its states in the state's z, of a continuous one
};

// States and sizes of a contact's friction.
struct Contact {
  int load = -1;
  int side = 0;  // of a cylinder's ends: -1, 1; else 0
  int z0 = -1;   // three states: how far the surfaces have gone since they stick, axes of `from`; -1: no friction
};

// Work of a force of the scene, a further state: J since the start.
struct ForceWork {
  std::string force;
  std::vector<int> loads;
  int z0 = -1;
};

// Rates that carry no inertia (massless.h). The first `moving` follow from the balance of springs and dampers, the others rest.
struct MasslessRates {
  std::vector<int> rates;          // of w_all, locked in their clusters
  std::vector<int> cluster, lock;  // where: ClusterWork::locked
  int moving = 0;
  MatX Z;      // nv x rates: motions that move no mass, identity on the rates
  VecX scale;  // m per unit of each rate
};

// An effect of a body as it stands in the model: what `flexframe effects` tells.
struct EffectState {
  int body = -1;       // of the scene
  std::string owner;   // its name
  std::string effect;  // a name of the registry (effects.h)
  bool on = false;
  bool possible = true;  // false: the scene's symmetry excludes it, exactly
  std::string by;        // who decided: "scene", "symmetry", "program", "file"
  std::string why;       // half a sentence
  int coordinates = 0;   // elastic coordinates that it brings
};

struct Model {
  std::string title;
  SimulationSettings settings;
  std::vector<Part> parts;  // clusters contiguous, parents before children
  std::vector<FramePoint> frames;
  std::vector<LoopJoint> loops;
  std::vector<Flexure> flexures;
  std::vector<std::vector<int>> pieces;  // of every body of the scene: its parts from root to tip
  std::vector<Cluster> clusters;         // parents before children
  std::vector<Load> loads;
  std::vector<TimeFunction> expressions;
  std::vector<Signal> signals;
  std::vector<StateFunction> functions;
  std::vector<Block> blocks;  // in the order in which their outputs can be evaluated
  std::vector<Contact> contacts;
  std::vector<CouplingRow> couplings;
  std::vector<ForceWork> works;
  int nz = 0;  // further states: of blocks, contacts and works
  MasslessRates massless;
  Notes notes;                       // what was decided while building
  std::vector<EffectState> effects;  // of the flexible bodies, body by body
  int nq = 0, nv = 0;                // sizes of q_all and w_all
  double size = 1.0;                 // m, of the whole mechanism
  double mass = 0.0;                 // kg
};

// Whether the coordinates of a cluster have conditions to keep.
inline bool has_closure(const Cluster& c) { return !c.loops.empty() || !c.couplings.empty(); }
// "loop of joint 'pin'" or "coupling 'gears'": what closes a cluster, by its first.
inline std::string closure_of(const Model& model, const Cluster& c) {
  return c.loops.empty() ? "coupling '" + model.couplings[c.couplings.front()].name + "'"
                         : "joint '" + model.loops[c.loops.front()].name + "'";
}

// Whether a part hangs on another one of the same cluster; else on what carries the cluster.
inline bool hangs_inside(const Model& model, int part) {
  const Part& p = model.parts[part];
  return p.parent != ground && model.parts[p.parent].cluster == p.cluster;
}

}  // namespace flexframe::sim
