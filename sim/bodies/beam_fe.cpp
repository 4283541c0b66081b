// The finite-element beam of Schiavo, Ferretti, Vigano 2005 eq. 30-38 in space, with the second-order field of Heckmann et
// al. 2006 eq. 8. Shear-flexible variant: Friedman, Kosmatka 1993 (exact static shape functions), equal to the Hermite
// element for vanishing shear flexibility.
#include "sim/base/eigen_solvers.h"
#include "sim/bodies/beam_boundary.h"
#include "sim/bodies/beam_terms.h"
#include "sim/bodies/resolution.h"
#include "sim/bodies/section_strain.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

namespace flexframe::sim {
namespace {

using beam::FieldRows;
using beam::Integrals;
using beam::Properties;

enum Kind { kU, kV, kVSlope, kW, kWSlope, kTheta, kKinds };
constexpr std::array<const char*, kKinds> kKindNames = {"u", "v", "v'", "w", "w'", "theta"};

// Numbering of the full set of coordinates: node by node, only the kinds that exist.
struct Layout {
  int elements = 1;
  double h = 0.0;                       // m, of every element where `nodes` is empty
  std::vector<double> nodes;            // m, ascending from 0; empty: evenly
  std::array<int, kKinds> offset = {};  // within a node, -1 where the kind does not exist
  int per_node = 0;
  int full() const { return per_node * (elements + 1); }
  int index(int node, int kind) const { return node * per_node + offset[kind]; }
  bool has(int kind) const { return offset[kind] >= 0; }
  double length(int element) const { return nodes.empty() ? h : nodes[element + 1] - nodes[element]; }
  // x of a place in an element
  double at(int element, double xi) const {
    return nodes.empty() ? (element + xi) * h : xi == 0.0 ? nodes[element] : nodes[element] + xi * length(element);
  }
  // element, and how far along it
  std::pair<int, double> place(double x) const {
    if (nodes.empty()) {
      const int element = std::clamp(static_cast<int>(x / h), 0, elements - 1);
      return {element, std::clamp(x / h - element, 0.0, 1.0)};
    }
    const auto after = std::upper_bound(nodes.begin() + 1, nodes.end() - 1, x);
    const int element = static_cast<int>(after - nodes.begin()) - 1;
    return {element, std::clamp((x - nodes[element]) / length(element), 0.0, 1.0)};
  }
};

// highest degree: cubic times cubic, or the squared distance to the tip times slope times slope (6): 4 points are exact
constexpr int gauss_points = 4;

// More coordinates cost time with the third power of their number: a beam of 300 has its first ten bending frequencies to 1e-4 and those of
// axial motion and twist, whose elements are linear, to 2e-2.
constexpr int most_coordinates = 300;

// A force within an element bends, stretches and twists it there in a way that its nodes do not know: forces act on frames, so nodes are
// put on them. The even node next to a frame moves there; where none is near, one is added. In lengths of the even elements:
constexpr double on_node = 0.02;  // a frame so near lies on the node
constexpr double moves = 0.35;    // so near it moves an even node
constexpr double apart = 0.1;     // no new nodes nearer to others than this: their elements were stiff

void put_nodes_on_frames(const BeamDef& def, Layout& layout) {
  if (def.model == BeamModel::lumped) return;
  struct Node {
    double x;
    bool taken;
  };
  std::vector<Node> nodes;
  for (int i = 0; i <= layout.elements; ++i) nodes.push_back({static_cast<double>(i), i == 0 || i == layout.elements});
  bool even = true;
  std::vector<double> places;
  for (const auto& [name, s] : def.frames) places.push_back(s * layout.elements);
  std::sort(places.begin(), places.end());
  for (const double x : places) {
    const auto near =
        std::min_element(nodes.begin(), nodes.end(), [&](const Node& a, const Node& b) { return std::abs(a.x - x) < std::abs(b.x - x); });
    const double distance = std::abs(near->x - x);
    if (distance <= on_node) {
      near->taken = true;
    } else if (!near->taken && distance <= moves) {
      *near = {x, true};
      even = false;
    } else if (distance > apart && static_cast<int>(nodes.size()) * layout.per_node < most_coordinates) {
      nodes.insert(std::upper_bound(nodes.begin(), nodes.end(), x, [](double value, const Node& n) { return value < n.x; }), {x, true});
      even = false;
    }
  }
  if (even) return;
  const double h = def.length / layout.elements;
  for (const Node& n : nodes) layout.nodes.push_back(n.x * h);
  layout.elements = static_cast<int>(nodes.size()) - 1;
}

Layout layout_of(const BeamDef& def, const BeamEffects& e) {
  Layout layout;
  const std::array<bool, kKinds> exists = {e.axial, e.bending_xy, e.bending_xy, e.bending_xz, e.bending_xz, e.torsion};
  for (std::size_t k = 0; k < kKinds; ++k) layout.offset[k] = exists[k] ? layout.per_node++ : -1;
  layout.elements = def.elements;
  const bool by_name = def.all_elements || !def.initial.q.empty() || !def.initial.qd.empty();
  if (!by_name && layout.per_node > 0)
    layout.elements =
        std::min(def.elements, std::max(most_coordinates / layout.per_node - 1, elements_for_modes(def.keep_modes.value_or(0))));
  layout.h = def.length / layout.elements;
  if (!by_name && layout.elements > 0) put_nodes_on_frames(def, layout);
  return layout;
}

// Shape functions of a deflection and its section slope on one element; local coordinates: value, slope, value, slope.
struct Deflection {
  Eigen::Vector4d value, derivative, slope, curvature;
};

// flexibility = 12 EI / (k G A h^2), 0 without shear.
Deflection deflection_shapes(double xi, double h, double flexibility) {
  const double f = flexibility, c = 1.0 / (1.0 + f), x2 = xi * xi, x3 = x2 * xi;
  Deflection d;
  d.value << 1.0 - 3.0 * x2 + 2.0 * x3 + f * (1.0 - xi), h * (xi - 2.0 * x2 + x3 + 0.5 * f * (xi - x2)), 3.0 * x2 - 2.0 * x3 + f * xi,
      h * (x3 - x2 + 0.5 * f * (x2 - xi));
  d.derivative << (6.0 * x2 - 6.0 * xi - f) / h, 1.0 - 4.0 * xi + 3.0 * x2 + 0.5 * f * (1.0 - 2.0 * xi), (6.0 * xi - 6.0 * x2 + f) / h,
      3.0 * x2 - 2.0 * xi + 0.5 * f * (2.0 * xi - 1.0);
  d.slope << 6.0 * (x2 - xi) / h, 1.0 - 4.0 * xi + 3.0 * x2 + f * (1.0 - xi), 6.0 * (xi - x2) / h, 3.0 * x2 - 2.0 * xi + f * xi;
  d.curvature << 6.0 * (2.0 * xi - 1.0) / (h * h), (6.0 * xi - 4.0 - f) / h, 6.0 * (1.0 - 2.0 * xi) / (h * h), (6.0 * xi - 2.0 + f) / h;
  d.value *= c;
  d.derivative *= c;
  d.slope *= c;
  d.curvature *= c;
  return d;
}

// Rows at xi of an element, in the element's 2 per_node coordinates.
FieldRows element_rows(const Layout& layout, const Properties& p, const BeamEffects& e, int element, double xi) {
  FieldRows r(2 * layout.per_node);
  const double h = layout.length(element);
  const auto linear = [&](int kind, VecX& value, VecX& derivative) {
    const int a = layout.offset[kind], b = a + layout.per_node;
    value[a] = 1.0 - xi, value[b] = xi;
    derivative[a] = -1.0 / h, derivative[b] = 1.0 / h;
  };
  const auto cubic = [&](int kind, double flexibility, VecX& value, VecX& derivative, VecX& slope, VecX& curvature) {
    const Deflection d = deflection_shapes(xi, h, flexibility);
    for (int i = 0; i < 4; ++i) {
      const int at = layout.offset[kind] + i % 2 + (i / 2) * layout.per_node;
      value[at] = d.value[i], derivative[at] = d.derivative[i], slope[at] = d.slope[i], curvature[at] = d.curvature[i];
    }
  };
  if (e.axial) linear(kU, r.u, r.du);
  if (e.bending_xy) cubic(kV, e.shear ? 12.0 * p.ei_z / (p.shear_y * h * h) : 0.0, r.v, r.dv, r.phi_z, r.dphi_z);
  if (e.bending_xz) cubic(kW, e.shear ? 12.0 * p.ei_y / (p.shear_z * h * h) : 0.0, r.w, r.dw, r.s, r.ds);
  if (e.torsion) linear(kTheta, r.theta, r.dtheta);
  return r;
}

// The same in full coordinates.
FieldRows full_rows(const Layout& layout, const Properties& p, const BeamEffects& e, int element, double xi) {
  const FieldRows local = element_rows(layout, p, e, element, xi);
  FieldRows full(layout.full());
  const Eigen::Index first = static_cast<Eigen::Index>(element) * layout.per_node;
  const auto spread = [&](const VecX& from, VecX& to) { to.segment(first, from.size()) = from; };
  spread(local.u, full.u), spread(local.du, full.du);
  spread(local.v, full.v), spread(local.dv, full.dv), spread(local.phi_z, full.phi_z), spread(local.dphi_z, full.dphi_z);
  spread(local.w, full.w), spread(local.dw, full.dw), spread(local.s, full.s), spread(local.ds, full.ds);
  spread(local.theta, full.theta), spread(local.dtheta, full.dtheta);
  return full;
}

// Sums one element's local matrices into the full ones.
void scatter(const Integrals& local, int at, Integrals& full) {
  const auto n = local.Me.rows();
  full.md1.middleCols(at, n) += local.md1;
  full.J1.middleCols(at, n) += local.J1;
  full.Cr0.middleCols(at, n) += local.Cr0;
  full.Me.block(at, at, n, n) += local.Me;
  full.Ke.block(at, at, n, n) += local.Ke;
  for (std::size_t a = 0; a < 3; ++a) full.md2[a].block(at, at, n, n) += local.md2[a];
  for (std::size_t a = 0; a < 3; ++a) full.Cr1[a].block(at, at, n, n) += local.Cr1[a];
  for (std::size_t a = 0; a < 6; ++a) full.J2[a].block(at, at, n, n) += local.J2[a];
}

// Coordinates that the boundary leaves, as indices of the full set.
std::vector<int> free_coordinates(const Layout& layout, Boundary boundary) {
  std::vector<bool> held(layout.full(), false);
  const auto hold = [&](int node, std::initializer_list<int> kinds) {
    for (const int kind : kinds)
      if (layout.has(kind)) held[layout.index(node, kind)] = true;
  };
  const int tip = layout.elements;
  switch (boundary) {
    case Boundary::clamped_free:
      hold(0, {kU, kV, kVSlope, kW, kWSlope, kTheta});
      break;
    case Boundary::clamped_clamped:
      hold(0, {kU, kV, kVSlope, kW, kWSlope, kTheta});
      hold(tip, {kU, kV, kVSlope, kW, kWSlope, kTheta});
      break;
    case Boundary::clamped_supported:
      hold(0, {kU, kV, kVSlope, kW, kWSlope, kTheta});
      hold(tip, {kV, kW});
      break;
    // the last two are relative to the chord until the frame moves to the mean axes
    case Boundary::supported_supported:
    case Boundary::supported_free:
    case Boundary::free_free:
      hold(0, {kU, kV, kW, kTheta});
      hold(tip, {kV, kW});
      break;
  }
  std::vector<int> free;
  for (int i = 0; i < layout.full(); ++i)
    if (!held[i]) free.push_back(i);
  return free;
}

// Rigid motions that the frame's mean axes take out of the deformation, as columns of full coordinates.
MatX rigid_columns(const Layout& layout, Boundary boundary) {
  std::vector<VecX> columns;
  const auto uniform = [&](int kind) {
    if (!layout.has(kind)) return;
    VecX c = VecX::Zero(layout.full());
    for (int node = 0; node <= layout.elements; ++node) c[layout.index(node, kind)] = 1.0;
    columns.push_back(c);
  };
  const auto turn = [&](int kind) {
    if (!layout.has(kind)) return;
    VecX c = VecX::Zero(layout.full());
    for (int node = 0; node <= layout.elements; ++node) {
      c[layout.index(node, kind)] = layout.at(node, 0.0);
      c[layout.index(node, kind + 1)] = 1.0;
    }
    columns.push_back(c);
  };
  if (boundary == Boundary::free_free)
    for (const int kind : {kU, kV, kW, kTheta}) uniform(kind);
  if (boundary == Boundary::free_free || boundary == Boundary::supported_free)
    for (const int kind : {kV, kW}) turn(kind);
  MatX r(layout.full(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) r.col(static_cast<Eigen::Index>(i)) = columns[i];
  return r;
}

// full = Z q: the chosen coordinates, less the rigid motions they contain by mass: Z = S - R share.
struct BoundaryBasis {
  std::vector<int> free;
  MatX rigid, share;

  BoundaryBasis() = default;
  BoundaryBasis(const Layout& layout, Boundary boundary, const MatX& Me)
      : free(free_coordinates(layout, boundary)), rigid(rigid_columns(layout, boundary)) {
    if (rigid.cols() == 0 || free.empty()) {
      rigid.resize(layout.full(), 0);
      return;
    }
    const MatX mr = Me * rigid;
    share = solve_symmetric(rigid.transpose() * mr, mr(free, Eigen::all).transpose());
  }

  // Z
  beam::Basis matrix() const {
    MatX Z = MatX::Zero(rigid.rows(), static_cast<Eigen::Index>(free.size()));
    for (std::size_t j = 0; j < free.size(); ++j) Z(free[j], static_cast<Eigen::Index>(j)) = 1.0;
    if (rigid.cols() > 0) Z -= rigid * share;
    return Z.sparseView();
  }
  // rows Z
  template <class Rows>
  Rows times(const Rows& rows) const {
    Rows out = rows(Eigen::all, free);
    if (rigid.cols() > 0) out -= (rows * rigid) * share;
    return out;
  }
  // Z^T m Z of a symmetric m
  MatX congruent(const MatX& m) const {
    const MatX right = times(m);
    return times(MatX(right.transpose()));
  }
};

}  // namespace

struct FeBeam::Data {
  Data(const BeamDef& def, const BeamEffects& e)
      : effects(e),
        properties(beam::properties(def, e)),
        layout(layout_of(def, e)),
        full(layout.full()),
        root(full_rows(layout, properties, e, 0, 0.0)) {}

