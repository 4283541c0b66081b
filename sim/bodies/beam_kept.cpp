#include "sim/bodies/beam_kept.h"

#include "sim/base/eigen_solvers.h"
#include "sim/bodies/beam_elements.h"
#include "sim/bodies/held_shapes.h"
#include "sim/bodies/resolution.h"
#include "sim/scene/effect_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace flexframe::sim {
namespace {

using beam::FieldBlock;
using beam::FieldBlocks;
using beam::FieldRows;
using beam::Integrals;
using beam::kKinds;
using beam::Layout;
using beam::Properties;

// Mass and stiffness of one element in its 2 per_node coordinates; strain * x squared is twice its strain energy. Energies of smooth shapes
// come from strains without the loss of digits of x^T K x.
struct ElementMatrices {
  double length = -1.0;
  MatX M, K, strain;
};

// Elements of equal length are equal.
class Elements {
 public:
  Elements(const Layout& layout, const Properties& p, const BeamEffects& effects) : of_(static_cast<size_t>(layout.elements)) {
    BeamEffects linear = effects;
    linear.stiffening = false;
    const beam::GaussRule gauss = beam::gauss_rule(beam::gauss_points);
    for (int e = 0; e < layout.elements; ++e) {
      const double h = layout.length(e);
      size_t at = 0;
      while (at < kinds_.size() && kinds_[at].length != h) ++at;
      of_[static_cast<size_t>(e)] = at;
      if (at < kinds_.size()) continue;
      Integrals local(2 * layout.per_node);
      for (size_t g = 0; g < gauss.x.size(); ++g)
        beam::add_station(local, p, linear, beam::element_rows(layout, p, linear, e, gauss.x[g]), 0.0, gauss.w[g] * h);
      // Its root by the strains themselves: an eigensolver would mix the stiff with the soft.
      std::vector<Eigen::RowVectorXd> rows;
      for (size_t g = 0; g < gauss.x.size(); ++g)
        add_strains(beam::element_rows(layout, p, linear, e, gauss.x[g]), p, effects, gauss.w[g] * h, rows);
      MatX strain(static_cast<Eigen::Index>(rows.size()), 2 * layout.per_node);
      for (size_t i = 0; i < rows.size(); ++i) strain.row(static_cast<Eigen::Index>(i)) = rows[i];
      kinds_.push_back({h, local.Me, local.Ke, strain});
    }
  }
  const ElementMatrices& operator[](int element) const { return kinds_[of_[static_cast<size_t>(element)]]; }

 private:
  static void add_strains(const FieldRows& r, const Properties& p, const BeamEffects& e, double weight,
                          std::vector<Eigen::RowVectorXd>& rows) {
    const auto add = [&](const VecX& row, double stiffness) { rows.emplace_back(std::sqrt(stiffness * weight) * row.transpose()); };
    if (e.axial) add(r.du, p.ea);
    if (e.torsion) add(r.dtheta, p.gj);
    if (e.bending_xy && e.bending_xz && p.ei_yz != 0.0) {
      // EIz a^2 + EIy b^2 + 2 EIyz a b = EIz (a + EIyz/EIz b)^2 + (EIy - EIyz^2/EIz) b^2
      add(VecX(r.dphi_z + (p.ei_yz / p.ei_z) * r.ds), p.ei_z);
      add(r.ds, p.ei_y - p.ei_yz * p.ei_yz / p.ei_z);
    } else {
      if (e.bending_xy) add(r.dphi_z, p.ei_z);
      if (e.bending_xz) add(r.ds, p.ei_y);
    }
    if (e.shear && e.bending_xy && e.bending_xz) {
      add(VecX(r.dv - r.phi_z + (p.shear_yz / p.shear_y) * (r.dw - r.s)), p.shear_y);
      add(VecX(r.dw - r.s), p.shear_z - p.shear_yz * p.shear_yz / p.shear_y);
    } else if (e.shear) {
      if (e.bending_xy) add(VecX(r.dv - r.phi_z), p.shear_y);
      if (e.bending_xz) add(VecX(r.dw - r.s), p.shear_z);
    }
  }
  std::vector<ElementMatrices> kinds_;
  std::vector<size_t> of_;
};

Layout usable_layout(const BeamDef& def, const BeamEffects& effects) {
  constexpr int most = 1500;  // rounding would be 1 % of the first frequency
  Layout layout = beam::layout_of(def, effects);
  if (layout.elements < 1 || layout.elements > most)
    throw InputError(
        fmt::format("elements must lie in 1 .. {} with these effects, found {}; for more take model = \"mixed\"", most, def.elements));
  return layout;
}

struct Beam {
  Layout layout;
  Properties p;
  BeamEffects effects;
  Elements elements;
  std::vector<beam::Station> stations;  // those with a name, then the series
  size_t named = 0;
  bool inertia = false;  // of motions of the holds loads the shapes

