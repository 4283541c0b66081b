// Rigid elements, equations and supports of Nastran bulk data.
#include "sim/reduce/fe_nastran_reader.h"

#include <algorithm>

namespace flexframe::sim {

bool NastranReader::turning(int node) {
  if (turning_nodes.size() < model.nodes.size()) {
    turning_nodes.assign(model.nodes.size(), false);
    for (const FeElement& e : model.elements) {
      const bool turns = fe_is_shell(e.shape) || (e.shape == FeShape::beam2 && model.beam_sections[e.section].turns()) ||
                         (e.shape == FeShape::lumped && model.lumps[e.section].turns);
      for (int k = 0; k < e.count && turns; ++k) turning_nodes[model.connectivity[e.first + k]] = true;
    }
  }
  return turning_nodes[node];
}

std::vector<int> NastranReader::grids_from(const NastranCard& c, size_t field) {
  std::vector<int> out;
  for (size_t k = field; k < c.fields.size(); ++k) {
    if (deck.blank(c, k)) continue;
    if (c.fields[k] == "THRU" && !out.empty() && k + 1 < c.fields.size()) {
      const int last = deck.integer(c, k + 1), first = model.node_ids[out.back()];
      if (last < first) deck.fail(c, fmt::format("{} THRU {} is no range", first, last));
      for (const auto& [id, card] : grids)
        if (id > first && id <= last) out.push_back(node_of(c, id));
      ++k;
    } else {
      out.push_back(node(c, k));
    }
  }
  return out;
}

void NastranReader::add_tie(const NastranCard& c) {
  FeSpider s;
  s.name = fmt::format("{}_{}", c.name, deck.integer(c, 0));
  s.line = c.line;
  if (c.name == "RBE3") return add_rbe3(c, s);
  if (c.name == "RBE1") return add_rbe1(c);
  if (c.name == "RROD") return add_rigid_rod(c);
  if (c.name == "RTRPLT") return add_rigid_bar(c, 3);
  std::vector<int> dofs = {0, 1, 2, 3, 4, 5};
  if (c.name == "RBE2") {
    s.node = node(c, 1);
    dofs = deck.components(c, 2);
    size_t last = c.fields.size();
    // A thermal expansion at the end is a number with a point.
    while (last > 3 && (deck.blank(c, last - 1) || (c.fields[last - 1].find('.') != std::string::npos))) --last;
    NastranCard cut = c;
    cut.fields.resize(last);
    s.slaves = grids_from(cut, 3);
  } else {
    const bool first = deck.components(c, 3).size() == 6, second = deck.components(c, 4).size() == 6;
    if (!first && !second) return add_rigid_bar(c, 2);
    s.node = node(c, first ? 1 : 2);
    s.slaves = {node(c, first ? 2 : 1)};
    if (const std::vector<int> given = deck.components(c, first ? 6 : 5); !given.empty()) dofs = given;
  }
  std::erase(s.slaves, s.node);
  if (s.slaves.empty()) deck.fail(c, "no dependent grids");
  const std::set<int> set(dofs.begin(), dofs.end());
  const bool translations = set.contains(0) && set.contains(1) && set.contains(2),
             rotations = set.contains(3) && set.contains(4) && set.contains(5);
  if (translations && (rotations || std::none_of(s.slaves.begin(), s.slaves.end(), [&](int n) { return turning(n); }))) {
    model.spiders.push_back(s);
    return;
  }
  for (int slave : s.slaves) partly(c, s.node, slave, set);
}

void NastranReader::partly(const NastranCard& c, int reference, int slave, const std::set<int>& dofs) {
  const Vec3 r = model.nodes[slave] - model.nodes[reference];
  const Mat3 Q = directions(c, slave);
  for (int d : dofs) {
    if (d >= 3 && !turning(slave)) continue;
    FeEquation e;
    e.line = c.line;
    const Vec3 along = Q.col(d % 3), arm = r.cross(along);
    Eigen::Index main = 0;
    along.cwiseAbs().maxCoeff(&main);
    const int base = d < 3 ? 0 : 3;
    for (int k = 0; k < 3; ++k) {
      const int axis = (static_cast<int>(main) + k) % 3;
      if (along(axis) != 0.0) e.terms.push_back({slave, base + axis, -along(axis)});
    }
    for (int k = 0; k < 3; ++k) {
      if (along(k) != 0.0) e.terms.push_back({reference, base + k, along(k)});
      if (d < 3 && arm(k) != 0.0) e.terms.push_back({reference, 3 + k, arm(k)});
    }
    model.equations.push_back(std::move(e));
  }
}

void NastranReader::add_rbe3(const NastranCard& c, FeSpider s) {
  s.rigid = false;
  s.node = node(c, 2);
  const std::vector<int> given = deck.components(c, 3);
  double weight = 0.0;
  bool open = false, turns = false, some = false;  // rotations count; some of them do
  size_t k = 4;
  // Groups: weight, motions, grids; a weight has a point.
  for (; k < c.fields.size(); ++k) {
    if (deck.blank(c, k)) continue;
    if (c.fields[k] == "UM" || c.fields[k] == "ALPHA") break;
    if (c.fields[k].find('.') != std::string::npos) {
      weight = deck.real(c, k);
      const std::vector<int> dofs = deck.components(c, ++k);
      const std::set<int> set(dofs.begin(), dofs.end());
      if (!set.contains(0) || !set.contains(1) || !set.contains(2))
        deck.fail(c, "grids that count with some of their translations only cannot be read; give 123");
      turns = set.size() == 6;
      some = some || (set.size() > 3 && !turns);
      open = true;
      continue;
    }
    if (!open) deck.fail(c, "a weight with a decimal point is expected before the grids");
    s.slaves.push_back(node(c, k));
    s.weights.push_back(weight);
    s.turns.push_back(turns ? weight : 0.0);
  }
  if (s.slaves.empty()) deck.fail(c, "no grids");
  if (std::any_of(s.weights.begin(), s.weights.end(), [](double w) { return !(w > 0.0); })) deck.fail(c, "weights must be > 0");
  const bool whole = std::set<int>(given.begin(), given.end()).size() == 6 || given.empty();
  // Rotations weigh by the mean distance from the reference grid, squared.
  double length = 0.0;
  for (const int n : s.slaves) length += (model.nodes[n] - model.nodes[s.node]).norm() / static_cast<double>(s.slaves.size());
  if (length == 0.0) length = units.length;
  for (double& turn : s.turns) turn *= length * length;
  const auto turned = [&](int n) { return turning(n); };
  const bool any = std::any_of(s.turns.begin(), s.turns.end(), [](double t) { return t > 0.0; });
  if ((some || (any && !whole)) && std::any_of(s.slaves.begin(), s.slaves.end(), turned))
    add_once(
        model.warnings,
        fmt::format("{}: RBE3 takes translations of its grids alone: their rotations count where all six motions of the grids are named "
                    "(123456) and all of the reference grid's follow",
                    deck.where(c)));
  if (!any || !whole) s.turns.clear();
  if (whole) model.spiders.push_back(std::move(s));
  else partial_means.push_back({s, given, directions(c, s.node)});
}

bool NastranReader::asked(const char* what, int sign, int set) const {
  const auto chosen = deck.chosen.find(what);
  if (chosen == deck.chosen.end()) return true;
  if (chosen->second == set) return true;
  const auto both = unions.find(sign * chosen->second);
  return both != unions.end() && both->second.contains(set);
}

void NastranReader::warn_of_choice(const char* what, int sign, const std::vector<const NastranCard*>& cards) {
  const auto chosen = deck.chosen.find(what);
  if (chosen == deck.chosen.end()) return;
  if (const auto also = deck.also_chosen.find(what); also != deck.also_chosen.end())
    model.warnings.push_back(
        fmt::format("{}: subcases choose {} = {} and {}: a body has one, and set {} counts; take the others out of case "
                    "control, or the first",
                    model.file, what, chosen->second, fmt::join(also->second, ", "), chosen->second));
  std::set<int> wanted = {chosen->second}, missing;
  if (const auto both = unions.find(sign * chosen->second); both != unions.end()) wanted = both->second;
  for (const int set : wanted)
    if (std::none_of(cards.begin(), cards.end(), [&](const NastranCard* c) { return deck.integer(*c, 0) == set; })) missing.insert(set);
  if (!missing.empty())
    model.warnings.push_back(fmt::format("{}: case control chooses {} = {}, and there is no {} of set {}: it does nothing", model.file,
                                         what, chosen->second, what, fmt::join(missing, ", ")));
}

void NastranReader::add_conditions() {
  attempt([&] {
    warn_of_choice("SPC", 1, supports);
    warn_of_choice("MPC", -1, equations);
  });
  std::set<int> sets;
  for (const NastranCard* c : supports)
    attempt([&] {
      const int set = deck.integer(*c, 0);
      if (!asked("SPC", 1, set)) return;
      sets.insert(set);
      if (c->name == "SPC1") {
        for (int n : grids_from(*c, 2))
          for (int d : deck.components(*c, 1)) hold(*c, n, d);
        return;
      }
      for (size_t k = 1; k < c->fields.size(); k += 3) {
        if (deck.blank(*c, k)) continue;
        if (deck.real(*c, k + 2) != 0.0) add_once(model.notes, fmt::format("{}: SPC with a value: fixed at zero", deck.where(*c)));
        for (int d : deck.components(*c, k + 1)) hold(*c, node(*c, k), d);
      }
    });
  if (sets.size() > 1 && !deck.chosen.contains("SPC"))
    model.warnings.push_back(fmt::format(
        "{}: {} sets of supports (SPC) and no case control that chooses: all of them hold the model (--hold none leaves it free)",
        model.file, sets.size()));
  for (const NastranCard* c : equations)
    attempt([&] {
      if (!asked("MPC", -1, deck.integer(*c, 0))) return;
      FeEquation e;
      e.line = c->line;
      // Two terms a line, the first field of a continuation is blank.
      for (size_t k = 1; k + 2 < c->fields.size(); k += k % 8 == 4 ? 5 : 3) {
        if (deck.blank(*c, k)) continue;
        const int n = node(*c, k);
        const std::vector<int> dofs = deck.components(*c, k + 1);
        if (dofs.size() != 1) deck.fail(*c, "one motion, 1 to 6, is expected at each grid");
        const Vec3 along = directions(*c, n).col(dofs[0] % 3);
        for (int d = 0; d < 3; ++d)
          if (along(d) != 0.0) e.terms.push_back({n, (dofs[0] < 3 ? 0 : 3) + d, deck.real(*c, k + 2) * along(d)});
      }
      if (e.terms.empty()) deck.fail(*c, "no terms");
      model.equations.push_back(std::move(e));
    });
  for (auto& [name, set] : model.node_sets) {
    std::sort(set.begin(), set.end());
    set.erase(std::unique(set.begin(), set.end()), set.end());
  }
}

}  // namespace flexframe::sim
