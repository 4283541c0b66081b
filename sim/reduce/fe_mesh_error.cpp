// Error of a mesh from stress jumps and inertia between nodes. See fe_mesh_error.h.
#include "sim/reduce/fe_mesh_error.h"

#include "sim/reduce/dense_products.h"
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_integrals.h"
#include "sim/reduce/fe_solver.h"
#include "sim/reduce/fe_two_level.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace flexframe::sim {
namespace {

// Corners of solids and shells that are looked at: of a thousand the mean square is known to some ten per cent.
constexpr size_t sample = 1000;

// Mean square of the error of the stress over an element, by that at its corners. Along an element of linear shapes the error is odd about
// the middle, which makes it a third; of quadratic ones it would be a fifth, but much of their error lies where no two elements meet, at
// the corners of supports, so a third for these too. Elements of constant strain are too stiff all over, which their means do not show: all
// of it (bars of every kind of element against fine ones: REDUCE.md).
double share_of_corners(FeShape shape) {
  return shape == FeShape::tetrahedron4 || shape == FeShape::triangle3 || shape == FeShape::wedge6 ? 1.0 : 1.0 / 3.0;
}

int corner_count(FeShape shape) {
  switch (shape) {
    case FeShape::tetrahedron4:
    case FeShape::tetrahedron10:
    case FeShape::quadrangle4:
    case FeShape::quadrangle8:
      return 4;
    case FeShape::triangle3:
    case FeShape::triangle6:
      return 3;
    case FeShape::wedge6:
    case FeShape::wedge15:
      return 6;
    default:
      return 8;
  }
}

Mat3X element_nodes(const FeModel& model, const FeElement& e) {
  Mat3X X(3, e.count);
  for (int i = 0; i < e.count; ++i) X.col(i) = model.nodes[model.connectivity[e.first + i]];
  return X;
}

// What a solid or shell is integrated over: its volume, m^3; of shells a third of it, the mean square of what grows from the middle
// outward.
double weight_of(const FeModel& model, const FeElement& e) {
  const Mat3X X = element_nodes(model, e);
  double sum = 0.0;
  if (fe_is_solid(e.shape))
    for (const FePoint& p : solid_points(e.shape, e.formulation, FeRule::stiffness, X, e.id)) sum += p.volume;
  else
    for (const FeShellPoint& p : shell_points(e.shape, X, e.id)) sum += p.area * e.thickness;
  return sum;
}

bool has_stress(const FeModel& model, const FeElement& e) {
  if (fe_is_solid(e.shape)) return true;
  // The face of a laminate says nothing of its inner layers.
  return fe_is_shell(e.shape) && e.material >= 0 && (e.section < 0 || model.layups[e.section].layers.empty());
}

// What an element says at one of its corners.
struct Corner {
  int element = 0;
  double weight = 0.0;  // its share of the element, m^3
  MatX stress;          // Pa, 6 x m; of shells the membrane's
  MatX bending;         // of shells, on the face that their group's normal points to
};

// Stress is compared among elements of one material and thickness, of shells besides only among those that lie in one plane by ten degrees.
struct Group {
  int material = 0;
  double thickness = 0.0;
  Vec3 normal = Vec3::Zero();  // of shells
  std::vector<Corner> corners;
  bool takes(const FeElement& e, const Vec3& n) const {
    constexpr double same_plane = 0.985;
    return material == e.material && thickness == e.thickness && (n.isZero(0.0) || std::abs(n.dot(normal)) > same_plane);
  }
};

class StressJumps {
 public:
  StressJumps(const FeModel& m, const FeSystem& s, const MatX& u) : model(m), system(s), U(u), around(m.nodes.size()) {
    for (size_t i = 0; i < model.elements.size(); ++i) {
      const FeElement& e = model.elements[i];
      if (!has_stress(model, e)) continue;
      whole += weight_of(model, e);
      for (int k = 0; k < corner_count(e.shape); ++k) around[model.connectivity[e.first + k]].push_back(static_cast<int>(i));
    }
  }

  bool any() const { return whole > 0.0; }

  // Energy of the jumps per field (of unit modal mass: (rad/s)^2), twice. Corners of a single element tell nothing: what the others tell is
  // taken for all. nullopt: hardly any element has a neighbour.
  std::optional<VecX> energy() {
    std::vector<int> nodes;
    for (size_t n = 0; n < around.size(); ++n)
      if (!around[n].empty()) nodes.push_back(static_cast<int>(n));
    const size_t step = std::max<size_t>(1, (nodes.size() + sample - 1) / sample);
    VecX sum = VecX::Zero(U.cols());
    double seen = 0.0, all = 0.0;
    for (size_t k = 0; k < nodes.size(); k += step)
      for (const Group& g : groups_at(nodes[k])) {
        for (const Corner& c : g.corners) all += c.weight;
        if (g.corners.size() > 1) seen += add_group(g, sum);
      }
    if (seen < 0.2 * all) return std::nullopt;
    return sum * (whole / seen);
  }