  Beam(const BeamDef& def, const BeamEffects& e)
      : layout(usable_layout(def, e)),
        p(beam::properties(def, e)),
        effects(e),
        elements(layout, p, e),
        stations(beam::named_stations(def)),
        named(stations.size()),
        inertia(def.keep_inertia) {
    for (int i = 0; i <= def.elements; ++i) stations.push_back({fmt::format("node[{}]", i), i * (def.length / def.elements)});
  }
};

// Coordinates that no mass and stiffness couples to others: fields of a principal direction at the nodes.
struct Group {
  int direction = 0;  // axial, bending_xy, bending_xz, torsion
  int count = 0;      // modes to keep
  MatX fields;        // kKinds x coordinates a node: the kinds of the beam's own directions as this group moves them
  MatX shapes;        // n x kept, orthonormal by mass
  VecX stiffness;
};

int slope_kind(int kind) { return kind == beam::kV ? beam::kVSlope : beam::kWSlope; }

// The angle from y to the direction in which bending is stiffest.
double principal_angle(const Properties& p) { return 0.5 * std::atan2(2.0 * p.ei_yz, p.ei_z - p.ei_y); }

std::vector<Group> groups_of(const Properties& p, const BeamEffects& e, const std::array<int, 4>& count) {
  std::vector<Group> out;
  const auto along = [&](int direction, std::vector<std::array<double, kKinds>> columns) {
    if (count[static_cast<size_t>(direction)] <= 0) return;
    Group g;
    g.direction = direction;
    g.count = count[static_cast<size_t>(direction)];
    g.fields = MatX::Zero(kKinds, static_cast<Eigen::Index>(columns.size()));
    for (size_t j = 0; j < columns.size(); ++j)
      for (int k = 0; k < kKinds; ++k) g.fields(k, static_cast<Eigen::Index>(j)) = columns[j][static_cast<size_t>(k)];
    out.push_back(std::move(g));
  };
  const bool coupled = e.bending_xy && e.bending_xz && (p.ei_yz != 0.0 || p.shear_yz != 0.0 || (e.shear && p.inertia_yz != 0.0));
  if (e.axial) along(0, {{1, 0, 0, 0, 0, 0}});
  if (coupled && !e.shear) {
    const double angle = principal_angle(p), c = std::cos(angle), s = std::sin(angle);
    const bool turned = std::abs(angle) > 0.25 * EIGEN_PI + 1e-9;  // nearer to z
    const std::vector<std::array<double, kKinds>> one = {{0, c, 0, s, 0, 0}, {0, 0, c, 0, s, 0}},
                                                  two = {{0, -s, 0, c, 0, 0}, {0, 0, -s, 0, c, 0}};
    along(1, turned ? two : one);
    along(2, turned ? one : two);
  } else if (coupled) {
    along(1, {{0, 1, 0, 0, 0, 0}, {0, 0, 1, 0, 0, 0}, {0, 0, 0, 1, 0, 0}, {0, 0, 0, 0, 1, 0}});
    if (!out.empty() && out.back().direction == 1) out.back().count += count[2];
  } else {
    if (e.bending_xy) along(1, {{0, 1, 0, 0, 0, 0}, {0, 0, 1, 0, 0, 0}});
    if (e.bending_xz) along(2, {{0, 0, 0, 1, 0, 0}, {0, 0, 0, 0, 1, 0}});
  }
  if (e.torsion) along(3, {{0, 0, 0, 0, 0, 1}});
  return out;
}

// The group's coordinates of a node as those of the beam.
MatX node_fields(const Layout& layout, const Group& g) {
  MatX E = MatX::Zero(layout.per_node, g.fields.cols());
  for (int k = 0; k < kKinds; ++k)
    if (layout.has(k)) E.row(layout.offset[static_cast<size_t>(k)]) = g.fields.row(k);
  return E;
}

bool is_slope(const Group& g, Eigen::Index column) {
  return g.fields(beam::kVSlope, column) != 0.0 || g.fields(beam::kWSlope, column) != 0.0;
}

LongBody long_body(const Layout& layout, const Elements& elements, const Group& g) {
  const Eigen::Index per = g.fields.cols();
  const Eigen::Index n = per * (layout.elements + 1);
  const MatX E = node_fields(layout, g);
  MatX both = MatX::Zero(2 * E.rows(), 2 * per);
  both.topLeftCorner(E.rows(), per) = E;
  both.bottomRightCorner(E.rows(), per) = E;
  LongBody out;
  std::vector<Eigen::Triplet<double>> K, M;
  const double none = 1e-14;  // of the diagonal: what does not couple
  const ElementMatrices* last = nullptr;
  MatX k, m;
  for (int e = 0; e < layout.elements; ++e) {
    if (&elements[e] != last) {
      last = &elements[e];
      k = both.transpose() * last->K * both;
      m = both.transpose() * last->M * both;
    }
    for (Eigen::Index i = 0; i < 2 * per; ++i)
      for (Eigen::Index j = 0; j < 2 * per; ++j) {
        const auto at = [&](Eigen::Index local) { return static_cast<int>(e * per + local); };
        if (std::abs(k(i, j)) > none * std::sqrt(k(i, i) * k(j, j))) K.emplace_back(at(i), at(j), k(i, j));
        if (std::abs(m(i, j)) > none * std::sqrt(m(i, i) * m(j, j))) M.emplace_back(at(i), at(j), m(i, j));
      }
  }
  out.K.resize(n, n);
  out.M.resize(n, n);
  out.K.setFromTriplets(K.begin(), K.end());
  out.M.setFromTriplets(M.begin(), M.end());
  // Each value moves uniformly; where it has a slope the beam turns besides, about its middle and measured at its size.
  const double L = layout.at(layout.elements - 1, 1.0), size = 0.5 * L;
  std::vector<VecX> rigid;
  out.scale = VecX::Ones(n);
  for (Eigen::Index c = 0; c < per; ++c) {
    out.clamp.push_back(static_cast<int>(c));
    VecX slide = VecX::Zero(n);
    for (int i = 0; i <= layout.elements; ++i) {
      if (is_slope(g, c)) {
        slide[i * per + c - 1] = (layout.at(std::min(i, layout.elements - 1), i < layout.elements ? 0.0 : 1.0) - size) / size;
        slide[i * per + c] = 1.0 / size;
        out.scale[i * per + c] = layout.elements / L;
      } else {
        slide[i * per + c] = 1.0;
      }
    }
    rigid.push_back(slide);
  }
  out.rigid.resize(n, static_cast<Eigen::Index>(rigid.size()));
  for (size_t i = 0; i < rigid.size(); ++i) out.rigid.col(static_cast<Eigen::Index>(i)) = rigid[i];
  return out;
}

// What joints and loads take hold of, in the group's coordinates.
Holds holds_of(const Beam& beam, const Group& g, const LongBody& body, const std::vector<HeldPoint>& held) {
  const Layout& layout = beam.layout;
  const Properties& p = beam.p;
  const Eigen::Index per = g.fields.cols(), n = body.K.rows();
  const double size = 0.5 * p.length;
  std::vector<VecX> by, loads;
  std::vector<double> places;
  // A field of the station, value or slope along each of the group's directions.
  const auto take = [&](double x, bool rotation, std::vector<VecX>& to) {
    const auto [element, xi] = layout.place(x);
    for (Eigen::Index c = 0; c < per; ++c) {
      if (is_slope(g, c)) continue;
      VecX row = VecX::Zero(n);
      if (g.direction == 0 || g.direction == 3) {
        if (rotation != (g.direction == 3)) continue;
        row[element * per + c] = 1.0 - xi, row[(element + 1) * per + c] = xi;
        if (rotation) row *= size;
      } else {
        const auto along = [&](Eigen::Index column) { return g.fields(beam::kV, column) != 0.0 ? size_t{0} : size_t{1}; };
        const beam::Deflections both = beam::deflections(p, beam.effects, xi, layout.length(element));
        for (Eigen::Index other = 0; other < per; ++other) {
          if (is_slope(g, other) || (other != c && !both.coupled)) continue;
          const beam::Deflection& d = both.of[along(c)][along(other)];
          const Eigen::Vector4d& f = rotation ? d.slope : d.value;
          for (Eigen::Index i = 0; i < 4; ++i) row[(element + i / 2) * per + other + i % 2] = (rotation ? size : 1.0) * f[i];
        }
      }
      to.push_back(row);
    }
  };
  for (const HeldPoint& h : held) {
    // On mean axes what acts on every part by its mass works on the slide alone; what holds the body bends it.
    if (h.node.empty() && h.load && h.force && g.direction != 3) {
      VecX ones = VecX::Zero(n);
      for (Eigen::Index c = 0; c < per; ++c)
        if (!is_slope(g, c)) {
          ones.setZero();
          for (Eigen::Index i = c; i < n; i += per) ones[i] = 1.0;
          loads.push_back(body.M * ones);
        }
    }
    for (const beam::Station& s : beam.stations) {
      if (s.name != h.node) continue;
      const bool inside = s.x > 0.0 && s.x < p.length;
      if (!h.load && inside && std::find(places.begin(), places.end(), s.x) == places.end()) places.push_back(s.x);
      if (h.force) take(s.x, false, h.load ? loads : by);
      if (h.moment) take(s.x, true, h.load ? loads : by);
    }
  }
  const auto columns = [&](const std::vector<VecX>& from) {
    MatX out(n, static_cast<Eigen::Index>(from.size()));
    for (size_t i = 0; i < from.size(); ++i) out.col(static_cast<Eigen::Index>(i)) = from[i];
    return out;
  };
  return {columns(by), columns(loads), static_cast<int>(places.size()), beam.inertia};
}

// The shapes' own modes, each with its largest deflection (the first of equal ones) positive.
void take_own_modes(const Layout& layout, const Elements& elements, Group& g) {
  const Eigen::Index per = g.fields.cols(), kept = g.shapes.cols();
  const MatX E = node_fields(layout, g);
  MatX both = MatX::Zero(2 * E.rows(), 2 * per);
  both.topLeftCorner(E.rows(), per) = E;
  both.bottomRightCorner(E.rows(), per) = E;
  MatX K = MatX::Zero(kept, kept);
  const ElementMatrices* last = nullptr;
  MatX strain;
  for (int e = 0; e < layout.elements; ++e) {
    if (&elements[e] != last) {
      last = &elements[e];
      const MatX all = last->strain * both;
      strain.resize(0, 2 * per);
      for (Eigen::Index i = 0; i < all.rows(); ++i)
        if (!all.row(i).isZero(0.0)) strain.conservativeResize(strain.rows() + 1, Eigen::NoChange), strain.bottomRows(1) = all.row(i);
    }
    const MatX strains = strain * g.shapes.middleRows(e * per, 2 * per);
    K.noalias() += strains.transpose() * strains;
  }
  const SymmetricEigen own(K);
  g.shapes = MatX(g.shapes * own.eigenvectors());
  g.stiffness = own.eigenvalues();
  for (Eigen::Index k = 0; k < kept; ++k) {
    double largest = 0.0, first = 0.0;
    for (Eigen::Index i = 0; i < g.shapes.rows(); ++i) {
      if (is_slope(g, i % per)) continue;
      const double value = g.shapes(i, k);
      if (std::abs(value) > (1.0 + 1e-6) * largest) first = value;
      largest = std::max(largest, std::abs(value));
    }
    if (first < 0.0) g.shapes.col(k) = -g.shapes.col(k);
  }
}

// Fields along the beam in few coordinates: of each kind its values at the nodes.
class KeptFields {
 public:
  KeptFields(const Layout& layout, const Properties& p, const BeamEffects& effects, const std::vector<Group>& groups)
      : layout_(layout), p_(p), effects_(effects) {
    for (const Group& g : groups) n_ += static_cast<int>(g.shapes.cols());
    for (int k = 0; k < kKinds; ++k) {
      if (!layout.has(k)) continue;
      Eigen::Index first = -1, end = 0, at = 0;
      for (const Group& g : groups) {
        if (!g.fields.row(k).isZero(0.0) && g.shapes.cols() > 0) {
          if (first < 0) first = at;
          end = at + g.shapes.cols();
        }
        at += g.shapes.cols();
      }
      if (first < 0) continue;
      FieldBlock& nodal = nodal_[static_cast<size_t>(k)];
      nodal.first = first;
      nodal.rows = MatX::Zero(end - first, layout.elements + 1);
      at = 0;
      for (const Group& g : groups) {
        const Eigen::Index per = g.fields.cols(), kept = g.shapes.cols();
        for (Eigen::Index c = 0; c < per && kept > 0; ++c) {
          if (g.fields(k, c) == 0.0) continue;
          for (Eigen::Index i = 0; i <= layout.elements; ++i)
            nodal.rows.col(i).segment(at - first, kept) += g.fields(k, c) * g.shapes.row(i * per + c).transpose();
        }
        at += kept;
      }
    }
  }

