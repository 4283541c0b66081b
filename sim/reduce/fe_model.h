// A finite element model as read from a file: plain data, not yet matrices. Lengths, stiffness and density in SI once read
// (readers scale by FeUnits). Node order of elements is Abaqus' (corners, then mid-edge nodes), whatever the file.
#pragma once

#include "sim/base/types.h"

#include <Eigen/Sparse>

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace flexframe::sim {

// lumped: stiffness and mass are given as they are (springs, masses with inertia, beams).
enum class FeShape {
  tetrahedron4,
  tetrahedron10,
  hexahedron8,
  hexahedron20,
  wedge6,
  wedge15,
  triangle3,
  quadrangle4,
  point_mass,
  triangle6,
  quadrangle8,
  beam2,
  lumped
};

// How the stiffness of an element is integrated.
enum class FeFormulation { full, reduced, incompatible };

// Linear elasticity, isotropic or with a matrix in the material's own axes.
struct FeMaterial {
  std::string name;
  double youngs_modulus = 0.0;  // Pa; of an anisotropic one the stiffness along its first axis
  double poisson = 0.0;         // -
  double density = 0.0;         // kg/m^3
  double shear_modulus = 0.0;   // Pa, of beams and rods alone; 0: E / 2 (1 + nu)
  bool massless = false;        // without density on purpose: the model has its mass elsewhere
  std::optional<Mat6> elasticity =
      std::nullopt;  // Pa, in the material's axes: stress from strain, xx yy zz xy yz xz, engineering shear strains
};

// A layer of a composite shell; layers lie on each other along the shell's normal, the first at the bottom.
struct FeLayer {
  double thickness = 0.0;  // m
  int material = -1;       // index
  int axes = -1;           // index of FeModel::axes, -1: the element's
  double angle = 0.0;      // rad about the shell's normal, from those axes
  bool operator==(const FeLayer&) const = default;
};

// What a shell is made of where it is more than a thickness of one material about its nodes.
struct FeLayup {
  std::vector<FeLayer> layers;  // empty: the element's own material and thickness
  double offset = 0.0;          // of the nodes from the middle, along the normal, in thicknesses
  double bending = 1.0;         // of one layer: its bending stiffness by that of a solid plate; 0: a membrane
  int bending_material = -1;    // of one layer: the material that bends, -1: its own
  int shear_material = -1;      // of one layer: the material of its transverse shear, -1: its own
  double shear = 1.0;           // its stiffness against transverse shear by that of a solid plate
  // Of one layer: heights above its middle where stress is told, m; nullopt: its own faces.
  std::optional<double> lower_face = std::nullopt, upper_face = std::nullopt;
  bool operator==(const FeLayup&) const = default;
};

// Section of a beam about its centroid, in the directions n1 (given) and n2 = t x n1 (t: from its first node to its second).
struct FeBeamSection {
  double area = 0.0, I11 = 0.0, I22 = 0.0, I12 = 0.0;  // m^2; m^4: I11 = int x2^2 dA, I22 = int x1^2 dA, I12 = int x1 x2 dA
  double torsion = 0.0;                                // m^4, Saint-Venant's constant
  double shear1 = 0.0, shear2 = 0.0;                   // m^2, areas that carry shear; 0: rigid in shear
  double mass_per_length = 0.0;                        // kg/m besides the material's
  Vec3 n1 = Vec3(0, 0, -1);
  bool truss = false;  // stretching, and twisting where `torsion` > 0: its nodes pass on no moments across the axis
  bool turns() const { return !truss || torsion > 0.0; }  // whether its nodes have rotations
};

// Stiffness and mass of a lumped element, six motions a node (ux uy uz rx ry rz) or three.
struct FeLump {
  MatX K, M;
  bool turns = false;  // six motions a node
};

struct FeElement {
  int id = 0;  // of the file
  FeShape shape = FeShape::tetrahedron4;
  FeFormulation formulation = FeFormulation::full;
  int material = -1;         // index, -1: none given
  double thickness = 0.0;    // shells, m; point mass: kg
  int section = -1;          // index of layups (shells; -1: none), beam_sections (beams) or lumps
  int axes = -1;             // index of FeModel::axes: the material's, -1: the space's (shells: x projected on the surface)
  int first = 0, count = 0;  // nodes: connectivity[first .. first + count)
  int line = 0;              // of the file, 0: unknown (binary, included)
};

// A reference point tied to a set of nodes.
//   rigid: the nodes move as a rigid body with the reference point.
//   averaging: the reference point moves as the weighted least-squares rigid fit of the nodes; the nodes stay free of each other.
struct FeSpider {
  std::string name;
  bool rigid = true;
  int node = -1;                // index of the reference point, which may belong to no element
  std::vector<int> slaves;      // indices
  int line = 0;                 // of the file
  std::vector<double> weights;  // of an averaging one, as slaves; empty: equal
  std::vector<double> turns;    // of its nodes' rotations, as slaves, m^2 (a length squared times the weight); empty: they do not count
};

struct FeConstraint {
  int node = -1;
  int dof = 0;                    // 0..5: ux uy uz rx ry rz
  Vec3 direction = Vec3::Zero();  // not zero: the motion along it instead (translation for dof < 3, rotation otherwise)
};

// Sum of coefficient times motion is zero.
struct FeEquation {
  struct Term {
    int node = -1, dof = 0;  // as FeConstraint
    double coefficient = 0.0;
  };
  std::vector<Term> terms;  // the first is the dependent one where that is possible
  int line = 0;
};

// A model given as matrices: row i belongs to degree of freedom `dof` of node `node`.
struct FeMatrices {
  Eigen::SparseMatrix<double> K, M;  // symmetric, both triangles
  std::vector<int> node, dof;
};

struct FeModel {
  std::string file;
  std::vector<int> node_ids;      // of the file
  std::vector<Vec3> nodes;        // m
  std::vector<int> connectivity;  // node indices
  std::vector<FeElement> elements;
  std::vector<FeMaterial> materials;
  std::map<std::string, std::vector<int>> node_sets, element_sets;  // indices, ascending; names in upper case
  std::vector<FeLayup> layups;
  std::map<int, VecX> node_thickness;  // by index of a 6- or 8-node shell whose thickness changes: at its nodes, m
  std::vector<FeBeamSection> beam_sections;
  std::vector<FeLump> lumps;
  std::vector<Mat3> axes;  // columns: material axes in space
  std::vector<FeSpider> spiders;
  std::vector<FeEquation> equations;
  std::vector<FeConstraint> constraints;  // supports: *BOUNDARY, SPC1
  std::optional<FeMatrices> matrices;     // instead of elements
  std::vector<std::string> notes;
  std::vector<std::string> warnings;  // what makes the numbers other than its user may expect
};

// Factors from the file's units to SI.
struct FeUnits {
  double length = 1.0, mass = 1.0, time = 1.0;
  double stress() const { return mass / (length * time * time); }
  double density() const { return mass / (length * length * length); }
};

// Systems of units by name: m (m kg s), mm (mm t s), mm-kg-s, mm-kg-ms, mm-g-ms, cm-g-s, in-lbf-s; nullopt for others.
std::optional<FeUnits> units_named(const std::string& name);

// A sentence for each material that is no solid in the units it was read in (density, stiffness or speed of sound out of range), with the
// units that would make one of it.
std::vector<std::string> unit_warnings(const FeModel& model, const FeUnits& read_as);

// A sentence where solids lie on the very nodes of others: their mass and stiffness count twice.
std::vector<std::string> doubled_solids(const FeModel& model);

// Of a mesh whose elements are its cells of most dimensions: warns where others, whose nodes are given, are no part of them (bars between
// solids, a frame under a plate) and so are left out.
void warn_of_loose_cells(FeModel& model, const std::vector<std::vector<int>>& others);

// "FILE:LINE" of an element, for messages; "FILE" where the line is unknown.
std::string place_of(const FeModel& model, const FeElement& element);

// Number of nodes of a shape; is it a solid, a shell; its name in messages ("20-node hexahedron").
int fe_node_count(FeShape shape);
bool fe_is_solid(FeShape shape);
bool fe_is_shell(FeShape shape);
const char* fe_name(FeShape shape);

// Corner faces of a solid or shell, outward, as places in the element's node list: 3 or 4 corners each.
const std::vector<std::vector<int>>& fe_faces(FeShape shape);
// Place of the node in the middle of the edge between corners a and b; -1: the element has none there.
int fe_middle(FeShape shape, int a, int b);
// All nodes of face k: its corners, then the middles of its edges.
std::vector<int> fe_face_nodes(FeShape shape, int k);

// What becomes of contact pairs, which a linear body cannot have: the deck is refused, their surfaces are tied, or they stay open.
enum class FeContact { refuse, tie, open };

// Abaqus / CalculiX input file: nodes, elements, sets, surfaces, materials, sections, supports (of the first step too), parts and
// instances, equations, couplings, ties, springs and masses: the words are listed in REDUCE.md; other contents of steps are passed over.
// Hyperelastic materials have their initial moduli, with a warning; elasticity that depends on temperature is that of the initial one.
// Everything that would change the structure and cannot be read is refused, all of it in one InputError with file and line.
FeModel read_inp(const std::filesystem::path& path, const FeUnits& units = {}, FeContact contact = FeContact::refuse);

// Nastran bulk data (.bdf .nas .dat), small, large and free fields, continuations by name: GRID GRDSET CORD1x CORD2x CTETRA CHEXA CPENTA
// (middle grids may lack) CQUAD4 CQUAD8 CTRIA3 CTRIA6 (thicknesses at grids) CBAR BAROR CBEAM BEAMOR (offsets, released ends) CROD CONROD
// CTUBE CELAS1 CELAS2 CBUSH CMASS1 CMASS2 CONM1 CONM2 RBE1 RBE2 RBE3 RBAR RROD RTRPLT MPC SPC SPC1 PSHELL PCOMP PCOMPG PSOLID PBAR PBARL
// PBEAM PBEAML PROD PTUBE PELAS PMASS PBUSH MAT1 MAT2 MAT8 MAT9 MAT11 INCLUDE; PARAM WTMASS. A material without density is taken as it is
// where the model has other mass, with a warning. Everything that would change the structure and cannot be read is refused, all of it in
// one InputError.
FeModel read_nastran(const std::filesystem::path& path, const FeUnits& units = {});

// gmsh mesh, formats 2.2 and 4.1, ASCII and binary. Physical groups become node and element sets (elements of the highest dimension only);
// no materials.
FeModel read_msh(const std::filesystem::path& path, const FeUnits& units = {});

// K and M as Matrix Market (.mtx, coordinate, real, symmetric or general) or as CalculiX writes them for *FREQUENCY, SOLVER=MATRIXSTORAGE
// (NAME.sti NAME.mas NAME.dof). `nodes`: text table "id x y z" a line for the coordinates (or an .inp, whose nodes are taken). dofs:
// CalculiX' NAME.dof ("node.dof" a line); without it 3 a node in the table's order.
FeModel read_fe_matrices(const std::filesystem::path& stiffness, const std::filesystem::path& mass, const std::filesystem::path& nodes,
                         const std::filesystem::path& dofs, const FeUnits& units = {});

// Gives elements without material one: to all, or to those of an element set. Throws InputError for an unknown set, naming those there are.
void set_material(FeModel& model, const FeMaterial& material, const std::string& element_set = "");

// Gives materials that lack it a density or an elasticity (name empty: all that lack it). Throws InputError for an unknown name or where
// none lacks it.
void complete_density(FeModel& model, const std::string& name, double density);
void complete_elasticity(FeModel& model, const std::string& name, double youngs_modulus, double poisson);

// Checks what any maker may get wrong: elements without material or thickness, non-positive constants, inside-out elements are left to
// assembly.
void check_model(const FeModel& model);

// Outer surface: corner faces that belong to one element only (shell faces always), as node indices.
std::vector<std::vector<int>> outer_faces(const FeModel& model);

}  // namespace flexframe::sim
