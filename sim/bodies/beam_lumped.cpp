// Lumped beams (Chudnovsky et al. 2006), with the paper's spring law and with one that couples neighbours; damping of all beams of several
// pieces.
#include "sim/bodies/beam_eigenforms.h"
#include "sim/bodies/beam_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

constexpr int kMaxPieces = 5000;

// This part of the beam from a to b, with the user's frames that lie in it.
BeamDef part_of(const BeamDef& def, double a, double b, bool last) {
  BeamDef part = def;
  part.length = b - a;
  part.damping = {};
  part.frames.clear();
  for (const auto& [name, share] : def.frames) {
    const double x = share * def.length;
    if (x < a || (x >= b && !last)) continue;
    part.frames[name] = std::clamp((x - a) / (b - a), 0.0, 1.0);
  }
  return part;
}

// Kelvin-Voigt time constant from the damping asked for.
double time_constant(const BeamDef& def, const BeamEffects& effects, const beam::Properties& p) {
  if (def.damping.mass != 0.0)
    throw InputError(
        fmt::format("damping.mass = {}: mass-proportional damping needs model = \"finite-element\" or \"modal\"; use ratio or stiffness",
                    def.damping.mass));
  double tau = def.damping.stiffness;
  if (def.damping.ratio.empty() || def.damping.ratio[0] == 0.0) return tau;
  const double zeta = def.damping.ratio[0], L = p.length;
  if (!(zeta > 0.0) || !std::isfinite(zeta)) throw InputError(fmt::format("damping ratio must be 0 or more, found {}", zeta));
  double omega = std::numeric_limits<double>::infinity();
  const double bending = std::pow(beam::bending_form(def.boundary, 1).lambda / L, 2), rod = beam::rod_form(def.boundary, 1).lambda / L;
  if (effects.bending_xy) omega = std::min(omega, bending * std::sqrt(p.ei_z / p.mass));
  if (effects.bending_xz) omega = std::min(omega, bending * std::sqrt(p.ei_y / p.mass));
  if (!std::isfinite(omega) && effects.torsion) omega = rod * std::sqrt(p.gj / (p.inertia_y + p.inertia_z));
  if (!std::isfinite(omega) && effects.axial) omega = rod * std::sqrt(p.ea / p.mass);
  if (std::isfinite(omega)) tau += 2.0 * zeta / omega;
  return tau;
}

}  // namespace

double chain_time_constant(const BeamDef& def, const BeamEffects& effects) {
  return time_constant(def, effects, beam::properties(def, effects));
}

namespace {

// Compliance of linearly varying moments: C_ik = int N_i N_k dx, N the hat functions of the joints, the outermost extended to the ends.
void set_coupling(BeamLinks& links, int n, double l) {
  const size_t count = n;
  links.diagonal.assign(count, 0.0);
  links.off.assign(count - 1, 0.0);
  if (n == 1) links.diagonal[0] = l;
  // spans between joints k and k + 1, s = 0 .. 1, from -1/2 or to 3/2 at the beam's ends
  const auto power = [](double s, double e) { return std::pow(s, e) / e; };
  for (std::size_t k = 0; k + 1 < count; ++k) {
    const double a = k == 0 ? -0.5 : 0.0, b = k + 2 == count ? 1.5 : 1.0;
    const double square = power(b, 3) - power(a, 3), linear = power(b, 2) - power(a, 2);
    links.diagonal[k] += l * (b - a - 2.0 * linear + square);
    links.diagonal[k + 1] += l * square;
    links.off[k] = l * (linear - square);
  }
}

}  // namespace

