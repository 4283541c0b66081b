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

enum class FeShape { tetrahedron4, tetrahedron10, hexahedron8, hexahedron20, wedge6, wedge15, triangle3, quadrangle4, point_mass };

// How the stiffness of an element is integrated.
enum class FeFormulation { full, reduced, incompatible };

// Isotropic linear elasticity.
struct FeMaterial {
  std::string name;
  double youngs_modulus = 0.0;  // Pa
  double poisson = 0.0;         // -
  double density = 0.0;         // kg/m^3
};

struct FeElement {
  int id = 0;  // of the file
  FeShape shape = FeShape::tetrahedron4;
  FeFormulation formulation = FeFormulation::full;
  int material = -1;         // index, -1: none given
  double thickness = 0.0;    // shells, m; point mass: kg
  int first = 0, count = 0;  // nodes: connectivity[first .. first + count)
  int line = 0;              // of the file, 0: unknown (binary, included)
};

// A reference point tied to a set of nodes.
//   rigid: the nodes move as a rigid body with the reference point.
//   averaging: the reference point moves as the least-squares rigid fit of the nodes (weights 1); the nodes stay free of each other.
struct FeSpider {
  std::string name;
  bool rigid = true;
  int node = -1;            // index of the reference point, which may belong to no element
  std::vector<int> slaves;  // indices
  int line = 0;
};

struct FeConstraint {
  int node = -1;
  int dof = 0;  // 0..5: ux uy uz rx ry rz
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
  std::vector<FeSpider> spiders;
  std::vector<FeConstraint> constraints;  // *BOUNDARY with value zero
  std::optional<FeMatrices> matrices;     // instead of elements
  std::vector<std::string> notes;
};

// Factors from the file's units to SI.
struct FeUnits {
  double length = 1.0, mass = 1.0, time = 1.0;
  double stress() const { return mass / (length * time * time); }
  double density() const { return mass / (length * length * length); }
};

// "FILE:LINE" of an element, for messages; "FILE" where the line is unknown.
std::string place_of(const FeModel& model, const FeElement& element);

int fe_node_count(FeShape shape);
bool fe_is_solid(FeShape shape);
bool fe_is_shell(FeShape shape);
const char* fe_name(FeShape shape);

// Corner faces of a solid or shell, outward, as places in the element's node list: 3 or 4 corners each.
const std::vector<std::vector<int>>& fe_faces(FeShape shape);

// Abaqus / CalculiX input file: *NODE *ELEMENT *NSET *ELSET *SURFACE *MATERIAL *ELASTIC *DENSITY *SOLID SECTION *SHELL SECTION *MASS
// *BOUNDARY *RIGID BODY *COUPLING *KINEMATIC *DISTRIBUTING *INCLUDE; steps are passed over. Words that would change the structure and are
// not known are refused with file and line.
FeModel read_inp(const std::filesystem::path& path, const FeUnits& units = {});

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

// Checks what any maker may get wrong: elements without material or thickness, non-positive constants, inside-out elements are left to
// assembly.
void check_model(const FeModel& model);

// Outer surface: corner faces that belong to one element only (shell faces always), as node indices.
std::vector<std::vector<int>> outer_faces(const FeModel& model);

}  // namespace flexframe::sim
