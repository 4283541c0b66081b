// The beam with eigenforms as shape functions: Heckmann, Otter, Dietz, Diaz Lopez 2006 eq. 4, 8-10.
#include "sim/bodies/beam_eigenforms.h"
#include "sim/bodies/beam_terms.h"
#include "sim/bodies/normal_modes.h"
#include "sim/bodies/section_strain.h"
#include "sim/scene/effect_names.h"

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

struct Mode {
  Direction direction = kAxial;
  int ordinal = 1;
  Eigenform form;
  double mass = 0.0, stiffness = 0.0;
  // of a volume: a Legendre polynomial instead of the form, or the form less its rigid share
  int degree = 0;
  double offset = 0.0, slope = 0.0;
};

// Derivative of a mode's form at xi = x/L.
double shape(const Mode& mode, double xi, int order) {
  const double t = 2.0 * xi - 1.0;
  switch (mode.degree) {
    case 1:
      return order == 0 ? t : order == 1 ? 2.0 : 0.0;
    case 2:
      return order == 0 ? 1.5 * t * t - 0.5 : order == 1 ? 6.0 * t : 12.0;
    case 3:
      return order == 0 ? (2.5 * t * t - 1.5) * t : order == 1 ? 15.0 * t * t - 3.0 : 60.0 * t;
    default:
      break;
  }
  const double rigid = order == 0 ? mode.offset + mode.slope * xi : order == 1 ? mode.slope : 0.0;
  return beam::evaluate(mode.form, xi, order) - rigid;
}

std::array<bool, 4> wanted(const BeamEffects& e) { return {e.axial, e.bending_xy, e.bending_xz, e.torsion}; }

std::vector<int> ordinals(const BeamDef& def, Direction direction) {
  if (def.modes.empty()) {
    if (direction == kBendingXy || direction == kBendingXz) return {1, 2, 3};
    return {1};
  }
  const auto found = def.modes.find(direction_names()[direction]);
  return found == def.modes.end() ? std::vector<int>{} : found->second;
}

