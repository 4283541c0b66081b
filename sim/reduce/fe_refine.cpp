// Division of a mesh. See fe_refine.h.
#include "sim/reduce/fe_refine.h"

#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_facets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace flexframe::sim {
namespace {

// Corners of a part, in the parent element's coordinates, 3 x corners.
using Part = Mat3X;

// The shape that has the corners alone.
FeShape corner_shape(FeShape shape) {
  switch (shape) {
    case FeShape::tetrahedron10:
      return FeShape::tetrahedron4;
    case FeShape::hexahedron20:
      return FeShape::hexahedron8;
    case FeShape::wedge15:
      return FeShape::wedge6;
    case FeShape::triangle6:
      return FeShape::triangle3;
    case FeShape::quadrangle8:
      return FeShape::quadrangle4;
    default:
      return shape;
  }
}

// What a linear solid becomes by nodes in the middles of its edges; others stay as they are, and are divided.
FeShape quadratic_shape(const FeElement& e) {
  switch (e.shape) {
    case FeShape::tetrahedron4:
      return FeShape::tetrahedron10;
    case FeShape::hexahedron8:
      return FeShape::hexahedron20;
    case FeShape::wedge6:
      return FeShape::wedge15;
    default:
      return e.shape;
  }
}

// Places of an element's corners in its own coordinates; of shells and beams the rest is zero.
Mat3X corner_places(FeShape shape) {
  Mat3X out = Mat3X::Zero(3, fe_node_count(corner_shape(shape)));
  switch (corner_shape(shape)) {
    case FeShape::triangle3:
      out.topRows(2) << 0, 1, 0, 0, 0, 1;
      return out;
    case FeShape::quadrangle4:
      out.topRows(2) << -1, 1, 1, -1, -1, -1, 1, 1;
      return out;
    case FeShape::beam2:
      out.row(0) << -1, 1;
      return out;
    default:
      return parent_nodes(corner_shape(shape));
  }
}

VecX values_at(FeShape shape, const Vec3& q) {
  VecX N;
  MatX dN;
  if (shape == FeShape::beam2) return Eigen::Vector2d(0.5 * (1.0 - q.x()), 0.5 * (1.0 + q.x()));
  if (fe_is_shell(shape)) surface_functions(shape, q.head<2>(), N, dN);
  else shape_functions(shape, q, N, dN);
  return N;
}

// A tetrahedron: its four corners, and the octahedron between them in four along its shortest diagonal. X: its corners in space.
std::vector<Part> tetrahedra(const Mat3X& corners, const Mat3X& X) {
  const auto middle = [](const Mat3X& of, int a, int b) -> Vec3 { return 0.5 * (of.col(a) + of.col(b)); };
  std::vector<Part> out;
  for (int c = 0; c < 4; ++c) {
    Part part(3, 4);
    for (int k = 0; k < 4; ++k) part.col(k) = middle(corners, c, k);
    out.push_back(part);
  }
  // Edges opposite to each other, and the ring of the other four.
  static constexpr int diagonals[3][6][2] = {{{0, 1}, {2, 3}, {0, 2}, {1, 2}, {1, 3}, {0, 3}},
                                             {{0, 2}, {1, 3}, {0, 1}, {1, 2}, {2, 3}, {0, 3}},
                                             {{0, 3}, {1, 2}, {0, 1}, {1, 3}, {2, 3}, {0, 2}}};
  const auto length = [&](const auto& d) { return (middle(X, d[0][0], d[0][1]) - middle(X, d[1][0], d[1][1])).norm(); };
  const auto& best =
      *std::min_element(std::begin(diagonals), std::end(diagonals), [&](const auto& a, const auto& b) { return length(a) < length(b); });
  const auto place = [&](int k) { return middle(corners, best[k][0], best[k][1]); };
  for (int k = 0; k < 4; ++k) {
    Part part(3, 4);
    part << place(0), place(1), place(2 + k), place(2 + (k + 1) % 4);
    const Mat3 edges = part.rightCols(3).colwise() - part.col(0);
    if (edges.determinant() < 0.0) part.col(2).swap(part.col(3));
    out.push_back(part);
  }
  return out;
}

// A triangle's parts: three corners and the one between, turned.
std::vector<Part> triangles(const Mat3X& c) {
  const Vec3 ab = 0.5 * (c.col(0) + c.col(1)), bc = 0.5 * (c.col(1) + c.col(2)), ca = 0.5 * (c.col(2) + c.col(0));
  std::vector<Part> out(4, Part(3, 3));
  out[0] << c.col(0), ab, ca;
  out[1] << ab, c.col(1), bc;
  out[2] << ca, bc, c.col(2);
  out[3] << bc, ca, ab;
  return out;
}

std::vector<Part> parts_of(FeShape shape, const Mat3X& X) {
  const Mat3X corners = corner_places(shape);
  std::vector<Part> out;
  switch (corner_shape(shape)) {
    case FeShape::tetrahedron4:
      return tetrahedra(corners, X);
    case FeShape::triangle3:
      return triangles(corners);
    case FeShape::wedge6:
      for (const double half : {-0.5, 0.5})
        for (const Part& t : triangles(corners.leftCols(3))) {
          Part part(3, 6);
          part << t, t;
          part.row(2) << Vec3::Constant(half - 0.5).transpose(), Vec3::Constant(half + 0.5).transpose();
          out.push_back(part);
        }
      return out;
    default:
      // Around each corner: half the element.
      for (Eigen::Index k = 0; k < corners.cols(); ++k) out.emplace_back((0.5 * corners).colwise() + 0.5 * corners.col(k));
      return out;
  }
}

// Opposite faces of a brick or wedge by their numbers (fe_faces), and the edges between them.
struct Axis {
  int axis, faces[2];
  std::vector<std::pair<int, int>> edges;
};
const std::vector<Axis>& axes_of(FeShape shape) {
  static const std::vector<Axis> brick = {{0, {5, 3}, {{0, 1}, {3, 2}, {4, 5}, {7, 6}}},
                                          {1, {2, 4}, {{0, 3}, {1, 2}, {4, 7}, {5, 6}}},
                                          {2, {0, 1}, {{0, 4}, {1, 5}, {2, 6}, {3, 7}}}};
  static const std::vector<Axis> wedge = {{2, {0, 1}, {{0, 3}, {1, 4}, {2, 5}}}};
  static const std::vector<Axis> none;
  return shape == FeShape::hexahedron8 ? brick : shape == FeShape::wedge6 ? wedge : none;
}

// Of each element the axes along which it is a layer by itself, both ends on the body's surface: quadratic shapes do not show how shear is
// spread over it. Only where all elements at its edges agree, so that they can be halved there and still fit.
using Layers = std::vector<std::array<bool, 3>>;
Layers single_layers(const FeModel& model) {
  Layers out(model.elements.size(), {false, false, false});
  const auto corner = [&](const FeElement& e, int i) { return model.connectivity[e.first + i]; };
  struct Face {
    std::array<int, 4> nodes;
    size_t element;
    int face;
  };
  std::vector<Face> faces;
  for (size_t i = 0; i < model.elements.size(); ++i) {
    const FeElement& e = model.elements[i];
    if (!fe_is_solid(e.shape)) continue;
    for (size_t k = 0; k < fe_faces(e.shape).size(); ++k) {
      Face face{{-1, -1, -1, -1}, i, static_cast<int>(k)};
      for (size_t n = 0; n < fe_faces(e.shape)[k].size(); ++n) face.nodes[n] = corner(e, fe_faces(e.shape)[k][n]);
      std::sort(face.nodes.begin(), face.nodes.end());
      faces.push_back(face);
    }
  }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.nodes < b.nodes; });
  std::vector<std::array<bool, 6>> outer(model.elements.size(), std::array<bool, 6>{});
  for (size_t k = 0; k < faces.size(); ++k) {
    const bool shared = (k > 0 && faces[k - 1].nodes == faces[k].nodes) || (k + 1 < faces.size() && faces[k + 1].nodes == faces[k].nodes);
    outer[faces[k].element][faces[k].face] = !shared;
  }
  // Of each edge that may be halved: how many elements have it, and how many would halve it.
  std::map<std::pair<int, int>, std::pair<int, int>> edges;
  const auto edge = [&](const FeElement& e, int a, int b) { return std::minmax({corner(e, a), corner(e, b)}); };
  for (size_t i = 0; i < out.size(); ++i)
    for (const Axis& axis : axes_of(model.elements[i].shape)) {
      if (!outer[i][axis.faces[0]] || !outer[i][axis.faces[1]]) continue;
      out[i][axis.axis] = true;
      for (const auto& [a, b] : axis.edges) ++edges[edge(model.elements[i], a, b)].second;
    }
  if (edges.empty()) return out;
  for (const FeElement& e : model.elements) {
    const int corners = static_cast<int>(fe_is_solid(e.shape) || fe_is_shell(e.shape) ? corner_places(e.shape).cols() : 0);
    for (int a = 0; a < corners; ++a)
      for (int b = 0; b < a; ++b)
        if (const auto at = edges.find(edge(e, a, b)); at != edges.end()) ++at->second.first;
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (size_t i = 0; i < out.size(); ++i)
      for (const Axis& axis : axes_of(model.elements[i].shape)) {
        const FeElement& e = model.elements[i];
        const auto fits = [&](const std::pair<int, int>& of) {
          const auto& [all, halving] = edges.at(edge(e, of.first, of.second));
          return all == halving;
        };
        if (!out[i][axis.axis] || std::all_of(axis.edges.begin(), axis.edges.end(), fits)) continue;
        out[i][axis.axis] = false;
        changed = true;
        for (const auto& [a, b] : axis.edges) --edges[edge(e, a, b)].second;
      }
  }
  return out;
}

