#include "sim/bodies/beam_elements.h"

#include "sim/base/eigen_solvers.h"
#include "sim/bodies/resolution.h"

#include <algorithm>

namespace flexframe::sim::beam {

std::pair<int, double> Layout::place(double x) const {
  if (nodes.empty()) {
    const int element = std::clamp(static_cast<int>(x / h), 0, elements - 1);
    return {element, std::clamp(x / h - element, 0.0, 1.0)};
  }
  const auto after = std::upper_bound(nodes.begin() + 1, nodes.end() - 1, x);
  const int element = static_cast<int>(after - nodes.begin()) - 1;
  return {element, std::clamp((x - nodes[element]) / length(element), 0.0, 1.0)};
}

namespace {

// More coordinates cost time with the third power of their number: a beam of 300 has its first ten bending frequencies to 1e-4 and those of
// axial motion and twist, whose elements are linear, to 2e-2.
constexpr int most_coordinates = 300;
// Volumes of a mixed beam share this many, which leaves up to five of them (also what other beams have for `volumes`) 300 each: what looks
// at all of them at once (frequencies, static starts, implicit steps) has one dense matrix, 2400 rows for 8 x 1000 elements. What bends so
// little may always have its sixteen.
constexpr int most_of_volumes = 1500, always = 16;
// Few modes of them cost time in proportion to the number of elements; rounding, which grows with its fourth power, is 1e-5 of a frequency
// at 300 elements, as much as the 40th mode then lacks.
constexpr int most_kept_elements = 300;

// A force within an element bends, stretches and twists it there in a way that its nodes do not know: forces act on frames, so nodes are
// put on them. The even node next to a frame moves there; where none is near, one is added. In lengths of the even elements:
constexpr double on_node = 0.02;  // a frame so near lies on the node
constexpr double moves = 0.35;    // so near it moves an even node
constexpr double apart = 0.1;     // no new nodes nearer to others than this: their elements were stiff

void put_nodes_on_frames(const BeamDef& def, int most_nodes, Layout& layout) {
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
    } else if (distance > apart && static_cast<int>(nodes.size()) < most_nodes) {
      nodes.insert(std::upper_bound(nodes.begin(), nodes.end(), x, [](double value, const Node& n) { return value < n.x; }), {x, true});
      even = false;
    }
  }
  if (even) return;
  const double h = def.length / layout.elements;
  for (const Node& n : nodes) layout.nodes.push_back(n.x * h);
  layout.elements = static_cast<int>(nodes.size()) - 1;
}

}  // namespace

Layout layout_of(const BeamDef& def, const BeamEffects& e) {
  Layout layout;
  const std::array<bool, kKinds> exists = {e.axial, e.bending_xy, e.bending_xy, e.bending_xz, e.bending_xz, e.torsion};
  for (std::size_t k = 0; k < kKinds; ++k) layout.offset[k] = exists[k] ? layout.per_node++ : -1;
  layout.elements = def.elements;
  const bool by_name = def.all_elements || !def.initial.q.empty() || !def.initial.qd.empty();
  const bool choose = !by_name && layout.per_node > 0;
  const int per_node = std::max(1, layout.per_node);
  const int share = std::max(most_of_volumes / std::max(1, def.volumes), (always + 1) * per_node);
  const int coordinates = std::min(most_coordinates, share);
  const int most = def.keep_modes ? std::max(most_kept_elements, elements_for_modes(*def.keep_modes)) : coordinates / per_node - 1;
  if (choose) layout.elements = std::min(def.elements, most);
  layout.h = def.length / layout.elements;
  const int most_nodes = def.keep_modes ? 2 * most : (coordinates - 1) / per_node + 1;
  if (choose && layout.elements > 0) put_nodes_on_frames(def, most_nodes, layout);
  return layout;
}

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

namespace {

Deflection combined(const Deflection& a, double fa, const Deflection& b, double fb) {
  return {fa * a.value + fb * b.value, fa * a.derivative + fb * b.derivative, fa * a.slope + fb * b.slope,
          fa * a.curvature + fb * b.curvature};
}

}  // namespace

