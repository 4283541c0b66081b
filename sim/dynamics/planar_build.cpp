#include "sim/dynamics/planar_data.h"

#include "sim/bodies/axis_mass.h"
#include "sim/dynamics/kinematics.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

namespace flexframe::sim {

using namespace planar;

namespace {

// Axes whose third is n: the coordinate axes themselves where n is z.
Mat3 axes_about(const Vec3& n) {
  if (n.z() < -0.5) return axes_about(Vec3(-n)) * Vec3(1.0, -1.0, -1.0).asDiagonal();
  return Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), n).toRotationMatrix();
}

// What a rotation within the plane is between planar axes; false if it leaves the plane by more than rounding.
bool planar_rotation(const Mat3& R, Pose2& out) {
  if (std::abs(R(2, 2) - 1.0) > 1e-12 || std::hypot(R(0, 2), R(1, 2)) > 1e-9) return false;
  const double angle = std::atan2(R(1, 0), R(0, 0));
  out.c = std::cos(angle);
  out.s = std::sin(angle);
  return true;
}

bool small(const MatX& A, double scale) { return A.size() == 0 || A.cwiseAbs().maxCoeff() <= 1e-12 * scale; }
double largest(const MatX& A) { return A.size() == 0 ? 0.0 : A.cwiseAbs().maxCoeff(); }

// Component a (in planar axes Q) of a vector-valued quadratic form; empty where it vanishes.
MatX component(const std::array<MatX, 3>& forms, const Mat3& Q, int a, Eigen::Index n) {
  MatX out;
  for (int k = 0; k < 3; ++k) {
    if (forms[k].size() == 0 || Q(k, a) == 0.0) continue;
    if (out.size() == 0) out = MatX::Zero(n, n);
    out += Q(k, a) * forms[k];
  }
  return out;
}

Body planar_body(const FlexibleBody& body, const Mat3& Q) {
  Body b;
  b.n = body.n;
  b.mass = body.mass;
  b.md0 = (Q.transpose() * body.md0).head<2>();
  const Vec3 n = Q.col(2);
  // Tensor elements xx yy zz xy xz yz in n . J n.
  Vec6 weight;
  weight << n.x() * n.x(), n.y() * n.y(), n.z() * n.z(), 2.0 * n.x() * n.y(), 2.0 * n.x() * n.z(), 2.0 * n.y() * n.z();
  b.J0 = weight.dot(body.J0);
  if (b.n == 0) return b;
  const MatX md1 = Q.transpose() * body.md1;
  b.md1_x = md1.row(0).transpose();
  b.md1_y = md1.row(1).transpose();
  b.J1 = body.J1.transpose() * weight;
  b.Cr0 = body.Cr0.transpose() * n;
  b.md2_x = component(body.md2, Q, 0, b.n);
  b.md2_y = component(body.md2, Q, 1, b.n);
  b.Cr1 = component(body.Cr1, Q, 2, b.n);
  if (b.Cr1.size() > 0) {
    b.Cr1_difference = b.Cr1 - b.Cr1.transpose();
    if (small(b.Cr1_difference, largest(b.Cr1))) b.Cr1_difference.resize(0, 0);
  }
  for (int s = 0; s < 6; ++s) {
    if (body.J2[s].size() == 0 || weight[s] == 0.0) continue;
    if (b.J2.size() == 0) b.J2 = MatX::Zero(b.n, b.n);
    b.J2 += weight[s] * body.J2[s];
  }
  b.Me = body.Me;
  b.Ke = body.Ke;
  b.De = body.De;
  b.stiffness = body.stiffness;
  b.ksigma = body.ksigma;
  b.Mre = MatX3::Zero(b.n, 3);
  b.J2q = b.work = b.ce = VecX::Zero(b.n);
  return b;
}

bool planar_kind(JointKind kind) {
  return kind == JointKind::weld || kind == JointKind::revolute || kind == JointKind::prismatic || kind == JointKind::planar;
}

// Why a scene is left to the spatial equations.
struct Refusal {
  std::string why;
};

}  // namespace

// The planar data of a model, step by step; throws Refusal.
struct PlanarDynamics::Data::Builder {
  const Model& model;
  const Work& work;
  Data& d;
  Vec3 normal = Vec3::Zero();    // of the plane, world axes
  Mat3 Qw = Mat3::Identity();    // planar axes of the world,
  std::vector<Mat3> Qp{}, Qf{};  // of every part and every frame, in its own axes

  void build() {
    find_normal();
    for (const PartWork& p : work.parts) Qp.push_back(axes_about(p.world.R.transpose() * normal));
    for (size_t i = 0; i < model.frames.size(); ++i) add_frame(i);
    for (size_t i = 0; i < model.parts.size(); ++i) add_part(i);
    for (size_t k = 0; k < model.clusters.size(); ++k) add_cluster(static_cast<int>(k));
    for (const Load& load : model.loads) add_load(load);
  }