BeamChain make_lumped_beam(const BeamDef& def, const BeamEffects& effects) {
  if (def.elements < 1 || def.elements > kMaxPieces)
    throw InputError(fmt::format("elements must lie in 1 .. {}, found {}", kMaxPieces, def.elements));
  if (effects.shear) throw InputError("effect 'shear' needs model = \"finite-element\"");
  const beam::Properties p = beam::properties(def, effects);
  beam::named_stations(def);
  const double tau = time_constant(def, effects, p), l = def.length / def.elements;
  BeamChain chain;
  BeamLinks& links = chain.links;
  links.free = {effects.torsion, effects.bending_xz, effects.bending_xy};
  links.time_constant = tau;
  links.section << p.gj, 0.0, 0.0, 0.0, p.ei_y, -p.ei_yz, 0.0, -p.ei_yz, p.ei_z;
  for (int a = 0; a < 3; ++a)
    if (!links.free[a]) links.section.row(a).setZero(), links.section.col(a).setZero();

  // joints at the elements' middles: a half piece at either end, whole ones between
  std::vector<double> cuts = {0.0};
  for (int i = 0; i < def.elements; ++i) cuts.push_back((i + 0.5) * l);
  cuts.push_back(def.length);
  if (def.curvature_coupling) set_coupling(links, def.elements, l);
  else links.diagonal.assign(def.elements, l);
  const BeamEffects inside{.axial = effects.axial};
  const std::string boundary_node = "element.boundary";
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    BeamDef part = part_of(def, cuts[k], cuts[k + 1], k + 2 == cuts.size());
    part.boundary = Boundary::clamped_free;
    part.elements = 1;
    // the series of nodes are the elements' boundaries: the middles of whole pieces, where a piece is tangent to the beam
    part.frames[boundary_node] = k == 0 ? 0.0 : k + 2 == cuts.size() ? 1.0 : 0.5;
    BeamPiece piece{fmt::format("element[{}]", k), make_fe_beam(part, inside), cuts[k]};
    const beam::Properties own = beam::properties(part, inside);
    piece.body.J0 += beam::rotary_inertia(own, effects) - beam::rotary_inertia(own, inside);
    std::vector<FlexibleNode>& nodes = piece.body.nodes;
    nodes.resize(nodes.size() - 2);
    for (FlexibleNode& node : nodes)
      if (node.name == boundary_node) node.name = "node[0]";
    if (tau > 0.0 && piece.body.n > 0) piece.body.De = tau * piece.body.Ke;
    chain.pieces.push_back(std::move(piece));
  }
  return chain;
}

Mat3X link_moments(const BeamLinks& links, const Mat3X& theta) {
  const auto n = theta.cols();
  Mat3X curvature(3, n);
  if (links.off.empty()) {
    for (Eigen::Index i = 0; i < n; ++i) curvature.col(i) = theta.col(i) / links.diagonal[i];
    return -links.section * curvature;
  }
  // Thomas's algorithm: C is positive definite, no pivoting
  VecX pivot(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const size_t k = i;
    pivot[i] = links.diagonal[k];
    curvature.col(i) = theta.col(i);
    if (i == 0) continue;
    const double f = links.off[k - 1] / pivot[i - 1];
    pivot[i] -= f * links.off[k - 1];
    curvature.col(i) -= f * curvature.col(i - 1);
  }
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    if (i + 1 < n) curvature.col(i) -= links.off[i] * curvature.col(i + 1);
    curvature.col(i) /= pivot[i];
  }
  return -links.section * curvature;
}

std::string beam_validity_note(const BeamDef& def, const BeamEffects& effects) {
  // a mode's frequency comes out too high by (beta r)^2 (1 + E/kG) / 2, r the section's radius of gyration (ACCURACY: shear, rotary
  // inertia)
  constexpr double first_limit = 0.01, last_limit = 0.1;
  const Section& s = def.section;
  if (effects.shear || !(def.length > 0.0 && s.area > 0.0)) return {};
  int highest = 1;
  if (def.model == BeamModel::modal)
    for (const auto& [direction, list] : def.modes)
      if (direction.starts_with("bending"))
        for (const int ordinal : list) highest = std::max(highest, std::min(ordinal, kMaxMode));
  std::string note;
  const auto look = [&](bool on, const char* plane, double second_moment, double factor) {
    if (!on || !(second_moment > 0.0) || !note.empty()) return;
    const double r = std::sqrt(second_moment / s.area);
    const double soft = 1.0 + 2.0 * (1.0 + def.material.poisson) / (factor > 0.0 ? factor : 5.0 / 6.0);
    const auto excess = [&](int mode) { return 0.5 * soft * std::pow(beam::bending_form(def.boundary, mode).lambda / def.length * r, 2); };
    if (excess(1) > first_limit) {
      note = fmt::format(
          "slenderness L/r = {:.3g} in {}: without shear and rotary inertia the first frequency is about {:.2g} % too high; "
          "effect 'shear' with model = \"finite-element\" has both",
          def.length / r, plane, 100.0 * excess(1));
    } else if (excess(highest) > last_limit) {
      int good = 1;
      while (excess(good + 1) <= last_limit) ++good;
      note = fmt::format(
          "slenderness L/r = {:.3g} in {}: modes above {} are more than {:.0f} % too high without shear and rotary inertia; "
          "mode {} is used",
          def.length / r, plane, good, 100.0 * last_limit, highest);
    }
  };
  look(effects.bending_xy, "bending_xy", s.iz, s.shear_y);
  look(effects.bending_xz, "bending_xz", s.iy, s.shear_z);
  return note;
}

std::string beam_validity_note(const BeamDef& def) { return beam_validity_note(def, {.bending_xy = true, .bending_xz = true}); }

}  // namespace flexframe::sim
