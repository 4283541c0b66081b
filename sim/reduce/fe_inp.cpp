// Tables of an Abaqus / CalculiX input file to a model: what stands where. See read_inp in fe_model.h.
#include "sim/reduce/fe_inp_resolver.h"

#include <algorithm>

namespace flexframe::sim {

FeModel InpResolver::run() {
  model.notes = deck.notes;
  model.warnings = deck.warnings;
  model.materials = deck.materials;
  complaints.texts = deck.refusals;
  refuse_other_materials();
  place_spaces();
  // What follows would only name what is missing with the file.
  if (deck.incomplete) complaints.raise(model.file);
  for (int i = 0; i < static_cast<int>(spaces.size()); ++i) add_elements(i);
  name_sets();
  for (int i = 0; i < static_cast<int>(spaces.size()); ++i) {
    for (const InpSection& s : scope(i).sections) complaints.guarded([&] { add_section(i, s); });
    complaints.guarded([&] { add_thickness(i); });
    add_masses(i);
    for (const InpTransform& t : scope(i).transforms) complaints.guarded([&] { add_transform(i, t); });
  }
  for (int i = 0; i < static_cast<int>(spaces.size()); ++i)
    for (const InpValue& v : scope(i).springs) complaints.guarded([&] { add_springs(i, v); });
  mark_turning();
  for (int i = 0; i < static_cast<int>(spaces.size()); ++i) {
    // Surfaces of elements that cannot be read have no faces.
    for (const InpTie& t : scope(i).ties)
      if (!deck.elements_refused) complaints.guarded([&] { add_tie(i, t); });
    for (const InpMpc& m : scope(i).mpcs) complaints.guarded([&] { add_mpc(i, m); });
  }
  for (int i = 0; i < static_cast<int>(spaces.size()); ++i) {
    for (const InpEquation& e : scope(i).equations) complaints.guarded([&] { add_equation(i, e); });
    for (const InpBoundary& b : scope(i).boundaries) complaints.guarded([&] { add_boundary(i, b); });
  }
  complaints.guarded([&] { add_partial_means(model, std::move(partial_means), turning); });
  if (complaints.texts.empty()) need_properties();
  complaints.raise(model.file);
  tell_bricks();
  return std::move(model);
}

void InpResolver::refuse_other_materials() {
  std::map<std::string, size_t> first;
  for (size_t i = 0; i < deck.materials.size(); ++i) {
    const FeMaterial& m = deck.materials[i];
    const auto [at, fresh] = first.try_emplace(inp_upper(m.name), i);
    if (fresh) continue;
    const FeMaterial& before = deck.materials[at->second];
    const bool same = m.youngs_modulus == before.youngs_modulus && m.poisson == before.poisson && m.density == before.density &&
                      m.elasticity == before.elasticity;
    if (!same)
      complaints.texts.push_back(fmt::format("{}: *MATERIAL: '{}' is there already ({}), with other constants: give each its own name",
                                             deck.where(deck.material_places[i]), m.name, deck.where(deck.material_places[at->second])));
  }
}

void InpResolver::tell_bricks() {
  if (deck.abaqus) return;
  bool shells = false, beams = false;
  for (const FeElement& e : model.elements) {
    shells = shells || fe_is_shell(e.shape);
    beams = beams || (e.shape == FeShape::beam2 && e.section >= 0 && !model.beam_sections[e.section].truss);
  }
  if (shells || beams)
    model.notes.push_back(fmt::format(
        "{} as Abaqus takes them; CalculiX makes bricks of them, one across the thickness, which are stiffer (S4, S8, B31, B32) "
        "or hourglass (S4R), and hinges beams where rods begin: a coarse deck has other frequencies there",
        shells && beams ? "shells and beams are"
        : shells        ? "shells are"
                        : "beams are"));
}

void InpResolver::place_spaces() {
  spaces.push_back({});
  if (deck.instances.empty())
    for (size_t n = 1; n < deck.scopes.size(); ++n) deck.instances.push_back({deck.scopes[n].name, n});
  for (const InpInstance& i : deck.instances) {
    InpSpace s;
    s.name = i.name;
    s.scope = i.scope;
    s.turn = i.turn;
    s.shift = i.shift;
    spaces.push_back(std::move(s));
  }
  // Numbers of a later instance are moved where they are taken.
  int highest = 0, offset = 0;
  for (InpSpace& s : spaces) {
    const InpScope& from = deck.scopes[s.scope];
    s.first_node = static_cast<int>(model.nodes.size());
    int top = 0;
    for (int id : from.node_ids) top = std::max(top, id);
    for (const InpElement& e : from.elements) top = std::max(top, e.id);
    offset = 0;
    if (highest > 0 && top > 0) {
      offset = 1;
      while (offset <= std::max(highest, top) && offset < 1000000000) offset *= 10;
      offset *= std::max(1, (highest + offset - 1) / offset);
      if (offset > 2000000000 - top)
        throw InputError(fmt::format(
            "{}: node and element numbers of the instances, one after the other, exceed 2e9: give the parts smaller ones", model.file));
      add_once(model.notes, fmt::format("nodes and elements of instance {} have their numbers + {}", s.name, offset));
    }
    highest = std::max(highest, top + offset);
    for (size_t k = 0; k < from.nodes.size(); ++k) {
      model.node_ids.push_back(from.node_ids[k] + offset);
      model.nodes.push_back(s.turn * from.nodes[k] + s.shift);
    }
    offsets.push_back(offset);
  }
}

void InpResolver::add_elements(int space) {
  InpSpace& s = spaces[space];
  const InpScope& from = scope(space);
  for (const InpElement& e : from.elements) {
    const InpType& type = *e.type;
    std::vector<int> nodes;
    bool whole = true;
    for (int k = 0; k < type.nodes && whole; ++k) {
      const int id = from.connectivity[e.first + k], node = node_by_id(space, id);
      whole = node >= 0;
      if (!whole) complaints.guarded([&] { fail(e.place, fmt::format("element {}: node {} is not there", e.id, id)); });
      nodes.push_back(node);
    }
    const int direction = e.direction > 0 ? node_by_id(space, e.direction) : -1;
    if (e.direction > 0 && direction < 0)
      complaints.guarded([&] { fail(e.place, fmt::format("element {}: node {} is not there", e.id, e.direction)); });
    s.first.push_back(static_cast<int>(model.elements.size()));
    const auto add = [&](std::vector<int> some) {
      FeElement made;
      made.id = e.id + offsets[space];
      made.shape = type.shape;
      made.formulation = type.formulation;
      made.first = static_cast<int>(model.connectivity.size());
      made.count = static_cast<int>(some.size());
      made.line = e.place.file == 0 ? e.place.line : 0;
      model.connectivity.insert(model.connectivity.end(), some.begin(), some.end());
      if (direction >= 0) beam_directions[static_cast<int>(model.elements.size())] = direction;
      if (type.shape == FeShape::lumped) kinds[static_cast<int>(model.elements.size())] = type.kind;
      model.elements.push_back(made);
    };
    if (!whole) {
      // Told above.
    } else if (type.kind == InpKind::beam && type.nodes == 3) {
      add({nodes[0], nodes[1]});
      add({nodes[1], nodes[2]});
    } else if (type.kind != InpKind::rigid_shape && type.kind != InpKind::left_out && type.kind != InpKind::point) {
      add(nodes);
    }
    s.count.push_back(static_cast<int>(model.elements.size()) - s.first.back());
  }
}

FeModel resolve_inp(InpDeck deck, const std::string& file) { return InpResolver(std::move(deck), file).run(); }

FeModel read_inp(const std::filesystem::path& path, const FeUnits& units, FeContact contact) {
  return resolve_inp(read_inp_tables(path, units, contact), path.string());
}

}  // namespace flexframe::sim
