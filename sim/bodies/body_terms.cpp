#include "sim/bodies/body_terms.h"

#include "sim/base/spatial.h"
#include "sim/bodies/axis_mass.h"

namespace flexframe::sim {

void BodyTerms::reserve(const FlexibleBody& body) {
  Mre = Mat6X::Zero(6, body.n);
  ce = VecX::Zero(body.n);
  work = VecX::Zero(body.n);
  work2 = VecX::Zero(body.n);
  if (has_axis_mass(body)) return reserve_axis_mass(body, *this);
  for (size_t s = 0; s < 6; ++s)
    if (body.J2[s].size() > 0) J2q[s] = VecX::Zero(body.n);
}

void update_mass(const FlexibleBody& body, const VecX& q, BodyTerms& out, bool elastic) {
  if (has_axis_mass(body)) return update_axis_mass(body, q, out, elastic);
  // First moment and its derivative Ct.
  Vec3 md = body.md0;
  Vec6 J = body.J0;
  if (body.n > 0) {
    out.Mre.topRows<3>() = body.md1;
    out.Mre.bottomRows<3>() = body.Cr0;
    md.noalias() += body.md1 * q;
    J.noalias() += body.J1 * q;
    for (int a = 0; a < 3; ++a) {
      if (body.md2[a].size() > 0) {
        out.work.noalias() = body.md2[a] * q;
        out.Mre.row(a) += out.work.transpose();
        md[a] += 0.5 * q.dot(out.work);
      }
      if (body.Cr1[a].size() > 0) {
        out.work.noalias() = body.Cr1[a] * q;
        out.Mre.row(3 + a) += out.work.transpose();
      }
    }
    for (int s = 0; s < 6; ++s) {
      if (body.J2[s].size() > 0) {
        out.J2q[s].noalias() = body.J2[s] * q;
        J[s] += 0.5 * q.dot(out.J2q[s]);
      }
    }
  }
  out.md = md;
  const Mat3 S = skew(md);
  out.Mrr.topLeftCorner<3, 3>() = body.mass * Mat3::Identity();
  out.Mrr.topRightCorner<3, 3>() = -S;
  out.Mrr.bottomLeftCorner<3, 3>() = S;
  out.Mrr.bottomRightCorner<3, 3>() << J[0], J[3], J[4], J[3], J[1], J[5], J[4], J[5], J[2];
}

void update_velocity_terms(const FlexibleBody& body, const Vec6& V, const VecX& qd, BodyTerms& out) {
  if (has_axis_mass(body)) return update_axis_velocity_terms(body, V, qd, out);
  const Vec3 v = V.head<3>(), w = V.tail<3>();
  Vec6 P = out.Mrr * V;  // momenta
  if (body.n == 0) {
    const Vec3 p = P.head<3>(), L = P.tail<3>();
    out.cr.head<3>() = w.cross(p);
    out.cr.tail<3>() = w.cross(L) + v.cross(p);
    return;
  }
  const Vec6 Pe = out.Mre * qd;
  P += Pe;
  const Vec3 p = P.head<3>(), L = P.tail<3>(), mdd = Pe.head<3>();

  // Elastic row: sum_a w_a (Cr1_a - Cr1_a^T) qd - Ct (v x w) - 1/2 w^T dJ/dq w.
  // Weights of the tensor elements xx yy zz xy xz yz in 1/2 w^T J w.
  Vec6 weight;
  weight << 0.5 * w.x() * w.x(), 0.5 * w.y() * w.y(), 0.5 * w.z() * w.z(), w.x() * w.y(), w.x() * w.z(), w.y() * w.z();
  out.ce.noalias() = -(out.Mre.topRows<3>().transpose() * v.cross(w));
  out.ce.noalias() -= body.J1.transpose() * weight;
  Vec6 Jdot = body.J1 * qd;
  for (int s = 0; s < 6; ++s) {
    if (body.J2[s].size() == 0) continue;
    Jdot[s] += out.J2q[s].dot(qd);
    out.ce -= weight[s] * out.J2q[s];
  }
  Vec3 Crdot_qd = Vec3::Zero(), mddd = Vec3::Zero();
  for (int a = 0; a < 3; ++a) {
    if (body.Cr1[a].size() > 0) {
      out.work.noalias() = body.Cr1[a] * qd;
      Crdot_qd[a] = out.work.dot(qd);
      if (w[a] != 0.0) {
        out.work2.noalias() = body.Cr1[a].transpose() * qd;
        out.ce += w[a] * (out.work - out.work2);
      }
    }
    if (body.md2[a].size() > 0) {
      out.work.noalias() = body.md2[a] * qd;
      mddd[a] = out.work.dot(qd);
    }
  }
  Mat3 Jd;
  Jd << Jdot[0], Jdot[3], Jdot[4], Jdot[3], Jdot[1], Jdot[5], Jdot[4], Jdot[5], Jdot[2];
  out.cr.head<3>() = w.cross(p) + w.cross(mdd) + mddd;
  out.cr.tail<3>() = w.cross(L) + v.cross(p) + mdd.cross(v) + Jd * w + Crdot_qd;
}

void elastic_force(const FlexibleBody& body, const VecX& q, const VecX& qd, VecX& out) {
  if (body.stiffness.size() > 0) out = body.stiffness.cwiseProduct(q);
  else out.noalias() = body.Ke * q;
  if (body.ksigma.size() > 0) out += body.ksigma;
  if (body.De.size() > 0) out.noalias() += body.De * qd;
}

double strain_energy(const FlexibleBody& body, const VecX& q) {
  if (body.n == 0) return 0.0;
  double e = 0.5 * q.dot(body.Ke * q);
  if (body.ksigma.size() > 0) e += body.ksigma.dot(q);
  return e;
}

double kinetic_energy(const FlexibleBody& body, const BodyTerms& terms, const Vec6& V, const VecX& qd) {
  double e = 0.5 * V.dot(terms.Mrr * V);
  if (body.n > 0) e += V.dot(terms.Mre * qd) + 0.5 * qd.dot(elastic_mass(body, terms) * qd);
  return e;
}

bool same_kinetics(const FlexibleBody& a, const FlexibleBody& b) {
  bool same = a.n == b.n && a.mass == b.mass && a.md0 == b.md0 && a.J0 == b.J0 && same_values(a.md1, b.md1) && same_values(a.J1, b.J1) &&
              same_values(a.Cr0, b.Cr0) && same_values(a.Me, b.Me) && a.nodes.size() == b.nodes.size() && same_axis_mass(a.axis, b.axis);
  for (size_t i = 0; i < 3; ++i) same = same && same_values(a.md2[i], b.md2[i]) && same_values(a.Cr1[i], b.Cr1[i]);
  for (size_t i = 0; i < 6; ++i) same = same && same_values(a.J2[i], b.J2[i]);
  for (size_t k = 0; same && k < a.nodes.size(); ++k) {
    const FlexibleNode &m = a.nodes[k], &n = b.nodes[k];
    same = m.origin == n.origin && m.rotation == n.rotation && same_values(m.phi, n.phi) && same_values(m.psi, n.psi);
    for (size_t i = 0; i < 3; ++i) same = same && same_values(m.phi2[i], n.phi2[i]);
  }
  return same;
}

}  // namespace flexframe::sim
