#include "sim/time/error_weights.h"

#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/flexures.h"
#include "sim/dynamics/massless.h"
#include "sim/scene/joint_kinds.h"
#include "sim/time/system.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::sim {
namespace {

// The least deformation worth resolving to the relative tolerance, of a body's size.
constexpr double least_deformation = 1e-5;
// The least motion of a joint worth it, rad or of the mechanism's size.
constexpr double least_joint_motion = 1e-2;
// Coordinates that close a loop are starting values of the closure only: errors of so many units do, and of so many per unit of tolerance.
constexpr double closing_units = 30.0, closing_error = 1e-3;
// Work done, where the motion does not feel it: a thirtieth of the motion's accuracy; least energy, of the mechanism's at its slowest rate
// of interest.
constexpr double work_share = 30.0, felt_work_share = 1e3, least_energy = 1e-9;
// What springs and dampers that hold what has no mass take up: in a motion of that share of the size.
constexpr double massless_motion = 1e-3;
// Of vibrations that are stepped over (dirk) nobody sees the phase; what decays or is followed is asked for more.
constexpr double slack_stepped_over = 0.28, slack_followed = 0.15;
// At the default tolerance, and of tighter ones alike, so that what is asked ten times closer comes ten times closer; looser ones ask with
// this power of them for more.
constexpr double slack_growth = 0.15;
// A multistep method's errors of one sign add up over the many short steps of a period: asked for a tenth, a pendulum keeps its energy
// fifteen times better for the same number of evaluations.
constexpr double adams_strictness = 10.0;
// A coordinate has no digits below that of itself.
constexpr double rounding = 50.0 * std::numeric_limits<double>::epsilon();
// Trees that move by less than that of the mechanism's size are drowned by the sizes above; their share makes them move by the latter.
constexpr double drowned_joints = 1e-4, drowned_bodies = 3e-5, narrow = 1e3;
// States of blocks and contacts, in their own units.
constexpr double least_further = 1e-6, pulled_surfaces = 1e-4;
// Motion that is rounding of the mechanism's size has no size of its own.
constexpr double least_motion = 1e-13;

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

void ErrorWeights::begin(const System& system, Method method, const VecX& y) {
  elastic_slack_ = method == Method::dirk ? slack_stepped_over : slack_followed;
  strictness_ = method == Method::adams ? adams_strictness : 1.0;
  if (tree_.size() != system.model.parts.size()) {
    prepare(system);
    start_ = low_ = high_ = y.head(system.model.nq);
  }
  scale_.setZero();
  update(system, y);
}

// What does not change in a run.
void ErrorWeights::prepare(const System& system) {
  const Model& model = system.model;
  const size_t n = model.parts.size();
  tree_.resize(n);
  for (size_t i = 0; i < n; ++i) tree_[i] = model.parts[i].parent == ground ? static_cast<int>(i) : tree_[model.parts[i].parent];
  for (const Cluster& c : model.clusters)
    for (int i : c.parts) tree_[i] = tree_[c.parts.front()];
  reaches_.assign(n, {});
  part_size_.assign(n, 0.0);
  for (size_t i = 0; i < n; ++i) {
    if (model.parts[i].body.n == 0) continue;
    part_size_[i] = part_reach(model.parts[i].body, model.size);
    reaches_[i] = displacement_per_coordinate(model.parts[i].body, part_size_[i]);
  }
  if (shares.size() != n) shares.clear();
  least_share_ = shares.empty() ? 1.0 : *std::min_element(shares.begin(), shares.end());
}

// Which state every rate is, and the share of the tree of every state.
void ErrorWeights::find_states(const System& system, Eigen::Index states) {
  const Model& model = system.model;
  rate_of_.assign(model.nv, -1);
  int at = model.nq;
  for (size_t c = 0; c < model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) rate_of_[model.clusters[c].v0 + k] = at++;
  share_of_ = VecX::Ones(states);
  if (shares.empty()) return;
  const auto set_rates = [&](int v0, int n, double share) {
    for (int k = v0; k < v0 + n; ++k)
      if (rate_of_[k] >= 0) share_of_[rate_of_[k]] = share;
  };
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    const double part = share(tree_[i]);
    share_of_.segment(p.q0, p.joint.nq).setConstant(part);
    share_of_.segment(p.eq0, p.body.n).setConstant(part);
    set_rates(p.v0, p.joint.nv, part);
    set_rates(p.ev0, p.body.n, part);
  }
}