 private:
  const FeModel& model;
  const FeSystem& system;
  const MatX& U;
  std::vector<std::vector<int>> around;     // elements at a corner
  double whole = 0.0;                       // m^3
  std::map<int, MatX> stresses, membranes;  // of the elements met
  std::map<std::pair<int, int>, Mat6> compliances;

  const MatX& stress_of(int element) {
    const auto [at, fresh] = stresses.try_emplace(element);
    if (fresh) at->second = element_stress(model, system, model.elements[element], U);
    return at->second;
  }

  // Of a shell: the stress of its motions in its plane.
  const MatX& membrane_of(int element) {
    const auto [at, fresh] = membranes.try_emplace(element);
    if (!fresh) return at->second;
    const FeElement& e = model.elements[element];
    // A curved shell's motion along the normal stretches it too: the mean of its faces.
    if (e.shape == FeShape::triangle6 || e.shape == FeShape::quadrangle8)
      return at->second = 0.5 * (stress_of(element) + element_stress(model, system, e, U, true));
    double area = 0.0;
    const Vec3 n = shell_axes(e.shape, element_nodes(model, e), e.id, area).col(2);
    MatX flat = MatX::Zero(U.rows(), U.cols());
    for (int i = 0; i < e.count; ++i) {
      const auto& dof = system.dof[model.connectivity[e.first + i]];
      const Eigen::RowVectorXd out = n.x() * U.row(dof[0]) + n.y() * U.row(dof[1]) + n.z() * U.row(dof[2]);
      for (int d = 0; d < 3; ++d) flat.row(dof[d]) = U.row(dof[d]) - n(d) * out;
    }
    return at->second = element_stress(model, system, e, flat);
  }

  const Mat6& compliance(const FeElement& e) {
    const auto [at, fresh] = compliances.try_emplace({e.material, e.axes});
    if (fresh) at->second = elasticity(material_in_space(model, e)).inverse();
    return at->second;
  }

  std::vector<Group> groups_at(int node) {
    std::vector<Group> groups;
    for (int index : around[node]) {
      const FeElement& e = model.elements[index];
      Vec3 normal = Vec3::Zero();
      if (fe_is_shell(e.shape)) {
        double area = 0.0;
        normal = shell_axes(e.shape, element_nodes(model, e), e.id, area).col(2);
      }
      auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.takes(e, normal); });
      if (group == groups.end()) group = groups.insert(groups.end(), {e.material, e.thickness, normal, {}});
      const int* nodes = &model.connectivity[e.first];
      const Eigen::Index place = std::find(nodes, nodes + e.count, node) - nodes;
      // The face that the normal points to is the other one where a shell looks the other way: so bending changes its sign.
      const double side = normal.dot(group->normal) < 0.0 ? -1.0 : 1.0;
      Corner corner{index, weight_of(model, e) / corner_count(e.shape), stress_of(index).middleRows(6 * place, 6), {}};
      if (fe_is_shell(e.shape)) {
        corner.bending = side * (corner.stress - membrane_of(index).middleRows(6 * place, 6));
        corner.stress = membrane_of(index).middleRows(6 * place, 6);
      }
      group->corners.push_back(std::move(corner));
    }
    return groups;
  }

  // Weight of the group's corners.
  double add_group(const Group& group, VecX& sum) {
    double weight = 0.0;
    const bool shells = group.corners[0].bending.size() > 0;
    MatX mean = MatX::Zero(6, U.cols()), bending = mean;
    for (const Corner& c : group.corners) {
      weight += c.weight;
      mean += c.weight * c.stress;
      if (shells) bending += c.weight * c.bending;
    }
    mean /= weight;
    bending /= weight;
    for (const Corner& c : group.corners) {
      const FeElement& e = model.elements[c.element];
      const Mat6& S = compliance(e);
      const auto add = [&](const MatX& jump, double share) {
        sum += c.weight * share * jump.cwiseProduct(S * jump).colwise().sum().transpose();
      };
      add(c.stress - mean, share_of_corners(e.shape));
      // Bending grows from the middle outward: its mean square is a third; its shapes are one degree higher than the membrane's.
      if (shells) add(c.bending - bending, 1.0 / 9.0);
    }
    return weight;
  }
};

