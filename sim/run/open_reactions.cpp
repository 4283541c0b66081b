#include "sim/run/open_reactions.h"

#include "sim/dynamics/closure.h"
#include "sim/dynamics/friction_rest.h"
#include "sim/time/system.h"

#include <fmt/ranges.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

constexpr size_t looks = 20;
// Share of the largest reaction of a loop that may be open without a word: what rounding makes is far below.
constexpr double tolerated = 0.01;

// Whether an output tells of forces in one of a cluster's joints.
bool forces_asked(const System& system, const Cluster& c) {
  return std::any_of(system.scene.outputs.begin(), system.scene.outputs.end(), [&](const OutputDef& o) {
    if (o.quantity != Quantity::reaction && o.quantity != Quantity::friction_force) return false;
    return std::any_of(c.parts.begin(), c.parts.end(), [&](int i) { return system.model.parts[i].joint.name == o.of.body; }) ||
           std::any_of(c.loops.begin(), c.loops.end(), [&](int l) { return system.model.loops[l].name == o.of.body; });
  });
}

}  // namespace

OpenReactions::OpenReactions(const System& system) {
  const Model& model = system.model;
  const auto watch = [&](const std::string& joint, int part, int loop) {
    bool asked = false, rubs = false;
    for (const OutputDef& o : system.scene.outputs) asked = asked || (o.quantity == Quantity::reaction && o.of.body == joint);
    for (const JointDef& j : system.scene.joints) rubs = rubs || (j.name == joint && j.friction && j.friction->reaction);
    if (asked || rubs) watched_.push_back({joint, part, loop, rubs, 0.0});
  };
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const Cluster& c = model.clusters[k];
    if (c.loops.empty()) continue;
    for (int i : c.parts) watch(model.parts[i].joint.name, i, -1);
    for (int l : c.loops) watch(model.loops[l].name, -1, l);
  }
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    Resting r{static_cast<int>(k), false, {}};
    int sticking = 0;
    for (const FrictionPoint& p : system.friction.points) {
      if (p.cluster != r.cluster || p.law.regularised) continue;
      ++sticking;
      r.rubs = r.rubs || p.law.reaction;
    }
    if (has_closure(model.clusters[k]) && sticking > 1 && (r.rubs || forces_asked(system, model.clusters[k]))) resting_.push_back(r);
  }
}

bool OpenReactions::wants(size_t sample, size_t samples) const {
  return !(watched_.empty() && resting_.empty()) && sample % std::max<size_t>(1, samples / looks) == 0;
}

void OpenReactions::look(System& system) {
  update_system_accelerations(system);
  compute_reactions(system.model, system.work, reactions_);
  const SharedReactions shared = shared_reactions(system.model, system.work, reactions_);
  for (Watched& w : watched_) w.open = std::max(w.open, w.part >= 0 ? shared.part[w.part] : shared.loop[w.loop]);
  if (resting_.empty()) return;
  for (const int part : openly_held(system.model, system.friction, system.work))
    for (Resting& r : resting_) {
      const std::string& joint = system.model.parts[part].joint.name;
      if (r.cluster == system.model.parts[part].cluster && std::find(r.open.begin(), r.open.end(), joint) == r.open.end())
        r.open.push_back(joint);
    }
}

void OpenReactions::warn(Notes& into) const {
  for (const Watched& w : watched_)
    if (w.open > tolerated)
      into.warn(fmt::format("joint '{}'", w.joint),
                fmt::format("the reactions in its loop are statically indeterminate with rigid bodies: up to {:.2g} of the loop's largest "
                            "reaction is shared out by least squares{}; for the true shares make a body elastic, or give its joints the "
                            "freedoms that the real ones have",
                            std::min(w.open, 1.0), w.rubs ? ", and its friction follows that" : ""));
  for (const Resting& r : resting_)
    if (!r.open.empty())
      into.warn(
          fmt::format("joint '{}'", fmt::join(r.open, "', '")),
          fmt::format(
              "rests by friction that rigid bodies leave open: several joints or coordinates hold the same motion, and what each "
              "of them holds (friction_force, reactions) is one share-out of many{}; for the true shares make a body elastic",
              r.rubs ? "; when they give way and what rubs on what still slides depend on it, since normal forces are reactions" : ""));
}

}  // namespace flexframe::sim
