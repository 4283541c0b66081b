// Private to fe_nastran.cpp (cards, coordinate systems, grids, materials), fe_nastran_elements.cpp and fe_nastran_ties.cpp (rigid elements,
// supports, equations), fe_nastran_beams.cpp, fe_nastran_masses.cpp, fe_nastran_rigid.cpp: Nastran bulk data become a model.
#pragma once

#include "sim/reduce/fe_complaints.h"
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_nastran_cards.h"
#include "sim/reduce/fe_tie.h"

#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <unordered_map>

namespace flexframe::sim {

// Coordinates: origin and axes in space; cylindrical and spherical ones have angles in degrees.
struct NastranCoordinates {
  char kind = 'R';
  Vec3 origin = Vec3::Zero();
  Mat3 axes = Mat3::Identity();

  Vec3 place(const Vec3& x) const {
    constexpr double degree = std::numbers::pi / 180.0;
    Vec3 local = x;
    if (kind == 'C') local = Vec3(x.x() * std::cos(degree * x.y()), x.x() * std::sin(degree * x.y()), x.z());
    if (kind == 'S')
      local = x.x() * Vec3(std::sin(degree * x.y()) * std::cos(degree * x.z()), std::sin(degree * x.y()) * std::sin(degree * x.z()),
                           std::cos(degree * x.y()));
    return origin + axes * local;
  }

  // Directions at a place.
  Mat3 directions(const Vec3& at) const {
    if (kind == 'R') return axes;
    const Vec3 r = axes.transpose() * (at - origin);
    const double phi = std::atan2(r.y(), r.x());
    Mat3 local;
    local.col(0) = Vec3(std::cos(phi), std::sin(phi), 0.0);
    local.col(1) = Vec3(-std::sin(phi), std::cos(phi), 0.0);
    local.col(2) = Vec3::UnitZ();
    if (kind == 'S') {
      const double theta = std::atan2(std::hypot(r.x(), r.y()), r.z());
      const Vec3 out = local.col(0), around = local.col(1);
      local.col(0) = std::sin(theta) * out + std::cos(theta) * Vec3::UnitZ();
      local.col(1) = std::cos(theta) * out - std::sin(theta) * Vec3::UnitZ();
      local.col(2) = around;
    }
    return axes * local;
  }
};

// A card of elements, and what becomes of it.
struct NastranElementCard {
  const char* name;
  FeShape shape;
  int corners;
  std::vector<int> order;  // place in the card of our node i; more nodes than corners: the quadratic one
  FeShape quadratic;
};
const std::vector<NastranElementCard>& nastran_element_cards();

// A grid whose own card is complained of.
struct NastranMissingGrid {};

class NastranReader {
 public:
  NastranReader(NastranDeck d, const FeUnits& u, const std::string& file) : deck(std::move(d)), units(u) { model.file = file; }
  FeModel run();

 private:
  NastranDeck deck;
  FeUnits units;
  FeModel model;
  FeComplaints complaints;
  std::map<int, const NastranCard*> grids, materials, properties, coordinate_cards;
  std::map<int, NastranCoordinates> known_coordinates;
  std::vector<const NastranCard*> elements, ties, supports, equations;
  const NastranCard *grid_defaults = nullptr, *bar_defaults = nullptr, *beam_defaults = nullptr;  // GRDSET, BAROR, BEAMOR
  std::set<std::string> told;
  std::set<int> bad_grids;                               // whose own cards are complained of
  std::map<std::string, int> refused_more;               // of a refusal: how often again
  std::map<int, std::string> other_properties;           // cards of properties that cannot be read
  std::map<int, const NastranCard*> missing_properties;  // the first card that names each
  std::map<int, std::set<int>> unions;                   // SPCADD, MPCADD
  std::unordered_map<int, int> node_at;
  std::map<int, int> displacement;  // node -> coordinates of its motions
  std::map<int, int> material_at, shell_layup, shear_materials;
  std::map<int, std::pair<const NastranCard*, size_t>> springs, scalar_masses;  // PELAS, PMASS: card and field of the number
  std::set<int> element_ids, mass_ids;
  std::vector<PartialMean> partial_means;                         // RBE3 of some motions
  std::map<std::pair<int, int>, int> middles;                     // of edges whose middle grid is left out
  std::map<std::pair<int, std::array<double, 3>>, int> arm_ends;  // of beams beside their grids: grid and offset -> node
  std::vector<bool> turning_nodes;
  std::optional<std::set<int>> tied_grids;  // that rigid elements name
  std::set<int> solid_grids;                // found with them
  double weight_to_mass = 1.0;

  void once(std::map<int, const NastranCard*>& table, const NastranCard& c);
  void sort_card(const NastranCard& c);
  // Cards that make no part of the structure that can be read; false: another one.
  bool refused_card(const NastranCard& c);
  // Properties of scalar elements, more than one a card.
  void scalar_properties(std::map<int, std::pair<const NastranCard*, size_t>>& table, const NastranCard& c, size_t step);
  // Runs it and keeps its complaint, unless it is that a grid is missing that has a complaint of its own.
  template <class Work>
  void attempt(const Work& work) {
    try {
      complaints.guarded(work);
    } catch (const NastranMissingGrid&) {
      return;
    }
  }
  void refuse(const NastranCard& c, const std::string& text);
  void note_other(const NastranCard& c);
  // Materials without density where the model has mass elsewhere.
  void allow_massless();

