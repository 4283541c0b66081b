#include "sim/model/fe_body.h"

#include "sim/base/eigen_solvers.h"
#include "sim/bodies/axis_mass.h"
#include "sim/bodies/beam.h"
#include "sim/bodies/beam_boundary.h"
#include "sim/bodies/beam_terms.h"
#include "sim/bodies/normal_modes.h"

#include <algorithm>
#include <memory>

namespace flexframe::sim {

bool has_ratio(const Damping& damping) {
  return std::any_of(damping.ratio.begin(), damping.ratio.end(), [](double z) { return z != 0.0; });
}

namespace {

// With few modes of its elements.
FeBody make_kept_body(const BeamDef& beam, const BeamEffects& effects, const std::vector<HeldPoint>& held, bool damped) {
  FeBody out;
  out.fewer = beam::computed_elements(beam, effects) < beam.elements;
  std::vector<HeldPoint> points = held;
  if (!beam.keep_static) std::erase_if(points, [](const HeldPoint& p) { return p.load; });
  const Damping& own = beam.damping;
  if (damped || own.mass != 0.0 || own.stiffness != 0.0 || has_ratio(own)) {
    // A damped vibration lags: what it leaves at the boundary, from where deflections are seen, needs the static shapes of forces there.
    points.push_back({"root", true, beam.boundary == Boundary::clamped_free, true});
    if (beam.boundary != Boundary::clamped_free) points.push_back({"tip", true, false, true});
  }
  const int bending = *beam.keep_modes;
  KeptBeam made =
      make_kept_beam(beam, effects, {beam.keep_axial.value_or(bending), bending, bending, beam.keep_torsion.value_or(bending)}, points);
  out.body = std::move(made.body);
  if (out.body.n == 0) return out;
  out.shown.differs = beam.boundary != Boundary::free_free;
  out.shown.coordinates = std::move(made.coordinates);
  return out;
}

// A finite-element beam for the equations of motion: same elements, frame on the mean axes, eigenmodes as coordinates.
//
// Boundaries that only place the frame (clamped-free, supported-supported, supported-free, free-free) span the same deformations.
// On the mean axes frame and deformation are decoupled in the kinetic energy, which keeps the mass matrix of second order positive
// definite; in a frame clamped to the root of a hinged beam it is not, since the elements nearly contain the frame's rotation.
// damped: damping ratios are added afterwards (add_mounted_damping).
FeBody make_fe_body(const BeamDef& beam, const BeamEffects& effects, const std::vector<HeldPoint>& held, bool damped) {
  if (beam.keep_modes) return make_kept_body(beam, effects, held, damped);
  FeBody part;
  auto made = std::make_unique<FeBeam>(beam, effects);
  part.body = made->linear();
  if (part.body.n == 0) return part;
  part.fewer = beam::computed_elements(beam, effects) < beam.elements;
  const bool frame_only = beam.boundary == Boundary::clamped_free || beam.boundary == Boundary::supported_supported ||
                          beam.boundary == Boundary::supported_free || beam.boundary == Boundary::free_free;
  // The change of coordinates costs n^3 a node; a beam of more than 150 coordinates keeps its elements' ones.
  const bool modes = part.body.n <= 150;
  MatX V = MatX::Identity(part.body.n, part.body.n);
  if (frame_only && beam.boundary != Boundary::free_free) {
    BeamDef mean = beam;
    mean.boundary = Boundary::free_free;
    const FlexibleBody named = part.body;
    made = std::make_unique<FeBeam>(mean, effects);
    part.body = made->linear();
    // The damping that the scene asks for is that of its boundary's modes.
    if (named.De.size() > 0) {
      const MatX P = same_deformation(part.body, named);
      const MatX back = solve_square(P, MatX::Identity(P.rows(), P.cols()));
      part.body.De = back.transpose() * named.De * back;
    }
    part.shown.differs = true;
  }
  if (modes) {
    part.body = to_normal_modes(part.body, V);
    made->add_second_order(V, part.body);
  } else {
    made->add_second_order(part.body);
  }
  part.shown.coordinates = part.shown.differs ? in_boundary(beam, effects, beam.boundary, V) : V;
  return part;
}

// Whether two beams are one to the last number. A field added to them does not compile here until it is compared.
bool same(const Section& a, const Section& b) {
  const auto& [shape, size, area, iy, iz, iyz, j, shear_y, shear_z, shear_yz, outline] = b;
  return a.shape == shape && a.size == size && a.area == area && a.iy == iy && a.iz == iz && a.iyz == iyz && a.j == j &&
         a.shear_y == shear_y && a.shear_z == shear_z && a.shear_yz == shear_yz && a.outline == outline;
}
bool same(const Material& a, const Material& b) {
  const auto& [density, youngs_modulus, poisson] = b;
  return a.density == density && a.youngs_modulus == youngs_modulus && a.poisson == poisson;
}
bool same(const Damping& a, const Damping& b) {
  const auto& [ratio, mass, stiffness] = b;
  return a.ratio == ratio && a.mass == mass && a.stiffness == stiffness;
}
bool same(const BeamEffects& a, const BeamEffects& b) {
  const auto& [axial, bending_xy, bending_xz, torsion, stiffening, shear, large_bending, complete] = b;
  return a.axial == axial && a.bending_xy == bending_xy && a.bending_xz == bending_xz && a.torsion == torsion &&
         a.stiffening == stiffening && a.shear == shear && a.large_bending == large_bending && a.complete == complete;
}
bool same(const HeldPoint& a, const HeldPoint& b) {
  const auto& [node, force, moment, load] = b;
  return a.node == node && a.force == force && a.moment == moment && a.load == load;
}
bool same(const SectionStation& a, const SectionStation& b) {
  const auto& [at, section] = b;
  return a.at == at && same(a.section, section);
}
template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const T& x, const T& y) { return same(x, y); });
}
bool same(const EffectChoice& a, const EffectChoice& b) {
  const auto& [automatic, names, without] = b;
  return a.automatic == automatic && a.names == names && a.without == without;
}
bool same(const FlexibleInitial& a, const FlexibleInitial& b) {
  const auto& [q, qd, static_start] = b;
  return a.q == q && a.qd == qd && a.static_start == static_start;
}
bool same(const ProgramChoice& a, const ProgramChoice& b) {
  const auto& [effects, held_by, complete_inertia, first_bending] = b;
  return a.effects == effects && a.held_by == held_by && a.complete_inertia == complete_inertia && a.first_bending == first_bending;
}
bool same(const BeamDef& a, const BeamDef& b) {
  const auto& [length, section, stations, axis, material, model, boundary, elements, volumes, keep_modes, keep_axial, keep_torsion,
               keep_static, keep_inertia, modes, curvature_coupling, effects, damping, frames, initial, all_elements, chosen] = b;
  return a.length == length && same(a.section, section) && same(a.stations, stations) && a.axis == axis && same(a.material, material) &&
         a.model == model && a.boundary == boundary && a.elements == elements && a.volumes == volumes && a.keep_modes == keep_modes &&
         a.keep_axial == keep_axial && a.keep_torsion == keep_torsion && a.keep_static == keep_static && a.keep_inertia == keep_inertia &&
         a.modes == modes && a.curvature_coupling == curvature_coupling && same(a.effects, effects) && same(a.damping, damping) &&
         a.frames == frames && same(a.initial, initial) && a.all_elements == all_elements && same(a.chosen, chosen);
}

