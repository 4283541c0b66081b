#include "sim/dynamics/four_places.h"

#include "sim/dynamics/chain.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/plane_frames.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace flexframe::sim {

namespace {

// A loop's frame b as frame a sees it.
struct Apart {
  Four c{}, s{};
  FourVector p;
};

}  // namespace

// What the partition says, and room.
struct FourClosing {
  struct Dependent {
    int part, rate;  // of its joint
    double scale;    // rate_scale
  };
  struct Row {
    int loop;  // of the cluster
    PlaneRow closure;
    std::vector<double> senses;  // per dependent rate: 1 or -1 where its joint moves frame b or a of the loop alone
  };
  int listed = 0;  // PartitionPlan::made of all this
  bool closes = false;
  int side = 0;                                      // Partition::side
  size_t first = 0;                                  // PartitionPlan::first
  std::vector<Dependent> dependent;                  // in the partition's order
  std::vector<Row> rows, left_out;                   // of the partition, and the others
  std::vector<FourPose> a, b;                        // of the loops' frames, in the base frame
  std::vector<Apart> apart;                          // of the loops
  std::vector<FourTwist> twists;                     // per dependent rate, of the base frame
  std::vector<FourNumbers> residual, step, inverse;  // inverse: of the rows' dependent columns, column by column
};

