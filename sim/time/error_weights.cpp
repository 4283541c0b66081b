#include "sim/time/system.h"

#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/massless.h"
#include "sim/scene/joint_kinds.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

// Extent of a body's nodes, m; of one node its distance from the body frame, and where that is none the mechanism's size.
double part_reach(const FlexibleBody& body, double whole) {
  Eigen::AlignedBox3d box;
  for (const FlexibleNode& node : body.nodes) box.extend(node.origin);
  double reach = body.nodes.empty() ? 0.0 : box.diagonal().norm();
  for (const FlexibleNode& node : body.nodes)
    if (body.nodes.size() == 1) reach = node.origin.norm();
  return reach > 0.0 ? reach : whole;
}

// Largest displacement of a node per unit of each elastic coordinate, m; for pure twists the rotation times the body's size.
VecX displacement_per_coordinate(const FlexibleBody& body, double size) {
  VecX out = VecX::Zero(body.n), turn = VecX::Zero(body.n);
  for (const FlexibleNode& node : body.nodes) {
    out = out.cwiseMax(node.phi.colwise().norm().transpose());
    turn = turn.cwiseMax(size * node.psi.colwise().norm().transpose());
  }
  for (int k = 0; k < body.n; ++k)
    if (out[k] < 1e-6 * turn[k]) out[k] = turn[k];
    else if (out[k] == 0.0) out[k] = 1.0;
  return out;
}

}  // namespace