void ErrorWeights::update(const System& system, const VecX& y) {
  const Model& model = system.model;
  if (scale_.size() != y.size()) scale_ = VecX::Zero(y.size());
  find_states(system, y.size());
  // Trees in which dry friction turns round or sticks: an event's time is as good as the rate that comes to zero there, so every elastic
  // coordinate is asked for the tolerance of its own range (a bar's stretch is a thousandth of its bending, and as fast), and no rate for
  // less.
  timed_.assign(model.parts.size(), 0);
  for (const FrictionPoint& p : system.friction.points)
    if (p.phase != FrictionPhase::regularised) timed_[tree_[p.part]] = 1;
  elastic_sizes(system, y);
  raise_elastic(system, y);
  raise_joints(system, y);
  if (model.nz > 0) {
    const Eigen::Index first = y.size() - model.nz - (system.quadrature ? 2 : 0);
    for (Eigen::Index k = first; k < first + model.nz; ++k) scale_[k] = std::max({scale_[k], std::abs(y[k]), least_further});
    // How far surfaces that stick are pulled, m; while they slide a unit vector stands there that does not change.
    for (size_t k = 0; k < model.contacts.size(); ++k)
      if (const int z0 = model.contacts[k].z0; z0 >= 0)
        scale_.segment<3>(first + z0)
            .setConstant(system.work.signals.contacts[k].slip == ContactSlip::slips ? 1.0 : pulled_surfaces * model.size);
  }
  if (system.quadrature) raise_work(system, y);
  follow_ranges(y);
  for (Eigen::Index i = 0; i < scale_.size(); ++i) scale_[i] = std::max(scale_[i], rounding * std::abs(y[i]) / system.tolerance);
}

// Largest elastic displacement and rate of every tree, at least the least one worth resolving.
void ErrorWeights::elastic_sizes(const System& system, const VecX& y) {
  const Model& model = system.model;
  // A run's slowest rate of interest: sizes of rates start at (size of the coordinate) / duration.
  const double slow = 1.0 / model.settings.duration;
  moved_.assign(model.parts.size(), 0.0);
  speed_.assign(model.parts.size(), 0.0);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    if (p.body.n == 0) continue;
    const int t = tree_[i];
    double& m = moved_[t];
    double& s = speed_[t];
    const double least = share(t) * least_deformation * part_size_[i];
    m = std::max(m, least);
    s = std::max(s, least * slow);
    for (int k = 0; k < p.body.n; ++k) {
      m = std::max(m, reaches_[i][k] * std::abs(gone(y, p.eq0 + k, t)));
      if (const int r = rate_of_[p.ev0 + k]; r >= 0) s = std::max(s, reaches_[i][k] * std::abs(y[r]));
    }
  }
  // Links of lumped beams are elastic too; the beam's length tells how far one moves the tip.
  for (const Flexure& f : model.flexures) {
    const int t = tree_[f.parts.front()];
    double& m = moved_[t];
    double& s = speed_[t];
    const double least = share(t) * least_deformation * f.length;
    m = std::max(m, least);
    s = std::max(s, least * slow);
    for (int i : f.parts) {
      const Part& p = model.parts[i];
      for (int k = 0; k < p.joint.nv; ++k) {
        m = std::max(m, f.length * std::abs(gone(y, p.q0 + k, t)));
        if (const int r = rate_of_[p.v0 + k]; r >= 0) s = std::max(s, f.length * std::abs(y[r]));
      }
    }
  }
  // The tolerance is one of positions, relative to the mechanism's size; elastic displacements are much smaller and would go
  // uncontrolled at loose tolerances, so that they are asked for a lower power of it of their own range at least.
  const double loosest =
      std::pow(1.0 / default_tolerance, elastic_slack_) * std::pow(std::min(1.0, default_tolerance / system.tolerance), slack_growth);
  for (size_t t = 0; t < moved_.size(); ++t)
    moved_[t] *= std::clamp(share(static_cast<int>(t)) * model.size / std::max(moved_[t], 1e-300), 1.0, loosest);
}

