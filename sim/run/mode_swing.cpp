#include "sim/run/mode_swing.h"

#include "sim/dynamics/directions.h"
#include "sim/model/joint_motion.h"
#include "sim/results/recorder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexframe::sim {

Results swing_in_mode(const System& system, const LinearMode& mode, double amplitude, int pictures, double seconds) {
  System moved = system;
  const VecX sizes = rate_sizes(moved.model);
  const double reach =
      (mode.shape.array().square() + mode.quadrature.array().square()).sqrt().matrix().cwiseProduct(sizes).cwiseAbs().maxCoeff();
  if (!(reach > 0.0)) throw InputError("the mode moves no coordinate");
  std::vector<double> times;
  times.reserve(static_cast<size_t>(std::max(pictures, 0)));
  for (int i = 0; i < pictures; ++i) times.push_back(seconds * i / pictures);
  Recorder recorder(moved, times);
  const VecX start = moved.work.q;
  for (int i = 0; i < pictures; ++i) {
    const double phase = 2.0 * std::numbers::pi * i / pictures;
    const VecX step = amplitude / reach * (std::sin(phase) * mode.shape + std::cos(phase) * mode.quadrature);
    VecX& q = moved.work.q;
    q = start;
    moved.work.w.setZero();
    for (const Part& p : moved.model.parts) {
      if (p.joint.nv > 0) move_coordinates(p.joint.kind, q.data() + p.q0, step.data() + p.v0);
      q.segment(p.eq0, p.body.n) += step.segment(p.ev0, p.body.n);
    }
    // Prescribed motions stay where they are at the start.
    recorder.record(moved, 0.0, pack_state(moved, Eigen::Vector2d::Zero()));
  }
  return recorder.finish(moved);
}

}  // namespace flexframe::sim