  int n() const { return n_; }

  // At places of elements.
  FieldBlocks at(const std::vector<std::pair<int, double>>& places) const {
    FieldBlocks out;
    const auto count = static_cast<Eigen::Index>(places.size());
    const auto linear = [&](int kind, FieldBlock& value, FieldBlock& derivative) {
      const FieldBlock& nodal = nodal_[static_cast<size_t>(kind)];
      for (FieldBlock* b : {&value, &derivative}) b->first = nodal.first, b->rows.resize(nodal.rows.rows(), count);
      for (Eigen::Index i = 0; i < count && nodal.rows.rows() > 0; ++i) {
        const auto [e, xi] = places[static_cast<size_t>(i)];
        value.rows.col(i) = (1.0 - xi) * nodal.rows.col(e) + xi * nodal.rows.col(e + 1);
        derivative.rows.col(i) = (nodal.rows.col(e + 1) - nodal.rows.col(e)) / layout_.length(e);
      }
    };
    const auto cubic = [&](size_t along, FieldBlock& value, FieldBlock& derivative, FieldBlock& slope, FieldBlock& curvature) {
      const int kind = along == 0 ? beam::kV : beam::kW;
      const FieldBlock& own = nodal_[static_cast<size_t>(kind)];
      for (FieldBlock* b : {&value, &derivative, &slope, &curvature}) b->first = own.first, b->rows.setZero(own.rows.rows(), count);
      for (Eigen::Index i = 0; i < count && own.rows.rows() > 0; ++i) {
        const int e = places[static_cast<size_t>(i)].first;
        const beam::Deflections both = beam::deflections(p_, effects_, places[static_cast<size_t>(i)].second, layout_.length(e));
        for (size_t by = 0; by < 2; ++by) {
          if (by != along && !both.coupled) continue;
          // Where they are coupled both directions are of one group, with the same rows.
          const int by_kind = by == 0 ? beam::kV : beam::kW;
          const MatX &v = nodal_[static_cast<size_t>(by_kind)].rows, &s = nodal_[static_cast<size_t>(slope_kind(by_kind))].rows;
          const beam::Deflection& d = both.of[along][by];
          value.rows.col(i) += d.value[0] * v.col(e) + d.value[1] * s.col(e) + d.value[2] * v.col(e + 1) + d.value[3] * s.col(e + 1);
          // Values cancel in derivatives: their difference counts.
          const auto add_differences = [&](const Eigen::Vector4d& f, FieldBlock& to) {
            to.rows.col(i) += f[2] * (v.col(e + 1) - v.col(e)) + f[1] * s.col(e) + f[3] * s.col(e + 1);
          };
          add_differences(d.derivative, derivative), add_differences(d.slope, slope), add_differences(d.curvature, curvature);
        }
      }
    };
    linear(beam::kU, out.u, out.du);
    cubic(0, out.v, out.dv, out.phi_z, out.dphi_z);
    cubic(1, out.w, out.dw, out.s, out.ds);
    linear(beam::kTheta, out.theta, out.dtheta);
    return out;
  }