class Refinement {
 public:
  Refinement(const FeModel& m, const std::vector<FeConstraint>& h, FeFiner how) : model(m), held(h), finer(how), rises(m) {
    out.model = m;
    round_middles();
    out.model.connectivity.clear();
    out.model.elements.clear();
    out.model.node_thickness.clear();
    out.model.element_sets.clear();
    if (finer == FeFiner::quadratic) layers = single_layers(model);
  }

  FeRefined run() {
    for (size_t i = 0; i < model.elements.size(); ++i) {
      const FeElement& e = model.elements[i];
      const bool whole = e.shape == FeShape::point_mass || e.shape == FeShape::lumped ||
                         (e.shape == FeShape::beam2 && model.beam_sections[e.section].truss);
      if (whole) add(e, {model.connectivity.begin() + e.first, model.connectivity.begin() + e.first + e.count});
      else divide(e, static_cast<int>(i));
    }
    hold();
    tie();
    return std::move(out);
  }

 private:
  // A node by the shares of the corners that it lies between, in 64ths: the same of all elements that have it.
  using Key = std::vector<std::pair<int, int>>;

  const FeModel& model;
  const std::vector<FeConstraint>& held;
  const FeFiner finer;
  FeRefined out;
  Layers layers;           // where elements become quadratic
  const FacetRises rises;  // of shells, whose new nodes lie on the surface that their facets stand for
  std::map<Key, int> made;
  std::map<int, std::vector<int>> between;  // of each new node: the old ones on the edge, the face or in the element that it lies in