  // The axis of the first hinge.
  void find_normal() {
    for (const Part& p : model.parts)
      if (traits(p.joint.kind).in_plane == InPlane::axis_normal) {
        normal = frame_world(model, work, p.joint.reversed ? p.joint.outboard : p.joint.inboard).R * p.joint.axis;
        break;
      }
    if (normal.isZero(0.0)) throw Refusal{"no hinge gives a plane"};
    if (!model.flexures.empty()) throw Refusal{"a lumped beam's springs are computed in space"};
    Qw = axes_about(normal);
    d.world_axes = Qw;
    d.gravity.head<2>() = (Qw.transpose() * model.settings.gravity).head<2>();
  }

  void add_frame(size_t i) {
    const FramePoint& f = model.frames[i];
    const FrameWork& fw = work.frames[i];
    const Mat3 Q = f.part == ground ? Qw : Qp[f.part];
    Frame frame;
    frame.part = f.part;
    frame.flexible = fw.flexible;
    Qf.push_back(axes_about(fw.pose.R.transpose() * Q.col(2)));
    if (!planar_rotation(Q.transpose() * fw.pose.R * Qf.back(), frame.pose)) throw Refusal{"a frame is turned out of the plane"};
    frame.pose.p = (Q.transpose() * fw.pose.p).head<2>();
    if (fw.flexible) take_node(f, Q, frame);
    d.frames.push_back(std::move(frame));
  }

  // What a frame on a node moves by, in the planar axes Q of its part.
  void take_node(const FramePoint& f, const Mat3& Q, Frame& frame) {
    const FlexibleNode& node = model.parts[f.part].body.nodes[f.node];
    const Eigen::Index n = node.phi.cols();
    const Mat3 Qn = axes_about(node.rotation.transpose() * Q.col(2));
    Pose2 at_node, offset;
    if (!planar_rotation(Q.transpose() * node.rotation * Qn, at_node) || !planar_rotation(Qn.transpose() * f.offset.R * Qf.back(), offset))
      throw Refusal{"a node is turned out of the plane"};
    const Refusal leaves{fmt::format("'{}' deforms out of the plane", model.parts[f.part].name)};
    const MatX phi = Q.transpose() * node.phi, psi = Q.transpose() * node.psi;
    if (!small(phi.row(2), largest(phi)) || !small(psi.topRows<2>(), largest(psi))) throw leaves;
    const MatX normal_part = component(node.phi2, Q, 2, n);
    frame.phi2_x = component(node.phi2, Q, 0, n);
    frame.phi2_y = component(node.phi2, Q, 1, n);
    if (!small(normal_part, std::max(largest(frame.phi2_x), largest(frame.phi2_y)))) throw leaves;
    frame.origin = (Q.transpose() * node.origin).head<2>();
    frame.node_angle = std::atan2(at_node.s, at_node.c);
    frame.offset_angle = std::atan2(offset.s, offset.c);
    frame.offset = (Qn.transpose() * f.offset.p).head<2>();
    frame.arm = turn_back(offset, frame.offset);
    frame.phi_x = phi.row(0).transpose();
    frame.phi_y = phi.row(1).transpose();
    frame.psi = psi.row(2).transpose();
    frame.h_x = frame.h_y = frame.scratch = VecX::Zero(n);
    frame.B = MatX3::Zero(n, 3);
    frame.B.col(2) = frame.psi;
  }

  void take_joint(const TreeJoint& j, planar::Joint& out) const {
    if (!planar_kind(j.kind)) throw Refusal{fmt::format("joint '{}' leaves the plane", j.name)};
    if (j.friction) throw Refusal{fmt::format("joint '{}' has friction", j.name)};
    out.kind = j.kind;
    out.nv = j.nv;
    const Mat3& QA = Qf[j.reversed ? j.outboard : j.inboard];
    const Mat3& QB = Qf[j.reversed ? j.inboard : j.outboard];
    if (!planar_rotation(QA.transpose() * QB, out.zero)) throw Refusal{fmt::format("joint '{}' is turned out of the plane", j.name)};
    const Vec3 axis = QA.transpose() * j.axis;
    if (j.kind == JointKind::prismatic) {
      if (std::abs(axis.z()) > 1e-9) throw Refusal{fmt::format("joint '{}' leaves the plane", j.name)};
      out.direction = axis.head<2>();
    } else if (j.kind != JointKind::weld) {
      if (axis.head<2>().norm() > 1e-9) throw Refusal{fmt::format("joint '{}' leaves the plane", j.name)};
      out.sense = axis.z() > 0.0 ? 1.0 : -1.0;
    }
    if (j.kind == JointKind::planar) {
      const JointAxes a = joint_axes(j.axis);
      out.direction = (QA.transpose() * a.x).head<2>();
      out.direction_y = (QA.transpose() * a.y).head<2>();
    }
    if (j.kind == JointKind::weld && j.reversed) out.zero = inverse(out.zero);
  }

