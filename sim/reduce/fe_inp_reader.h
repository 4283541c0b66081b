// Private to fe_inp_tables.cpp (which keyword does what), fe_inp_mesh.cpp (lines of nodes, elements, sets, instances) and
// fe_inp_properties.cpp (lines of materials, sections, ties, supports): the reader of an Abaqus / CalculiX input file.
#pragma once

#include "sim/reduce/fe_inp_tables.h"

#include <fmt/format.h>

namespace flexframe::sim {

Mat3 turned_about(const Vec3& axis, double degrees);

class InpTableReader : public InpLines {
 public:
  InpTableReader(const FeUnits& u, FeContact c) : units(u), contact(c) {
    deck.scopes.emplace_back();
    deck.length = u.length;
    deck.force_per_length = u.mass / (u.time * u.time);
  }
  InpDeck take(const std::filesystem::path& path) {
    read(path);
    try {
      // Behind a fault constants may be incomplete; the deck is refused for it anyway.
      if (faults.empty()) settle_elastics();
    } catch (const InputError& e) {
      faults.emplace_back(e.what());
    }
    deck.files = files;
    deck.incomplete = incomplete;
    deck.refusals.insert(deck.refusals.end(), faults.begin(), faults.end());
    return std::move(deck);
  }

 protected:
  void keyword(const InpKeyword& given) override;
  void data(std::string_view text) override;
  void finish_keyword() override;
  // Lines count where one that is blank stands for what it could say.
  void blank() override {
    if (k.name == "BEAM GENERAL SECTION" && lines > 0) ++lines;
  }
  bool passed_over() const override { return skip; }
  void abandon(bool keyword) override {
    pending.clear();
    terms.clear();
    if (keyword) skip = true;
  }

 private:
  FeUnits units;
  FeContact contact;
  InpDeck deck;
  std::vector<InpElastic> elastics;
  std::vector<double> temperatures;          // *INITIAL CONDITIONS, as they stand
  std::set<std::string> tying_interactions;  // of contact pairs that never open
  std::string interaction;
  InpKeyword k;
  std::string_view line;
  std::vector<std::string_view> f;
  size_t scope = 0;
  int step = 0;  // 0: before the first
  bool ended = false;
  bool expands = false;   // a material does, by *EXPANSION
  bool perturbs = false;  // the present step, small motions about the state that those before it reached
  bool preloads = false;  // one of those had loads
  int lines = 0;          // of data of the present keyword
  bool skip = false;
  const InpType* type = nullptr;
  bool refused_type = false;  // of the present elements: only their numbers are taken
  std::vector<int> pending;   // numbers of an element that runs over lines
  std::vector<double> numbers;
  std::vector<std::string> terms;
  int wanted = 0;
  Mat3 system_axes = Mat3::Identity();  // *SYSTEM
  Vec3 system_origin = Vec3::Zero();
  std::vector<double> system_points;
  std::set<std::string> told;

  InpScope& s() { return deck.scopes[scope]; }
  std::string up(const char* key) const { return inp_upper(k.get(key)); }
  std::string need(const char* key) const;
  void note(const std::string& text) {
    if (told.insert(text).second) deck.notes.push_back(text);
  }
  void refuse(const std::string& text) {
    skip = true;
    if (told.insert(text).second) deck.refusals.push_back(fmt::format("{}: {}", where(at), text));
  }
  double value(size_t i, const char* what, double otherwise) const { return i < f.size() && !f[i].empty() ? real(f[i], what) : otherwise; }

  // Keywords; those that answer: whether it was one of theirs. Steps: supports of the first are the model's.
  void in_step();
  void begin_step();
  void tell_of_load();
  void warn_once(const char* word, const std::string& text);
  bool structure();
  void begin_element();
  bool set_word();
  FeMaterial& material();
  // Of a material that has a keyword twice.
  void warn_again();
  bool material_word();
  bool section_word();
  void begin_section();
  bool tie_word();
  void other_word();
  // Parameters of a keyword that is read, which nobody here knows: a warning.
  void tell_unknown_parameters();

  // Lines of data.
  void read_data();
  void read_node();
  static void add_member(InpSet& set, int id);
  void read_element();
  void read_set(InpSet& set, const std::unordered_map<int, int>& there);
  void read_ngen();
  // A node that a keyword makes, where none has its number, and its place in the keyword's NSET.
  void make_node(int id, const Vec3& x);
  // Numbers of the nodes in a set, ascending, as the sets of decks are unless they say otherwise.
  std::vector<int> bounding_nodes(std::string_view name);
  // Nodes on straight lines from those of one set to those of another: 'set, set, intervals, step of the numbers'. The keyword's NSET has
  // the two sets' nodes too.
  void read_nfill();
  // Copies of an element along up to three directions: 'element, then for rows, columns and layers: number, step of the nodes, step of the
  // elements'.
  void read_elgen();
  void copy_element(const InpElement& from, long id, long shift);
  static size_t constants(const std::string& kind);
  void read_elastic();
  void finish_elastic();
  // Constants at the initial temperature to the materials.
  void settle_elastics();
  void give_elasticity(const InpElastic& given, const std::vector<double>& constants);
  void read_hyperelastic();
  void contact_pair();
  void read_thickness();
  void read_section();
  void read_rotary();
  // Directions (SPRING1, SPRING2; a blank line for SPRINGA), then the stiffness.
  void read_spring();
  void read_added_mass();
  void read_axes(InpAxes& axes);
  void read_orientation();
  void read_tie();
  void read_boundary();
  void read_equation();
  void read_mpc();
  void read_system();
  void read_instance();
};

}  // namespace flexframe::sim
