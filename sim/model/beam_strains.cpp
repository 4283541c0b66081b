#include "sim/model/beam_strains.h"

#include "sim/bodies/beam_pieces.h"
#include "sim/model/bodies.h"
#include "sim/scene/force_kinds.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace flexframe::sim {
namespace {

void add(CoordinateRow& sum, const CoordinateRow& row, double factor) {
  for (const auto& [k, value] : row) sum[k] += factor * value;
}

CoordinateRow combined(const CoordinateRow& a, double fa, const CoordinateRow& b, double fb) {
  CoordinateRow out;
  add(out, a, fa);
  add(out, b, fb);
  return out;
}

// Places along the beam where section forces may jump, m.
std::set<double> places_of_hold(const Model& model, const Scene& scene, int body) {
  std::set<double> out;
  const auto take = [&](const FrameRef& f) {
    if (f.body != scene.bodies[body].name) return;
    const FramePoint p = find_frame(model, scene, body, f.frame, "");
    double x = piece_start(std::get<BeamDef>(scene.bodies[body].kind), model.parts[p.part].piece);
    for (const FlexibleNode& node : model.parts[p.part].body.nodes)
      if (node.name == p.node_name) x += node.origin.x();
    out.insert(x);
  };
  for (const JointDef& j : scene.joints) take(j.parent), take(j.child);
  for (const ForceDef& f : scene.forces) {
    if (f.kind == ForceKind::distributed) continue;
    take(f.on);
    if (traits(f.kind).between) take(f.from);
  }
  return out;
}

// Elements between two places of hold, from first to last (one behind it): three stations an element.
void add_elements(const std::vector<ElementStrain>& elements, size_t first, size_t last, std::vector<StrainStation>& out) {
  const auto middle = [&](size_t e) { return 0.5 * (elements[e].x0 + elements[e].x1); };
  for (size_t e = first; e < last; ++e) {
    const ElementStrain& el = elements[e];
    const double h = el.x1 - el.x0;
    const size_t before = e > first ? e - 1 : e, after = e + 1 < last ? e + 1 : e;
    // The curvature's second derivative: how its slope changes from element to element.
    const auto bend = [&](const std::array<CoordinateRow, 2> ElementStrain::*which, double xi) {
      const std::array<CoordinateRow, 2>& own = el.*which;
      CoordinateRow row = combined(own[0], 1.0 - xi, own[1], xi);
      if (before == after) return row;
      const double bow = h * h * (0.5 * xi * xi - 0.5 * xi + 1.0 / 12.0) / (middle(after) - middle(before));
      for (const auto& [neighbour, sign] : {std::pair(after, 1.0), std::pair(before, -1.0)}) {
        const std::array<CoordinateRow, 2>& there = elements[neighbour].*which;
        const double slope = sign * bow / (elements[neighbour].x1 - elements[neighbour].x0);
        add(row, there[1], slope);
        add(row, there[0], -slope);
      }
      return row;
    };
    const auto line = [&](CoordinateRow ElementStrain::*which, double x) {
      if (before == after) return el.*which;
      // Through the middles on that side of this one's; beyond the last ones the same line goes on.
      const size_t a = x < middle(e) ? (before < e ? before : e) : (after > e ? e : before), b = a == e ? after : e;
      const double share = (x - middle(a)) / (middle(b) - middle(a));
      return combined(elements[a].*which, 1.0 - share, elements[b].*which, share);
    };
    const auto rows_at = [&](double xi) {
      const double x = el.x0 + xi * h;
      return std::array{line(&ElementStrain::stretch, x), bend(&ElementStrain::bend_y, xi), bend(&ElementStrain::bend_z, xi),
                        line(&ElementStrain::twist, x)};
    };
    // Between two elements that nothing parts: the mean of what both say.
    if (e == first) {
      out.push_back({el.x0, rows_at(0.0)});
    } else {
      const auto here = rows_at(0.0);
      for (size_t f = 0; f < 4; ++f) out.back().row[f] = combined(out.back().row[f], 0.5, here[f], 0.5);
    }
    out.push_back({0.5 * (el.x0 + el.x1), rows_at(0.5)});
    out.push_back({el.x1, rows_at(1.0)});
  }
}

std::vector<StrainStation> recover(const std::vector<ElementStrain>& elements, const std::set<double>& holds) {
  std::vector<StrainStation> out;
  const double tiny = 1e-9 * elements.back().x1;
  size_t first = 0;
  for (size_t e = 0; e < elements.size(); ++e) {
    const auto inside = [&](const ElementStrain& el) {
      const auto at = holds.upper_bound(el.x0 + tiny);
      return at != holds.end() && *at < el.x1 - tiny;
    };
    const auto held = [&](double x) {
      const auto at = holds.lower_bound(x - tiny);
      return at != holds.end() && *at <= x + tiny;
    };
    const bool last = e + 1 == elements.size();
    if (!last && !held(elements[e].x1) && !inside(elements[e]) && !inside(elements[e + 1])) continue;
    add_elements(elements, first, e + 1, out);
    first = e + 1;
  }
  return out;
}

// Value at x of the parabola (line, constant) through the rows of up to three stations.
StrainStation extrapolated(const std::vector<StrainStation>& through, double x) {
  StrainStation out;
  out.x = x;
  for (size_t i = 0; i < through.size(); ++i) {
    double weight = 1.0;
    for (size_t j = 0; j < through.size(); ++j)
      if (j != i) weight *= (x - through[j].x) / (through[i].x - through[j].x);
    for (size_t f = 0; f < 4; ++f) add(out.row[f], through[i].row[f], weight);
  }
  return out;
}

// Adds stations where something takes hold and at the ends, each side from its own neighbours.
std::vector<StrainStation> to_holds(std::vector<StrainStation> at, double length, std::set<double> holds) {
  holds.insert(0.0);
  holds.insert(length);
  std::vector<StrainStation> out;
  size_t next = 0;
  for (auto from = holds.begin(), to = std::next(from); to != holds.end(); ++from, ++to) {
    std::vector<StrainStation> inside;
    while (next < at.size() && at[next].x <= *to + 1e-9 * length) inside.push_back(std::move(at[next++]));
    if (inside.empty()) continue;
    const size_t near = std::min<size_t>(inside.size(), 3);
    const std::vector<StrainStation> first(inside.begin(), inside.begin() + static_cast<std::ptrdiff_t>(near)),
        last(inside.end() - static_cast<std::ptrdiff_t>(near), inside.end());
    if (inside.front().x > *from + 1e-9 * length) out.push_back(extrapolated(first, *from));
    const bool beyond = inside.back().x < *to - 1e-9 * length;
    out.insert(out.end(), std::make_move_iterator(inside.begin()), std::make_move_iterator(inside.end()));
    if (beyond) out.push_back(extrapolated(last, *to));
  }
  return out;
}

// Joints of a lumped beam at the elements' middles; the pieces between lengthen.
std::vector<StrainStation> lumped_strains(const BeamDef& beam, const BeamEffects& effects, const BeamLinks& links,
                                          const std::set<double>& holds) {
  const int n = beam.elements;
  const double h = beam.length / n;
  std::vector<int> axes;  // free ones, in the order of the coordinates
  for (int a = 0; a < 3; ++a)
    if (links.free[a]) axes.push_back(a);
  const int per_link = static_cast<int>(axes.size()), own = effects.axial ? 1 : 0;
  // Piece 0, then link and piece in turn.
  const auto link_coordinate = [&](int link, int k) { return own + link * (per_link + own) + k; };
  const auto piece_coordinate = [&](int piece) { return piece * (per_link + own); };

  // Curvatures of the links from their angles: columns of C^-1.
  std::vector<StrainStation> at(n);
  for (int i = 0; i < n; ++i) at[i].x = (i + 0.5) * h;
  BeamLinks unit = links;
  unit.section = Mat3::Identity();
  for (int j = 0; j < n; ++j)
    for (int k = 0; k < per_link; ++k) {
      const int axis = axes[k];
      Mat3X theta = Mat3X::Zero(3, n);
      theta(axis, j) = 1.0;
      // About z the slope v', about y the slope -w'.
      const size_t field = axis == 0 ? 3 : axis == 1 ? 2 : 1;
      const double sign = axis == 1 ? -1.0 : 1.0;
      if (links.off.empty()) {
        at[j].row[field][link_coordinate(j, k)] = sign / links.diagonal[j];
        continue;
      }
      const Mat3X moments = link_moments(unit, theta);
      for (int i = 0; i < n; ++i)
        if (std::abs(moments(axis, i)) > 1e-14 * moments.row(axis).cwiseAbs().maxCoeff())
          at[i].row[field][link_coordinate(j, k)] = -sign * moments(axis, i);
    }
  if (effects.axial) {
    // Halves at the ends.
    const auto middle = [&](int piece) { return piece == 0 ? 0.25 * h : piece == n ? beam.length - 0.25 * h : piece * h; };
    const auto length = [&](int piece) { return piece == 0 || piece == n ? 0.5 * h : h; };
    for (StrainStation& s : at) {
      const int a = std::clamp(static_cast<int>(s.x / h), 0, n - 1), b = a + 1;
      const double share = (s.x - middle(a)) / (middle(b) - middle(a));
      s.row[0][piece_coordinate(a)] = (1.0 - share) / length(a);
      s.row[0][piece_coordinate(b)] = share / length(b);
    }
  }
  return to_holds(std::move(at), beam.length, holds);
}

BeamEffects effects_of(const Model& model, int body) {
  BeamEffects e;
  for (const EffectState& s : model.effects) {
    if (s.body != body || !s.on) continue;
    if (s.effect == "axial") e.axial = true;
    if (s.effect == "bending_xy") e.bending_xy = true;
    if (s.effect == "bending_xz") e.bending_xz = true;
    if (s.effect == "torsion") e.torsion = true;
    if (s.effect == "shear") e.shear = true;
  }
  return e;
}

// Moves stations to where their piece lies, and its coordinates behind those of the pieces before.
void shift(std::vector<StrainStation>& stations, double x, int coordinate) {
  for (StrainStation& s : stations) {
    s.x += x;
    for (CoordinateRow& row : s.row) {
      CoordinateRow moved;
      for (const auto& [k, value] : row) moved[k + coordinate] = value;
      row = std::move(moved);
    }
  }
}

}  // namespace