// What inertia does to a beam or rod between its nodes: a load q held at both ends bends by energy q^2 L^5 / (720 E I), stretches by q^2
// L^3 / (12 E A), twice. u: motions of the two nodes, 12 x m.
VecX between_nodes(const FeBeamSection& s, const FeMaterial& m, const Mat3X& X, const MatX& u, const VecX& eigenvalues) {
  const double L = (X.col(1) - X.col(0)).norm(), mass = m.density * s.area + s.mass_per_length;
  const Vec3 t = (X.col(1) - X.col(0)) / L;
  const Vec3 n2 = t.cross(s.n1).stableNormalized(), n1 = n2.cross(t);
  // Mean square of what goes linearly from end to end.
  const auto square = [&](const Vec3& along) {
    const Eigen::RowVectorXd a = along.transpose() * u.middleRows(0, 3), b = along.transpose() * u.middleRows(6, 3);
    return VecX((a.cwiseAbs2() + a.cwiseProduct(b) + b.cwiseAbs2()).transpose() / 3.0);
  };
  const double E = m.youngs_modulus;
  VecX flexible = square(t) * (std::pow(L, 3) / (12.0 * E * s.area));
  if (!s.truss) flexible += (square(n1) / s.I22 + square(n2) / s.I11) * (std::pow(L, 5) / (720.0 * E));
  return eigenvalues.cwiseAbs2().cwiseProduct(flexible) * mass * mass;
}

}  // namespace

namespace {

// The squared frequency of the fine mesh's mode that is like the coarse mesh's mode k. like: shares of that in each of the fine ones, at
// the coarse nodes, where high modes look like low ones: the lowest is taken that has half of it, with those of the same frequency, which
// share their shapes anew. The one at its place where none is like it.
double value_of_twin(const VecX& like, const VecX& eigenvalues, Eigen::Index k) {
  constexpr double half = 0.5, equal = 0.05;
  for (Eigen::Index l = 0; l < eigenvalues.size(); ++l) {
    double whole = 0.0, sum = 0.0;
    for (Eigen::Index j = l; j < eigenvalues.size() && eigenvalues(j) < (1.0 + equal) * eigenvalues(l); ++j) {
      whole += like(j);
      sum += like(j) * eigenvalues(j);
    }
    if (whole > half) return sum / whole;
  }
  return eigenvalues(std::min(k, eigenvalues.size() - 1));
}

}  // namespace

namespace {

// Motions of the divided system by those of the system before.
SparseMatrix interpolation(const FeRefined& divided, const FeSystem& system, const FeSystem& fine) {
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](size_t node, int old, double share) {
    for (int d = 0; d < 6; ++d)
      if (fine.dof[node][d] >= 0 && system.dof[old][d] >= 0) entries.emplace_back(fine.dof[node][d], system.dof[old][d], share);
  };
  for (size_t n = 0; n < system.dof.size(); ++n) add(n, static_cast<int>(n), 1.0);
  for (const auto& [node, shares] : divided.shares)
    for (const auto& [old, share] : shares) add(static_cast<size_t>(node), old, share);
  SparseMatrix out(fine.size, system.size);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

// A mesh that has been divided, and its equations.
struct Divided {
  const FeRefined& mesh;
  const FeSystem& fine;
  const FeReduced& reduced;
};

std::optional<FeModes> modes_of_divided(const Divided& by, const FeSystem& system, const FeModes& modes, int wanted,
                                        const FeDivision& division) {
  const auto& [divided, fine, reduced] = by;
  const MatX rigid = free_rigid_motions(divided.model, fine, reduced, divided.held);
  if (division.coarse)
    return two_level_modes(*division.coarse, {reduced, rigid, interpolation(divided, system, fine)}, modes, wanted, division.ask);
  FeSolver solver(reduced, rigid, estimate_modes(divided.model, fine), division.threads, division.ask);
  solver.factorise();
  // Modes that the coarse mesh has above others may be below them: some more.
  const auto count = static_cast<int>(modes.eigenvalues.size());
  const int most = reduced.size() - static_cast<int>(rigid.cols());
  return solver.modes(std::min(count + 6, most), 0.0, MatX(reduced.size(), 0), {});
}

}  // namespace