void ErrorWeights::raise_elastic(const System& system, const VecX& y) {
  const Model& model = system.model;
  shake_.assign(model.parts.size(), 0.0);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    if (p.body.n == 0) continue;
    const VecX& reach = reaches_[i];
    const int tree = tree_[i];
    const size_t t = tree;
    const double size = part_size_[i];
    for (int k = 0; k < p.body.n; ++k) {
      double& q = scale_[p.eq0 + k];
      q = std::max(q, timed_[t] ? std::max(std::abs(gone(y, p.eq0 + k, tree)), share(tree) * least_deformation * size / reach[k])
                                : moved_[t] / reach[k]);
      const double frequency = std::sqrt(std::max(0.0, p.body.Ke(k, k)) / p.body.Me(k, k));
      if (!timed_[t]) shake_[t] = std::max(shake_[t], frequency * q * reach[k] / size);
      const int r = rate_of_[p.ev0 + k];
      if (r < 0) continue;
      double& rate = scale_[r];
      rate = timed_[t] ? std::max({rate, std::abs(y[r]), frequency * q}) : std::max({rate, speed_[t] / reach[k], frequency * q});
    }
  }
  // Neighbouring links move together at a frequency far below that of a link by itself; the geometric mean of the two costs no accuracy.
  for (const Flexure& f : model.flexures) {
    const size_t t = tree_[f.parts.front()];
    const double frequency = flexure_frequency(f) / std::sqrt(static_cast<double>(f.parts.size()));
    for (int i : f.parts) {
      const Part& p = model.parts[i];
      for (int k = 0; k < p.joint.nv; ++k) {
        double& q = scale_[p.q0 + k];
        q = std::max(q, moved_[t] / f.length);
        shake_[t] = std::max(shake_[t], frequency * q);
        const int r = rate_of_[p.v0 + k];
        if (r >= 0) scale_[r] = std::max({scale_[r], speed_[t] / f.length, frequency * q});
      }
    }
  }
}

void ErrorWeights::raise_joints(const System& system, const VecX& y) {
  const Model& model = system.model;
  const double slow = 1.0 / model.settings.duration, closing = std::min(closing_units, closing_error / system.tolerance);
  for (size_t i = 0; i < model.parts.size(); ++i) {
    const Part& p = model.parts[i];
    if (p.joint.link >= 0) continue;
    const int tree = tree_[i];
    const double part = share(tree), cluster_size = model.clusters[p.cluster].size;
    for (int k = 0; k < p.joint.nq; ++k) {
      // An angle is as good after a thousand turns as after one, and a distance as if its start were zero.
      const bool length = is_length(p.joint.kind, k);
      const double unit = part * (length ? cluster_size : 1.0),
                   size = std::abs(length ? y[p.q0 + k] - start_[p.q0 + k] : gone(y, p.q0 + k, tree));
      double& q = scale_[p.q0 + k];
      q = std::max({q, least_joint_motion * unit, length ? size : std::min(size, 1.0)});
      const bool closes = p.joint.nq == p.joint.nv && rate_of_[p.v0 + k] < 0;
      if (closes && !follows_damper(model, system.work, p.v0 + k)) q = std::max(q, closing * unit);
    }
    for (int k = 0; k < p.joint.nv; ++k) {
      const int r = rate_of_[p.v0 + k];
      if (r < 0) continue;
      const double unit = is_length(p.joint.kind, k) ? cluster_size : 1.0;
      scale_[r] = std::max({scale_[r], least_joint_motion * slow * unit * part, shake_[tree] * unit, std::abs(y[r])});
    }
  }
}