  // Middle nodes that lie on the straight sides of quadratic shells move onto the surface.
  void round_middles() {
    for (const FeElement& e : model.elements) {
      if (e.shape != FeShape::triangle6 && e.shape != FeShape::quadrangle8) continue;
      const int* nodes = &model.connectivity[e.first];
      const int corners = e.count / 2;
      for (int k = 0; k < corners; ++k) {
        const int next = (k + 1) % corners, middle = nodes[fe_middle(e.shape, k, next)];
        if (const Vec3 rise = rises.of(nodes[k], nodes[next]); !rise.isZero(0.0))
          out.model.nodes[middle] = 0.5 * (model.nodes[nodes[k]] + model.nodes[nodes[next]]) + rise;
      }
    }
  }

  // From the place of a new node in a flat shell to the surface; sum: its corners, in 64ths.
  Vec3 rise_at(const FeElement& e, const std::map<int, int>& sum) const {
    if (e.shape != FeShape::triangle3 && e.shape != FeShape::quadrangle4) return Vec3::Zero();
    if (sum.size() == 2) return rises.of(sum.begin()->first, sum.rbegin()->first);
    return e.shape == FeShape::quadrangle4 ? rises.of_middle(&model.connectivity[e.first]) : Vec3::Zero();
  }

  void add(FeElement e, const std::vector<int>& nodes) {
    e.first = static_cast<int>(out.model.connectivity.size());
    e.count = static_cast<int>(nodes.size());
    out.model.connectivity.insert(out.model.connectivity.end(), nodes.begin(), nodes.end());
    out.model.elements.push_back(e);
  }

