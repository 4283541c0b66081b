#include "sim/bodies/body_terms.h"

#include "sim/base/sized.h"
#include "sim/base/wide.h"
#include "sim/bodies/axis_mass.h"
#include "sim/bodies/rigid_terms.h"
#include "sim/bodies/rod_axis.h"

namespace flexframe::sim {

namespace {

using Tensor = Eigen::Matrix<double, 1, 1>;  // about the normal of the plane

// First order of the coupling, of the first moment and of the inertia tensor.
template <int N>
FLEXFRAME_INLINE void first_order(const FlexibleBody& body, const VecX& q, Mat6X& Mre, Vec3& md, Vec6& J) {
  auto both = sized<N>(Mre);
  both.template topRows<3>() = sized<N>(body.md1);
  both.template bottomRows<3>() = sized<N>(body.Cr0);
  md += combine_sized<N>(body.md1, q);
  J += combine_sized<N>(body.J1, q);
}
template <int N>
FLEXFRAME_INLINE void first_order(const PlaneBody& body, const VecX& q, MatX3& Mre, Vec2& md, Tensor& J) {
  const auto x = component_of<N>(body.md1, 0), y = component_of<N>(body.md1, 1);
  component_of<N>(Mre, 0) = x;
  component_of<N>(Mre, 1) = y;
  component_of<N>(Mre, 2) = sized<N>(body.Cr0);
  md += Vec2(x.dot(sized<N>(q)), y.dot(sized<N>(q)));
  J[0] += sized<N>(body.J1).dot(sized<N>(q));
}

Mat3 full_tensor(const Vec6& J) {
  Mat3 out;
  out << J[0], J[3], J[4], J[3], J[1], J[5], J[4], J[5], J[2];
  return out;
}
void rigid_mass(double mass, const Vec3& md, const Vec6& J, Mat6& out) {
  const Mat3 S = skew(md);
  out.topLeftCorner<3, 3>() = mass * Mat3::Identity();
  out.topRightCorner<3, 3>() = -S;
  out.bottomLeftCorner<3, 3>() = S;
  out.bottomRightCorner<3, 3>() = full_tensor(J);
}
void rigid_mass(double mass, const Vec2& md, const Tensor& J, Mat3& out) {
  out << mass, 0.0, -md.y(), 0.0, mass, md.x(), -md.y(), md.x(), J[0];
}

// Weights of the tensor's elements in 1/2 w^T J w (in space xx yy zz xy xz yz).
Vec6 tensor_weight(const Vec3& w) {
  Vec6 out;
  out << 0.5 * w.x() * w.x(), 0.5 * w.y() * w.y(), 0.5 * w.z() * w.z(), w.x() * w.y(), w.x() * w.z(), w.y() * w.z();
  return out;
}
Tensor tensor_weight(double w) { return Tensor(0.5 * w * w); }
Vec3 times(const Vec6& J, const Vec3& w) { return full_tensor(J) * w; }
double times(const Tensor& J, double w) { return J[0] * w; }

// -Ct (v x w) - 1/2 w^T J1 w, and the rate of the tensor's first order.
template <int N>
FLEXFRAME_INLINE Vec6 centrifugal(const FlexibleBody& body, const Vec3& v, const Vec3& w, const Vec6& weight, const VecX& qd,
                                  BodyTerms& out) {
  const Vec3 a = v.cross(w);
  const double *m = out.Mre.data(), *J = body.J1.data();
  const Eigen::Index n = N > 0 ? N : qd.size();
  Vec6 Jdot = Vec6::Zero();
  for (Eigen::Index k = 0; k < n; ++k, m += 6, J += 6) {
    const Eigen::Map<const Vec6> J1(J);
    out.ce[k] = -(m[0] * a[0] + m[1] * a[1] + m[2] * a[2]) - J1.dot(weight);
    Jdot += J1 * qd[k];
  }
  return Jdot;
}
template <int N>
FLEXFRAME_INLINE Tensor centrifugal(const PlaneBody& body, const Vec2& v, double w, const Tensor& weight, const VecX& qd, PlaneTerms& out) {
  const Vec2 a = cross(v, w);
  sized<N>(out.ce) = -a.x() * component_of<N>(out.Mre, 0) - a.y() * component_of<N>(out.Mre, 1) - weight[0] * sized<N>(body.J1);
  return Tensor(sized<N>(body.J1).dot(sized<N>(qd)));
}

// ce -= (sum of w_a Cr1_a)^T qd of so many matrices, column by column.
template <int N, int Matrices>
FLEXFRAME_INLINE void subtract_transposed(const double* const* Cr1, const double* w, const VecX& qd, VecX& ce) {
  using Column = Eigen::Map<const Eigen::Matrix<double, N, 1>>;
  const Eigen::Index n = N > 0 ? N : qd.size();
  for (Eigen::Index k = 0; k < n; ++k) {
    const Column first(Cr1[0] + k * n, n);
    if constexpr (Matrices == 1) {
      ce[k] -= w[0] * first.dot(sized<N>(qd));
    } else {
      const Column second(Cr1[1] + k * n, n);
      if constexpr (Matrices == 2) ce[k] -= (w[0] * first + w[1] * second).dot(sized<N>(qd));
      else ce[k] -= (w[0] * first + w[1] * second + w[2] * Column(Cr1[2] + k * n, n)).dot(sized<N>(qd));
    }
  }
}

// ce += sum of w_a (Cr1_a - Cr1_a^T) qd, and qd^T Cr1_a qd.
template <int N>
FLEXFRAME_INLINE Vec3 add_gyroscopic(const FlexibleBody& body, const Vec3& w, const VecX& qd, BodyTerms& out) {
  Vec3 squares = Vec3::Zero();
  const double* Cr1[3] = {};
  double weight[3] = {};
  int count = 0;
  for (int a = 0; a < 3; ++a) {
    if (body.Cr1[a].size() == 0) continue;
    multiply_sized<N>(body.Cr1[a], qd.data(), out.work.data());
    squares[a] = sized<N>(out.work).dot(sized<N>(qd));
    if (w[a] == 0.0) continue;
    sized<N>(out.ce) += w[a] * sized<N>(out.work);
    Cr1[count] = body.Cr1[a].data();
    weight[count++] = w[a];
  }
  if (count == 1) subtract_transposed<N, 1>(Cr1, weight, qd, out.ce);
  else if (count == 2) subtract_transposed<N, 2>(Cr1, weight, qd, out.ce);
  else if (count == 3) subtract_transposed<N, 3>(Cr1, weight, qd, out.ce);
  return squares;
}
template <int N>
FLEXFRAME_INLINE Tensor add_gyroscopic(const PlaneBody& body, double w, const VecX& qd, PlaneTerms& out) {
  if (body.Cr1[0].size() == 0) return Tensor::Zero();
  multiply_sized<N>(body.Cr1[0], qd.data(), out.work.data());
  const Tensor square(sized<N>(out.work).dot(sized<N>(qd)));
  if (body.Cr1_difference.size() == 0) return square;
  multiply_sized<N>(body.Cr1_difference, qd.data(), out.work2.data());
  sized<N>(out.ce) += w * sized<N>(out.work2);
  return square;
}

template <class S, class Body>
void reserve_terms(const Body& body, TermsIn<S>& out) {
  out.ce = out.work = out.work2 = VecX::Zero(body.n);
  for (size_t s = 0; s < S::tensor; ++s)
    if (body.J2[s].size() > 0) out.J2q[s] = VecX::Zero(body.n);
}

template <int N, class S, class Body>
FLEXFRAME_INLINE void mass(const Body& body, const VecX& q, TermsIn<S>& out) {
  // First moment and its derivative Ct.
  typename S::Linear md = body.md0;
  auto J = body.J0;
  if (body.n > 0) {
    first_order<N>(body, q, out.Mre, md, J);
    for (int a = 0; a < S::linear; ++a) {
      if (body.md2[a].size() == 0) continue;
      multiply_sized<N>(body.md2[a], q.data(), out.work.data());
      component_of<N>(out.Mre, a) += sized<N>(out.work);
      md[a] += 0.5 * sized<N>(q).dot(sized<N>(out.work));
    }
    for (int a = 0; a < S::angular; ++a) {
      if (body.Cr1[a].size() == 0) continue;
      multiply_sized<N>(body.Cr1[a], q.data(), out.work.data());
      component_of<N>(out.Mre, S::linear + a) += sized<N>(out.work);
    }
    for (int s = 0; s < S::tensor; ++s) {
      if (body.J2[s].size() == 0) continue;
      multiply_sized<N>(body.J2[s], q.data(), out.J2q[s].data());
      J[s] += 0.5 * sized<N>(q).dot(sized<N>(out.J2q[s]));
    }
  }
  out.md = md;
  rigid_mass(body.mass, md, J, out.Mrr);
}

template <int N, class S, class Body>
FLEXFRAME_INLINE void velocity_terms(const Body& body, const typename S::Twist& V, const VecX& qd, TermsIn<S>& out) {
  const typename S::Linear v = linear(V);
  const typename S::Angular w = angular(V);
  typename S::Twist P = out.Mrr * V;  // momenta
  const typename S::Twist Pe = combine_sized<N>(out.Mre, qd);
  P += Pe;
  const typename S::Linear p = linear(P), mdd = linear(Pe);

  // Elastic row: sum_a w_a (Cr1_a - Cr1_a^T) qd - Ct (v x w) - 1/2 w^T dJ/dq w.
  const auto weight = tensor_weight(w);
  auto Jdot = centrifugal<N>(body, v, w, weight, qd, out);
  for (int s = 0; s < S::tensor; ++s) {
    if (body.J2[s].size() == 0) continue;
    Jdot[s] += sized<N>(out.J2q[s]).dot(sized<N>(qd));
    sized<N>(out.ce) -= weight[s] * sized<N>(out.J2q[s]);
  }
  const Eigen::Matrix<double, S::angular, 1> Crdot_qd = add_gyroscopic<N>(body, w, qd, out);
  typename S::Linear mddd = S::Linear::Zero();
  for (int a = 0; a < S::linear; ++a) {
    if (body.md2[a].size() == 0) continue;
    multiply_sized<N>(body.md2[a], qd.data(), out.work.data());
    mddd[a] = sized<N>(out.work).dot(sized<N>(qd));
  }
  out.cr = joined(cross(w, p) + cross(w, mdd) + mddd,
                  cross(w, angular(P)) + cross(v, p) + cross(mdd, v) + times(Jdot, w) + as_angular(Crdot_qd));
}

FLEXFRAME_WIDE void wide_mass(const FlexibleBody& body, const VecX& q, BodyTerms& out) {
  by_larger_count(
      body.n, [&](auto n) __attribute__((always_inline)) { mass<n()>(body, q, out); });
}
FLEXFRAME_WIDE void wide_mass(const PlaneBody& body, const VecX& q, PlaneTerms& out) {
  by_larger_count(
      body.n, [&](auto n) __attribute__((always_inline)) { mass<n()>(body, q, out); });
}
FLEXFRAME_WIDE void wide_velocity_terms(const FlexibleBody& body, const Vec6& V, const VecX& qd, BodyTerms& out) {
  if (body.n == 0) return rigid_velocity_terms(V, out);
  by_larger_count(
      body.n, [&](auto n) __attribute__((always_inline)) { velocity_terms<n()>(body, V, qd, out); });
}
FLEXFRAME_WIDE void wide_velocity_terms(const PlaneBody& body, const Vec3& V, const VecX& qd, PlaneTerms& out) {
  if (body.n == 0) return rigid_velocity_terms(V, out);
  by_larger_count(
      body.n, [&](auto n) __attribute__((always_inline)) { velocity_terms<n()>(body, V, qd, out); });
}

template <int N, class Body>
FLEXFRAME_INLINE void structural_force(const Body& body, const VecX& q, const VecX& qd, VecX& out) {
  if (body.stiffness.size() > 0) sized<N>(out) = sized<N>(body.stiffness).cwiseProduct(sized<N>(q));
  else multiply_sized<N>(body.Ke, q.data(), out.data());
  if (body.ksigma.size() > 0) sized<N>(out) += sized<N>(body.ksigma);
  if (body.De.size() > 0) add_sized<N>(body.De, qd, out);
}
template <class Body>
void structural_force(const Body& body, const VecX& q, const VecX& qd, VecX& out) {
  out.resize(body.n);
  by_larger_count(
      body.n, [&](auto n) __attribute__((always_inline)) { structural_force<n()>(body, q, qd, out); });
}

}  // namespace

void reserve(const FlexibleBody& body, BodyTerms& out) {
  out.Mre = Mat6X::Zero(6, body.n);
  if (body.n == 0) wide_mass(body, VecX(), out);
  if (body.rod) return reserve_rod(body, out);
  if (!has_axis_mass(body)) return reserve_terms(body, out);
  out.ce = out.work = out.work2 = VecX::Zero(body.n);
  reserve_axis_mass(body, out);
}
void reserve(const PlaneBody& body, PlaneTerms& out) {
  out.Mre = MatX3::Zero(body.n, 3);
  if (body.n == 0) wide_mass(body, VecX(), out);
  if (body.rod) reserve_rod(body, out);
  else reserve_terms(body, out);
}

void update_mass(const FlexibleBody& body, const VecX& q, BodyTerms& out, bool elastic) {
  if (body.rod) update_rod_mass(body, q, out, elastic);
  else if (has_axis_mass(body)) update_axis_mass(body, q, out, elastic);
  else wide_mass(body, q, out);
}
void update_mass(const PlaneBody& body, const VecX& q, PlaneTerms& out, bool elastic) {
  if (body.rod) update_rod_mass(body, q, out, elastic);
  else wide_mass(body, q, out);
}

void update_velocity_terms(const FlexibleBody& body, const Vec6& V, const VecX& qd, BodyTerms& out) {
  if (body.rod) update_rod_velocity_terms(body, V, qd, out);
  else if (has_axis_mass(body)) update_axis_velocity_terms(body, V, qd, out);
  else wide_velocity_terms(body, V, qd, out);
}
void update_velocity_terms(const PlaneBody& body, const Vec3& V, const VecX& qd, PlaneTerms& out) {
  if (body.rod) update_rod_velocity_terms(body, V, qd, out);
  else wide_velocity_terms(body, V, qd, out);
}

void elastic_force(const FlexibleBody& body, const VecX& q, const VecX& qd, VecX& out) { structural_force(body, q, qd, out); }
void elastic_force(const PlaneBody& body, const VecX& q, const VecX& qd, VecX& out) { structural_force(body, q, qd, out); }

namespace {

// x^T A x.
double quadratic_form(const MatX& A, const VecX& x) {
  static thread_local VecX product;
  product.resize(x.size());
  multiply(A, x.data(), product.data());
  return x.dot(product);
}

// Twice the energy of elastic rates by themselves. Normal modes, whose stiffness is a diagonal, have unit mass.
template <class Body, class Terms>
double elastic_square(const Body& body, const Terms& terms, const VecX& qd) {
  if (body.stiffness.size() > 0 && terms.Mee.size() == 0) return qd.squaredNorm();
  return quadratic_form(elastic_mass(body, terms), qd);
}

}  // namespace

double strain_energy(const FlexibleBody& body, const VecX& q) {
  if (body.n == 0) return 0.0;
  double e = 0.5 * (body.stiffness.size() > 0 ? q.cwiseAbs2().dot(body.stiffness) : quadratic_form(body.Ke, q));
  if (body.ksigma.size() > 0) e += body.ksigma.dot(q);
  return e;
}

double kinetic_energy(const FlexibleBody& body, const BodyTerms& terms, const Vec6& V, const VecX& qd) {
  double e = 0.5 * V.dot(terms.Mrr * V);
  if (body.n > 0) e += V.dot(terms.Mre * qd) + 0.5 * elastic_square(body, terms, qd);
  return e;
}

double kinetic_energy(const PlaneBody& body, const PlaneTerms& terms, const Vec3& V, const VecX& qd) {
  double e = 0.5 * V.dot(terms.Mrr * V);
  if (body.n > 0) e += V.dot(combine(terms.Mre, qd)) + 0.5 * elastic_square(body, terms, qd);
  return e;
}

bool same_kinetics(const FlexibleBody& a, const FlexibleBody& b) {
  bool same = a.n == b.n && a.mass == b.mass && a.md0 == b.md0 && a.J0 == b.J0 && same_values(a.md1, b.md1) && same_values(a.J1, b.J1) &&
              same_values(a.Cr0, b.Cr0) && same_values(a.Me, b.Me) && a.nodes.size() == b.nodes.size() && same_axis_mass(a.axis, b.axis) &&
              same_rod(a.rod, b.rod);
  for (size_t i = 0; i < 3; ++i) same = same && same_values(a.md2[i], b.md2[i]) && same_values(a.Cr1[i], b.Cr1[i]);
  for (size_t i = 0; i < 6; ++i) same = same && same_values(a.J2[i], b.J2[i]);
  for (size_t k = 0; same && k < a.nodes.size(); ++k) {
    const FlexibleNode &m = a.nodes[k], &n = b.nodes[k];
    same = m.origin == n.origin && m.rotation == n.rotation && same_values(m.phi, n.phi) && same_values(m.psi, n.psi) &&
           same_values(m.along, n.along);
    for (size_t i = 0; i < 3; ++i) same = same && same_values(m.phi2[i], n.phi2[i]) && same_values(m.psi2[i], n.psi2[i]);
  }
  return same;
}

}  // namespace flexframe::sim
