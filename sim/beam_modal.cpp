// The beam with eigenforms as shape functions: Heckmann, Otter, Dietz, Diaz Lopez 2006 (seed 001) eq. 4, 8-10.
#include "sim/beam_eigenforms.h"
#include "sim/beam_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {
namespace {

using beam::Eigenform;
using beam::FieldRows;
using beam::Properties;

enum Direction { kAxial, kBendingXy, kBendingXz, kTorsion };
constexpr std::array<const char*, 4> kDirections = {"axial", "bending_xy", "bending_xz", "torsion"};

struct Mode {
  Direction direction = kAxial;
  int ordinal = 1;
  Eigenform form;
  double mass = 0.0, stiffness = 0.0;
};

std::array<bool, 4> wanted(const BeamEffects& e) { return {e.axial, e.bending_xy, e.bending_xz, e.torsion}; }

std::vector<int> ordinals(const BeamDef& def, Direction direction) {
  if (def.modes.empty()) {
    if (direction == kBendingXy || direction == kBendingXz) return {1, 2, 3};
    return {1};
  }
  const auto found = def.modes.find(kDirections[direction]);
  return found == def.modes.end() ? std::vector<int>{} : found->second;
}

void check_modes(const BeamDef& def) {
  for (const auto& [name, list] : def.modes) {
    if (std::find(kDirections.begin(), kDirections.end(), name) == kDirections.end())
      throw InputError(fmt::format("modes: unknown direction '{}'; allowed are axial, bending_xy, bending_xz, torsion", name));
    std::vector<int> sorted = list;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      if (sorted[i] < 1 || sorted[i] > kMaxMode)
        throw InputError(fmt::format("modes: {} holds {}; mode numbers lie in 1 .. {}", name, sorted[i], kMaxMode));
      if (i > 0 && sorted[i] == sorted[i - 1]) throw InputError(fmt::format("modes: {} holds {} twice", name, sorted[i]));
    }
  }
}

// Forms with their exact modal mass and stiffness.
std::vector<Mode> select_modes(const BeamDef& def, const BeamEffects& effects, const Properties& p) {
  check_modes(def);
  const double L = p.length, polar = p.inertia_y + p.inertia_z;
  const std::array<double, 4> mass = {p.mass * L, p.mass * L, p.mass * L, polar * L};
  const std::array<double, 4> stiffness = {p.ea / L, p.ei_z / (L * L * L), p.ei_y / (L * L * L), p.gj / L};
  std::vector<Mode> modes;
  for (const Direction d : {kAxial, kBendingXy, kBendingXz, kTorsion}) {
    if (!wanted(effects)[d]) continue;
    const bool bends = d == kBendingXy || d == kBendingXz;
    for (const int ordinal : ordinals(def, d)) {
      Mode mode;
      mode.direction = d;
      mode.ordinal = ordinal;
      mode.form = bends ? beam::bending_form(def.boundary, ordinal) : beam::rod_form(def.boundary, ordinal);
      mode.mass = mass[d];
      mode.stiffness = stiffness[d] * std::pow(mode.form.lambda, bends ? 4 : 2);
      modes.push_back(mode);
    }
  }
  return modes;
}

FieldRows rows_at(const std::vector<Mode>& modes, double x, double L) {
  FieldRows r(static_cast<int>(modes.size()));
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const Eigenform& f = modes[i].form;
    const auto at = static_cast<Eigen::Index>(i);
    const double value = beam::evaluate(f, x / L, 0), slope = beam::evaluate(f, x / L, 1) / L;
    const auto curvature = [&] { return beam::evaluate(f, x / L, 2) / (L * L); };
    switch (modes[i].direction) {
      case kAxial: r.u[at] = value, r.du[at] = slope; break;
      case kBendingXy: r.v[at] = value, r.dv[at] = r.phi_z[at] = slope, r.dphi_z[at] = curvature(); break;
      case kBendingXz: r.w[at] = value, r.dw[at] = r.s[at] = slope, r.ds[at] = curvature(); break;
      case kTorsion: r.theta[at] = value, r.dtheta[at] = slope; break;
    }
  }
  return r;
}

