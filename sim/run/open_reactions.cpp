#include "sim/run/open_reactions.h"

#include "sim/time/system.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

constexpr size_t looks = 20;
// Share of the largest reaction of a loop that may be open without a word: what rounding makes is far below.
constexpr double tolerated = 0.01;

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
}

bool OpenReactions::wants(size_t sample, size_t samples) const {
  return !watched_.empty() && sample % std::max<size_t>(1, samples / looks) == 0;
}

void OpenReactions::look(System& system) {
  update_system_accelerations(system);
  compute_reactions(system.model, system.work, reactions_);
  const SharedReactions shared = shared_reactions(system.model, system.work, reactions_);
  for (Watched& w : watched_) w.open = std::max(w.open, w.part >= 0 ? shared.part[w.part] : shared.loop[w.loop]);
}

void OpenReactions::warn(Notes& into) const {
  for (const Watched& w : watched_)
    if (w.open > tolerated)
      into.warn(fmt::format("joint '{}'", w.joint),
                fmt::format("the reactions in its loop are statically indeterminate with rigid bodies: up to {:.2g} of the loop's largest "
                            "reaction is shared out by least squares{}; for the true shares make a body elastic, or give its joints the "
                            "freedoms that the real ones have",
                            std::min(w.open, 1.0), w.rubs ? ", and its friction follows that" : ""));
}

}  // namespace flexframe::sim
