#include "sim/run/held_warping.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

double shear_modulus_of(const Material& m) { return m.youngs_modulus / (2.0 * (1.0 + m.poisson)); }

// Ends of a beam that a weld holds.
int welded_ends(const Scene& scene, const std::string& body) {
  bool root = false, tip = false;
  for (const JointDef& j : scene.joints) {
    if (j.kind != JointKind::weld) continue;
    for (const FrameRef* f : {&j.parent, &j.child}) {
      if (f->body != body) continue;
      root = root || f->frame.empty() || f->frame == "root";
      tip = tip || f->frame == "tip";
    }
  }
  return static_cast<int>(root) + static_cast<int>(tip);
}

// Beyond these rotations (rad) their parts along x do not tell the twist any more.
constexpr double small_rotation = 0.5;

// The largest energy of twist in the run, J; 0 where it cannot be told.
double twist_energy(const ResultBody& body, double gj) {
  const auto n = static_cast<Eigen::Index>(body.nodes.size());
  if (body.rotation.cols() != 3 * n || n < 2 || body.rotation.cwiseAbs().maxCoeff() > small_rotation) return 0.0;
  std::vector<Eigen::Index> along(n);
  for (Eigen::Index k = 0; k < n; ++k) along[k] = k;
  const auto x = [&](Eigen::Index k) { return body.nodes[k].origin.x(); };
  std::sort(along.begin(), along.end(), [&](Eigen::Index a, Eigen::Index b) { return x(a) < x(b); });
  VecX energy = VecX::Zero(body.rotation.rows());
  for (size_t k = 1; k < along.size(); ++k) {
    const double span = x(along[k]) - x(along[k - 1]);
    if (!(span > 1e-9 * body.length)) continue;
    energy.array() += 0.5 * gj / span * (body.rotation.col(3 * along[k]) - body.rotation.col(3 * along[k - 1])).array().square();
  }
  return energy.maxCoeff();
}

}  // namespace

double warping_constant(const Section& section) {
  if (section.shape != "i" && section.shape != "u") return 0.0;
  const auto size = [&](const char* name) { return section.size.at(name); };
  const double flange = size("flange"), web = size("web"), high = size("height") - flange;
  if (section.shape == "i") return std::pow(size("width"), 3) * flange * high * high / 24.0;
  const double wide = size("width") - 0.5 * web;
  return std::pow(wide, 3) * high * high * flange / 12.0 * (3.0 * wide * flange + 2.0 * high * web) / (6.0 * wide * flange + high * web);
}

double held_twist(const Section& section, const Material& material, double length, int ends) {
  const double cw = warping_constant(section);
  if (!(cw > 0.0) || ends < 1) return 0.0;
  const double z = length * std::sqrt(shear_modulus_of(material) * section.j / (material.youngs_modulus * cw)) / ends;
  return std::tanh(z) / z;
}

void warn_of_held_warping(const Scene& scene, const std::vector<EffectState>& effects, const Results& results, double asked, Notes& notes) {
  const double elastic = results.strain.size() > 0 ? results.strain.maxCoeff() : 0.0;
  if (!(elastic > 0.0)) return;
  for (const BodyDef& def : scene.bodies) {
    const auto* beam = std::get_if<BeamDef>(&def.kind);
    const bool twists = beam && std::any_of(effects.begin(), effects.end(),
                                            [&](const EffectState& s) { return s.owner == def.name && s.effect == "torsion" && s.on; });
    if (!twists) continue;
    const int ends = welded_ends(scene, def.name);
    const double less = held_twist(beam->section, beam->material, beam->length, ends);
    const auto body = std::find_if(results.bodies.begin(), results.bodies.end(), [&](const ResultBody& b) { return b.name == def.name; });
    if (!(less > 0.0) || body == results.bodies.end()) continue;
    const double share = std::min(1.0, twist_energy(*body, shear_modulus_of(beam->material) * beam->section.j) / elastic);
    if (!(less * share > asked)) continue;
    notes.warn(fmt::format("body '{}'", def.name),
               fmt::format("its section '{}' is computed as free to warp; welded at {}, it twists {:.0f} % less: {:.2g} of the elastic "
                           "energy is twist. For the right twist between its ends take a section 'general' with j = {:.4g}",
                           beam->section.shape, ends == 2 ? "both ends" : "one end", 100.0 * less, share, beam->section.j / (1.0 - less)));
  }
}

}  // namespace flexframe::sim