  BeamEffects effects;
  Properties properties;
  Layout layout;
  Integrals full;
  FieldRows root;
  beam::Basis Z;
  std::vector<beam::Station> stations;  // those with a name, then the series
  std::size_t named = 0;
  FlexibleBody linear;

  template <class AnyBasis>
  void add_second_order(const AnyBasis& basis, FlexibleBody& body) const;
};

// The running integrals visit the nodes in the order of x.
template <class AnyBasis>
void FeBeam::Data::add_second_order(const AnyBasis& basis, FlexibleBody& body) const {
  beam::set_second_order(body, full, basis);
  if (!effects.stiffening || body.n == 0) return;
  const bool series = 3.0 * body.n * body.n * static_cast<double>(stations.size() - named) <= beam::kMaxSeriesNumbers;
  std::vector<std::size_t> order(stations.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return stations[a].x < stations[b].x; });
  const beam::GaussRule gauss = beam::gauss_rule(gauss_points);
  // Few coordinates: element by element into them.
  constexpr bool few = std::is_same_v<AnyBasis, MatX>;
  beam::SecondOrder running(few ? body.n : layout.full());
  FieldRows root_in_body(0);
  if constexpr (few) root_in_body = beam::in_coordinates(root, basis);
  int done_element = 0;
  double done = 0.0;  // within it
  for (const std::size_t i : order) {
    if (i >= named && !series) continue;
    const double x = stations[i].x;
    const auto [element, xi] = layout.place(x);
    while (done_element < element || done < xi) {
      const double end = done_element < element ? 1.0 : xi;
      beam::SecondOrder part(2 * layout.per_node);
      for (std::size_t g = 0; g < gauss.x.size(); ++g) {
        const double at = done + (end - done) * gauss.x[g];
        beam::add_second_order(part, properties, effects, element_rows(layout, properties, effects, done_element, at),
                               layout.at(done_element, at), (end - done) * layout.length(done_element) * gauss.w[g]);
      }
      const int at = done_element * layout.per_node;
      if constexpr (few) beam::add_part(running, part, MatX(basis.middleRows(at, 2 * layout.per_node)));
      else beam::add_part(running, part, at);
      done = end;
      if (done_element < element) ++done_element, done = 0.0;
    }
    if constexpr (few) body.nodes[i].phi2 = beam::second_order_at(running, root_in_body, x);
    else body.nodes[i].phi2 = beam::second_order_at(running, root, x, basis);
  }
}

FeBeam::FeBeam(const BeamDef& def, const BeamEffects& effects) {
  // some forty dense matrices of this size exist while the body is made: 0.8 GB at most
  constexpr int kMaxCoordinates = 1500;
  const Layout wanted = layout_of(def, effects);
  const int most = kMaxCoordinates / std::max(1, wanted.per_node) - 1;
  if (wanted.elements < 1 || wanted.elements > most)
    throw InputError(
        fmt::format("elements must lie in 1 .. {} with these effects, found {}; for more take model = \"mixed\"", most, def.elements));
  data_ = std::make_unique<Data>(def, effects);
  Data& d = *data_;
  const Layout& layout = d.layout;
  const beam::GaussRule gauss = beam::gauss_rule(gauss_points);
  for (int k = 0; k < layout.elements; ++k) {
    Integrals local(2 * layout.per_node);
    for (std::size_t g = 0; g < gauss.x.size(); ++g)
      beam::add_station(local, d.properties, effects, element_rows(layout, d.properties, effects, k, gauss.x[g]), layout.at(k, gauss.x[g]),
                        gauss.w[g] * layout.length(k));
    scatter(local, k * layout.per_node, d.full);
  }
  const bool root_twists = def.boundary == Boundary::free_free && effects.torsion;
  if (effects.stiffening && root_twists) beam::add_root_rotation(d.full, d.properties, d.root);

  const BoundaryBasis basis(layout, def.boundary, d.full.Me);
  d.Z = basis.matrix();
  FlexibleBody& body = d.linear;
  body = beam::linear_body(d.full, d.properties, effects, d.Z);
  body.Me = basis.congruent(d.full.Me);
  body.Ke = basis.congruent(d.full.Ke);
  // Its panels are of equal length.
  const auto panel_rows = [&](int panel, double xi) {
    if (layout.nodes.empty()) return full_rows(layout, d.properties, effects, panel, xi);
    const auto [element, within] = layout.place((panel + xi) * (def.length / layout.elements));
    return full_rows(layout, d.properties, effects, element, within);
  };
  beam::set_axis_mass(body, d.properties, effects, d.Z, {layout.elements, gauss_points, panel_rows, d.root});
  body.De = beam::damping_matrix(def.damping, body.Me, body.Ke);
  for (const int i : free_coordinates(layout, def.boundary)) {
    const int node = i / layout.per_node, local = i % layout.per_node;
    const auto kind = std::find(layout.offset.begin(), layout.offset.end(), local) - layout.offset.begin();
    body.labels.push_back(fmt::format("node {} {}", node, kKindNames[kind]));
  }
  d.stations = beam::named_stations(def);
  d.named = d.stations.size();
  for (int i = 0; i <= def.elements; ++i) d.stations.push_back({fmt::format("node[{}]", i), i * (def.length / def.elements)});
  for (const beam::Station& s : d.stations) {
    const auto [element, xi] = layout.place(s.x);
    FlexibleNode& node = body.nodes.emplace_back(beam::make_node(s.name, s.x, full_rows(layout, d.properties, effects, element, xi)));
    node.phi = basis.times(node.phi);
    node.psi = basis.times(node.psi);
  }
}

FeBeam::~FeBeam() = default;

MatX in_boundary(const BeamDef& def, const BeamEffects& effects, Boundary boundary, const MatX& T) {
  const Layout layout = layout_of(def, effects);
  const std::vector<int> free = free_coordinates(layout, boundary);
  std::vector<int> held;
  for (int i = 0; i < layout.full(); ++i)
    if (!std::binary_search(free.begin(), free.end(), i)) held.push_back(i);
  MatX shapes = MatX::Zero(layout.full(), T.cols());
  shapes(free_coordinates(layout, Boundary::free_free), Eigen::all) = T;
  // Uniform motions and turns of the whole beam, as many as the boundary holds.
  const MatX rigid = rigid_columns(layout, Boundary::free_free);
  const MatX a = solve_square(MatX(rigid(held, Eigen::all)), MatX(shapes(held, Eigen::all)));
  return shapes(free, Eigen::all) - rigid(free, Eigen::all) * a;
}

const FlexibleBody& FeBeam::linear() const { return data_->linear; }
void FeBeam::add_second_order(FlexibleBody& body) const { data_->add_second_order(data_->Z, body); }
void FeBeam::add_second_order(const MatX& T, FlexibleBody& body) const { data_->add_second_order(MatX(data_->Z * T), body); }

std::vector<ElementStrain> fe_strains(const BeamDef& def, const BeamEffects& effects) {
  const Layout layout = layout_of(def, effects);
  const Properties p = beam::properties(def, effects);
  std::vector<int> coordinate(layout.full(), -1);
  const std::vector<int> free = free_coordinates(layout, def.boundary);
  for (std::size_t j = 0; j < free.size(); ++j) coordinate[free[j]] = static_cast<int>(j);
  // What the mean axes take out is rigid and strains nothing.
  std::vector<ElementStrain> out;
  for (int e = 0; e < layout.elements; ++e) {
    const FieldRows at0 = element_rows(layout, p, effects, e, 0.0), at1 = element_rows(layout, p, effects, e, 1.0);
    const auto row = [&](const VecX& local) {
      CoordinateRow r;
      for (Eigen::Index i = 0; i < local.size(); ++i)
        if (const int k = coordinate[Eigen::Index{e} * layout.per_node + i]; k >= 0 && local[i] != 0.0) r[k] = local[i];
      return r;
    };
    out.push_back({layout.at(e, 0.0),
                   layout.at(e, 1.0),
                   row(at0.du),
                   row(at0.dtheta),
                   {row(at0.dphi_z), row(at1.dphi_z)},
                   {row(at0.ds), row(at1.ds)}});
  }
  return out;
}

int beam::computed_elements(const BeamDef& def, const BeamEffects& effects) { return layout_of(def, effects).elements; }

FlexibleBody make_fe_beam(const BeamDef& def, const BeamEffects& effects) {
  const FeBeam beam(def, effects);
  FlexibleBody body = beam.linear();
  beam.add_second_order(body);
  return body;
}

}  // namespace flexframe::sim