// Runs of one scene with other numbers often leave its beams as they are: those made last are kept, a thread's own.
struct KeptBody {
  BeamDef beam;
  BeamEffects effects;
  std::vector<HeldPoint> held;
  bool damped;
  FeBody made;
};
constexpr size_t kept_bodies = 6;
constexpr Eigen::Index most_kept = 200000;  // numbers, about, of a body that is kept

Eigen::Index numbers_of(const FlexibleBody& body) {
  Eigen::Index out = 3 * static_cast<Eigen::Index>(body.nodes.size() + 4) * body.n * body.n;
  if (has_axis_mass(body)) {
    out += body.axis.phi.size() + body.axis.once.size() + body.axis.twice.size() + body.axis.Me.size();
    for (const MatX& row : body.axis.row) out += row.size();
    if (body.axis.series) out += body.axis.series->second.size();
  }
  if (body.rod) out += 5 * body.rod->turn.size() + body.rod->along.size();
  return out;
}

}  // namespace

FeBody fe_body(const BeamDef& beam, const BeamEffects& effects, const std::vector<HeldPoint>& held, bool damped) {
  static thread_local std::vector<KeptBody> kept;
  const auto found = std::find_if(kept.begin(), kept.end(), [&](const KeptBody& k) {
    return k.damped == damped && same(k.effects, effects) && same(k.held, held) && same(k.beam, beam);
  });
  if (found != kept.end()) {
    std::rotate(found, found + 1, kept.end());  // the one used last is the last
    return kept.back().made;
  }
  FeBody made = make_fe_body(beam, effects, held, damped);
  multiply_out(made.body.axis);
  if (numbers_of(made.body) <= most_kept) {
    if (kept.size() == kept_bodies) kept.erase(kept.begin());
    kept.push_back({beam, effects, held, damped, made});
  }
  return made;
}

}  // namespace flexframe::sim