std::vector<StrainStation> strain_stations(const Model& model, const Scene& scene, int body, std::vector<std::string>& left_out) {
  const auto* beam = std::get_if<BeamDef>(&scene.bodies[body].kind);
  if (!beam || coordinate_count(model, body) == 0) return {};
  const BeamEffects effects = effects_of(model, body);
  for (const char* name : {"axial", "torsion"}) {
    const auto state =
        std::find_if(model.effects.begin(), model.effects.end(), [&](const EffectState& s) { return s.body == body && s.effect == name; });
    if (state == model.effects.end() || (!state->on && state->possible)) left_out.emplace_back(name);
  }
  if (beam->model == BeamModel::lumped) {
    for (const Flexure& f : model.flexures)
      if (f.scene_body == body) return lumped_strains(*beam, effects, f.links, places_of_hold(model, scene, body));
    BeamLinks rigid;  // nothing but axial
    rigid.diagonal.assign(beam->elements, 1.0);
    return lumped_strains(*beam, effects, rigid, places_of_hold(model, scene, body));
  }
  if (beam->model == BeamModel::modal) return modal_strains(*beam, effects);

  BeamDef piece = *beam;
  const std::vector<int>& parts = model.pieces[body];
  const bool mixed = beam->model == BeamModel::mixed;
  piece.length = beam->length / static_cast<double>(parts.size());
  piece.frames.clear();
  std::vector<ElementStrain> elements;
  std::vector<StrainStation> stations, volumes;
  piece.damping = {};
  if (mixed && !beam->modes.empty()) volumes = volume_strains(piece, effects);
  int coordinate = 0;
  for (size_t k = 0; k < parts.size(); ++k) {
    const Part& part = model.parts[parts[k]];
    const double x = static_cast<double>(k) * piece.length;
    if (mixed && !beam->modes.empty()) {
      std::vector<StrainStation> own = volumes;
      shift(own, x, coordinate);
      stations.insert(stations.end(), std::make_move_iterator(own.begin()), std::make_move_iterator(own.end()));
      coordinate += part.body.n;
      continue;
    }
    // Their nodes lie on the frames (beam_fe.cpp).
    piece.frames = piece_of(*beam, static_cast<int>(k), 0.0).frames;
    for (ElementStrain& e : fe_strains(piece, effects)) {
      const auto moved = [&](CoordinateRow& row) {
        CoordinateRow out;
        for (const auto& [c, value] : row) out[c + coordinate] = value;
        row = std::move(out);
      };
      e.x0 += x, e.x1 += x;
      for (CoordinateRow* row : {&e.stretch, &e.twist, &e.bend_y[0], &e.bend_y[1], &e.bend_z[0], &e.bend_z[1]}) moved(*row);
      elements.push_back(std::move(e));
    }
    coordinate += part.shown.coordinates.size() > 0 ? static_cast<int>(part.shown.coordinates.rows()) : part.body.n;
  }
  return elements.empty() ? stations : recover(elements, places_of_hold(model, scene, body));
}

}  // namespace flexframe::sim