// Orthogonality made exact: the quadrature's rounding would otherwise couple the modes.
void set_structure(FlexibleBody& body, const std::vector<Mode>& modes, const Properties& p, const Damping& damping) {
  const auto n = static_cast<Eigen::Index>(modes.size());
  if (n == 0) return;
  body.Me = MatX::Zero(n, n);
  body.Ke = MatX::Zero(n, n);
  const double L = p.length;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Mode& a = modes[static_cast<std::size_t>(i)];
    body.Me(i, i) = a.mass;
    body.Ke(i, i) = a.stiffness;
    for (Eigen::Index j = 0; j < n; ++j) {
      const Mode& b = modes[static_cast<std::size_t>(j)];
      if (a.direction == kBendingXy && b.direction == kBendingXz && a.ordinal == b.ordinal)
        body.Ke(i, j) = body.Ke(j, i) = p.ei_yz * std::pow(a.form.lambda, 4) / (L * L * L);
    }
  }
  if (damping.mass != 0.0 || damping.stiffness != 0.0) body.De = damping.mass * body.Me + damping.stiffness * body.Ke;
  for (const double zeta : damping.ratio)
    if (!(zeta >= 0.0) || !std::isfinite(zeta)) throw InputError(fmt::format("damping ratio must be 0 or more, found {}", zeta));
  if (std::all_of(damping.ratio.begin(), damping.ratio.end(), [](double z) { return z == 0.0; })) return;
  if (body.De.size() == 0) body.De = MatX::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double zeta = damping.ratio[std::min(static_cast<std::size_t>(i), damping.ratio.size() - 1)];
    body.De(i, i) += 2.0 * zeta * std::sqrt(body.Ke(i, i) * body.Me(i, i));
  }
}

}  // namespace

FlexibleBody make_modal_beam(const BeamDef& def, const BeamEffects& effects) {
  if (effects.shear) throw InputError("effect 'shear' needs model = \"finite-element\": eigenforms are those of the Euler-Bernoulli beam");
  const Properties p = beam::properties(def, effects);
  const double L = p.length;
  const std::vector<Mode> modes = select_modes(def, effects, p);
  const int n = static_cast<int>(modes.size());
  double highest = 0.0;
  for (const Mode& mode : modes) highest = std::max(highest, mode.form.lambda);

  // one panel a half wave of the highest form: 12 Gauss points leave less than 1e-15 of the integral of a product
  const beam::GaussRule gauss = beam::gauss_rule(12);
  const int panels = std::max(1, static_cast<int>(std::ceil(highest / std::numbers::pi)));
  const double h = L / panels;
  beam::Integrals sum(n);
  for (int e = 0; e < panels; ++e)
    for (std::size_t g = 0; g < gauss.x.size(); ++g) {
      const double x = (e + gauss.x[g]) * h;
      beam::add_station(sum, p, effects, rows_at(modes, x, L), x, gauss.w[g] * h);
    }
  const FieldRows root = rows_at(modes, 0.0, L);
  if (effects.stiffening && effects.torsion && def.boundary == Boundary::free_free) beam::add_root_rotation(sum, p, root);

  beam::Basis Z(n, n);
  Z.setIdentity();
  FlexibleBody body = beam::reduced_body(sum, p, effects, Z);
  set_structure(body, modes, p, def.damping);
  for (const Mode& mode : modes)
    body.labels.push_back(fmt::format("{} {} ({:.6g} Hz)", kDirections[mode.direction], mode.ordinal,
                                      std::sqrt(mode.stiffness / mode.mass) / (2.0 * std::numbers::pi)));

  // nodes: those with a name, then the series; the running integrals visit them in the order of x
  std::vector<beam::Station> stations = beam::named_stations(def);
  const std::size_t named = stations.size();
  const int intervals = std::max(10, static_cast<int>(std::ceil(4.0 * highest / std::numbers::pi)));
  for (int k = 0; k <= intervals; ++k) stations.push_back({fmt::format("station[{}]", k), L * k / intervals});
  const bool series = 3.0 * n * n * (intervals + 1.0) <= beam::kMaxSeriesNumbers;
  std::vector<std::size_t> order(stations.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return stations[a].x < stations[b].x; });
  body.nodes.resize(stations.size());
  beam::SecondOrder running(effects.stiffening ? n : 0);
  double done = 0.0;
  for (const std::size_t i : order) {
    const double x = stations[i].x;
    body.nodes[i] = beam::make_node(stations[i].name, x, rows_at(modes, x, L), Z);
    if (!effects.stiffening || n == 0 || (i >= named && !series)) continue;
    const int parts = static_cast<int>(std::ceil((x - done) / h));
    for (int part = 0; part < parts; ++part) {
      const double width = (x - done) / parts;
      for (std::size_t g = 0; g < gauss.x.size(); ++g) {
        const double s = done + (part + gauss.x[g]) * width;
        beam::add_second_order(running, effects, rows_at(modes, s, L), s, gauss.w[g] * width);
      }
    }
    done = x;
    body.nodes[i].phi2 = beam::second_order_at(running, root, x, Z);
  }
  return body;
}

}  // namespace flexframe::sim
