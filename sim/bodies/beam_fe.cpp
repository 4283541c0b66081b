// The finite-element beam of Schiavo, Ferretti, Vigano 2005 eq. 30-38 in space, with the second-order field of Heckmann et
// al. 2006 eq. 8. Shear-flexible variant: Friedman, Kosmatka 1993 (exact static shape functions), equal to the Hermite
// element for vanishing shear flexibility.
#include "sim/base/eigen_solvers.h"
#include "sim/bodies/beam_boundary.h"
#include "sim/bodies/beam_elements.h"
#include "sim/bodies/section_strain.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

namespace flexframe::sim {
namespace {

using beam::element_rows;
using beam::FieldRows;
using beam::free_coordinates;
using beam::gauss_points;
using beam::Integrals;
using beam::kKinds;
using beam::Layout;
using beam::layout_of;
using beam::Properties;
using beam::rigid_columns;
using beam::seen_from;

constexpr std::array<const char*, kKinds> kKindNames = {"u", "v", "v'", "w", "w'", "theta"};

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
  if (!effects.stiffening || effects.large_bending || body.n == 0) return;
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
    if constexpr (few) body.nodes[i].psi2 = beam::second_turns(running);
    else body.nodes[i].psi2 = beam::second_turns(running, basis);
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
  beam::set_rod_axis(body, d.properties, effects, d.Z, {layout.elements, beam::rod_points, panel_rows, d.root});
}

FeBeam::~FeBeam() = default;

MatX in_boundary(const BeamDef& def, const BeamEffects& effects, Boundary boundary, const MatX& T) {
  const Layout layout = layout_of(def, effects);
  MatX shapes = MatX::Zero(layout.full(), T.cols());
  shapes(free_coordinates(layout, Boundary::free_free), Eigen::all) = T;
  return seen_from(layout, boundary, shapes);
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
