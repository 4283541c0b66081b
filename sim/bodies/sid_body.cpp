// SID file to body and back, and the identities that hold in real files. See sid.h and SID.md.
#include "sim/bodies/sid.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/plain_text.h"
#include "sim/base/spatial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <unordered_map>

namespace flexframe::sim {
namespace {

// Rows of a symmetric tensor in J: 11 22 33 12 13 23.
constexpr int tensor_row[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
// Oe's columns multiply wx^2 wy^2 wz^2 wx wy, wy wz, wx wz: the tensor row each stands for, and Oe = -factor J1.
constexpr int oe_row[6] = {0, 1, 2, 3, 5, 4};
constexpr double oe_factor[6] = {0.5, 0.5, 0.5, 1.0, 1.0, 1.0};

bool has_order(const std::optional<SidTaylor>& block, bool first) {
  return block && std::any_of(block->entries.begin(), block->entries.end(), [&](const SidEntry& e) { return (e.mode > 0) == first; });
}

void fill(const SidTaylor& block, int mode, MatX& m) {
  for (const SidEntry& e : block.entries)
    if (e.mode == mode) m(e.row - 1, e.column - 1) = e.value;
  if (block.structure == 2)
    for (const SidEntry& e : block.entries)
      if (e.mode == mode && e.row != e.column && m(e.column - 1, e.row - 1) == 0.0) m(e.column - 1, e.row - 1) = e.value;
  if (block.structure == 4 && mode == 0) m.setIdentity();
}

double relative(double deviation, double scale) { return scale > 0.0 ? deviation / scale : deviation; }

// The frequency in "Eigen Mode 3 : 56.638 Hz", or -1.
double label_frequency(const std::string& label) {
  const size_t hz = label.rfind("Hz");
  const size_t colon = label.rfind(':');
  if (hz == std::string::npos || colon == std::string::npos || hz < colon) return -1.0;
  const std::string number = label.substr(colon + 1, hz - colon - 1);
  const char* end = nullptr;
  const double value = leading_number(number.c_str(), &end);
  return end == number.c_str() ? -1.0 : value;
}

// sqrt(eig(Me \ Ke)) / 2 pi, ascending; empty when Me is not positive definite.
VecX frequencies(const MatX& Me, const MatX& Ke) {
  const Cholesky cholesky(Me);
  if (cholesky.info() != Eigen::Success) return {};
  MatX A = cholesky.solve_lower(Ke);
  A = cholesky.solve_lower(A.transpose());
  SymmetricEigen eigen(0.5 * (A + A.transpose()), Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt() / (2.0 * std::numbers::pi);
}

// Collects deviations between two sparse tensors over n x n x 3 (or smaller) places.
class Comparison {
 public:
  void a(long place, double value) { at(place).first += value; }
  void b(long place, double value) { at(place).second += value; }
  double residual() const {
    double deviation = 0.0, scale = 0.0;
    for (const auto& [place, ab] : terms) {
      deviation = std::max(deviation, std::abs(ab.first - ab.second));
      scale = std::max({scale, std::abs(ab.first), std::abs(ab.second)});
    }
    return relative(deviation, scale);
  }

 private:
  std::pair<double, double>& at(long place) { return terms[place]; }
  std::unordered_map<long, std::pair<double, double>> terms;
};

}  // namespace

MatX sid_m0(const SidTaylor& block) {
  MatX m = MatX::Zero(block.rows, block.columns);
  fill(block, 0, m);
  return m;
}

MatX sid_m1(const SidTaylor& block, int mode) {
  MatX m = MatX::Zero(block.rows, block.columns);
  fill(block, mode, m);
  return m;
}

SidTaylor make_sid_block(const MatX& m0, const std::vector<MatX>& m1, int modes, int structure) {
  SidTaylor t;
  t.order = m1.empty() ? 0 : 1;
  t.rows = static_cast<int>(m0.rows());
  t.columns = static_cast<int>(m0.cols());
  t.modes = modes;
  t.structure = structure;
  const auto add = [&](const MatX& m, int mode) {
    for (int r = 0; r < m.rows(); ++r)
      for (int c = 0; c < (structure == 2 ? r + 1 : m.cols()); ++c)
        if (m(r, c) != 0.0) t.entries.push_back({r + 1, mode, c + 1, m(r, c)});
  };
  if (structure != 4) add(m0, 0);
  for (size_t k = 0; k < m1.size(); ++k) add(m1[k], static_cast<int>(k) + 1);
  if (t.entries.empty() && structure != 4) t.structure = 0;
  return t;
}

std::vector<SidCheck> check_sid(const SidFile& sid) {
  std::vector<SidCheck> checks;
  const long n = sid.nelastq;
  if (n == 0) return checks;
  // What one of two blocks does not say cannot contradict the other.
  const bool moving_inertia = sid.J && sid.J->order > 0;
  if (sid.mdCM && sid.mdCM->order > 0 && sid.Ct && (has_order(sid.mdCM, true) || has_order(sid.Ct, false))) {
    Comparison c;
    for (const SidEntry& e : sid.mdCM->entries)
      if (e.mode > 0) c.a(3L * e.mode + e.row, e.value);
    for (const SidEntry& e : sid.Ct->entries)
      if (e.mode == 0) c.b(3L * e.row + e.column, e.value);
    checks.push_back({"mdCM.M1(:,q) = Ct.M0(q,:)", c.residual()});
  }
  if (sid.Oe && moving_inertia) {
    Comparison c;
    for (const SidEntry& e : sid.Oe->entries)
      if (e.mode == 0) c.a(6L * e.row + oe_row[e.column - 1], e.value);
    for (const SidEntry& e : sid.J->entries)
      if (e.mode > 0) c.b(6L * e.mode + e.row - 1, -(e.row <= 3 ? 0.5 : 1.0) * e.value);
    checks.push_back({"Oe.M0(j,:) = -(J1xx/2, J1yy/2, J1zz/2, J1xy, J1yz, J1xz)", c.residual()});
  }
  if (sid.Gr && moving_inertia) {
    Comparison c;
    for (const SidEntry& e : sid.Gr->entries) {
      const long mode = (e.column - 1) % n, axis = (e.column - 1) / n;
      const int row = tensor_row[e.row - 1][axis];
      c.a(6 * (mode + 1) + row, (e.row - 1 == axis ? 1.0 : 0.5) * e.value);
    }
    for (const SidEntry& e : sid.J->entries)
      if (e.mode > 0) c.b(6L * e.mode + e.row - 1, e.value);
    checks.push_back({"sym(Gr_j) = J1_j", c.residual()});
  }
  if (sid.Ge && has_order(sid.Cr, true)) {
    // With geometric stiffening Cr.M1 has a symmetric part that Ge has not.
    Comparison full, skew_part;
    for (const SidEntry& e : sid.Ge->entries) {
      full.a(3L * n * (e.row - 1) + (e.column - 1), e.value);
      skew_part.a(3L * n * (e.row - 1) + (e.column - 1), e.value);
    }
    for (const SidEntry& e : sid.Cr->entries)
      if (e.mode > 0) {
        const long axis = e.column - 1, place = 3L * n * (e.row - 1) + n * axis + e.mode - 1;
        full.b(place, 2.0 * e.value);
        skew_part.b(place, e.value);
        skew_part.b(3L * n * (e.mode - 1) + n * axis + e.row - 1, -e.value);
      }
    checks.push_back({"Ge_j(k,:) = 2 Cr1(k,j,:)", std::min(full.residual(), skew_part.residual())});
  }
  Comparison origin, ap;
  bool any_origin = false, any_ap = false;
  for (size_t i = 0; i < sid.nodes.size(); ++i) {
    const SidNode& node = sid.nodes[i];
    const long base = static_cast<long>(i) * 9 * (n + 1);
    // Where a writer left the first order of a node out there is nothing to compare.
    if (has_order(node.origin, true)) {
      any_origin = true;
      for (const SidEntry& e : node.origin->entries)
        if (e.mode > 0) origin.a(base + 3L * e.mode + e.row, e.value);
      if (node.phi)
        for (const SidEntry& e : node.phi->entries)
          if (e.mode == 0) origin.b(base + 3L * e.column + e.row, e.value);
    }
    if (has_order(node.AP, true) && node.psi) {
      any_ap = true;
      const Mat3 ap0 = sid_m0(*node.AP);
      std::vector<Vec3> psi(n, Vec3::Zero());
      for (const SidEntry& e : node.psi->entries)
        if (e.mode == 0) psi[e.column - 1](e.row - 1) = e.value;
      for (const SidEntry& e : node.AP->entries)
        if (e.mode > 0) ap.a(base + 9L * e.mode + 3L * e.row + e.column, e.value);
      for (int k = 0; k < n; ++k) {
        const Mat3 turned = skew(psi[k]) * ap0;
        for (int r = 0; r < 3; ++r)
          for (int s = 0; s < 3; ++s)
            if (turned(r, s) != 0.0) ap.b(base + 9L * (k + 1) + 3L * (r + 1) + s + 1, turned(r, s));
      }
    }
  }
  if (any_origin) checks.push_back({"origin.M1(:,q) = phi(:,q)", origin.residual()});
  if (any_ap) checks.push_back({"AP.M1(:,q,:) = skew(psi_q) AP.M0", ap.residual()});
  return checks;
}

namespace {

// Smallest eigenvalue of the undeformed free body's mass matrix, rigid and elastic motion, scaled to a unit diagonal; 0 where it is too
// large to look at.
double least_mass(const FlexibleBody& body) {
  const int n = body.n;
  if (n == 0 || n > 300 || body.Me.rows() != n || body.md1.cols() != n || body.Cr0.cols() != n) return 0.0;
  MatX M = MatX::Zero(6 + n, 6 + n);
  M.topLeftCorner<3, 3>() = body.mass * Mat3::Identity();
  const Vec3& d = body.md0;
  Mat3 cross;
  cross << 0, -d.z(), d.y(), d.z(), 0, -d.x(), -d.y(), d.x(), 0;
  M.block<3, 3>(3, 0) = cross;
  M.block<3, 3>(0, 3) = cross.transpose();
  M.block<3, 3>(3, 3) << body.J0(0), body.J0(3), body.J0(4), body.J0(3), body.J0(1), body.J0(5), body.J0(4), body.J0(5), body.J0(2);
  M.block(0, 6, 3, n) = body.md1;
  M.block(3, 6, 3, n) = body.Cr0;
  M.bottomLeftCorner(n, 6) = M.topRightCorner(6, n).transpose();
  M.bottomRightCorner(n, n) = body.Me;
  const VecX scale = M.diagonal().unaryExpr([](double m) { return m > 0.0 ? 1.0 / std::sqrt(m) : 1.0; });
  M = (scale.asDiagonal() * M * scale.asDiagonal()).eval();
  return M.allFinite() ? SymmetricEigen(M, Eigen::EigenvaluesOnly).eigenvalues()(0) : 0.0;
}

// A file's body step by step.
class BodyOfSid {
 public:
  BodyOfSid(const SidFile& sid, const std::string& name, std::vector<std::string>* notes, SidLacks* lacks)
      : sid_(sid), name_(name), notes_(notes), lacks_(lacks), n_(sid.nelastq) {}

  FlexibleBody make() {
    require_blocks();
    require_size();
    body_.n = n_;
    body_.mass = sid_.mass;
    body_.labels = sid_.labels;
    if (!body_.labels.empty()) body_.labels.resize(n_);
    take_first_moment();
    take_inertia();
    take_first_moment_of_second_order();
    take_angular_momentum();
    if (n_ > 0) take_structure();
    for (const SidCheck& c : check_sid(sid_))
      if (c.residual > 1e-4) note(fmt::format("identity {} does not hold: off by {:.2g} of the largest entry", c.identity, c.residual));
    for (const SidNode& source : sid_.nodes) take_node(source);
    if (turned_ > 0)
      note(fmt::format("{} nodes without rotation shapes (psi): taken from the first order of their orientation (AP.M1)", turned_));
    look_for_lacks();
    if (const double least = least_mass(body_); least < -1e-6)
      note(
          fmt::format("mass, inertia and their coupling to the elastic coordinates contradict each other (scaled, the mass matrix of the "
                      "free body has the eigenvalue {:.2g}): the body cannot move freely",
                      least));
    return std::move(body_);
  }

 private:
  void note(std::string text) {
    if (notes_) notes_->push_back(std::move(text));
  }
  void lack(std::string text) {
    if (lacks_) lacks_->all.push_back(std::move(text));
  }
  [[noreturn]] void fail(const std::string& text) const { throw InputError(name_ + ": " + text); }

  void require_blocks() const {
    if (!(sid_.mass > 0.0)) fail(fmt::format("mass = {}: a body needs a mass > 0", sid_.mass));
    if (!sid_.mdCM) fail("block mdCM (mCM) is missing");
    if (!sid_.J) fail("block J (mmi) is missing");
    if (n_ > 0 && !sid_.Me) fail("block Me is missing");
    if (n_ > 0 && !sid_.Ke) fail("block Ke is missing");
  }

  // Dense storage against what the file gives: entries, and 64 MB that anybody has.
  void require_size() const {
    const bool second = has_order(sid_.Oe, true) || has_order(sid_.Ct, true) || has_order(sid_.Cr, true) || has_order(sid_.Ge, false);
    size_t entries = 0, stiff_nodes = 0;
    const auto count = [&](std::initializer_list<const std::optional<SidTaylor>*> blocks) {
      for (const auto* b : blocks)
        if (*b) entries += (*b)->entries.size();
    };
    count({&sid_.mdCM, &sid_.J, &sid_.Ct, &sid_.Cr, &sid_.Me, &sid_.Gr, &sid_.Ge, &sid_.Oe, &sid_.ksigma, &sid_.Ke, &sid_.De});
    for (const SidNode& node : sid_.nodes) {
      count({&node.origin, &node.phi, &node.psi, &node.AP});
      stiff_nodes += has_order(node.phi, true);
    }
    const double nd = n_;
    const double matrices = 3.0 + (second ? 12.0 : 0.0) + 3.0 * static_cast<double>(stiff_nodes);
    const double bytes = 8.0 * (nd * nd * matrices + 6.0 * nd * static_cast<double>(sid_.nodes.size()));
    if (bytes > 64e6 + 3200.0 * static_cast<double>(entries))
      fail(fmt::format("nelastq = {} would need {:.0f} MB of matrices, but the file gives only {} numbers", n_, bytes / 1e6, entries));
  }

  // Calls visit for the entries of zeroth order (mode 0), or of first.
  template <class Visit>
  static void each(const std::optional<SidTaylor>& block, bool first, const Visit& visit) {
    for (const SidEntry& e : block->entries)
      if ((e.mode > 0) == first) visit(e);
  }

  // Terms that make a structure follow its deformation. Those of Gr and Ge follow from the other blocks.
  void look_for_unused() {
    const std::tuple<const std::optional<SidTaylor>*, const char*, const char*> blocks[] = {
        {&sid_.Me, "Me", "mass"}, {&sid_.Ke, "Ke", "stiffness"}, {&sid_.De, "De", "damping"}};
    for (const auto& [block, word, what] : blocks)
      if (*block &&
          std::any_of((*block)->entries.begin(), (*block)->entries.end(), [](const SidEntry& e) { return e.mode > 0 && e.value != 0.0; }))
        lack(fmt::format("block {} of its file changes with the deformation ({}.M1), which is not used: the {} is that without deformation",
                         word, word, what));
  }

  // Zero orders that stand in the file are a body's that has them so (mean axes); blocks that are not there are unknown.
  void look_for_lacks() {
    const auto says_first_order = [](const std::optional<SidTaylor>& block) { return block && block->order > 0; };
    if (n_ > 0 && !sid_.Ct && !says_first_order(sid_.mdCM))
      lack(
          "its file has neither Ct nor a first order of mdCM: accelerations and weight do not deform the body, which is right on mean axes "
          "only");
    if (n_ > 0 && !sid_.Cr && !sid_.Gr)
      lack("its file has neither Cr nor Gr: angular accelerations do not deform the body, which is right on mean axes only");
    if (n_ > 0 && !sid_.Oe && !says_first_order(sid_.J))
      lack("its file has neither Oe nor a first order of J: centrifugal forces do not deform the body");
    if (n_ > 1 && !sid_.Ge && !says_first_order(sid_.Cr))
      lack("its file has neither Ge nor a first order of Cr: Coriolis forces of the deformation do not deform the body");
    look_for_unused();
    std::vector<std::string> nowhere;
    for (const SidNode& node : sid_.nodes)
      if (!node.origin) nowhere.push_back(node.id);
    if (!nowhere.empty())
      lack(fmt::format("its file does not say where {} of {} nodes are (block origin; the first is {}): they lie at the body's frame",
                       nowhere.size(), sid_.nodes.size(), nowhere.front()));
  }

  // An entry of one of several n x n blocks, which are empty where all of them would be zero.
  double& entry(MatX& block, int row, int column) const {
    if (block.size() == 0) block = MatX::Zero(n_, n_);
    return block(row, column);
  }

  void make_symmetric(MatX& m, const std::string& what) {
    if (m.size() == 0) return;
    const double scale = m.cwiseAbs().maxCoeff();
    const double skewness = (m - m.transpose()).cwiseAbs().maxCoeff();
    if (skewness > 1e-6 * scale)
      note(fmt::format("{} is not symmetric (by {:.2g} of its largest entry): its symmetric part is used", what, skewness / scale));
    m = (0.5 * (m + m.transpose())).eval();
  }

  // Ct is what the equations of motion couple by; mdCM.M1 says the same.
  void take_first_moment() {
    if (sid_.mdCM->rows > 0) body_.md0 = sid_m0(*sid_.mdCM);
    body_.md1 = Mat3X::Zero(3, n_);
    if (has_order(sid_.Ct, false)) body_.md1 = sid_m0(*sid_.Ct).transpose();
    if (!has_order(sid_.mdCM, true)) return;
    Mat3X from_md = Mat3X::Zero(3, n_);
    each(sid_.mdCM, true, [&](const SidEntry& e) { from_md(e.row - 1, e.mode - 1) = e.value; });
    if (!has_order(sid_.Ct, false)) {
      body_.md1 = from_md;
      if (!sid_.Ct) note("Ct is missing: taken from mdCM.M1");
    } else {
      const double scale = body_.md1.cwiseAbs().maxCoeff(), apart = (from_md - body_.md1).cwiseAbs().maxCoeff();
      if (apart > 1e-6 * scale) note(fmt::format("mdCM.M1 differs from Ct.M0 by {:.2g} of the largest entry: Ct is used", apart / scale));
    }
  }

  void require_inertia_tensor() const {
    Mat3 J;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) J(r, c) = body_.J0(tensor_row[r][c]);
    const Vec3 eigenvalues = Eigen::SelfAdjointEigenSolver<Mat3>(J, Eigen::EigenvaluesOnly).eigenvalues();
    // A thin rod has one vanishing moment; digits lost in printing must not refuse it.
    if (eigenvalues(0) < -1e-6 * std::abs(eigenvalues(2))) fail("J.M0 is no inertia tensor: it has a negative principal moment");
  }

  // Of first and second order.
  void take_inertia() {
    if (sid_.J->rows > 0) body_.J0 = sid_m0(*sid_.J);
    body_.J1 = Mat6X::Zero(6, n_);
    if (has_order(sid_.J, true)) {
      each(sid_.J, true, [&](const SidEntry& e) { body_.J1(e.row - 1, e.mode - 1) = e.value; });
    } else if (has_order(sid_.Oe, false)) {
      each(sid_.Oe, false, [&](const SidEntry& e) { body_.J1(oe_row[e.column - 1], e.row - 1) = -e.value / oe_factor[e.column - 1]; });
      note("J has no first order: taken from Oe.M0");
    }
    require_inertia_tensor();
    if (has_order(sid_.Oe, true)) {
      each(sid_.Oe, true,
           [&](const SidEntry& e) { entry(body_.J2[oe_row[e.column - 1]], e.row - 1, e.mode - 1) = -e.value / oe_factor[e.column - 1]; });
      for (MatX& J2 : body_.J2) make_symmetric(J2, "Oe.M1");
    } else if (n_ > 0) {
      note("Oe has no first order: the inertia is linear in the elastic coordinates");
    }
  }

  void take_first_moment_of_second_order() {
    if (!has_order(sid_.Ct, true)) return;
    each(sid_.Ct, true, [&](const SidEntry& e) { entry(body_.md2[e.column - 1], e.row - 1, e.mode - 1) = e.value; });
    for (MatX& md2 : body_.md2) make_symmetric(md2, "Ct.M1");
  }

  void take_angular_momentum() {
    body_.Cr0 = Mat3X::Zero(3, n_);
    if (has_order(sid_.Cr, false)) {
      body_.Cr0 = sid_m0(*sid_.Cr).transpose();
    } else if (!sid_.Cr && has_order(sid_.Gr, false)) {
      // Gr_j = J1_j - skew(Cr0_j).
      const MatX Gr = sid_m0(*sid_.Gr);
      for (int j = 0; j < n_; ++j)
        for (int a = 0; a < 3; ++a) {
          const int b = (a + 1) % 3, c = (a + 2) % 3;
          body_.Cr0(a, j) = 0.5 * (Gr(b, n_ * c + j) - Gr(c, n_ * b + j));
        }
      note("Cr is missing: taken from Gr");
    }
    if (has_order(sid_.Cr, true)) {
      each(sid_.Cr, true, [&](const SidEntry& e) { entry(body_.Cr1[e.column - 1], e.row - 1, e.mode - 1) = e.value; });
    } else if (has_order(sid_.Ge, false)) {
      each(sid_.Ge, false,
           [&](const SidEntry& e) { entry(body_.Cr1[(e.column - 1) / n_], e.row - 1, (e.column - 1) % n_) = 0.5 * e.value; });
      note("Cr has no first order: taken from Ge / 2");
    }
  }

  void take_structure() {
    body_.Me = sid_m0(*sid_.Me);
    body_.Ke = sid_m0(*sid_.Ke);
    if (body_.Me.rows() != n_) fail("block Me is empty");
    if (body_.Ke.rows() != n_) fail("block Ke is empty");
    make_symmetric(body_.Me, "Me");
    if (has_order(sid_.De, false) || (sid_.De && sid_.De->structure == 4)) body_.De = sid_m0(*sid_.De);
    if (has_order(sid_.ksigma, false)) body_.ksigma = sid_m0(*sid_.ksigma);
    // ksigma(q) + Ke q is the elastic force: what follows q in ksigma is stiffness.
    if (has_order(sid_.ksigma, true)) each(sid_.ksigma, true, [&](const SidEntry& e) { body_.Ke(e.row - 1, e.mode - 1) += e.value; });
    make_symmetric(body_.Ke, "Ke");
    const VecX f = frequencies(body_.Me, body_.Ke);
    if (f.size() == 0) fail("Me is not positive definite");
    // Labels carry the frequencies of the maker's eigenmodes; other bases do not.
    std::vector<double> given;
    for (const std::string& label : body_.labels) given.push_back(label_frequency(label));
    std::sort(given.begin(), given.end());
    if (static_cast<int>(given.size()) != n_ || given.front() < 0.0) return;
    double worst = 0.0;
    for (int k = 0; k < n_; ++k) worst = std::max(worst, std::abs(given[k] - f(k)) / std::max(f(k), 1e-3));
    if (worst > 2e-3)
      note(fmt::format("the frequencies of the labels differ from those of Me, Ke by up to {:.2g}: Me and Ke are used", worst));
  }

  Mat3 node_rotation(const SidNode& source) const {
    if (!has_order(source.AP, false)) return Mat3::Identity();
    const Mat3 ap = sid_m0(*source.AP);
    // Files print five to twelve digits; a rotation is restored to full precision, anything further off is damage.
    if ((ap * ap.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() > 1e-3 || ap.determinant() < 0.0)
      fail(fmt::format("node {}: AP.M0 is no rotation", source.id));
    const Mat3 rotation = Eigen::Quaterniond(ap).normalized().toRotationMatrix();
    return (rotation - ap).cwiseAbs().maxCoeff() < 1e-15 ? ap : rotation;
  }

  void take_displacements(const SidNode& source, FlexibleNode& node) {
    node.phi = Mat3X::Zero(3, n_);
    if (has_order(source.phi, false)) {
      node.phi = sid_m0(*source.phi);
    } else if (has_order(source.origin, true)) {
      each(source.origin, true, [&](const SidEntry& e) { node.phi(e.row - 1, e.mode - 1) = e.value; });
      note(fmt::format("node {}: phi is zero but origin.M1 is not: phi is taken from it", source.id));
    }
    if (!has_order(source.phi, true)) return;
    each(source.phi, true, [&](const SidEntry& e) { entry(node.phi2[e.row - 1], e.mode - 1, e.column - 1) = e.value; });
    for (MatX& phi2 : node.phi2) make_symmetric(phi2, fmt::format("phi.M1 of node {}", source.id));
  }

  void take_rotations(const SidNode& source, FlexibleNode& node) {
    node.psi = Mat3X::Zero(3, n_);
    if (has_order(source.psi, false)) {
      node.psi = sid_m0(*source.psi);
    } else if (has_order(source.AP, true)) {
      std::vector<Mat3> first(n_, Mat3::Zero());
      each(source.AP, true, [&](const SidEntry& e) { first[e.mode - 1](e.row - 1, e.column - 1) = e.value; });
      for (int k = 0; k < n_; ++k) {
        const Mat3 w = first[k] * node.rotation.transpose();
        node.psi.col(k) = 0.5 * Vec3(w(2, 1) - w(1, 2), w(0, 2) - w(2, 0), w(1, 0) - w(0, 1));
      }
      ++turned_;
    } else if (!source.psi && !node.phi.isZero(0.0) && lacks_) {
      lacks_->unturned.push_back(node.name);
    }
    if (!has_order(source.psi, true)) return;
    each(source.psi, true, [&](const SidEntry& e) { entry(node.psi2[e.row - 1], e.mode - 1, e.column - 1) = e.value; });
    for (MatX& psi2 : node.psi2) make_symmetric(psi2, fmt::format("psi.M1 of node {}", source.id));
  }

  void take_stresses(const SidNode& source, FlexibleNode& node) {
    if (!source.sigma || source.sigma->entries.empty()) return;
    node.sigma = MatX::Zero(6, n_);
    bool initial = false;
    for (const SidEntry& e : source.sigma->entries) {
      if (e.mode > 0) node.sigma(e.row - 1, e.mode - 1) = e.value;
      else if (source.sigma->columns == n_ && (n_ > 1 || !has_order(source.sigma, true))) node.sigma(e.row - 1, e.column - 1) = e.value;
      else initial = true;
    }
    if (initial) note(fmt::format("node {}: the initial stress (sigma.M0) is not used", source.id));
  }

  void take_node(const SidNode& source) {
    FlexibleNode node;
    const bool number = std::all_of(source.id.begin(), source.id.end(), [](char c) { return c >= '0' && c <= '9'; });
    node.name = number ? "node[" + source.id + "]" : source.id;
    if (source.origin && source.origin->rows > 0) node.origin = sid_m0(*source.origin);
    node.rotation = node_rotation(source);
    take_displacements(source, node);
    take_rotations(source, node);
    take_stresses(source, node);
    body_.nodes.push_back(std::move(node));
  }

  const SidFile& sid_;
  const std::string& name_;
  std::vector<std::string>* notes_;
  SidLacks* lacks_;
  const int n_;
  FlexibleBody body_;
  size_t turned_ = 0;
};

}  // namespace

FlexibleBody to_flexible_body(const SidFile& sid, const std::string& name, std::vector<std::string>* notes, SidLacks* lacks) {
  return BodyOfSid(sid, name, notes, lacks).make();
}

SidFile from_flexible_body(const FlexibleBody& body, const std::string& comment) {
  SidFile sid;
  const int n = body.n;
  sid.comment = comment;
  sid.mass = body.mass;
  sid.nelastq = n;
  sid.labels = body.labels;
  if (!sid.labels.empty()) sid.labels.resize(n);
  const auto columns = [&](const auto& m) {
    std::vector<MatX> out;
    out.reserve(n);
    for (int k = 0; k < n; ++k) out.push_back(m.cols() == n ? MatX(m.col(k)) : MatX(MatX::Zero(m.rows(), 1)));
    return out;
  };
  // M1(:, k, :) of a block nq x c from c matrices M(j, k).
  const auto stack = [&](std::initializer_list<const MatX*> parts, std::initializer_list<double> factors) {
    std::vector<MatX> out;
    if (std::all_of(parts.begin(), parts.end(), [](const MatX* m) { return m->size() == 0; })) return out;
    for (int k = 0; k < n; ++k) {
      MatX m = MatX::Zero(n, static_cast<int>(parts.size()));
      int c = 0;
      for (const MatX* part : parts) {
        if (part->size() > 0) m.col(c) = factors.begin()[c] * part->col(k);
        ++c;
      }
      out.push_back(std::move(m));
    }
    return out;
  };
  const auto zero = [&](const auto& m, int rows, int cols) { return m.size() > 0 ? MatX(m) : MatX(MatX::Zero(rows, cols)); };

  const Mat3X md1 = zero(body.md1, 3, n), Cr0 = zero(body.Cr0, 3, n);
  const Mat6X J1 = zero(body.J1, 6, n);
  sid.mdCM = make_sid_block(body.md0, columns(md1), n);
  sid.J = make_sid_block(body.J0, columns(J1), n);
  sid.Ct = make_sid_block(md1.transpose(), stack({&body.md2[0], &body.md2[1], &body.md2[2]}, {1, 1, 1}), n);
  sid.Cr = make_sid_block(Cr0.transpose(), stack({&body.Cr1[0], &body.Cr1[1], &body.Cr1[2]}, {1, 1, 1}), n);
  const MatX Me = zero(body.Me, n, n);
  sid.Me = make_sid_block(Me, {}, n, Me.isIdentity(0.0) ? 4 : 2);
  // Gr_j = -2 int skew(c) skew(phi_j) dm = J1_j - skew(Cr0_j); Ge_j(k, :) = 2 int (phi_j x phi_k) dm, the skew part of Cr1 twice.
  const Eigen::Index columns_of_three = 3 * static_cast<Eigen::Index>(n);
  MatX Gr = MatX::Zero(3, columns_of_three), Ge = MatX::Zero(n, columns_of_three);
  for (int j = 0; j < n; ++j) {
    Mat3 G = -skew(Cr0.col(j));
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        G(r, c) += J1(tensor_row[r][c], j);
        Gr(r, n * c + j) = G(r, c);
      }
  }
  for (int a = 0; a < 3; ++a)
    if (body.Cr1[a].size() > 0) Ge.middleCols(static_cast<Eigen::Index>(n) * a, n) = body.Cr1[a] - body.Cr1[a].transpose();
  sid.Gr = make_sid_block(Gr, {}, n);
  sid.Ge = make_sid_block(Ge, {}, n);
  MatX Oe = MatX::Zero(n, 6);
  for (int c = 0; c < 6; ++c) Oe.col(c) = -oe_factor[c] * J1.row(oe_row[c]).transpose();
  sid.Oe = make_sid_block(
      Oe, stack({&body.J2[0], &body.J2[1], &body.J2[2], &body.J2[3], &body.J2[5], &body.J2[4]}, {-0.5, -0.5, -0.5, -1, -1, -1}), n);
  sid.ksigma = make_sid_block(zero(body.ksigma, n, 1), {}, n);
  sid.Ke = make_sid_block(zero(body.Ke, n, n), {}, n, 2);
  const MatX De = zero(body.De, n, n);
  sid.De = make_sid_block(De, {}, n, De == De.transpose() ? 2 : 3);

  for (const FlexibleNode& source : body.nodes) {
    SidNode node;
    node.id = source.name.starts_with("node[") && source.name.ends_with("]") ? source.name.substr(5, source.name.size() - 6) : source.name;
    const Mat3X phi = zero(source.phi, 3, n), psi = zero(source.psi, 3, n);
    node.origin = make_sid_block(source.origin, columns(phi), n);
    std::vector<MatX> ap1;
    const auto by_mode = [n](const std::array<MatX, 3>& second) {
      std::vector<MatX> out;
      if (std::any_of(second.begin(), second.end(), [](const MatX& m) { return m.size() > 0; }))
        for (int k = 0; k < n; ++k) {
          MatX& m = out.emplace_back(MatX::Zero(3, n));
          for (int a = 0; a < 3; ++a)
            if (second[a].size() > 0) m.row(a) = second[a].row(k);
        }
      return out;
    };
    for (int k = 0; k < n; ++k) ap1.push_back(skew(psi.col(k)) * source.rotation);
    node.phi = make_sid_block(phi, by_mode(source.phi2), n);
    node.psi = make_sid_block(psi, by_mode(source.psi2), n);
    node.AP = make_sid_block(source.rotation, ap1, n);
    if (source.sigma.size() > 0) node.sigma = make_sid_block(MatX::Zero(6, 1), columns(source.sigma), n);
    sid.nodes.push_back(std::move(node));
  }
  return sid;
}

}  // namespace flexframe::sim