  // At one place, in all coordinates.
  FieldRows row_at(double x) const {
    const FieldBlocks b = at({layout_.place(x)});
    FieldRows r(n_);
    const auto take = [](const FieldBlock& from, VecX& to) {
      if (from.rows.rows() > 0) to.segment(from.first, from.rows.rows()) = from.rows.col(0);
    };
    take(b.u, r.u), take(b.du, r.du), take(b.v, r.v), take(b.dv, r.dv), take(b.phi_z, r.phi_z), take(b.dphi_z, r.dphi_z);
    take(b.w, r.w), take(b.dw, r.dw), take(b.s, r.s), take(b.ds, r.ds), take(b.theta, r.theta), take(b.dtheta, r.dtheta);
    return r;
  }

 private:
  const Layout& layout_;
  const Properties& p_;
  const BeamEffects& effects_;
  int n_ = 0;
  std::array<FieldBlock, kKinds> nodal_;
};

// All integrals, four points an element.
void set_constants(const Beam& beam, const KeptFields& fields, Integrals& sum) {
  const Layout& layout = beam.layout;
  const beam::GaussRule gauss = beam::gauss_rule(beam::gauss_points);
  std::vector<std::pair<int, double>> places;
  const auto count = static_cast<Eigen::Index>(layout.elements) * beam::gauss_points;
  Eigen::ArrayXd x(count), weight(count);
  Eigen::Index at = 0;
  for (int e = 0; e < layout.elements; ++e)
    for (size_t g = 0; g < gauss.x.size(); ++g) {
      places.emplace_back(e, gauss.x[g]);
      x[at] = layout.at(e, gauss.x[g]);
      weight[at++] = gauss.w[g] * layout.length(e);
    }
  beam::add_stations(sum, beam.p, beam.effects, fields.at(places), x, weight);
}

void add_nodes(const Beam& beam, const KeptFields& fields, FlexibleBody& body) {
  std::vector<std::pair<int, double>> places;
  for (const beam::Station& s : beam.stations) places.push_back(beam.layout.place(s.x));
  const FieldBlocks at = fields.at(places);
  body.nodes.resize(beam.stations.size());
  for (size_t i = 0; i < beam.stations.size(); ++i) {
    FlexibleNode& node = body.nodes[i];
    node.name = beam.stations[i].name;
    node.origin = Vec3(beam.stations[i].x, 0.0, 0.0);
    node.phi = Mat3X::Zero(3, body.n);
    node.psi = Mat3X::Zero(3, body.n);
    const auto set = [&](Mat3X& motion, Eigen::Index row, const FieldBlock& field, double sign) {
      if (field.rows.rows() == 0) return;
      motion.row(row).segment(field.first, field.rows.rows()) = sign * field.rows.col(static_cast<Eigen::Index>(i)).transpose();
    };
    set(node.phi, 0, at.u, 1.0), set(node.phi, 1, at.v, 1.0), set(node.phi, 2, at.w, 1.0);
    // A section turns by (theta, -w', v').
    set(node.psi, 0, at.theta, 1.0), set(node.psi, 1, at.s, -1.0), set(node.psi, 2, at.phi_z, 1.0);
  }
}

// The running integrals visit the nodes in the order of x.
void set_second_order_of_nodes(const Beam& beam, const KeptFields& fields, const FieldRows& root, FlexibleBody& body) {
  const std::vector<beam::Station>& stations = beam.stations;
  const Layout& layout = beam.layout;
  const size_t named = beam.named;
  const bool series = 3.0 * body.n * body.n * static_cast<double>(stations.size() - named) <= beam::kMaxSeriesNumbers;
  std::vector<size_t> order(stations.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return stations[a].x < stations[b].x; });
  const beam::GaussRule gauss = beam::gauss_rule(beam::gauss_points);
  beam::SecondOrder running(body.n);
  int done_element = 0;
  double done = 0.0;  // within it
  for (const size_t i : order) {
    if (i >= named && !series) continue;
    const auto [element, xi] = layout.place(stations[i].x);
    std::vector<std::pair<int, double>> places;
    std::vector<double> x, weight;
    while (done_element < element || done < xi) {
      const double end = done_element < element ? 1.0 : xi;
      for (size_t g = 0; g < gauss.x.size() && end > done; ++g) {
        places.emplace_back(done_element, done + (end - done) * gauss.x[g]);
        x.push_back(layout.at(done_element, places.back().second));
        weight.push_back((end - done) * layout.length(done_element) * gauss.w[g]);
      }
      done = end;
      if (done_element < element) ++done_element, done = 0.0;
    }
    if (!places.empty()) {
      const auto count = static_cast<Eigen::Index>(x.size());
      beam::add_second_order(running, beam.p, beam.effects, fields.at(places), Eigen::ArrayXd(Eigen::Map<Eigen::ArrayXd>(x.data(), count)),
                             Eigen::ArrayXd(Eigen::Map<Eigen::ArrayXd>(weight.data(), count)));
    }
    body.nodes[i].phi2 = beam::second_order_at(running, root, stations[i].x);
    body.nodes[i].psi2 = beam::second_turns(running);
  }
}

