// Large static deformations of mixed beams, from their pieces alone: the potential energy of a welded chain under a dead load at its
// tip is made stationary here, without the program's dynamics.
#include "tests/unit/beam_chains.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flexframe::sim::test_beam_static {
namespace {

constexpr double pi = std::numbers::pi;

struct Place {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();
};

Place operator*(const Place& a, const Place& b) { return {a.R * b.R, a.p + a.R * b.p}; }
Place inverse(const Place& a) { return {a.R.transpose(), -(a.R.transpose() * a.p)}; }
Mat3 turn(const Vec3& a) { return a.norm() == 0.0 ? Mat3::Identity() : Eigen::AngleAxisd(a.norm(), a.normalized()).toRotationMatrix(); }

Place place(const FlexibleNode& node, const VecX& q) {
  Place out{turn(node.psi * q), node.origin + node.phi * q};
  for (std::size_t a = 0; a < 3; ++a)
    if (node.phi2[a].size() > 0) out.p[static_cast<Eigen::Index>(a)] += 0.5 * q.dot(node.phi2[a] * q);
  return out;
}

struct Welded {
  std::vector<BeamPiece> pieces;
  std::vector<Place> before;  // weld in front of each piece: from the previous piece's tip (the first: from the world)
};

Place across(const Welded& chain, std::size_t k, const VecX& q) {
  const FlexibleBody& body = chain.pieces[k].body;
  return chain.before[k] * inverse(place(body.nodes[0], q)) * place(body.nodes[1], q);
}

// Tip under a dead force and moment-free: q = Ke^-1 dr/dq^T F, solved by Anderson's mixing in steps of the load.
Vec3 loaded_tip(const Welded& chain, const Vec3& force, int steps) {
  const std::size_t pieces = chain.pieces.size();
  int size = 0;
  std::vector<int> at;
  std::vector<Eigen::LDLT<MatX>> stiffness;
  for (const BeamPiece& piece : chain.pieces) {
    at.push_back(size);
    size += piece.body.n;
    stiffness.emplace_back(piece.body.Ke);
  }
  const auto local = [&](const VecX& all, std::size_t k) { return VecX(all.segment(at[k], chain.pieces[k].body.n)); };
  const auto tip = [&](const VecX& all) {
    Place t;
    for (std::size_t k = 0; k < pieces; ++k) t = t * across(chain, k, local(all, k));
    return t.p;
  };
  const auto update = [&](const VecX& all, const Vec3& load) {
    std::vector<Vec3> tail(pieces + 1, Vec3::Zero());  // tip seen from behind each piece
    for (std::size_t k = pieces; k-- > 0;) tail[k] = across(chain, k, local(all, k)).R * tail[k + 1] + across(chain, k, local(all, k)).p;
    VecX next(size);
    Mat3 R = Mat3::Identity();
    for (std::size_t k = 0; k < pieces; ++k) {
      VecX q = local(all, k), generalised(q.size());
      for (Eigen::Index i = 0; i < q.size(); ++i) {
        const double step = 1e-5, keep = q[i];
        q[i] = keep + step;
        const Place plus = across(chain, k, q);
        q[i] = keep - step;
        const Place minus = across(chain, k, q);
        q[i] = keep;
        const Vec3 change = (plus.R * tail[k + 1] + plus.p - minus.R * tail[k + 1] - minus.p) / (2.0 * step);
        generalised[i] = load.dot(R * change);
      }
      next.segment(at[k], q.size()) = stiffness[k].solve(generalised);
      R = R * across(chain, k, q).R;
    }
    return next;
  };
  VecX q = VecX::Zero(size);
  for (int s = 1; s <= steps; ++s) {
    const Vec3 load = force * s / steps;
    std::vector<VecX> points, residuals;
    double last = 1.0;
    for (int iteration = 0; iteration < 300; ++iteration) {
      const VecX residual = update(q, load) - q;
      last = residual.norm() / (1e-30 + q.norm());
      if (last < 1e-9) break;
      points.push_back(q);
      residuals.push_back(residual);
      if (points.size() > 12) points.erase(points.begin()), residuals.erase(residuals.begin());
      const auto m = static_cast<Eigen::Index>(points.size()) - 1;
      q += 0.3 * residual;
      if (m == 0) continue;
      MatX dr(size, m), dq(size, m);
      for (Eigen::Index i = 0; i < m; ++i) {
        const auto j = static_cast<std::size_t>(i);
        dr.col(i) = residuals[j + 1] - residuals[j];
        dq.col(i) = points[j + 1] - points[j];
      }
      const VecX mix = dr.colPivHouseholderQr().solve(residual);
      q -= (dq + 0.3 * dr) * mix;
    }
    EXPECT_LT(last, 1e-7) << "load step " << s;
  }
  return tip(q);
}

Welded straight(const BeamDef& def, const BeamEffects& effects) {
  Welded chain{mixed_pieces(def, effects), {}};
  chain.before.resize(chain.pieces.size());
  return chain;
}

BeamDef slender(int volumes) {
  BeamDef def;
  def.length = 1.0;
  def.section.area = 1e-4;
  def.section.iy = def.section.iz = 1e-10;
  def.section.j = 2e-10;
  def.material = {1000.0, 1e10, 0.3};  // EI = 1, EA = 1e6
  def.model = BeamModel::mixed;
  def.volumes = volumes;
  def.elements = 2;
  return def;
}

TEST(BeamStatic, ElasticaOfTenVolumes) {
  // Elastica (Mattiasson 1981): P L^2/EI, w/L, u/L
  const std::array<std::array<double, 3>, 4> table = {
      {{1, .3017207738, .0564332363}, {2, .4934574804, .1606417208}, {5, .7137915236, .3876283607}, {10, .8106090249, .5549955978}}};
  const Welded chain = straight(slender(10), {.axial = true, .bending_xz = true, .stiffening = true});
  for (const auto& [load, w, u] : table) {
    const Vec3 tip = loaded_tip(chain, Vec3(0, 0, load), static_cast<int>(load));
    EXPECT_NEAR(tip.z(), w, 2e-5) << load;
    EXPECT_NEAR(1.0 - tip.x(), u, 2e-5) << load;
  }
}

TEST(BeamStatic, BatheBolourchiBend) {
  // 45 degrees of a circle of radius 100, section 1 x 1, E 1e7, load 600 out of its plane
  constexpr int volumes = 10;
  const double half = pi / 8.0 / volumes;
  BeamDef def;
  def.section.area = 1.0;
  def.section.iy = def.section.iz = 1.0 / 12.0;
  def.section.j = 0.1406;
  def.material = {1.0, 1e7, 0.0};
  def.elements = 2;
  def.volumes = 1;
  def.length = 200.0 * std::sin(half);
  Welded chain;
  for (int k = 0; k < volumes; ++k) {
    chain.pieces.push_back(
        mixed_pieces(def, {.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = true})[0]);
    chain.before.push_back({turn(Vec3(0, 0, k == 0 ? half : 2.0 * half)), Vec3::Zero()});
  }
  const Vec3 start = loaded_tip(chain, Vec3::Zero(), 1), tip = loaded_tip(chain, Vec3(0, 0, 600.0), 6);
  EXPECT_NEAR(start.x(), 100.0 * std::sin(pi / 4.0), 0.05);
  EXPECT_NEAR(tip.z(), 53.58, 0.5358);
  EXPECT_NEAR(tip.x() - start.x(), -23.65, 0.2365);
  EXPECT_NEAR(start.y() - tip.y(), 13.72, 0.1372);
}

TEST(BeamStatic, PrincetonBeam) {
  // Dowell, Traybar, Hodges 1977: 0.508 x 12.3777 x 3.2024 mm, E 71.7e9, nu 0.31, 8.896 N at the tip; z is the soft direction here
  // (thickness along z)
  const double b = 12.3777e-3, t = 3.2024e-3;
  BeamDef def;
  def.length = 0.508;
  def.section.area = b * t;
  def.section.iz = t * b * b * b / 12.0;
  def.section.iy = b * t * t * t / 12.0;
  def.section.j = b * t * t * t / 3.0 * (1.0 - 0.63 * t / b);
  def.material = {2700.0, 71.7e9, 0.31};
  def.model = BeamModel::mixed;
  def.volumes = 5;
  def.elements = 2;
  const Welded chain = straight(def, {.axial = true, .bending_xy = true, .bending_xz = true, .torsion = true, .stiffening = true});
  const std::array<std::array<double, 3>, 3> table = {{{0, 0, .010714}, {45, .10899, .00884}, {90, .14625, 0}}};
  for (const auto& [degrees, soft, stiff] : table) {
    const double a = degrees * pi / 180.0;
    const Vec3 tip = loaded_tip(chain, 8.896 * Vec3(0.0, std::cos(a), std::sin(a)), 3);
    EXPECT_NEAR(tip.z(), soft, 0.01 * soft + 1e-6) << degrees;
    EXPECT_NEAR(tip.y(), stiff, 0.01 * stiff + 1e-6) << degrees;
  }
}

}  // namespace
}  // namespace flexframe::sim::test_beam_static