  void add_part(size_t i) {
    const Part& part = model.parts[i];
    if (has_axis_mass(part.body)) throw Refusal{fmt::format("'{}' has the complete kinetic energy of its axis", part.name)};
    PlanarPart p;
    take_joint(part.joint, p.joint);
    p.body = planar_body(part.body, Qp[i]);
    const int n = part.body.n, nv = part.joint.nv;
    p.q = p.qd = p.qdd = p.elastic = p.load_e = p.fe = VecX::Zero(n);
    p.tau = VecX::Zero(nv);
    p.Mre = p.C = p.Fe = p.scratch = MatX3::Zero(n, 3);
    p.Mee = MatX::Zero(n, n);
    p.F = MatX3::Zero(nv + n, 3);
    p.V = p.A0 = p.A = p.load = p.fr = Vec3::Zero();
    d.parts.push_back(std::move(p));
  }

  void add_cluster(int k) {
    const Cluster& c = model.clusters[k];
    PlanarCluster pc;
    pc.Ib = pc.U = MatX3::Zero(c.nv, 3);
    size_t entry = 0;
    for (int i : c.parts) {
      const Part& part = model.parts[i];
      if (part.parent != ground && model.parts[part.parent].cluster == k) continue;
      const Pose& e = c.entry[entry++];
      Pose2 out;
      if (!planar_rotation(Qf[c.base].transpose() * e.R * Qf[part.joint.inboard], out)) throw Refusal{"a frame is turned out of the plane"};
      out.p = (Qf[c.base].transpose() * e.p).head<2>();
      pc.entry.push_back(out);
    }
    for (int l : c.loops) add_rows(l, pc);
    d.clusters.push_back(std::move(pc));
  }

  void add_rows(int l, PlanarCluster& pc) const {
    const LoopJoint& loop = model.loops[l];
    if (loop.spring) throw Refusal{fmt::format("joint '{}' closes a loop and has a spring", loop.name)};
    const Pose rel = sim::compose(sim::inverse(frame_world(model, work, loop.a)), frame_world(model, work, loop.b));
    const Mat3 &QA = Qf[loop.a], &QB = Qf[loop.b];
    const double height = QA.col(2).dot(rel.p);
    for (const ClosureRow& r : loop.rows) {
      Row row{};
      row.kind = r.kind;
      row.loop = l;
      row.length = r.length;
      const Vec3 u = QA.transpose() * r.u, b = QB.transpose() * r.b;
      row.u = u.head<2>();
      row.b = b.head<2>();
      row.constant = r.kind == ClosureRow::translation ? u.z() * height : u.z() * b.z();
      row.out_of_plane2 = height * height;
      pc.rows.push_back(row);
    }
  }

  void add_load(const Load& load) {
    const ForceKind kind = load.def.kind;
    if (load.table) throw Refusal{fmt::format("force '{}' follows a table against a coordinate", load.def.name)};
    if (kind == ForceKind::spring_damper) {
      const Vec3 line = frame_world(model, work, load.on).p - frame_world(model, work, load.from).p;
      if (std::abs(normal.dot(line)) > 1e-12 * std::max(line.norm(), model.size)) throw Refusal{"a spring-damper leaves the plane"};
      d.load_direction.push_back(Vec3::Zero());
      return;
    }
    if ((kind != ForceKind::force && kind != ForceKind::torque && kind != ForceKind::distributed) || load.expression < 0)
      throw Refusal{fmt::format("force '{}' is of a kind that is computed in space", load.def.name)};
    const Mat3 Q = !load.def.follower ? Qw : (kind == ForceKind::distributed ? Qp[model.frames[load.on].part] : Qf[load.on]);
    const Vec3 u = Q.transpose() * load.def.direction;
    d.load_direction.push_back(kind == ForceKind::torque ? Vec3(0.0, 0.0, u.z()) : Vec3(u.x(), u.y(), 0.0));
  }
};

std::unique_ptr<PlanarDynamics> PlanarDynamics::make(const Model& model, const Work& work, std::string& why_not) {
  auto data = std::make_unique<Data>();
  try {
    Data::Builder{model, work, *data}.build();
  } catch (const Refusal& refusal) {
    why_not = refusal.why;
    return nullptr;
  }
  return std::unique_ptr<PlanarDynamics>(new PlanarDynamics(std::move(data)));
}

}  // namespace flexframe::sim