Deflections deflections(const Properties& p, const BeamEffects& e, double xi, double h) {
  Deflections out;
  out.coupled = e.shear && e.bending_xy && e.bending_xz && (p.ei_yz != 0.0 || p.shear_yz != 0.0);
  if (!out.coupled) {
    const double factor = e.shear ? 12.0 / (h * h) : 0.0;
    if (e.bending_xy) out.of[0][0] = deflection_shapes(xi, h, e.shear ? factor * p.ei_z / p.shear_y : 0.0);
    if (e.bending_xz) out.of[1][1] = deflection_shapes(xi, h, e.shear ? factor * p.ei_y / p.shear_z : 0.0);
    return out;
  }
  // S^-1 EI is similar to the symmetric B^-1 EI B^-T, S = B B^T.
  Eigen::Matrix2d B, EI;
  const double across = p.shear_yz / std::sqrt(p.shear_y);
  B << std::sqrt(p.shear_y), 0.0, across, std::sqrt(p.shear_z - across * across);
  EI << p.ei_z, p.ei_yz, p.ei_yz, p.ei_y;
  const Eigen::Matrix2d back = B.inverse(), similar = back * EI * back.transpose();
  const SymmetricEigen own(MatX(6.0 / (h * h) * (similar + similar.transpose())));
  const Eigen::Matrix2d U = own.eigenvectors(), T = back.transpose() * U, inverse = U.transpose() * B.transpose();
  const Deflection one = deflection_shapes(xi, h, own.eigenvalues()[0]), two = deflection_shapes(xi, h, own.eigenvalues()[1]);
  for (size_t a = 0; a < 2; ++a)
    for (size_t b = 0; b < 2; ++b) {
      const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
      out.of[a][b] = combined(one, T(i, 0) * inverse(0, j), two, T(i, 1) * inverse(1, j));
    }
  return out;
}

FieldRows element_rows(const Layout& layout, const Properties& p, const BeamEffects& e, int element, double xi) {
  FieldRows r(2 * layout.per_node);
  const double h = layout.length(element);
  const auto linear = [&](int kind, VecX& value, VecX& derivative) {
    const int a = layout.offset[kind], b = a + layout.per_node;
    value[a] = 1.0 - xi, value[b] = xi;
    derivative[a] = -1.0 / h, derivative[b] = 1.0 / h;
  };
  const Deflections both = deflections(p, e, xi, h);
  const auto cubic = [&](size_t along, VecX& value, VecX& derivative, VecX& slope, VecX& curvature) {
    for (size_t by = 0; by < 2; ++by) {
      if (by != along && !both.coupled) continue;
      const Deflection& d = both.of[along][by];
      for (int i = 0; i < 4; ++i) {
        const int at = layout.offset[by == 0 ? kV : kW] + i % 2 + (i / 2) * layout.per_node;
        value[at] = d.value[i], derivative[at] = d.derivative[i], slope[at] = d.slope[i], curvature[at] = d.curvature[i];
      }
    }
  };
  if (e.axial) linear(kU, r.u, r.du);
  if (e.bending_xy) cubic(0, r.v, r.dv, r.phi_z, r.dphi_z);
  if (e.bending_xz) cubic(1, r.w, r.dw, r.s, r.ds);
  if (e.torsion) linear(kTheta, r.theta, r.dtheta);
  return r;
}

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

MatX seen_from(const Layout& layout, Boundary boundary, const MatX& shapes) {
  const std::vector<int> free = free_coordinates(layout, boundary);
  std::vector<int> held;
  for (int i = 0; i < layout.full(); ++i)
    if (!std::binary_search(free.begin(), free.end(), i)) held.push_back(i);
  // Uniform motions and turns of the whole beam, as many as the boundary holds.
  const MatX rigid = rigid_columns(layout, Boundary::free_free);
  const MatX a = solve_square(MatX(rigid(held, Eigen::all)), MatX(shapes(held, Eigen::all)));
  return shapes(free, Eigen::all) - rigid(free, Eigen::all) * a;
}

}  // namespace flexframe::sim::beam