  // The element with its middles, single layers in two.
  void raise(const FeElement& e, const Mat3X& X, const std::array<bool, 3>& layer) {
    const FeShape shape = quadratic_shape(e);
    std::vector<Part> parts = {corner_places(e.shape)};
    for (int d = 0; d < 3; ++d) {
      if (!layer[d]) continue;
      std::vector<Part> halves;
      for (const Part& part : parts)
        for (const double middle : {-0.5, 0.5}) {
          halves.push_back(part);
          halves.back().row(d) = (0.5 * part.row(d)).array() + middle;
        }
      parts = std::move(halves);
    }
    out.raised = true;
    FeElement raised = e;
    raised.shape = shape;
    raised.formulation = FeFormulation::full;
    for (const Part& part : parts) {
      std::vector<int> nodes(fe_node_count(shape), -1);
      for (int a = 0; a < part.cols(); ++a) {
        nodes[a] = node(e, X, part.col(a));
        for (int b = 0; b < a; ++b)
          if (const int m = fe_middle(shape, a, b); m >= 0) nodes[m] = node(e, X, 0.5 * (part.col(a) + part.col(b)));
      }
      add(raised, nodes);
    }
  }

  void divide(const FeElement& e, int index) {
    Mat3X X(3, e.count);
    for (int i = 0; i < e.count; ++i) X.col(i) = out.model.nodes[model.connectivity[e.first + i]];
    if (finer == FeFiner::quadratic && quadratic_shape(e) != e.shape) return raise(e, X, layers[index]);
    const auto thickness = model.node_thickness.find(index);
    for (const Part& part : parts_of(e.shape, X)) {
      std::vector<int> nodes(e.count, -1);
      VecX own(e.count);  // thickness
      const auto take = [&](int place, const Vec3& q) {
        nodes[place] = node(e, X, q);
        if (thickness != model.node_thickness.end()) own(place) = values_at(e.shape, q).dot(thickness->second);
      };
      const int corners = static_cast<int>(part.cols());
      for (int a = 0; a < corners; ++a) {
        take(a, part.col(a));
        for (int b = 0; b < a; ++b)
          if (const int m = fe_middle(e.shape, a, b); m >= 0) take(m, 0.5 * (part.col(a) + part.col(b)));
      }
      if (thickness != model.node_thickness.end()) out.model.node_thickness[static_cast<int>(out.model.elements.size())] = own;
      add(e, nodes);
    }
  }

  int node(const FeElement& e, const Mat3X& X, const Vec3& q) {
    const int* nodes = &model.connectivity[e.first];
    const VecX N = values_at(e.shape, q);
    for (int i = 0; i < e.count; ++i)
      if (std::abs(N(i) - 1.0) < 1e-9) return nodes[i];
    const VecX share = values_at(corner_shape(e.shape), q);
    std::map<int, int> sum;  // nodes of a collapsed element come twice
    std::vector<int> places;
    for (int i = 0; i < share.size(); ++i)
      if (const int n = static_cast<int>(std::lround(64.0 * share(i))); n != 0) {
        sum[nodes[i]] += n;
        places.push_back(i);
      }
    if (sum.size() == 1) return sum.begin()->first;
    const auto [at, fresh] = made.try_emplace({sum.begin(), sum.end()}, static_cast<int>(out.model.nodes.size()));
    if (!fresh) return at->second;
    out.model.nodes.emplace_back(X * N + rise_at(e, sum));
    out.model.node_ids.push_back(0);
    auto& interpolated = out.shares[at->second];
    for (int i = 0; i < N.size(); ++i)
      if (std::abs(N(i)) > 1e-9) interpolated.emplace_back(nodes[i], N(i));
    std::vector<int>& old = between[at->second];
    for (size_t a = 0; a < places.size(); ++a) {
      old.push_back(nodes[places[a]]);
      for (size_t b = 0; b < a; ++b)
        if (const int m = fe_middle(e.shape, places[a], places[b]); m >= 0) old.push_back(nodes[m]);
    }
    return at->second;
  }