void check_modes(const BeamDef& def) {
  for (const auto& [name, list] : def.modes) {
    if (std::find(direction_names().begin(), direction_names().end(), name) == direction_names().end())
      throw InputError(fmt::format("modes: unknown direction '{}'; allowed are {}", name, fmt::join(direction_names(), ", ")));
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
    const auto at = static_cast<Eigen::Index>(i);
    const double value = shape(modes[i], x / L, 0), slope = shape(modes[i], x / L, 1) / L;
    const auto curvature = [&] { return shape(modes[i], x / L, 2) / (L * L); };
    switch (modes[i].direction) {
      case kAxial:
        r.u[at] = value, r.du[at] = slope;
        break;
      case kBendingXy:
        r.v[at] = value, r.dv[at] = r.phi_z[at] = slope, r.dphi_z[at] = curvature();
        break;
      case kBendingXz:
        r.w[at] = value, r.dw[at] = r.s[at] = slope, r.ds[at] = curvature();
        break;
      case kTorsion:
        r.theta[at] = value, r.dtheta[at] = slope;
        break;
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
    const Mode& a = modes[i];
    body.Me(i, i) = a.mass;
    body.Ke(i, i) = a.stiffness;
    for (Eigen::Index j = 0; j < n; ++j) {
      const Mode& b = modes[j];
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

// Forms of a volume on its mean axes: the static ones of its ends, then those between clamped ends.
std::vector<Mode> volume_modes(const BeamDef& def, const BeamEffects& effects) {
  check_modes(def);
  std::vector<Mode> modes;
  for (const Direction d : {kAxial, kBendingXy, kBendingXz, kTorsion}) {
    if (!wanted(effects)[d]) continue;
    const bool bends = d == kBendingXy || d == kBendingXz;
    for (const int degree : bends ? std::vector<int>{2, 3} : std::vector<int>{1}) {
      Mode mode;
      mode.direction = d;
      mode.degree = degree;
      modes.push_back(mode);
    }
    const auto listed = def.modes.find(direction_names()[d]);
    if (listed == def.modes.end()) continue;
    for (const int ordinal : listed->second) {
      Mode mode;
      mode.direction = d;
      mode.ordinal = ordinal;
      if (bends) {
        // phi'''' = lambda^4 phi gives the integrals of phi and xi phi from the ends; the rigid share has the same
        mode.form = beam::bending_form(Boundary::clamped_clamped, ordinal);
        const double l4 = std::pow(mode.form.lambda, 4);
        const auto end = [&](double xi, int order) { return beam::evaluate(mode.form, xi, order); };
        const double mean = (end(1.0, 3) - end(0.0, 3)) / l4, moment = (end(1.0, 3) - end(1.0, 2) + end(0.0, 2)) / l4;
        mode.offset = 4.0 * mean - 6.0 * moment;
        mode.slope = 12.0 * moment - 6.0 * mean;
      } else {
        mode.form = beam::rod_form(Boundary::clamped_clamped, ordinal);
        mode.offset = mode.form.sine * (1.0 - std::cos(mode.form.lambda)) / mode.form.lambda;
      }
      modes.push_back(mode);
    }
  }
  return modes;
}

FlexibleBody modal_body(const BeamDef& def, const BeamEffects& effects, const Properties& p, const std::vector<Mode>& modes,
                        bool turning_root);

}  // namespace

namespace {

// Stations: sixteen a half wave of the highest form, at least forty, which straight lines between them follow to 0.5 %.
std::vector<StrainStation> form_strains(const std::vector<Mode>& modes, double L, const MatX& V) {
  double highest = 0.0;
  for (const Mode& mode : modes) highest = std::max(highest, mode.form.lambda);
  const int intervals = std::max(40, static_cast<int>(std::ceil(16.0 * highest / std::numbers::pi)));
  std::vector<StrainStation> out;
  for (int k = 0; k <= intervals; ++k) {
    const FieldRows r = rows_at(modes, L * k / intervals, L);
    StrainStation s;
    s.x = L * k / intervals;
    std::size_t field = 0;
    for (const VecX* row : {&r.du, &r.dphi_z, &r.ds, &r.dtheta}) {
      const VecX own = V.size() > 0 ? VecX(V.transpose() * *row) : *row;
      for (Eigen::Index i = 0; i < own.size(); ++i)
        if (own[i] != 0.0) s.row[field][static_cast<int>(i)] = own[i];
      ++field;
    }
    out.push_back(std::move(s));
  }
  return out;
}

}  // namespace

std::vector<StrainStation> modal_strains(const BeamDef& def, const BeamEffects& effects) {
  const Properties p = beam::properties(def, effects);
  return form_strains(select_modes(def, effects, p), p.length, {});
}

std::vector<StrainStation> volume_strains(const BeamDef& def, const BeamEffects& effects) {
  MatX V;
  to_normal_modes(make_modal_volume(def, effects), V);
  return form_strains(volume_modes(def, effects), beam::properties(def, effects).length, V);
}

FlexibleBody make_modal_volume(const BeamDef& def, const BeamEffects& effects) {
  if (effects.shear)
    throw InputError("effect 'shear' needs finite elements in the volumes: eigenforms are those of the Euler-Bernoulli beam");
  const Properties p = beam::properties(def, effects);
  const std::vector<Mode> modes = volume_modes(def, effects);
  FlexibleBody body = modal_body(def, effects, p, modes, true);
  body.De = beam::damping_matrix(def.damping, body.Me, body.Ke);
  for (const Mode& mode : modes)
    body.labels.push_back(mode.degree > 0 ? fmt::format("{} static {}", direction_names()[mode.direction], mode.degree)
                                          : fmt::format("{} clamped {}", direction_names()[mode.direction], mode.ordinal));
  return body;
}

FlexibleBody make_modal_beam(const BeamDef& def, const BeamEffects& effects) {
  if (effects.shear) throw InputError("effect 'shear' needs model = \"finite-element\": eigenforms are those of the Euler-Bernoulli beam");
  const Properties p = beam::properties(def, effects);
  const std::vector<Mode> modes = select_modes(def, effects, p);
  FlexibleBody body = modal_body(def, effects, p, modes, def.boundary == Boundary::free_free);
  set_structure(body, modes, p, def.damping);
  for (const Mode& mode : modes)
    body.labels.push_back(fmt::format("{} {} ({:.6g} Hz)", direction_names()[mode.direction], mode.ordinal,
                                      std::sqrt(mode.stiffness / mode.mass) / (2.0 * std::numbers::pi)));
  return body;
}

namespace {

// Everything but damping and labels; structural matrices by quadrature.
FlexibleBody modal_body(const BeamDef& def, const BeamEffects& effects, const Properties& p, const std::vector<Mode>& modes,
                        bool turning_root) {
  const double L = p.length;
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
  if (effects.stiffening && effects.torsion && turning_root) beam::add_root_rotation(sum, p, root);

  beam::Basis Z(n, n);
  Z.setIdentity();
  FlexibleBody body = beam::linear_body(sum, p, effects, Z);
  body.Me = beam::in_body(sum.Me, Z);
  body.Ke = beam::in_body(sum.Ke, Z);
  beam::set_second_order(body, sum, Z);
  // eight points a half wave: the second-order field to 1e-8, the linear one exactly
  beam::set_axis_mass(body, p, effects, Z, {panels, 8, [&](int panel, double xi) { return rows_at(modes, (panel + xi) * h, L); }, root});

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
    FlexibleNode& node = body.nodes[i] = beam::make_node(stations[i].name, x, rows_at(modes, x, L));
    node.phi = Mat3X(node.phi * Z);
    node.psi = Mat3X(node.psi * Z);
    if (!effects.stiffening || effects.large_bending || n == 0 || (i >= named && !series)) continue;
    const int parts = static_cast<int>(std::ceil((x - done) / h));
    for (int part = 0; part < parts; ++part) {
      const double width = (x - done) / parts;
      for (std::size_t g = 0; g < gauss.x.size(); ++g) {
        const double s = done + (part + gauss.x[g]) * width;
        beam::add_second_order(running, p, effects, rows_at(modes, s, L), s, gauss.w[g] * width);
      }
    }
    done = x;
    body.nodes[i].phi2 = beam::second_order_at(running, root, x, Z);
    body.nodes[i].psi2 = beam::second_turns(running, Z);
  }
  beam::set_rod_axis(body, p, effects, Z, {panels, 6, [&](int panel, double xi) { return rows_at(modes, (panel + xi) * h, L); }, root});
  return body;
}

}  // namespace

}  // namespace flexframe::sim
