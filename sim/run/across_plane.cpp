#include "sim/run/across_plane.h"

#include "sim/dynamics/kinematics.h"
#include "sim/start/linearise.h"
#include "sim/start/make_system.h"
#include "sim/start/statics.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

// Elastic coordinates of the scene in space, more of which would take longer than most runs.
constexpr int most_coordinates = 250;

// The beams that the scene's plane leaves without deformations, with all of them.
std::vector<std::string> let_out_of_plane(const std::vector<EffectState>& effects, Scene& scene) {
  std::vector<std::string> beams;
  for (BodyDef& body : scene.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || !beam->effects.automatic || !beam->modes.empty()) continue;
    std::vector<std::string> names;
    bool held = false;
    for (const EffectState& s : effects) {
      if (s.owner != body.name) continue;
      if (s.on) names.push_back(s.effect);
      held = held || (!s.on && s.by == "symmetry" && s.effect.starts_with("bending"));
    }
    if (!held) continue;
    for (const char* name : {"bending_xy", "bending_xz", "torsion", "stiffening"}) {
      const auto& without = beam->effects.without;
      if (std::find(without.begin(), without.end(), name) != without.end()) continue;
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    beam->effects.automatic = false;
    beam->effects.names = names;
    beams.push_back(body.name);
  }
  return beams;
}

int unstable_modes(const Linearisation& linear) {
  return static_cast<int>(
      std::count_if(linear.modes.begin(), linear.modes.end(), [](const LinearMode& m) { return m.kind == LinearMode::unstable; }));
}

// How far places of the second mechanism lie from the same ones of the first, m; 0 where they are not the same.
double apart(const System& a, const System& b) {
  if (a.model.frames.size() != b.model.frames.size()) return 0.0;
  double out = 0.0;
  for (size_t f = 0; f < a.model.frames.size(); ++f) {
    const int frame = static_cast<int>(f);
    if (a.model.frames[f].part != b.model.frames[f].part) return 0.0;
    out = std::max(out, (frame_world(a.model, a.work, frame).p - frame_world(b.model, b.work, frame).p).norm());
  }
  return out;
}

// Rounding and the search leave far less.
constexpr double same_place = 1e-4;  // of the mechanism's size

}  // namespace

void warn_of_leaving_plane(const Scene& scene, const std::vector<EffectState>& effects, Notes& notes) {
  if (!wants_statics(scene)) return;
  Scene other = scene;
  other.outputs.clear();
  const std::vector<std::string> beams = let_out_of_plane(effects, other);
  if (beams.empty()) return;
  try {
    const System flat = make_system(scene), wide = make_system(other);
    if (wide.model.nv > most_coordinates) return;
    const double left = apart(flat, wide);
    const bool leaves = left > same_place * flat.model.size;
    if (!leaves && unstable_modes(linearise(wide)) <= unstable_modes(linearise(flat))) return;
    notes.warn("",
               fmt::format("static equilibrium: it holds in the plane only: '{}' buckle{} or tip{} over across it{}; effects = [\"auto\", "
                           "\"bending_xy\", \"bending_xz\", \"torsion\"] shows that",
                           fmt::join(beams, "', '"), beams.size() > 1 ? "" : "s", beams.size() > 1 ? "" : "s",
                           leaves ? fmt::format(", by {:.3g} m", left) : ""));
  } catch (const SimulationError&) {
    // What has no equilibrium in space, or none that is found, is not judged.
  }
}

}  // namespace flexframe::sim