std::optional<VecX> divided_mesh_error(const FeModel& model, const FeSystem& system, const FeReduced& coarse, const FeModes& modes,
                                       int wanted, const FeDivision& division) {
  std::optional<FeRefined> divided = refine(model, division.held, division.finer);
  for (int k = 1; k < division.times && divided; ++k) divided = refine(divided->model, divided->held);
  if (!divided) return std::nullopt;
  FeSystem fine = assemble(divided->model);
  const FeReduced reduced = eliminate(divided->model, fine, divided->held);
  if (division.coarse && !reduced.identity) {  // that has its own
    SparseMatrix().swap(fine.K);
    SparseMatrix().swap(fine.M);
  }
  const std::optional<FeModes> found = modes_of_divided({*divided, fine, reduced}, system, modes, wanted, division);
  if (!found) return std::nullopt;
  // At the nodes that both have, as fields of the coarse mesh.
  const MatX all = reduced.expand(found->vectors);
  MatX common = MatX::Zero(system.size, all.cols());
  for (size_t n = 0; n < system.dof.size(); ++n)
    for (int d = 0; d < 6; ++d)
      if (system.dof[n][d] >= 0) common.row(system.dof[n][d]) = all.row(fine.dof[n][d]);
  const MatX M_common = symmetric_product(system.M, common);
  const VecX length = common.cwiseProduct(M_common).colwise().sum().cwiseSqrt();
  const MatX like = (product_tn(coarse.expand(modes.vectors), M_common) * length.cwiseInverse().asDiagonal()).cwiseAbs2();
  VecX out(modes.eigenvalues.size());
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    const double fine_value = value_of_twin(VecX(like.row(k)), found->eigenvalues, k);
    // Half the size leaves a quarter of the error: what is seen is three quarters of it (fifteen sixteenths of a mesh divided twice), of
    // its logarithm where it is large. Quadratic elements leave little of the error of linear ones.
    const double left = divided->raised ? 0.0 : std::pow(0.25, division.times);
    out(k) = std::abs(std::pow(modes.eigenvalues(k) / fine_value, 0.5 / (1.0 - left)) - 1.0);
  }
  return out;
}

std::optional<VecX> mesh_error(const FeModel& model, const FeSystem& system, const MatX& U, const VecX& eigenvalues) {
  if (model.matrices) return std::nullopt;
  VecX stiff = VecX::Zero(U.cols()), inertia = stiff;
  bool any = false;
  if (StressJumps jumps(model, system, U); jumps.any()) {
    const std::optional<VecX> found = jumps.energy();
    if (found) stiff = found->cwiseQuotient(eigenvalues);
    else stiff.setConstant(std::numeric_limits<double>::infinity());
    any = true;
  }
  for (const FeElement& e : model.elements) {
    if (e.shape != FeShape::beam2 || e.section < 0 || e.material < 0) continue;
    const FeBeamSection& section = model.beam_sections[e.section];
    if (!(section.I11 > 0.0 && section.I22 > 0.0) && !section.truss) continue;
    MatX u = MatX::Zero(12, U.cols());
    for (int i = 0; i < 2; ++i)
      for (int d = 0; d < 3; ++d)
        if (const int row = system.dof[model.connectivity[e.first + i]][d]; row >= 0) u.row(6 * i + d) = U.row(row);
    inertia += between_nodes(section, model.materials[e.material], element_nodes(model, e), u, eigenvalues);
    any = true;
  }
  if (!any) return std::nullopt;
  inertia = inertia.cwiseQuotient(eigenvalues);
  VecX out(U.cols());
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    // Shares of the mode's energy that a fine mesh would not have. Nine tenths: where the estimate says no more than that it is lost.
    const double share = std::min(0.9, stiff(k) + inertia(k) / (1.0 + inertia(k)));
    out(k) = std::isfinite(stiff(k)) ? 1.0 / std::sqrt(1.0 - share) - 1.0 : stiff(k);
  }
  return out;
}

VecX hourglass_shares(const FeModel& model, const FeSystem& system, const MatX& U, const VecX& eigenvalues) {
  VecX out = VecX::Zero(U.cols());
  if (model.matrices) return out;
  for (const FeElement& e : model.elements) {
    if (!fe_is_held_by_share(e.shape, e.formulation) || e.material < 0) continue;
    MatX u = MatX::Zero(3 * Eigen::Index{e.count}, U.cols());
    for (int i = 0; i < e.count; ++i)
      for (int d = 0; d < 3; ++d)
        if (const int row = system.dof[model.connectivity[e.first + i]][d]; row >= 0) u.row(3 * Eigen::Index{i} + d) = U.row(row);
    out += hourglass_energy(e.shape, element_nodes(model, e), model.materials[e.material], e.id, u);
  }
  return out.cwiseQuotient(eigenvalues);
}

}  // namespace flexframe::sim
