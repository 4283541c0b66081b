// Private to fe_inp*.cpp: the tables of an Abaqus / CalculiX input file become a model. Instances are placed and elements made
// (fe_inp.cpp), names looked up (fe_inp_names.cpp), sections, masses and springs given (fe_inp_sections.cpp), nodes tied and held
// (fe_inp_ties.cpp).
#pragma once

#include "sim/reduce/fe_complaints.h"
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_inp_tables.h"
#include "sim/reduce/fe_tie.h"

#include <functional>
#include <set>
#include <tuple>
#include <unordered_map>

namespace flexframe::sim {

// A scope where it stands: the deck outside of parts, or an instance of a part.
struct InpSpace {
  std::string name;
  size_t scope = 0;
  Mat3 turn = Mat3::Identity();
  Vec3 shift = Vec3::Zero();
  int first_node = 0;             // of the model
  std::vector<int> first, count;  // of the model's elements, per element of the scope
};

struct InpElementRef {
  int space = 0, local = 0;
  auto operator<=>(const InpElementRef&) const = default;  // NOLINT(modernize-use-nullptr): what clang-tidy 14 sees in every <=>
};

class InpResolver {
 public:
  InpResolver(InpDeck d, const std::string& file) : deck(std::move(d)) { model.file = file; }
  FeModel run();

 private:
  InpDeck deck;
  FeModel model;
  FeComplaints complaints;
  std::vector<InpSpace> spaces;
  std::map<int, Mat3> transformed;                       // node -> its axes
  std::map<int, InpKind> kinds;                          // of lumped elements
  std::map<int, int> rotation_nodes;                     // node that stands for the rotations of another
  std::map<int, Vec3> pilots;                            // of *MPC, MEANROT: nodes whose first motion is a turn about this axis
  std::vector<int> offsets;                              // of the numbers of each space, to those of the model
  std::unordered_map<int, const InpSection*> sectioned;  // element -> the section that it has
  std::set<std::pair<const InpSection*, const InpSection*>> told_sections;
  std::map<int, int> beam_directions;                            // beam -> node that its first direction points to
  std::vector<PartialMean> partial_means;                        // distributing couplings of some directions
  std::vector<bool> turning;                                     // nodes that have rotations of their own
  std::map<int, bool> rectangles;                                // beam sections that nodal thicknesses may change: RECT, or CIRC
  std::map<std::tuple<int, std::string, int>, int> rectangular;  // space, orientation, leading axis -> axes
  InpScope& scope(int space) { return deck.scopes[spaces[space].scope]; }
  [[noreturn]] void fail(const InpPlace& place, const std::string& text) const {
    throw InputError(fmt::format("{}: {}", deck.where(place), text));
  }
  void place_spaces();
  // What CalculiX does otherwise with shells and beams.
  void tell_bricks();
  // Index in the model of a node by its number; -1: not there. A number outside of parts may be meant for the only instance.
  int node_by_id(int space, int id);
  void add_elements(int space);

  // Names.
  int space_by_name(const std::string& name) const;
  // The space and own name that a name means, seen from `space`: its own, INSTANCE.NAME, one outside of parts, one of the only instance.
  template <class Has>
  std::optional<std::pair<int, std::string>> find(int space, const std::string& name, const Has& has) {
    if (has(space, name)) return std::pair(space, name);
    if (const size_t dot = name.find('.'); dot != std::string::npos) {
      const int other = space_by_name(name.substr(0, dot));
      if (other >= 0 && has(other, name.substr(dot + 1))) return std::pair(other, name.substr(dot + 1));
    }
    if (space != 0 && has(0, name)) return std::pair(0, name);
    if (space == 0 && spaces.size() == 2 && has(1, name)) return std::pair(1, name);
    return std::nullopt;
  }
  std::optional<std::vector<int>> node_set(int space, const std::string& name);
  void add_node_set(int space, const std::string& name, std::set<int>& out, std::set<std::pair<int, std::string>>& visited);
  // "INSTANCE.12"; -1: none.
  int dotted_node(const std::string& name);
  int instance_of(int space, const std::string& name) const;
  std::optional<std::vector<InpElementRef>> element_set(int space, const std::string& name);
  std::optional<InpElementRef> element_by_id(int space, int id);
  void add_element_set(int space, const std::string& name, std::set<InpElementRef>& out, std::set<std::pair<int, std::string>>& visited);
  std::vector<int> nodes_of(const std::vector<InpElementRef>& elements);
  std::vector<int> model_elements(const std::vector<InpElementRef>& elements);
  // Nodes by a number, INSTANCE.NUMBER or a set.
  std::vector<int> nodes_named(int space, const std::string& where, const InpPlace& place);
  int one_node(int space, const std::string& where, const InpPlace& place);
  std::vector<int> elements_named(int space, const std::string& set, const InpPlace& place, const char* what);
  // Sets of instances have the instance's name before theirs where there are several, or where the plain name is taken.
  void name_sets();