// The mass matrix of the shapes as the boundary's frame sees them: full coordinates that it holds are zero, seen those it leaves.
MatX mass_seen(const Layout& layout, const Elements& elements, Boundary boundary, const MatX& seen) {
  MatX shapes = MatX::Zero(layout.full(), seen.cols());
  shapes(beam::free_coordinates(layout, boundary), Eigen::all) = seen;
  const auto times_mass = [&](const MatX& x) {
    MatX out = MatX::Zero(x.rows(), x.cols());
    for (int e = 0; e < layout.elements; ++e) {
      const int first = e * layout.per_node, count = 2 * layout.per_node;
      out.middleRows(first, count) += elements[e].M * x.middleRows(first, count);
    }
    return out;
  };
  const MatX rigid = beam::rigid_columns(layout, boundary);
  if (rigid.cols() > 0) {
    const MatX inertia = times_mass(rigid);
    shapes -= rigid * solve_symmetric(rigid.transpose() * inertia, inertia.transpose() * shapes);
  }
  return shapes.transpose() * times_mass(shapes);
}

}  // namespace

KeptBeam make_kept_beam(const BeamDef& def, const BeamEffects& effects, const std::array<int, 4>& count,
                        const std::vector<HeldPoint>& held) {
  const Beam beam(def, effects);
  const Layout& layout = beam.layout;
  const Properties& p = beam.p;
  std::vector<Group> groups = groups_of(p, effects, count);
  for (Group& g : groups) {
    const LongBody body = long_body(layout, beam.elements, g);
    g.shapes = held_shapes(body, holds_of(beam, g, body, held), g.count);
    take_own_modes(layout, beam.elements, g);
  }

  const KeptFields fields(layout, p, effects, groups);
  Integrals sum(fields.n());
  set_constants(beam, fields, sum);
  const FieldRows root = fields.row_at(0.0);
  if (effects.stiffening && effects.torsion) beam::add_root_rotation(sum, p, root);

  KeptBeam out;
  FlexibleBody& body = out.body;
  beam::Basis identity(fields.n(), fields.n());
  identity.setIdentity();
  body = beam::linear_body(sum, p, effects, identity);
  beam::set_second_order(body, sum, identity);
  body.Me = MatX::Identity(body.n, body.n);
  body.stiffness.resize(body.n);
  MatX full = MatX::Zero(layout.full(), body.n);
  Eigen::Index at = 0;
  int most = 0;
  for (const Group& g : groups) {
    const MatX E = node_fields(layout, g);
    const Eigen::Index per = g.fields.cols(), kept = g.shapes.cols();
    for (Eigen::Index i = 0; i <= layout.elements && kept > 0; ++i)
      full.block(i * layout.per_node, at, layout.per_node, kept) = E * g.shapes.middleRows(i * per, per);
    for (Eigen::Index k = 0; k < kept; ++k)
      body.labels.push_back(fmt::format("{} shape {} ({:.6g} Hz)", direction_names()[static_cast<size_t>(g.direction)], k + 1,
                                        std::sqrt(g.stiffness[k]) / (2.0 * EIGEN_PI)));
    body.stiffness.segment(at, kept) = g.stiffness;
    at += kept;
    most = std::max(most, static_cast<int>(kept));
  }
  body.Ke = body.stiffness.asDiagonal();
  const int panels = std::min(layout.elements, std::max(10, elements_for_modes(most)));
  const auto rows = [&](int panel, double xi) { return fields.row_at((panel + xi) * (p.length / panels)); };
  beam::set_axis_mass(body, p, effects, identity, {panels, beam::gauss_points, rows, root});

  add_nodes(beam, fields, body);
  if (effects.stiffening && !effects.large_bending && body.n > 0) set_second_order_of_nodes(beam, fields, root, body);

  // Few panels of many points: shapes of so few waves are smooth (pendulum with eight modes: 12, 16 and 20 points are 1.0e-4, 1.2e-5 and
  // 6e-6 of its deflection off 48).
  const int points = std::max(12, 3 * most / 2 + 3), parts = (points + 23) / 24;
  const auto smooth = [&](int panel, double xi) { return fields.row_at((panel + xi) * (p.length / parts)); };
  beam::set_rod_axis(body, p, effects, identity, {parts, (points + parts - 1) / parts, smooth, root});

  out.coordinates = beam::seen_from(layout, def.boundary, full);
  // The damping of the boundary's modes as the coordinates kept make them. The whole beam's, projected, would hold back the kept
  // coordinates by rates that the others could follow: it converged with the number of modes only.
  const Damping& damping = def.damping;
  const bool damped = damping.mass != 0.0 || damping.stiffness != 0.0 || !damping.ratio.empty();
  if (damped && body.n > 0)
    body.De = beam::damping_matrix(damping, mass_seen(layout, beam.elements, def.boundary, out.coordinates), body.Ke);
  return out;
}

}  // namespace flexframe::sim
