#include "sim/start/statics.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/directions.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/inverse_dynamics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::sim {
namespace {

bool marked(const BodyDef& body) {
  if (const auto* beam = std::get_if<BeamDef>(&body.kind)) return beam->initial.static_start;
  if (const auto* modal = std::get_if<ModalDef>(&body.kind)) return modal->initial.static_start;
  if (const auto* space = std::get_if<StateSpaceDef>(&body.kind)) return space->initial.static_start;
  return false;
}

// Per part: whether its elastic coordinates are sought, and whether its joint may move.
struct Sought {
  std::vector<char> elastic, joint;
};

Sought what_is_sought(const Model& model, const Scene& scene) {
  const size_t n = model.parts.size();
  Sought out{std::vector<char>(n, 0), std::vector<char>(n, 0)};
  // Trees that hang on ground, joined where a loop runs through them: what happens in one does not move another.
  std::vector<int> tree(n);
  for (const Cluster& c : model.clusters) {
    const int id = c.parent == ground ? c.parts.front() : tree[c.parent];
    for (int i : c.parts) tree[i] = id;
  }
  std::vector<char> touched(n, 0);
  for (size_t i = 0; i < n; ++i) {
    const Part& p = model.parts[i];
    out.elastic[i] = scene.simulation.static_start || (p.scene_body >= 0 && marked(scene.bodies[p.scene_body]));
    if (out.elastic[i]) touched[tree[i]] = 1;
  }
  for (size_t i = 0; i < n; ++i) {
    const Part& p = model.parts[i];
    const JointDef* def = p.joint.scene_joint >= 0 ? &scene.joints[p.joint.scene_joint] : nullptr;
    out.joint[i] = touched[tree[i]] && !(def && (def->initial.value || def->initial.rate));
  }
  return out;
}

// Held joints inside loops become closure conditions, so that no loop moves them.
void lock_held(const Model& model, const Sought& sought, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    if (model.clusters[c].loops.empty()) continue;
    ClusterWork& cw = work.clusters[c];
    std::vector<double> value;
    for (int i : model.clusters[c].parts) {
      const Part& p = model.parts[i];
      if (sought.joint[i]) continue;
      for (int k = 0; k < p.joint.nv; ++k) {
        cw.locked.push_back(p.v0 - model.clusters[c].v0 + k);
        value.push_back(p.joint.nq == p.joint.nv ? work.q[p.q0 + k] : 0.0);
      }
    }
    if (cw.locked.empty()) continue;
    cw.lock_value = Eigen::Map<const VecX>(value.data(), static_cast<Eigen::Index>(value.size()));
    cw.partition = choose_partition(model, static_cast<int>(c), work, true);
    close_positions(model, static_cast<int>(c), work);
  }
}

void unlock(const Model& model, Work& work) {
  for (size_t c = 0; c < model.clusters.size(); ++c) {
    ClusterWork& cw = work.clusters[c];
    if (cw.locked.empty()) continue;
    cw.locked.clear();
    cw.lock_value.resize(0);
    cw.residual.resize(0);
    cw.rate.resize(0);
    cw.bias.resize(0);
    cw.partition = choose_partition(model, static_cast<int>(c), work, false);
  }
}

std::string name_of(const Model& model, const Direction& d) {
  const Part& p = model.parts[d.part];
  return d.rate >= 0 ? fmt::format("joint '{}'", p.joint.name) : fmt::format("the deformation of body '{}'", p.name);
}

// A mechanism under a share of its loads: gravity, forces and the inertia of prescribed motions.
struct Problem {
  Model model;                        // a copy: the share is applied to it
  Vec3 gravity;
  std::vector<double> expression;     // full values
  std::vector<TimeJet> motion;
  Work& work;
  std::vector<Direction> sought;
  VecX scale;                         // metres per unit
  RestForces rest;

  void load(double share) {
    model.settings.gravity = share * gravity;
    for (size_t i = 0; i < expression.size(); ++i) work.expression_value[i] = share * expression[i];
    for (size_t i = 0; i < motion.size(); ++i) work.motion[i] = {motion[i].value, share * motion[i].rate, share * motion[i].acceleration};
  }

  // Forces on what is sought; false where a loop cannot be closed or something is not finite.
  bool evaluate(const std::vector<VecX>* elastic, VecX& f) {
    try {
      update_positions(model, work);
      update_velocities(model, work);
      rest_forces(model, work, elastic, rest);
    } catch (const SimulationError&) {
      return false;
    }
    f.resize(static_cast<Eigen::Index>(sought.size()));
    for (size_t k = 0; k < sought.size(); ++k) f[static_cast<Eigen::Index>(k)] = rest.force[sought[k].v] / scale[static_cast<Eigen::Index>(k)];
    return f.allFinite();
  }