  // Sections.
  int material_named(const std::string& name, const InpPlace& place) const;
  const InpAxes* axes_named(int space, const std::string& name, const InpPlace& place, int& whose);
  // Place of the axis of an orientation, as made for an element, that is the material's first one.
  int leading_axis(const InpAxes& axes, const Mat3& made, const std::string& name, const InpPlace& place, const FeElement& e);
  // Index of the axes of an orientation for an element: one for all where it is rectangular.
  int axes_for(int space, const std::string& name, const InpPlace& place, const FeElement& e);
  // Two materials of one name.
  void refuse_other_materials();
  void add_section(int space, const InpSection& s);
  // Where an element has another section already.
  void warn_of_section(int element, const InpSection& s);
  // Layers with orientations of their own; cylindrical ones differ from element to element, and so does then the layup.
  void set_layer_axes(int space, const InpSection& s, FeElement& e);
  std::optional<FeBeamSection> circle(const InpSection& s);
  std::optional<FeBeamSection> i_section(const InpSection& s) const;
  void add_beam_section(int space, const InpSection& s, const std::vector<int>& elements);
  // Mean of the nodes' thicknesses, of shells and of beams that are rectangles or circles (diameters).
  void add_thickness(int space);

  // Masses and springs.
  void add_masses(int space);
  void give_lump(FeElement& e, const FeLump& lump);
  // Volume, or of shells their area, or of beams their length; and whether it is there.
  double extent(const FeElement& e) const;
  // *NONSTRUCTURAL MASS as more density: a material of its own for each material of the set.
  void add_distributed_mass(int space, const InpValue& v);
  // Direction of motion d at a node: translations for d < 3, rotations else.
  Vec3 direction(int node, int d) const;
  void add_springs(int space, const InpValue& v);
  void need_properties();

  // Ties.
  void add_transform(int space, const InpTransform& t);
  void mark_turning();
  // Faces of a surface of elements, as nodes of the model; a shell's face is all of it, an edge of it its nodes (edges), or all of it too.
  std::vector<std::vector<int>> faces_of(int space, const std::string& name, const InpPlace& place, bool edges = true);
  std::vector<int> in_model(const FeElement& e, const std::vector<int>& places) const;
  std::vector<int> face_of(const FeElement& e, const std::string& name, const std::string& face, const InpPlace& place, bool edges) const;
  void add_free_faces(const std::vector<int>& elements, std::vector<std::vector<int>>& out) const;
  // Nodes of a surface, and each one's share of its area (for element faces; 1 else).
  std::map<int, double> weights_of_surface(int space, const std::string& name, const InpPlace& place);
  void add_tie(int space, const InpTie& t);
  int add_reference(const std::map<int, double>& nodes);
  // A kinematic coupling of some directions only: an equation for each. true: made.
  bool partly(int space, const InpTie& t, const FeSpider& spider);
  // A distributing coupling of some directions only; true: kept for later.
  bool partial_mean(int space, const InpTie& t, const FeSpider& spider);
  void add_surface_tie(int space, const InpTie& t);
  void add_mpc(int space, const InpMpc& m);
  // A term in the node's own directions as terms in space.
  void add_term(int node, int dof, double coefficient, FeEquation& out) const;
  void add_flat(const InpMpc& m, const std::vector<int>& nodes);
  void add_mean_rotation(const InpMpc& m, const std::vector<int>& nodes, int pilot);
  void add_equation(int space, const InpEquation& given);
  void add_boundary(int space, const InpBoundary& b);
};

}  // namespace flexframe::sim