// Nothing depends on the work done, and where the motion feels every load it needs hardly steps of its own: among rigid bodies it is asked
// for a thousandth of the accuracy of the motion (a mass that a few long steps follow to 1e-9 lacked 17 % of the work), beside vibrations
// that steps pass over for none. Prescribed coordinates and what sticks feel nothing, and a stop takes out its work in a short contact:
// there it is asked for a thirtieth, or, without other motion, for all of it.
void ErrorWeights::raise_work(const System& system, const VecX& y) {
  const Model& model = system.model;
  const double slow = 1.0 / model.settings.duration;
  const std::optional<double> balance = balance_energy(model, least_share_ * massless_motion, slow);
  const bool unfelt = balance || std::any_of(model.parts.begin(), model.parts.end(), [](const Part& p) {
                        return p.joint.motion >= 0 || p.joint.friction.has_value() || p.joint.stop.has_value();
                      });
  const bool elastic = std::any_of(model.parts.begin(), model.parts.end(), [](const Part& p) { return p.body.n > 0; });
  const double share = scale_.size() <= model.nq + 2 ? 1.0 : unfelt ? work_share : felt_work_share;
  if (share == felt_work_share && elastic) {
    scale_.tail<2>().setConstant(1e100);
    return;
  }
  // In a plane the work in space stands where it was looked at last, which may be long ago.
  Energy e;
  if (system.plane) {
    // Only read here.
    e = energy_of_motion(model, PlaneWork(const_cast<Work&>(system.work), *system.plane));
  } else {
    e = energy_of_motion(model, system.work);
  }
  const double size = least_share_ * model.size;
  double energy =
      std::max({e.kinetic, e.strain, y.tail<2>().cwiseAbs().maxCoeff(), least_energy * model.mass * std::pow(size * slow, 2), 1e-300});
  // The strain energy of the least deformation worth resolving.
  for (size_t i = 0; i < model.parts.size(); ++i)
    for (int k = 0; k < model.parts[i].body.n; ++k)
      energy = std::max(
          energy, 0.5 * model.parts[i].body.Ke(k, k) * std::pow(least_share_ * least_deformation * part_size_[i] / reaches_[i][k], 2));
  // Without mass: what springs and dampers take up in such a motion.
  if (balance) energy = std::max(energy, *balance);
  scale_.tail<2>() = scale_.tail<2>().cwiseMax(Eigen::Vector2d::Constant(share * energy));
}

void ErrorWeights::follow_ranges(const VecX& y) {
  low_ = low_.cwiseMin(y.head(low_.size()));
  high_ = high_.cwiseMax(y.head(high_.size()));
}

void ErrorWeights::write(double tolerance, double* weight) const {
  for (Eigen::Index i = 0; i < scale_.size(); ++i) weight[i] = 1.0 / (tolerance * scale_[i]) * strictness_;
}

void ErrorWeights::repack(const System& system, const std::vector<Partition>& before, Eigen::Index old_states, Eigen::Index states) {
  const Model& model = system.model;
  VecX of_rates = VecX::Zero(model.nv), next = VecX::Zero(states);
  if (scale_.size() == old_states) {
    int at = model.nq;
    for (size_t c = 0; c < model.clusters.size(); ++c)
      for (int k : before[c].ind) of_rates[model.clusters[c].v0 + k] = scale_[at++];
    next.head(model.nq) = scale_.head(model.nq);
    next.segment(states - model.nz - (system.quadrature ? 2 : 0), model.nz) = scale_.segment(at, model.nz);
  }
  int at = model.nq;
  for (size_t c = 0; c < model.clusters.size(); ++c)
    for (int k : system.work.clusters[c].partition.ind) next[at++] = of_rates[model.clusters[c].v0 + k];
  scale_ = next;
}

std::vector<double> ErrorWeights::narrowed(const System& system) const {
  if (stays_in_equilibrium(system)) return {};
  const Model& model = system.model;
  const size_t n = model.parts.size();
  // How far every tree went, of the mechanism's size or in radians: by joints, and by deformation.
  std::vector<double> joints(n, 0.0), bodies(n, 0.0);
  const VecX range = high_ - low_;
  for (size_t i = 0; i < n; ++i) {
    const Part& p = model.parts[i];
    const size_t t = tree_[i];
    for (int k = 0; k < p.joint.nq; ++k) {
      const double unit = is_length(p.joint.kind, k) ? model.clusters[p.cluster].size : 1.0;
      double& by = p.joint.link >= 0 ? bodies[t] : joints[t];
      by = std::max(by, std::min(1.0, range[p.q0 + k] / unit));
    }
    for (int k = 0; k < p.body.n; ++k) bodies[t] = std::max(bodies[t], reaches_[i][k] * range[p.eq0 + k] / model.size);
  }
  std::vector<double> out(n, 1.0);
  bool narrower = false;
  for (size_t i = 0; i < n; ++i) {
    const size_t t = tree_[i];
    const double most = std::max(joints[t], bodies[t]), before = share(tree_[i]);
    out[i] = before;
    if (most < least_motion || most > (joints[t] > bodies[t] ? drowned_joints : drowned_bodies)) continue;
    // A share found from a motion that was still drowned is looked at again where it was far off.
    if (const double wanted = std::min(1.0, narrow * most); wanted < 0.1 * before) out[i] = wanted, narrower = true;
  }
  return narrower ? out : std::vector<double>();
}

}  // namespace flexframe::sim