// Sizes by group, so that a coordinate passing through zero is not resolved to nothing, and a small one beside large ones not to
// more than its share: joint coordinates one by one, elastic coordinates by the displacement they cause, against the largest
// elastic displacement in the same mechanism.
//
// An error in the rate of something of frequency f becomes one of rate / f in its position. Rates of fast vibration are asked for
// their position's accuracy only, else the integrator resolves vibrations that nobody can see; and so are the rates of joints on
// vibrating bodies, which shake along.
void update_scale(System& system, const VecX& y) {
  const Model& model = system.model;
  VecX& scale = system.scale;
  if (scale.size() != y.size()) scale = VecX::Zero(y.size());
  std::vector<int> rate_of(model.nv, -1);
  int at = model.nq;
  for (size_t c = 0; c < model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) rate_of[model.clusters[c].v0 + k] = at++;
  // A run's slowest rate of interest: sizes of rates start at (size of the coordinate) / duration.
  const double slow = 1.0 / model.settings.duration;

  // Parts that shake each other: trees that hang on ground.
  std::vector<int> tree(model.parts.size());
  for (size_t i = 0; i < model.parts.size(); ++i) tree[i] = model.parts[i].parent == ground ? static_cast<int>(i) : tree[model.parts[i].parent];
  for (const Cluster& c : model.clusters)
    for (int i : c.parts) tree[i] = tree[c.parts.front()];
  std::vector<double> shake(model.parts.size(), 0.0);  // rad/s
  std::vector<double> moved(model.parts.size(), 0.0), speed(model.parts.size(), 0.0);  // largest elastic displacement (m) and rate of a tree
  std::vector<VecX> reaches(model.parts.size());
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    if (p.body.n == 0) continue;
    const double size = part_reach(p.body, model.size);
    reaches[i] = displacement_per_coordinate(p.body, size);
    double& m = moved[tree[i]];
    double& s = speed[tree[i]];
    // A hundred-thousandth of the body is the least deformation worth resolving to the relative tolerance.
    m = std::max(m, 1e-5 * size);
    s = std::max(s, 1e-5 * size * slow);
    for (int k = 0; k < p.body.n; ++k) {
      m = std::max(m, reaches[i][k] * std::abs(y[p.eq0 + k]));
      if (rate_of[p.ev0 + k] >= 0) s = std::max(s, reaches[i][k] * std::abs(y[rate_of[p.ev0 + k]]));
    }
  }
  // Links of lumped beams are elastic too; the beam's length tells how far one moves the tip. Neighbours move together at a frequency
  // far below that of a link by itself; the geometric mean of the two costs no accuracy.
  for (const Flexure& f : model.flexures) {
    double& m = moved[tree[f.parts.front()]];
    double& s = speed[tree[f.parts.front()]];
    m = std::max(m, 1e-5 * f.length);
    s = std::max(s, 1e-5 * f.length * slow);
    for (int i : f.parts) {
      const Part& p = model.parts[i];
      for (int k = 0; k < p.joint.nv; ++k) {
        m = std::max(m, f.length * std::abs(y[p.q0 + k]));
        if (rate_of[p.v0 + k] >= 0) s = std::max(s, f.length * std::abs(y[rate_of[p.v0 + k]]));
      }
    }
  }
  // The tolerance is one of positions, relative to the mechanism's size; elastic displacements are much smaller and would go
  // uncontrolled at loose tolerances, so that they are asked for a lower power of it of their own range at least.
  const double loosest = std::pow(1.0 / system.tolerance, system.elastic_slack);
  // Trees in which dry friction turns round or sticks: an event's time is as good as the rate that comes to zero there, so every elastic coordinate
  // is asked for the tolerance of its own range (a bar's stretch is a thousandth of its bending, and as fast), and no rate for less.
  std::vector<char> timed(model.parts.size(), 0);
  for (const FrictionPoint& p : system.friction.points)
    if (p.phase != FrictionPhase::regularised) timed[tree[p.part]] = 1;
  for (double& m : moved) m *= std::clamp(model.size / std::max(m, 1e-300), 1.0, loosest);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    if (p.body.n == 0) continue;
    const VecX& reach = reaches[i];
    const double size = part_reach(p.body, model.size);
    for (int k = 0; k < p.body.n; ++k) {
      double& q = scale[p.eq0 + k];
      q = std::max(q, timed[tree[i]] ? std::max(std::abs(y[p.eq0 + k]), 1e-5 * size / reach[k]) : moved[tree[i]] / reach[k]);
      const double frequency = std::sqrt(std::max(0.0, p.body.Ke(k, k)) / p.body.Me(k, k));
      if (!timed[tree[i]]) shake[tree[i]] = std::max(shake[tree[i]], frequency * q * reach[k] / size);
      if (rate_of[p.ev0 + k] < 0) continue;
      double& rate = scale[rate_of[p.ev0 + k]];
      rate = timed[tree[i]] ? std::max({rate, std::abs(y[rate_of[p.ev0 + k]]), frequency * q}) : std::max({rate, speed[tree[i]] / reach[k], frequency * q});
    }
  }
  for (const Flexure& f : model.flexures) {
    const int t = tree[f.parts.front()];
    const double frequency = flexure_frequency(f) / std::sqrt(static_cast<double>(f.parts.size()));
    for (int i : f.parts) {
      const Part& p = model.parts[i];
      for (int k = 0; k < p.joint.nv; ++k) {
        double& q = scale[p.q0 + k];
        q = std::max(q, moved[t] / f.length);
        shake[t] = std::max(shake[t], frequency * q);
        if (rate_of[p.v0 + k] < 0) continue;
        double& rate = scale[rate_of[p.v0 + k]];
        rate = std::max({rate, speed[t] / f.length, frequency * q});
      }
    }
  }
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    if (p.joint.link >= 0) continue;
    const double cluster_size = model.clusters[p.cluster].size;
    for (int k = 0; k < p.joint.nq; ++k) {
      // A hundredth of a radian, or of the mechanism, is the least motion worth resolving to the relative tolerance; an angle is as good
      // after a thousand turns as after one.
      const bool length = is_length(p.joint.kind, k);
      const double unit = length ? cluster_size : 1.0, size = std::abs(y[p.q0 + k]);
      double& q = scale[p.q0 + k];
      q = std::max({q, 1e-2 * unit, length ? size : std::min(size, 1.0)});
      // Coordinates that close a loop are starting values only: the others decide.
      if (p.joint.nq == p.joint.nv && rate_of[p.v0 + k] < 0 && !follows_damper(model, system.work, p.v0 + k)) q = std::max(q, std::min(30.0, 1e-3 / system.tolerance) * unit);
    }
    for (int k = 0; k < p.joint.nv; ++k) {
      const int r = rate_of[p.v0 + k];
      if (r < 0) continue;
      const double unit = is_length(p.joint.kind, k) ? cluster_size : 1.0;
      scale[r] = std::max({scale[r], 1e-2 * slow * unit, shake[tree[i]] * unit, std::abs(y[r])});
    }
  }
  // Nothing depends on the work done, and where the motion feels every load it needs no steps of its own. Prescribed coordinates and
  // what sticks feel nothing, and a stop takes out its work in a short contact: there it is asked for a thirtieth of the accuracy of
  // the motion, or, without other motion, for all of it.
  if (system.quadrature) {
    const bool unfelt = !model.massless.rates.empty() || std::any_of(model.parts.begin(), model.parts.end(), [](const Part& p) {
      return p.joint.motion >= 0 || p.joint.friction.has_value() || p.joint.stop.has_value();
    });
    const Energy e = compute_energy(model, system.work);
    double energy = std::max({e.kinetic, e.strain, y.tail<2>().cwiseAbs().maxCoeff(), 1e-9 * model.mass * std::pow(model.size * slow, 2), 1e-300});
    // The strain energy of the least deformation worth resolving.
    for (size_t i = 0; i < model.parts.size(); ++i)
      for (int k = 0; k < model.parts[i].body.n; ++k)
        energy = std::max(energy, 0.5 * model.parts[i].body.Ke(k, k) * std::pow(1e-5 * part_reach(model.parts[i].body, model.size) / reaches[i][k], 2));
    // Without mass: what springs and dampers take up in such a motion.
    if (!model.massless.rates.empty()) {
      const auto add = [&](double stiffness, double damping, double size) { energy = std::max(energy, (stiffness + damping * slow) * std::pow(1e-3 * size, 2)); };
      for (const Part& p : model.parts)
        if (p.joint.spring && p.joint.nv > 0) add(p.joint.spring->stiffness, p.joint.spring->damping, is_length(p.joint.kind, 0) ? model.size : 1.0);
      for (const Load& load : model.loads) {
        if (load.def.kind == ForceKind::spring_damper) add(load.def.spring.stiffness, load.def.spring.damping, model.size);
        if (load.def.kind == ForceKind::bushing) add(load.def.bushing_stiffness.head<3>().maxCoeff(), load.def.bushing_damping.head<3>().maxCoeff(), model.size);
      }
    }
    const double share = scale.size() > model.nq + 2 ? 30.0 : 1.0;
    scale.tail<2>() = unfelt || share == 1.0 ? VecX(scale.tail<2>().cwiseMax(Eigen::Vector2d::Constant(share * energy))) : VecX(Eigen::Vector2d::Constant(1e100));
  }
}

void error_weights(const System& system, const double*, double* weight) {
  for (int i = 0; i < system.scale.size(); ++i) weight[i] = 1.0 / (system.tolerance * system.scale[i]);
}

}  // namespace flexframe::sim
