#include "sim/time/sample_state.h"

#include "sim/dynamics/closure.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/places.h"
#include "sim/dynamics/plane_frames.h"
#include "sim/dynamics/velocities.h"
#include "sim/time/unpack.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// Frames that only forces hold on to are made with the accelerations, which a sample may do without.
void place_load_frames(const Model& model, Work& work) {
  for (const Load& load : model.loads) {
    const ForceKind kind = load.def.kind;
    if (kind != ForceKind::spring_damper && kind != ForceKind::bushing && kind != ForceKind::contact) continue;
    update_frame_pose(model, load.on, work);
    update_frame_pose(model, load.from, work);
    for (const int f : load.path) update_frame_pose(model, f, work);
  }
}

template <class W>
void require_all_closed(const Model& model, W& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) require_closed(model, static_cast<int>(c), work);
}

}  // namespace

bool has_plane_samples(const System& system) {
  if (!system.plane || !system.model.contacts.empty()) return false;
  const Vec3& g = system.model.settings.gravity;
  return std::abs(system.plane->axes.col(2).dot(g)) <= 1e-12 * g.norm();
}

Energy place_plane_sample(System& system, double t, const double* y, const std::vector<int>& frames, bool moving) {
  const Model& model = system.model;
  unpack_state(system, y);
  update_expressions(system.model, t, system.work);
  PlaneWork work(system.work, *system.plane);
  if (moving) {
    update_positions(model, work);
    update_velocities_alone(model, work);
  } else {
    update_places(model, work);
  }
  place_in_space(model, work, system.work);
  for (const int f : frames) place_frame(model, f, work, system.work);
  place_load_frames(model, system.work);
  return moving ? compute_energy(model, work, system.work) : Energy{};
}

bool place_four_samples(System& system, const double* times, const MatX& states, FourPlaces& places) {
  return places.place(system.model, system.work, states, [&](int lane) { update_expressions(system.model, times[lane], system.work); });
}

void bring_sample(System& system, double t, const FourPlaces& places, int lane) {
  system.work.time = t;
  if (system.work.carrying.driven) update_expressions(system.model, t, system.work);
  places.bring(system.model, lane, system.work);
}

Energy place_space_sample(System& system, double t, const double* y, const std::vector<int>& frames) {
  set_state(system, t, y, false);
  for (const int f : frames) update_frame_pose(system.model, f, system.work);
  place_load_frames(system.model, system.work);
  return compute_energy(system.model, system.work);
}

void require_sample_closed(System& system, bool in_plane) {
  if (!in_plane) return require_all_closed(system.model, system.work);
  PlaneWork work(system.work, *system.plane);
  require_all_closed(system.model, work);
}

}  // namespace flexframe::sim
