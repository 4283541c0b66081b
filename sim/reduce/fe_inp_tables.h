// What an Abaqus / CalculiX input file says, as tables: names and numbers as the file has them, not yet looked up. Coordinates and
// constants are in SI.
#pragma once

#include "sim/reduce/fe_inp_lines.h"
#include "sim/reduce/fe_model.h"

#include <set>
#include <unordered_map>

namespace flexframe::sim {

// What an element of the file becomes.
enum class InpKind {
  element,        // solid or shell
  beam,           // one or two beams
  truss,          // stretching only
  mass,           // point mass
  rotary,         // rotary inertia
  spring_ground,  // SPRING1
  spring_dofs,    // SPRING2
  spring_axial,   // SPRINGA
  rigid_shape,    // shape of a rigid body: its nodes only
  point,          // node of a distributing coupling
  left_out        // told of: dashpots
};

struct InpType {
  const char* name;
  InpKind kind;
  FeShape shape;
  FeFormulation formulation;
  int nodes;
};

struct InpElement {
  int id = 0;
  const InpType* type = nullptr;
  int first = 0;      // of InpScope::connectivity
  int direction = 0;  // of a beam: node behind its own, to which the section's first direction points from the first; 0: none
  InpPlace place;
};

// Members of a set; `instance` says whose, empty: of the scope that the set stands in.
struct InpMembers {
  std::string instance;
  std::vector<int> ids;
  std::vector<std::array<int, 3>> ranges;  // first, last, step: of what is there in the end; `ids` has what was there before
  std::vector<std::string> names;
  std::vector<std::string> elements_of;  // element sets whose nodes are members
};
using InpSet = std::vector<InpMembers>;

struct InpSurface {
  bool nodes = false;
  std::vector<std::pair<std::string, std::string>> parts;  // set or number, face or empty
  InpPlace place;
};

struct InpLayer {
  double thickness = 0.0;
  std::string material, orientation;
  double angle = 0.0;
};

struct InpSection {
  std::string set, material, orientation;
  bool shell = false, beam = false, own_constants = false;
  std::string shape;            // of a beam
  std::vector<double> numbers;  // dimensions: thickness, or of the beam's shape, SI lengths
  std::vector<InpLayer> layers;
  double offset = 0.0;
  bool nodal_thickness = false;
  Vec3 n1 = Vec3(0, 0, -1);
  double young = 0.0, shear = 0.0, density = 0.0;  // of a general section with its own
  InpPlace place;
};

// A value for a set of elements.
struct InpValue {
  std::string set, unit, orientation;
  std::vector<double> numbers;
  std::vector<std::vector<double>> lines;  // of a spring: as they stand, since a line that may be blank is missing
  InpPlace place;
};

struct InpTie {
  enum class Kind { rigid, coupling, kinematic, surfaces, weights } kind = Kind::rigid;
  bool averaging = false, adjust = true;
  std::string name, set, element_set, surface, reference, rotation_node, master;
  std::string orientation;                              // of the directions of a kinematic one
  std::vector<std::pair<int, int>> dofs;                // of a kinematic one; empty: all
  std::vector<std::pair<std::string, double>> members;  // set or node, weight
  double tolerance = -1.0;
  double radius = -1.0;   // of a coupling: nodes farther from the reference point are left out; negative: none
  bool rotations = true;  // of tied surfaces: those of shells are tied too
  InpPlace place;
};

struct InpBoundary {
  std::string where;
  std::vector<int> dofs;  // 0..5
  bool step = false;
  InpPlace place;
};

struct InpEquation {
  struct Term {
    std::string node;
    int dof = 0;
    double coefficient = 0.0;
  };
  std::vector<Term> terms;
  InpPlace place;
};

struct InpMpc {
  std::string type;
  std::vector<std::string> nodes;
  InpPlace place;
};

// Directions: rectangular (the same everywhere) or those of a cylinder.
struct InpAxes {
  bool cylindrical = false;
  Vec3 a = Vec3::UnitX(), b = Vec3::UnitY();
  int about = 0;  // axis of an additional rotation, 0: none
  double angle = 0.0;
  // Columns: the axes at a place. false: the points give no directions.
  bool at(const Vec3& place, Mat3& axes) const;
};

struct InpTransform {
  std::string set;
  InpAxes axes;
  InpPlace place;
};

struct InpThickness {
  std::string where;                 // node or set
  double first = 0.0, second = 0.0;  // m; of a beam along n1 and n2
  InpPlace place;
};

// A part, or what stands outside of all parts (the whole file where it has none).
struct InpScope {
  std::string name;
  std::unordered_map<int, int> node_at, element_at;
  std::vector<int> node_ids;
  std::vector<Vec3> nodes;
  std::vector<InpElement> elements;
  std::vector<int> connectivity;  // node numbers
  std::map<std::string, InpSet> node_sets, element_sets;
  std::map<std::string, InpSurface> surfaces;
  std::map<std::string, InpAxes> orientations;
  std::vector<InpThickness> nodal_thickness;
  std::vector<InpSection> sections;
  std::vector<InpValue> masses, rotaries, springs, added_masses;
  std::vector<InpTie> ties;
  std::vector<InpBoundary> boundaries;
  std::vector<InpEquation> equations;
  std::vector<InpMpc> mpcs;
  std::vector<InpTransform> transforms;
};

struct InpInstance {
  std::string name;
  size_t scope = 0;
  Mat3 turn = Mat3::Identity();
  Vec3 shift = Vec3::Zero();  // x = turn x_part + shift
};

// Elastic constants of a material in the file's units, a row for each temperature.
struct InpElastic {
  size_t material = 0;
  std::string kind;
  std::vector<std::pair<double, std::vector<double>>> rows;
  InpPlace place;
};

struct InpDeck {
  std::vector<InpScope> scopes;  // the first: outside of parts
  std::vector<InpInstance> instances;
  std::vector<FeMaterial> materials;
  std::vector<InpPlace> material_places;
  std::vector<std::string> files, notes, warnings, refusals;
  bool abaqus = false;                          // words that only Abaqus has: parts, *OUTPUT
  bool incomplete = false;                      // a file that is named is not there
  bool elements_refused = false;                // of a type that is not known: they have numbers and no nodes
  double length = 1.0, force_per_length = 1.0;  // of the file's units in SI
  std::string where(const InpPlace& place) const;
};

// Throws InputError for what is no input file; what cannot be part of a body is collected in `refusals`.
InpDeck read_inp_tables(const std::filesystem::path& path, const FeUnits& units, FeContact contact);

// Tables to model; used by read_inp. Throws InputError with all refusals.
FeModel resolve_inp(InpDeck deck, const std::string& file);

}  // namespace flexframe::sim