  // Places and directions.
  const NastranCoordinates& coordinates(const NastranCard& from, int id, int depth = 0);
  // Lengths in SI, angles left.
  Vec3 scaled(char kind, const Vec3& x) const;
  Vec3 grid_place(const NastranCard& from, int id, int depth = 0);
  void add_grid(const NastranCard& c);
  int node(const NastranCard& c, size_t field);
  int node_of(const NastranCard& c, int id);
  int node_if(const std::string& id) const;  // -1: no such grid
  Mat3 directions(const NastranCard& c, int node);
  void hold(const NastranCard& c, int node, int dof);

  // Materials and properties.
  void add_material(int id, const NastranCard& c);
  double across(const NastranCard& c, size_t field);
  int material(const NastranCard& c, size_t field);
  const NastranCard& property(const NastranCard& c, std::initializer_list<const char*> names);
  // A material with more density: non-structural mass.
  int heavier(int material, double more);
  double area_mass() const { return units.mass * weight_to_mass / (units.length * units.length); }

  // Elements.
  FeElement& put(const NastranCard& c, FeShape shape, const std::vector<int>& nodes);
  void add_element(const NastranCard& c);
  void finish_shell(const NastranCard& c, const NastranCard& p, int theta, FeElement& e);
  void set_shear(const NastranCard& p, FeLayup& layup);
  int shear_material(int id, const FeMaterial& given);
  void set_faces(const NastranCard& p, FeLayup& layup);
  // The thickness at an element's own grids where it gives some, m; their mean, with a warning where they differ.
  double thickness_of(const NastranCard& c, FeShape shape, double otherwise);
  int find_layup(const FeLayup& layup);
  // PCOMP; thickness comes back.
  int composite(const NastranCard& p, double offset, double& thickness);
  void turn_outward(FeShape shape, std::vector<int>& nodes);
  // A new node, with a number beyond those of the grids.
  int new_node(const Vec3& x);
  // The node in the middle of an edge whose grid is left out: it moves as the mean of its ends.
  int middle_node(const NastranCard& c, FeShape shape, int place, const std::vector<int>& corners);
  void add_beam(const NastranCard& given);
  // The node where a beam ends that a rigid arm joins to its grid.
  int end_beside(const NastranCard& c, int grid, const Vec3& offset);
  // A node of its own for an end that is released in some of the beam's directions, tied to the old one in the others.
  int released_end(const NastranCard& c, int end, const std::vector<int>& dofs, const Mat3& axes);
  FeBeamSection section(const NastranCard& p, Eigen::Vector2d& beside);
  void tapered(const NastranCard& p, FeBeamSection& s, Eigen::Vector2d& beside);
  FeBeamSection section_by_shape(const NastranCard& p);
  void finish_rod(const NastranCard& c, int a, int b, int material, const FeBeamSection& s);
  void add_rod(const NastranCard& c);
  void lump(const NastranCard& c, const std::vector<int>& nodes, MatX K, MatX M, bool turns);
  void add_spring(const NastranCard& c);
  // Grids and motions of a scalar element, one or two.
  std::vector<std::pair<int, int>> scalar_ends(const NastranCard& c);
  // What it measures: b . u is the motion of its first end less that of its second. nodes, turns: of the lump.
  VecX between(const NastranCard& c, const std::vector<std::pair<int, int>>& ends, std::vector<int>& nodes, bool& turns);
  void add_scalar_mass(const NastranCard& c);
  void add_mass_matrix(const NastranCard& c);
  void add_bush(const NastranCard& c);
  size_t bush_stiffness(const NastranCard& p);
  Vec3 bush_place(const NastranCard& c, const std::vector<int>& nodes);
  // Whether a grid has rotations for a rigid arm; asked once all other elements are there.
  bool arms_turn(int grid);
  void add_mass(const NastranCard& c);

  // Ties and supports.
  // Whether a node has rotations of its own; asked once all elements are there.
  bool turning(int node);
  // Grids from a field on, with THRU.
  std::vector<int> grids_from(const NastranCard& c, size_t field);
  void add_tie(const NastranCard& c);
  // Some motions only, in the dependent grid's directions.
  void partly(const NastranCard& c, int reference, int slave, const std::set<int>& dofs);
  void add_rbe3(const NastranCard& c, FeSpider s);
  // Motions of grids that follow six independent ones as a rigid body does, linear: grid and its motions (0..5).
  void add_rigid(const NastranCard& c, const std::vector<std::pair<int, std::vector<int>>>& independent,
                 const std::vector<std::pair<int, std::vector<int>>>& dependent);
  void add_rbe1(const NastranCard& c);
  void add_rigid_bar(const NastranCard& c, size_t grids_there);
  void add_rigid_rod(const NastranCard& c);
  // Whether a set of supports or equations is asked for; without case control, every one.
  bool asked(const char* what, int sign, int set) const;
  // Where case control chooses several sets, or one that is not there.
  void warn_of_choice(const char* what, int sign, const std::vector<const NastranCard*>& cards);
  void add_conditions();
};

}  // namespace flexframe::sim