  void find_directions(const Sought& what) {
    sought.clear();
    for (const Direction& d : independent_directions(model, work))
      if (d.rate >= 0 ? what.joint[d.part] : what.elastic[d.part]) sought.push_back(d);
    scale.resize(static_cast<Eigen::Index>(sought.size()));
    for (size_t k = 0; k < sought.size(); ++k) scale[static_cast<Eigen::Index>(k)] = sought[k].scale;
  }

  // -df/dx in metres: the elastic stiffness exactly, the rest by differences.
  bool stiffness(MatX& K) {
    const Eigen::Index n = static_cast<Eigen::Index>(sought.size());
    VecX base, f;
    std::vector<VecX> elastic(model.parts.size());
    if (!evaluate(nullptr, base)) return false;
    for (size_t i = 0; i < model.parts.size(); ++i) elastic[i] = work.parts[i].elastic;
    // Rates that a unit rate of each direction makes, for the elastic stiffness.
    const VecX q = work.q, w = work.w;
    K = MatX::Zero(n, n);
    MatX N = MatX::Zero(model.nv, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Direction& d = sought[static_cast<size_t>(k)];
      const size_t cluster = static_cast<size_t>(model.parts[d.part].cluster);
      const ClusterWork& cw = work.clusters[cluster];
      const int v0 = model.clusters[cluster].v0;
      N(d.v, k) = 1.0 / d.scale;
      for (size_t i = 0; i < cw.partition.ind.size(); ++i)
        if (v0 + cw.partition.ind[i] == d.v)
          for (size_t r = 0; r < cw.partition.dep.size(); ++r) N(v0 + cw.partition.dep[r], k) = cw.E(r, i) / d.scale;
    }
    for (const Part& p : model.parts) {
      if (p.body.n == 0) continue;
      const auto e = N.middleRows(p.ev0, p.body.n);
      std::vector<Eigen::Index> moving;
      for (Eigen::Index k = 0; k < n; ++k)
        if (!e.col(k).isZero(0.0)) moving.push_back(k);
      for (Eigen::Index k : moving) {
        const VecX force = p.body.Ke * e.col(k);
        for (Eigen::Index i : moving) K(i, k) += e.col(i).dot(force);
      }
    }
    for (Eigen::Index k = 0; k < n; ++k) {
      const Direction& d = sought[static_cast<size_t>(k)];
      // 1e-6 of the size: the truncation (1e-6 relative) costs Newton one digit a step, rounding stays at 1e-10.
      const double step = 1e-6 * model.size;
      move_along(model, d, step / d.scale, work);
      if (!evaluate(&elastic, f)) return false;
      K.col(k) -= (f - base) / step;
      work.q = q;
      work.w = w;
    }
    return evaluate(nullptr, base);
  }
};

// One search at the present share of the loads. 0 found, 1 not; `worst` is then the coordinate with the largest force.
int search(Problem& p, const Sought& what, StaticSolution& out, int& worst) {
  worst = 0;
  double damping = 0.0, last = -1.0;
  for (int iteration = 0; iteration < 200; ++iteration) {
    p.find_directions(what);
    const Eigen::Index n = static_cast<Eigen::Index>(p.sought.size());
    if (n == 0) return 0;
    VecX f, next;
    if (!p.evaluate(nullptr, f)) return 1;
    out.residual = f.cwiseAbs().maxCoeff(&worst);
    // Nothing is left of the forces but rounding: a few hundred roundings of the largest of them, through O(n) bodies.
    if (out.residual <= 1e-13 * p.rest.scale) return 0;
    MatX K;
    if (!p.stiffness(K)) return 1;
    ++out.iterations;
    const MatX S = 0.5 * (K + K.transpose());
    const double stiffest = std::max(S.diagonal().cwiseAbs().maxCoeff(), p.rest.scale / p.model.size);
    for (int attempt = 0; attempt < 60; ++attempt) {
      if (Cholesky(S + damping * MatX::Identity(n, n)).info() == Eigen::Success) break;
      damping = std::max(10.0 * damping, 1e-12 * stiffest);
    }
    VecX x = solve_square(K + damping * MatX::Identity(n, n), f);
    if (!x.allFinite()) return 1;
    const double longest = x.cwiseAbs().maxCoeff(&worst);
    // The last step no longer mends anything: rounding of the forces, or of places where a stiff body resists them (fifty roundings of the size).
    const double rounding = std::max(1e-8 * p.rest.scale, 1e-14 * p.model.size * stiffest);
    if (damping <= 1e-9 * stiffest && longest <= 1e-11 * p.model.size && out.residual <= rounding) {
      if (last >= 0.0 && out.residual >= 0.5 * last) return 0;
      last = out.residual;
    } else {
      f.cwiseAbs().maxCoeff(&worst);
    }
    double share = std::min(1.0, 0.5 * p.model.size / longest);
    const VecX q = p.work.q;
    const double slope = f.dot(x);
    bool accepted = false;
    for (int halving = 0; halving < 40 && !accepted; ++halving, share *= 0.5) {
      for (Eigen::Index k = 0; k < n; ++k) move_along(p.model, p.sought[static_cast<size_t>(k)], share * x[k] / p.scale[k], p.work);
      // Still pushed along the step, or back by less than half of what pushed at its start, or simply less force.
      accepted = p.evaluate(nullptr, next) && ((slope > 0.0 && next.dot(x) >= -0.5 * slope && next.norm() < 10.0 * f.norm()) || next.norm() < 0.9 * f.norm());
      if (!accepted) p.work.q = q;
    }
    if (!accepted) {
      p.evaluate(nullptr, f);
      // At the limit of the digits no step can be better.
      if (out.residual <= rounding && longest <= 1e-8 * p.model.size) return 0;
      if (damping > 1e3 * stiffest) return 1;
      damping = std::max(100.0 * damping, 1e-9 * stiffest);
      continue;
    }
    damping *= share > 0.4 ? 0.1 : 1.0;
    for (const Direction& d : p.sought)
      if (d.rate >= 0 && std::abs(p.work.q[p.model.parts[d.part].q0]) > 1e4 * std::max(1.0, p.model.size)) return 1;
    // Loops may have come near a singular position of their dependent coordinates.
    for (size_t c = 0; c < p.model.clusters.size(); ++c) {
      ClusterWork& cw = p.work.clusters[c];
      if (cw.partition.dep.empty() || partition_growth(p.model, static_cast<int>(c), p.work) < 10.0) continue;
      cw.partition = choose_partition(p.model, static_cast<int>(c), p.work, true);
    }
  }
  return 1;
}

}  // namespace