namespace {

using Mask [[gnu::vector_size(32)]] = std::int64_t;
FLEXFRAME_INLINE bool all(const Mask& m) { return (m[0] & m[1] & m[2] & m[3]) != 0; }

// most = the larger one in size.
FLEXFRAME_INLINE void take_greater(const Four& a, double scale, Four& most) {
  const Four size = (a < 0.0 ? -a : a) * scale;
  most = size > most ? size : most;
}

// kinematics.h: the pose of a flexible frame in its part.
FLEXFRAME_INLINE void bend_frame(const Model& model, int frame, FourWork& work) {
  const PlaneFrame& f = work.plane.frame_constants[frame];
  const PlaneNode& node = f.node;
  const Part& part = model.parts[model.frames[frame].part];
  const int n = part.body.n;
  const FourNumbers* const q = work.q.data() + part.eq0;
  const double *const x = node.phi.data(), *const y = x + n, *const psi = node.psi.data();
  FourPose& pose = work.frames[frame].pose;
  Four angle = Four{} + node.angle, px = Four{} + node.origin.x(), py = Four{} + node.origin.y();
  for (int k = 0; k < n; ++k) {
    angle += psi[k] * q[k].v;
    px += x[k] * q[k].v;
    py += y[k] * q[k].v;
  }
  for (size_t a = 0; a < 2; ++a) {
    if (node.phi2[a].size() == 0) continue;
    const double* h = node.phi2[a].data();
    Four sum{};
    for (int k = 0; k < n; ++k, h += n) {
      Four of{};
      for (int j = 0; j < n; ++j) of += h[j] * q[j].v;
      sum += of * q[k].v;
    }
    (a == 0 ? px : py) += 0.5 * sum;
  }
  sine_cosine(angle + f.offset_angle, pose.s, pose.c);
  pose.p = {px, py};
  if (f.offset.isZero(0.0)) return;
  FourPose of_node;
  sine_cosine(angle, of_node.s, of_node.c);
  const FourVector offset = turned(of_node, f.offset.x(), f.offset.y());
  pose.p = {px + offset.x, py + offset.y};
}

// closure.cpp: residual of a row.
FLEXFRAME_INLINE void set_residual(const PlaneRow& row, const Apart& r, Four& out) {
  if (row.kind == ClosureRow::translation) {
    out = row.u.x() * r.p.x + row.u.y() * r.p.y + row.constant;
  } else if (row.kind == ClosureRow::angle) {
    const FourVector b = turned(r, row.b.x(), row.b.y());
    out = row.u.x() * b.x + row.u.y() * b.y + row.constant;
  } else {
    out = (r.p.x * r.p.x + r.p.y * r.p.y + (row.height2 - row.length * row.length)) / (2.0 * row.length);
  }
}

// closure.cpp: wrench of a row's unit multiplier on frame b, about the base frame's origin in its axes.
FLEXFRAME_INLINE FourTwist unit_wrench(const PlaneRow& row, const Apart& r, const FourPose& a, const FourPose& b) {
  if (row.kind == ClosureRow::angle) {
    const FourVector turn = turned(r, row.b.x(), row.b.y());
    return {{}, turn.x * row.u.y() - turn.y * row.u.x()};
  }
  FourVector f = row.kind == ClosureRow::translation ? FourVector{Four{} + row.u.x(), Four{} + row.u.y()}
                                                     : FourVector{r.p.x / row.length, r.p.y / row.length};
  f = turned(a, f.x, f.y);
  return {f, b.p.x * f.y - b.p.y * f.x};
}

// The loops' frames where the parts stand.
FLEXFRAME_INLINE void place_ends(const Model& model, int cluster, const FourWork& work, FourClosing& c) {
  const std::vector<int>& loops = model.clusters[cluster].loops;
  for (size_t k = 0; k < loops.size(); ++k) {
    const LoopJoint& loop = model.loops[loops[k]];
    c.a[k] = frame_in_base(model, work, cluster, loop.a);
    c.b[k] = frame_in_base(model, work, cluster, loop.b);
    const FourPose seen = compose(inverse(c.a[k]), c.b[k]);
    c.apart[k] = {seen.c, seen.s, seen.p};
  }
}

// Twist of a joint per unit of a rate, about the base frame's origin in its axes.
FLEXFRAME_INLINE FourTwist twist_of(const Model& model, const FourClosing::Dependent& of, const FourWork& work) {
  const FourPart& p = work.parts[of.part];
  if (work.carrying.fixed[of.part] != Carrying::moving) {
    const MatX3& H = work.plane.parts[of.part].Hj;
    return to_parent(p.in_base, {{Four{} + H(of.rate, 0), Four{} + H(of.rate, 1)}, Four{} + H(of.rate, 2)});
  }
  const PlaneJoint& joint = work.plane.tree[of.part];
  const auto rate = static_cast<size_t>(of.rate);
  const Vec2& along = joint.direction[rate];
  const FourPose forward = joint.reversed ? inverse(p.joint.pose) : p.joint.pose;
  FourTwist S{turned_back(forward, {Four{} + along.x(), Four{} + along.y()}), Four{} + joint.sense[rate]};
  if (joint.reversed) {
    S = to_parent(forward, S);
    S = {{-S.v.x, -S.v.y}, -S.w};
  }
  return to_parent(compose(p.in_base, work.frames[model.parts[of.part].joint.outboard].pose), S);
}

// Of so many rows and columns. determinant: something of its sign.
FLEXFRAME_INLINE void invert_four(FourNumbers* A, size_t n, Four& determinant) {
  if (n == 1) {
    determinant = A[0].v;
    A[0].v = 1.0 / A[0].v;
    return;
  }
  if (n == 2) {
    determinant = A[0].v * A[3].v - A[1].v * A[2].v;
    const Four one = 1.0 / determinant, first = A[0].v;
    A[0].v = A[3].v * one;
    A[1].v = -A[1].v * one;
    A[2].v = -A[2].v * one;
    A[3].v = first * one;
    return;
  }
  static thread_local MatX lane;
  lane.resize(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  for (int l = 0; l < 4; ++l) {
    for (size_t k = 0; k < n * n; ++k) lane.data()[k] = A[k].v[l];
    const int side = invert(lane);
    if (side == 0) lane.setConstant(std::numeric_limits<double>::infinity());
    determinant[l] = side;
    for (size_t k = 0; k < n * n; ++k) A[k].v[l] = lane.data()[k];
  }
}

// closure.cpp: the partition's rows of G, their dependent columns. False where one of the four lies in another assembly than the
// partition's (closure.h: crossed): that is looked into one by one.
FLEXFRAME_INLINE bool factorise(const Model& model, const FourWork& work, FourClosing& c) {
  const size_t n = c.dependent.size();
  for (size_t k = 0; k < n; ++k) c.twists[k] = twist_of(model, c.dependent[k], work);
  for (size_t r = 0; r < n; ++r) {
    const FourClosing::Row& row = c.rows[r];
    const auto loop = static_cast<size_t>(row.loop);
    const FourTwist F = unit_wrench(row.closure, c.apart[loop], c.a[loop], c.b[loop]);
    for (size_t k = 0; k < n; ++k) {
      const FourTwist& V = c.twists[k];
      c.inverse[k * n + r].v = row.senses[k] * (V.v.x * F.v.x + V.v.y * F.v.y + V.w * F.w);
    }
  }
  Four determinant{};
  invert_four(c.inverse.data(), n, determinant);
  return c.side == 0 || all((Mask)(determinant * static_cast<double>(c.side) >= 0.0));
}

// The residuals of some rows; the largest in metres into `most`.
FLEXFRAME_INLINE void take_residuals(const std::vector<FourClosing::Row>& rows, const FourClosing& c, double size, FourNumbers* out,
                                     Four& most) {
  for (size_t r = 0; r < rows.size(); ++r) {
    Four residual;
    set_residual(rows[r].closure, c.apart[static_cast<size_t>(rows[r].loop)], residual);
    take_greater(residual, rows[r].closure.kind == ClosureRow::angle ? size : 1.0, most);
    if (out) out[r].v = residual;
  }
}

// closure.cpp, close_loops: Newton's method from the coordinates as they are, in which what has closed stays. False where one of the four
// has not after so many steps: what takes more is told by closing it alone.
FLEXFRAME_INLINE bool close_loops(const Model& model, int cluster, FourWork& work, FourClosing& c) {
  constexpr int most_steps = 8;
  const double size = model.clusters[cluster].size;
  const size_t n = c.dependent.size();
  Four last = Four{} + std::numeric_limits<double>::infinity();
  Mask done{};
  bool fresh = false;
  place_ends(model, cluster, work, c);
  for (int step = 0; step < most_steps; ++step) {
    Four moved{}, sum{};
    take_residuals(c.rows, c, size, c.residual.data(), moved);
    if (!fresh && !factorise(model, work, c)) return false;
    fresh = true;
    for (size_t k = 0; k < n; ++k) {
      Four by{};
      for (size_t r = 0; r < n; ++r) by += c.inverse[r * n + k].v * c.residual[r].v;
      c.step[k].v = by;
      sum += by;
      take_greater(by, c.dependent[k].scale, moved);
    }
    moved += 0.0 * sum;  // what is not finite is not closed
    done |= (Mask)(moved <= 3e-13 * size) | ((Mask)(moved <= 1e-10 * size) & (Mask)(moved > 0.25 * last));
    if (all(done)) return true;
    for (size_t k = 0; k < n; ++k) {
      Four& q = work.q[static_cast<size_t>(model.parts[c.dependent[k].part].q0 + c.dependent[k].rate)].v;
      q = done ? q : q - c.step[k].v;
    }
    place_chain(model, cluster, c.first, work);
    if (step == 0) done |= (Mask)(moved <= 1e-10 * size);
    else done |= (Mask)(moved <= 1e-3 * last) & (Mask)(moved * moved <= 1e-15 * size * last);
    place_ends(model, cluster, work, c);
    if (all(done)) return true;
    const Four least = last < size ? last : Four{} + size;
    fresh = all(done | (Mask)(moved <= 1e-3 * least));
    last = moved;
  }
  return false;
}

// closure.cpp, require_closed: of conditions that the partition leaves out.
FLEXFRAME_INLINE bool stays_closed(const Model& model, int cluster, const FourClosing& c) {
  if (c.left_out.empty()) return true;
  const double size = model.clusters[cluster].size;
  Four open{};
  take_residuals(c.left_out, c, size, nullptr, open);
  return all((Mask)(open <= 1e-4 * size));
}

FLEXFRAME_WIDE bool place_cluster(const Model& model, int cluster, FourWork& work, FourClosing& closing) {
  const Cluster& c = model.clusters[cluster];
  for (const int f : work.carrying.bent[static_cast<size_t>(cluster)]) bend_frame(model, f, work);
  place_chain(model, cluster, 0, work);
  if (closing.closes && !(close_loops(model, cluster, work, closing) && stays_closed(model, cluster, closing))) return false;
  if (c.parent != ground && work.plane.frames[c.base].flexible) bend_frame(model, c.base, work);
  for (const int i : c.parts) {
    FourPart& p = work.parts[i];
    if (!work.carrying.inside[static_cast<size_t>(i)]) p.in_carrier = compose(work.frames[c.base].pose, p.in_base);
    p.world = model.parts[i].parent == ground ? p.in_carrier : compose(work.parts[model.parts[i].parent].world, p.in_carrier);
  }
  return true;
}

FLEXFRAME_WIDE void bend_frames(const Model& model, const std::vector<int>& frames, FourWork& work) {
  for (const int f : frames) bend_frame(model, f, work);
}

// Whether a part is on the way from a frame to what carries the cluster.
bool carries(const Model& model, int cluster, int part, int frame) {
  for (int i = model.frames[frame].part; i != ground && model.parts[i].cluster == cluster; i = model.parts[i].parent)
    if (i == part) return true;
  return false;
}

FourClosing::Row make_row(const Model& model, const FourWork& work, int cluster, size_t loop, size_t at,
                          const std::vector<FourClosing::Dependent>& dependent) {
  const int joint = model.clusters[cluster].loops[loop];
  FourClosing::Row out{static_cast<int>(loop), work.plane.rows[joint][at], {}};
  for (const FourClosing::Dependent& d : dependent)
    out.senses.push_back((carries(model, cluster, d.part, model.loops[joint].b) ? 1.0 : 0.0) -
                         (carries(model, cluster, d.part, model.loops[joint].a) ? 1.0 : 0.0));
  return out;
}

// False where joints alone do not close the cluster.
bool list_closing(const Model& model, int cluster, ClusterWork& cw, const FourWork& work, FourClosing& out) {
  const Cluster& c = model.clusters[cluster];
  if (!cw.locked.empty() || !c.couplings.empty()) return false;
  const PartitionPlan& plan = plan_of(model, cluster, cw);
  if (plan.deforms) return false;
  out.side = cw.partition.side;
  if (out.listed == plan.made) return true;
  out = {};
  out.side = cw.partition.side;
  out.listed = plan.made;
  out.first = plan.first;
  for (const int rate : cw.partition.dep)
    for (const int i : c.parts)
      if (const int k = c.v0 + rate - model.parts[i].v0; k >= 0 && k < model.parts[i].joint.nv)
        out.dependent.push_back({i, k, rate_scale(model, cluster, rate)});
  int index = 0;
  std::vector<std::pair<size_t, size_t>> rows;  // loop, row of that
  for (size_t k = 0; k < c.loops.size(); ++k)
    for (size_t at = 0; at < model.loops[c.loops[k]].rows.size(); ++at, ++index) {
      rows.emplace_back(k, at);
      if (std::count(cw.partition.rows.begin(), cw.partition.rows.end(), index) == 0)
        out.left_out.push_back(make_row(model, work, cluster, k, at, {}));
    }
  for (const int row : cw.partition.rows) {
    const auto& [k, at] = rows[static_cast<size_t>(row)];
    out.rows.push_back(make_row(model, work, cluster, k, at, out.dependent));
  }
  out.closes = !c.loops.empty();
  out.a.resize(c.loops.size());
  out.b.resize(c.loops.size());
  out.apart.resize(c.loops.size());
  out.twists.resize(out.dependent.size());
  out.residual.resize(out.rows.size());
  out.step.resize(out.dependent.size());
  out.inverse.resize(out.dependent.size() * out.rows.size());
  return true;
}

// Flexible frames that joints, loops and the clusters' bases hold on to.
std::vector<int> held_frames(const Model& model, const PlaneMotion& plane) {
  std::vector<int> out;
  const auto take = [&](int f) {
    if (plane.frames[f].flexible && std::count(out.begin(), out.end(), f) == 0) out.push_back(f);
  };
  for (const Cluster& c : model.clusters) {
    take(c.base);
    for (const int f : c.frames) take(f);
  }
  return out;
}

}  // namespace

FourPlaces::FourPlaces(const Model& model, const Work& work, const PlaneMotion& plane, const std::vector<int>& frames)
    : work_{work.carrying, plane, {}, {}, {}, {}} {
  work_.q.resize(static_cast<size_t>(model.nq));
  work_.motion.resize(model.expressions.size());
  for (const FrameMotion<Plane>& f : plane.frames) work_.frames.push_back({four_times(f.pose)});
  work_.parts.resize(model.parts.size());
  for (size_t k = 0; k < model.clusters.size(); ++k) closing_.push_back(std::make_unique<FourClosing>());
  const std::vector<int> held = held_frames(model, plane);
  const auto known = [](const std::vector<Asked>& among, int at) {
    return std::any_of(among.begin(), among.end(), [at](const Asked& a) { return a.at == at; });
  };
  const auto is_plain = [](const Mat3& P, const Mat3& Q) { return P == Mat3::Identity() && Q == Mat3::Identity(); };
  for (const int f : frames) {
    const int part = model.frames[f].part;
    if (part == ground) continue;
    const int body = model.parts[part].scene_body;
    for (const int i : body >= 0 ? model.pieces[body] : std::vector<int>{part})
      if (!known(parts_, i)) parts_.push_back({i, is_plain(plane.axes, plane.part_axes[i])});
    if (!plane.frames[f].flexible || known(frames_, f)) continue;
    frames_.push_back({f, is_plain(plane.part_axes[part], plane.frame_constants[f].axes)});
    if (std::count(held.begin(), held.end(), f) == 0) beside_.push_back(f);
  }
}

FourPlaces::~FourPlaces() = default;

bool FourPlaces::fit(const Model& model, const PlaneMotion& plane, const std::vector<int>& frames) {
  if (!model.couplings.empty()) return false;
  const auto plain = [&](int f) {
    return static_cast<size_t>(f) < plane.frames.size() && !std::isnan(plane.frame_constants[f].height) &&
           plane.frame_constants[f].node.along.size() == 0;
  };
  const std::vector<int> held = held_frames(model, plane);
  return std::all_of(frames.begin(), frames.end(), plain) && std::all_of(held.begin(), held.end(), plain);
}

void FourPlaces::take_coordinates(const Model& model, const MatX& states) {
  for (int k = 0; k < model.nq; ++k) work_.q[static_cast<size_t>(k)].v = four(states.col(k).data()).v;
}

void FourPlaces::take_motions(const Model& model, const Work& work, int lane) {
  for (const int i : work.carrying.following) {
    const auto motion = static_cast<size_t>(model.parts[i].joint.motion);
    work_.motion[motion].value.v[lane] = work.motion[motion].value;
  }
}

bool FourPlaces::place_clusters(const Model& model, Work& work) {
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const int cluster = static_cast<int>(k);
    if (!list_closing(model, cluster, work.clusters[k], work_, *closing_[k]) || !place_cluster(model, cluster, work_, *closing_[k]))
      return false;
  }
  bend_frames(model, beside_, work_);
  return true;
}