  void hold() {
    std::multimap<int, const FeConstraint*> at;
    for (const FeConstraint& c : held) at.emplace(c.node, &c);
    out.held = held;
    // The same motion at another node; directions turn from node to node where they are a cylinder's.
    const auto like = [&](int n, const FeConstraint& c) -> const FeConstraint* {
      constexpr double about = 0.8;  // some 35 degrees
      const auto [first, last] = at.equal_range(n);
      for (auto it = first; it != last; ++it) {
        const FeConstraint& other = *it->second;
        const bool plain = other.direction.isZero(0.0);
        if (other.dof == c.dof && plain == c.direction.isZero(0.0) &&
            (plain || other.direction.normalized().dot(c.direction.normalized()) > about))
          return &other;
      }
      return nullptr;
    };
    for (const auto& [made_node, old] : between) {
      const auto [first, last] = at.equal_range(old[0]);
      for (auto it = first; it != last; ++it) {
        FeConstraint c{made_node, it->second->dof, Vec3::Zero()};
        const bool all = std::all_of(old.begin(), old.end(), [&](int n) {
          const FeConstraint* other = like(n, *it->second);
          if (other && !other->direction.isZero(0.0)) c.direction += other->direction.normalized();
          return other != nullptr;
        });
        if (!all) continue;
        if (!c.direction.isZero(0.0)) c.direction.normalize();
        out.held.push_back(c);
      }
    }
  }

  void tie() {
    for (FeSpider& spider : out.model.spiders) {
      std::map<int, double> weight, turn;
      for (size_t i = 0; i < spider.slaves.size(); ++i) {
        weight[spider.slaves[i]] = spider.weights.empty() ? 1.0 : spider.weights[i];
        turn[spider.slaves[i]] = spider.turns.empty() ? 0.0 : spider.turns[i];
      }
      if (spider.rigid) weight[spider.node] = 1.0;
      for (const auto& [made_node, old] : between) {
        if (!std::all_of(old.begin(), old.end(), [&](int n) { return weight.contains(n); })) continue;
        double sum = 0.0, turns = 0.0;
        for (const int n : old) {
          sum += weight[n];
          turns += turn[n];
        }
        spider.slaves.push_back(made_node);
        if (!spider.weights.empty()) spider.weights.push_back(sum / static_cast<double>(old.size()));
        if (!spider.turns.empty()) spider.turns.push_back(turns / static_cast<double>(old.size()));
      }
    }
  }
};

}  // namespace

double refined_growth(const FeModel& model, FeFiner finer) {
  double before = 0.0, after = 0.0;
  for (const FeElement& e : model.elements) {
    before += e.count;
    const bool raised = finer == FeFiner::quadratic && quadratic_shape(e) != e.shape && e.shape != FeShape::tetrahedron4;
    after += e.count * (raised ? 4.0 : fe_is_solid(e.shape) ? 8.0 : fe_is_shell(e.shape) ? 4.0 : e.shape == FeShape::beam2 ? 2.0 : 1.0);
  }
  return before > 0.0 ? after / before : 1.0;
}

std::optional<FeRefined> refine(const FeModel& model, const std::vector<FeConstraint>& held, FeFiner finer) {
  if (model.matrices) return std::nullopt;
  std::set<int> meshed;
  bool any = false;
  for (const FeElement& e : model.elements) {
    const bool mesh = fe_is_solid(e.shape) || fe_is_shell(e.shape);
    any = any || mesh || (e.shape == FeShape::beam2 && !model.beam_sections[e.section].truss);
    if (mesh) meshed.insert(model.connectivity.begin() + e.first, model.connectivity.begin() + e.first + e.count);
  }
  for (const FeEquation& equation : model.equations)
    for (const FeEquation::Term& t : equation.terms)
      if (meshed.contains(t.node)) return std::nullopt;
  if (!any) return std::nullopt;
  return Refinement(model, held, finer).run();
}

}  // namespace flexframe::sim