bool wants_statics(const Scene& scene) {
  return scene.simulation.static_start || std::any_of(scene.bodies.begin(), scene.bodies.end(), marked);
}

StaticSolution solve_statics(const Model& model, const Scene& scene, Work& work) {
  const Sought what = what_is_sought(model, scene);
  StaticSolution out;
  const VecX rates = work.w;
  work.w.setZero();
  lock_held(model, what, work);
  Problem p{model, model.settings.gravity, work.expression_value, work.motion, work, {}, {}, {}};
  const VecX start = work.q;

  int worst = 0;
  if (search(p, what, out, worst) != 0) {
    // Loads raised from zero; a share that is not reached is halved.
    work.q = start;
    double share = 0.0, step = 0.1;
    VecX reached = start;
    out.load_steps = 0;
    while (share < 1.0) {
      const double next = std::min(1.0, share + step);
      p.load(next);
      ++out.load_steps;
      if (search(p, what, out, worst) == 0) {
        share = next;
        reached = work.q;
        step *= 1.5;
        continue;
      }
      step *= 0.5;
      if (step < 1e-3) {
        const Direction d = p.sought.empty() ? Direction{} : p.sought[static_cast<size_t>(worst)];
        const double force = p.rest.force.size() > 0 ? p.rest.force[d.v] : 0.0;
        const bool deforms = d.rate < 0;
        throw InputError(fmt::format("{}: there is no static equilibrium{}: {} is still driven by {:.4g}{}; {}", scene.file.string(),
                                     share > 0.0 ? fmt::format(" beyond {:.3g} % of the loads", 100.0 * share) : "", name_of(model, d), std::abs(force),
                                     deforms ? "" : " N or Nm",
                                     deforms ? "it buckles or is deformed beyond what its model describes: use model = \"mixed\" with more volumes, or smaller loads"
                                             : "give it a spring, a stop or a joint that holds it, or hold it where it is with initial = { value = ... }"));
      }
      work.q = reached;
    }
  }
  p.find_directions(what);
  MatX K;
  if (!p.sought.empty() && p.stiffness(K)) {
    const VecX eigenvalues = SymmetricEigen(0.5 * (K + K.transpose()), Eigen::EigenvaluesOnly).eigenvalues();
    // Softer than 1e-9 of the stiffest direction is neutral, to the digits of the differences.
    out.stable = eigenvalues[0] > -1e-9 * eigenvalues.cwiseAbs().maxCoeff();
  }
  for (const Direction& d : p.sought) {
    const Part& part = model.parts[d.part];
    const int at = d.rate < 0 ? part.eq0 - 1 - d.rate : part.q0 + (part.joint.nq == part.joint.nv ? d.rate : 0);
    out.moved = std::max(out.moved, d.scale * std::abs(work.q[at] - start[at]));
  }
  unlock(model, work);
  work.expression_value = p.expression;
  work.motion = p.motion;
  update_positions(model, work);
  work.w = rates;
  return out;
}

}  // namespace flexframe::sim