namespace {

// As pose_between; plain: P and Q are the axes themselves.
FLEXFRAME_INLINE void set_pose(bool plain, const Mat3& P, const PlanePose& at, double height, const Mat3& Q, Pose& to) {
  if (!plain) {
    to = pose_between(P, at, height, Q);
    return;
  }
  to.R << at.c, -at.s, 0.0, at.s, at.c, 0.0, 0.0, 0.0, 1.0;
  to.p = {at.p.x(), at.p.y(), height};
}

}  // namespace

void FourPlaces::bring(const Model& model, int lane, Work& to) const {
  const PlaneMotion& plane = work_.plane;
  for (int k = 0; k < model.nq; ++k) to.q[k] = work_.q[static_cast<size_t>(k)].v[lane];
  for (const int i : work_.carrying.deforming) {
    const Part& part = model.parts[i];
    std::copy_n(to.q.data() + part.eq0, part.body.n, to.parts[i].q.data());
  }
  for (const auto& [i, plain] : parts_)
    set_pose(plain, plane.axes, lane_of(work_.parts[i].world, lane), plane.part_heights[i], plane.part_axes[i], to.parts[i].world);
  for (const auto& [f, plain] : frames_) {
    const PlaneFrame& at = plane.frame_constants[f];
    const int part = model.frames[f].part;
    set_pose(plain, plane.part_axes[part], lane_of(work_.frames[f].pose, lane), at.height - plane.part_heights[part], at.axes,
             to.frames[f].pose);
  }
}

}  // namespace flexframe::sim
