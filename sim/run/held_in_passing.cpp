#include "sim/run/held_in_passing.h"

#include "sim/model/beam_strains.h"
#include "sim/model/bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace flexframe::sim {
namespace {

// Whether a way along joints leads from the body back to it without passing a joint twice.
bool in_loop(const Scene& scene, const std::string& body) {
  std::map<std::string, std::string> leads_to;  // of bodies that hang together without this one
  const auto root = [&](std::string name) {
    for (auto at = leads_to.find(name); at != leads_to.end() && at->second != name; at = leads_to.find(name)) name = at->second;
    return name;
  };
  for (const JointDef& joint : scene.joints)
    if (joint.parent.body != body && joint.child.body != body) leads_to[root(joint.parent.body)] = root(joint.child.body);
  std::vector<std::string> met;
  for (const JointDef& joint : scene.joints) {
    if (joint.parent.body != body && joint.child.body != body) continue;
    const std::string other = root(joint.parent.body == body ? joint.child.body : joint.parent.body);
    if (other == body || std::find(met.begin(), met.end(), other) != met.end()) return true;
    met.push_back(other);
  }
  return false;
}

// No strain along the axis of what is made to move is larger.
constexpr double most_strain = 0.01;

}  // namespace

std::vector<std::string> let_lengthen_in_passing(const std::string& lost, Scene& scene, Notes& notes) {
  std::vector<std::string> out;
  for (BodyDef& body : scene.bodies) {
    auto* beam = std::get_if<BeamDef>(&body.kind);
    if (!beam || !beam->effects.automatic || !beam->chosen.held_by.empty()) continue;
    const auto listed = [](const std::vector<std::string>& names) { return std::find(names.begin(), names.end(), "axial") != names.end(); };
    const bool modes_listed = beam->model == BeamModel::modal && !beam->modes.empty();
    if (listed(beam->effects.names) || listed(beam->effects.without) || modes_listed || !in_loop(scene, body.name)) continue;
    beam->effects.names.emplace_back("axial");
    beam->chosen.effects = true;
    out.push_back(body.name);
  }
  if (!out.empty())
    notes.tell("", fmt::format("axial of '{}' switched on: without it the motion ended ({})", fmt::join(out, "', '"),
                               lost.substr(0, lost.find(';'))));
  return out;
}

LengthenedBeams::LengthenedBeams(const System& system, const std::vector<std::string>& names) {
  for (size_t b = 0; b < system.scene.bodies.size(); ++b) {
    if (std::find(names.begin(), names.end(), system.scene.bodies[b].name) == names.end()) continue;
    Beam beam;
    beam.body = static_cast<int>(b);
    std::vector<std::string> left_out;
    for (const StrainStation& station : strain_stations(system.model, system.scene, beam.body, left_out))
      beam.lengthening.emplace_back(station.row[0].begin(), station.row[0].end());
    beams_.push_back(std::move(beam));
  }
}

void LengthenedBeams::look(const System& system) const {
  for (const Beam& beam : beams_) {
    const VecX q = body_coordinates(system.model, beam.body, system.work.q, false);
    for (const auto& station : beam.lengthening) {
      double strain = 0.0;
      for (const auto& [k, value] : station) strain += value * q[k];
      if (!(std::abs(strain) < most_strain)) throw BeyondReach("a beam is lengthened farther than any material");
    }
  }
}

}  // namespace flexframe::sim
