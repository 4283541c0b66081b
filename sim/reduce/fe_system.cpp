// Numbering, assembly, elimination. See fe_system.h.
#include "sim/reduce/fe_system.h"

#include "sim/base/eigen_solvers.h"
#include "sim/base/spatial.h"
#include "sim/base/wide.h"
#include "sim/reduce/dense_products.h"
#include "sim/reduce/fe_attachment.h"
#include "sim/reduce/fe_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

namespace flexframe::sim {
namespace {

// Neighbours b >= a of each node a, ascending, in one array.
struct Neighbours {
  std::vector<long> begin;
  std::vector<int> node;
  long find(int a, int b) const { return std::lower_bound(node.begin() + begin[a], node.begin() + begin[a + 1], b) - node.begin(); }
};

Neighbours neighbours(const FeModel& model) {
  const int nodes = static_cast<int>(model.nodes.size());
  // Elements of each node.
  std::vector<long> first(nodes + 1, 0);
  for (int n : model.connectivity) ++first[n + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<int> elements(model.connectivity.size());
  std::vector<long> at(first.begin(), first.end() - 1);
  for (size_t e = 0; e < model.elements.size(); ++e)
    for (int i = 0; i < model.elements[e].count; ++i) elements[at[model.connectivity[model.elements[e].first + i]]++] = static_cast<int>(e);
  Neighbours out;
  out.begin.assign(1, 0);
  std::vector<int> seen(nodes, -1);
  for (int a = 0; a < nodes; ++a) {
    const size_t start = out.node.size();
    for (long k = first[a]; k < first[a + 1]; ++k) {
      const FeElement& e = model.elements[elements[k]];
      for (int i = 0; i < e.count; ++i) {
        const int b = model.connectivity[e.first + i];
        if (b >= a && seen[b] != a) {
          seen[b] = a;
          out.node.push_back(b);
        }
      }
    }
    std::sort(out.node.begin() + start, out.node.end());
    out.begin.push_back(static_cast<long>(out.node.size()));
  }
  return out;
}

int motions_of(const std::array<int, 6>& dof) { return dof[0] < 0 ? 0 : dof[3] < 0 ? 3 : 6; }

// Compressed columns with exact room: `width(a, b)` rows of node b in each column of node a.
struct Layout {
  SparseMatrix matrix;
  std::vector<long> start;  // per neighbour entry: place within a column of node a of the first row of node b
};

Layout full_layout(const FeSystem& s, const Neighbours& nb, bool same_direction_only) {
  Layout out;
  out.matrix.resize(s.size, s.size);
  out.start.resize(nb.node.size());
  const int nodes = static_cast<int>(s.dof.size());
  std::vector<int> column(s.size + 1, 0);
  long total = 0;
  for (int a = 0; a < nodes; ++a) {
    const int ma = motions_of(s.dof[a]);
    for (int d = 0; d < ma; ++d) {
      long rows = 0;
      for (long k = nb.begin[a]; k < nb.begin[a + 1]; ++k) {
        const int b = nb.node[k], mb = motions_of(s.dof[b]);
        if (same_direction_only) rows += d < mb ? 1 : 0;
        else rows += b == a ? mb - d : mb;
      }
      total += rows;
      if (total > std::numeric_limits<int>::max()) throw SimulationError("the model's matrices have more than 2^31 entries");
      column[s.dof[a][d] + 1] = static_cast<int>(total);
    }
  }
  out.matrix.resizeNonZeros(total);
  std::copy(column.begin(), column.end(), out.matrix.outerIndexPtr());
  int* inner = out.matrix.innerIndexPtr();
  for (int a = 0; a < nodes; ++a) {
    const int ma = motions_of(s.dof[a]);
    for (int d = 0; d < ma; ++d) {
      long place = column[s.dof[a][d]];
      for (long k = nb.begin[a]; k < nb.begin[a + 1]; ++k) {
        const int b = nb.node[k], mb = motions_of(s.dof[b]);
        if (d == 0) out.start[k] = place - column[s.dof[a][0]];
        if (same_direction_only) {
          if (d < mb) inner[place++] = s.dof[b][d];
        } else {
          for (int r = b == a ? d : 0; r < mb; ++r) inner[place++] = s.dof[b][r];
        }
      }
    }
  }
  std::fill(out.matrix.valuePtr(), out.matrix.valuePtr() + total, 0.0);
  return out;
}

FeSystem from_matrices(const FeModel& model) {
  const FeMatrices& given = *model.matrices;
  FeSystem s;
  s.dof.assign(model.nodes.size(), {-1, -1, -1, -1, -1, -1});
  s.size = static_cast<int>(given.node.size());
  for (int i = 0; i < s.size; ++i) s.dof[given.node[i]][given.dof[i]] = i;
  s.K = given.K.triangularView<Eigen::Lower>();
  s.M = given.M.triangularView<Eigen::Lower>();
  // Reference points of rigid spiders have motions of their own; their stiffness and mass come from the nodes they hold.
  for (const FeSpider& spider : model.spiders)
    if (spider.rigid)
      for (int d = 0; d < 6; ++d)
        if (s.dof[spider.node][d] < 0) s.dof[spider.node][d] = s.size++;
  s.K.conservativeResize(s.size, s.size);
  s.M.conservativeResize(s.size, s.size);
  return s;
}

}  // namespace

namespace {

// Whether an element's nodes have rotations.
bool turns(const FeModel& model, const FeElement& e) {
  if (e.shape == FeShape::beam2) return model.beam_sections[e.section].turns();
  if (e.shape == FeShape::lumped) return model.lumps[e.section].turns;
  return fe_is_shell(e.shape);
}

// Matrices of elements whose mass couples directions.
struct Blocks {
  std::vector<Eigen::Triplet<double>> K, M, lumped;
};

// Solids: M is nodes x nodes, the factor of the identity; shells, beams and lumps: all motions.
void element_matrices(const FeModel& model, const FeElement& e, const Mat3X& X, MatX& K, MatX& M) {
  if (e.shape == FeShape::point_mass) {
    K.setZero(3, 3);
    M.setConstant(1, 1, e.thickness);
  } else if (e.shape == FeShape::lumped) {
    K = model.lumps[e.section].K;
    M = model.lumps[e.section].M;
  } else if (e.shape == FeShape::beam2) {
    beam_matrices(model.beam_sections[e.section], model.materials[e.material], X, e.id, K, M);
  } else if (e.shape == FeShape::triangle6 || e.shape == FeShape::quadrangle8) {
    curved_shell_matrices(
        e.shape, X, [&](const Mat3& Q, const VecX& N) { return shell_law_at(model, e, Q, N); }, e.id, K, M);
  } else if (fe_is_shell(e.shape)) {
    double area = 0.0;
    shell_matrices(e.shape, X, shell_law(model, e, shell_axes(e.shape, X, e.id, area)), e.id, K, M);
  } else {
    const FeMaterial& given = model.materials[e.material];
    if (given.elasticity && e.axes >= 0) solid_stiffness(e.shape, e.formulation, X, material_in_space(model, e), e.id, K);
    else solid_stiffness(e.shape, e.formulation, X, given, e.id, K);
    solid_mass(e.shape, e.formulation, X, given, e.id, M);
  }
}

void add_blocks(const FeModel& model, const FeSystem& s, const FeElement& e, const MatX& Ke, const MatX& Me, Blocks& out) {
  const int per_node = static_cast<int>(Ke.rows()) / e.count;
  for (int i = 0; i < e.count; ++i)
    for (int j = 0; j < e.count; ++j)
      for (int a = 0; a < per_node; ++a)
        for (int b = 0; b < per_node; ++b) {
          const int row = s.dof[model.connectivity[e.first + i]][a], column = s.dof[model.connectivity[e.first + j]][b];
          // A truss has zeros where its nodes have no rotations.
          if (row < 0 || column < 0 || row < column) continue;
          if (const double k = Ke(per_node * i + a, per_node * j + b); k != 0.0) {
            out.K.emplace_back(row, column, k);
            if (e.shape == FeShape::lumped) out.lumped.emplace_back(row, column, k);
          }
          if (const double m = Me(per_node * i + a, per_node * j + b); m != 0.0) out.M.emplace_back(row, column, m);
        }
}

// What couples a node's rotations in the mass of a flat shell that is inclined: the layout has like directions only.
void add_turning_mass(const FeModel& model, const FeSystem& s, const FeElement& e, const MatX& Me, Blocks& out) {
  for (int i = 0; i < e.count; ++i) {
    const std::array<int, 6>& dof = s.dof[model.connectivity[e.first + i]];
    const double scale = Me.diagonal().segment<3>(6 * i + 3).maxCoeff();
    for (int a = 3; a < 6; ++a)
      for (int b = 3; b < a; ++b)
        if (const double m = Me(6 * i + a, 6 * i + b); std::abs(m) > 1e-12 * scale) out.M.emplace_back(dof[a], dof[b], m);
  }
}

void add_to(SparseMatrix& matrix, const std::vector<Eigen::Triplet<double>>& triplets) {
  if (triplets.empty()) return;
  SparseMatrix more(matrix.rows(), matrix.cols());
  more.setFromTriplets(triplets.begin(), triplets.end());
  matrix = SparseMatrix(matrix + more);
}

}  // namespace

FeSystem assemble(const FeModel& model) {
  if (model.matrices) return from_matrices(model);
  FeSystem s;
  const size_t nodes = model.nodes.size();
  std::vector<int> motions(nodes, 0);
  for (const FeElement& e : model.elements)
    for (int i = 0; i < e.count; ++i) {
      int& m = motions[model.connectivity[e.first + i]];
      m = std::max(m, turns(model, e) ? 6 : 3);
    }
  for (const FeSpider& spider : model.spiders)
    if (spider.rigid || motions[spider.node] > 0) motions[spider.node] = 6;
  // A node that only equations name has the motions that they name.
  for (const FeEquation& equation : model.equations)
    for (const FeEquation::Term& t : equation.terms) motions[t.node] = std::max(motions[t.node], t.dof < 3 ? 3 : 6);
  s.dof.assign(nodes, {-1, -1, -1, -1, -1, -1});
  for (size_t i = 0; i < nodes; ++i)
    for (int d = 0; d < motions[i]; ++d) s.dof[i][d] = s.size++;

  const Neighbours nb = neighbours(model);
  Layout K = full_layout(s, nb, false), M = full_layout(s, nb, true);

  MatX Ke, Me;
  Mat3X X;
  Blocks blocks;
  for (const FeElement& e : model.elements) {
    X.resize(3, e.count);
    for (int i = 0; i < e.count; ++i) X.col(i) = model.nodes[model.connectivity[e.first + i]];
    const bool shell = fe_is_shell(e.shape);
    const int per_node = turns(model, e) ? 6 : 3;
    try {
      element_matrices(model, e, X, Ke, Me);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", place_of(model, e), error.what()));
    }
    // Flat shells have a mass of each node by itself unless their nodes lie beside the middle, all others one that couples like directions
    // only.
    const bool curved = e.shape == FeShape::triangle6 || e.shape == FeShape::quadrangle8;
    const bool beside = shell && e.section >= 0;
    if (e.shape == FeShape::beam2 || e.shape == FeShape::lumped) {
      add_blocks(model, s, e, Ke, Me, blocks);
      continue;
    }
    if (curved || beside) add_blocks(model, s, e, MatX::Zero(6 * e.count, 6 * e.count), Me, blocks);
    else if (shell) add_turning_mass(model, s, e, Me, blocks);
    for (int i = 0; i < e.count; ++i)
      for (int j = 0; j < e.count; ++j) {
        const int a = model.connectivity[e.first + j], b = model.connectivity[e.first + i];  // column, row
        if (b < a) continue;
        const long k = nb.find(a, b);
        for (int d = 0; d < per_node; ++d) {
          double* column = K.matrix.valuePtr() + K.matrix.outerIndexPtr()[s.dof[a][d]];
          if (a == b) {
            // The node's own block comes first and is triangular.
            for (int r = d; r < per_node; ++r) column[r - d] += Ke(per_node * i + r, per_node * j + d);
          } else {
            // Columns d > 0 of the node lack d rows of its own block.
            double* rows = column + K.start[k] - d;
            for (int r = 0; r < per_node; ++r) rows[r] += Ke(per_node * i + r, per_node * j + d);
          }
          if (curved || beside) continue;
          if (shell) {
            if (a == b && i == j) M.matrix.valuePtr()[M.matrix.outerIndexPtr()[s.dof[a][d]]] += Me(6 * i + d, 6 * i + d);
          } else {
            // Every neighbour has translations: one row a neighbour.
            M.matrix.valuePtr()[M.matrix.outerIndexPtr()[s.dof[a][d]] + (k - nb.begin[a])] += Me(i, j);
          }
        }
      }
  }
  // Eigen 3.4 has no moves for sparse matrices.
  s.K.swap(K.matrix);
  s.M.swap(M.matrix);
  add_to(s.K, blocks.K);
  add_to(s.M, blocks.M);
  if (!blocks.lumped.empty()) {
    s.lumped_K.resize(s.size, s.size);
    s.lumped_K.setFromTriplets(blocks.lumped.begin(), blocks.lumped.end());
  }
  return s;
}

namespace {

using Terms = std::vector<std::pair<int, double>>;  // motion, coefficient

// Motions that are given by others, one equation after the other.
class Dependents {
 public:
  explicit Dependents(int size) : row(size) {}

  bool known(int dof) const { return row[dof].has_value(); }
  void give(int dof, Terms terms) { row[dof] = std::move(terms); }

  // Sum of the terms is zero. The first motion is the one taken out, where it is still free and its coefficient no rounding; else the one
  // of the largest coefficient.
  void equation(const Terms& terms) {
    double largest = 0.0;
    for (const auto& [dof, c] : terms) largest = std::max(largest, std::abs(c));
    const Terms free = in_free(terms);
    int pivot = -1;
    double best = 0.0;
    for (size_t i = 0; i < free.size(); ++i)
      if (std::abs(free[i].second) > best) {
        best = std::abs(free[i].second);
        pivot = static_cast<int>(i);
      }
    // What is left of an equation that follows from those before is rounding.
    if (best <= 1e-9 * largest) return;
    for (size_t i = 0; i < free.size(); ++i)
      if (free[i].first == terms[0].first && std::abs(free[i].second) > 1e-3 * best) pivot = static_cast<int>(i);
    Terms out;
    for (size_t i = 0; i < free.size(); ++i)
      if (static_cast<int>(i) != pivot && std::abs(free[i].second) > 1e-14 * best)
        out.emplace_back(free[i].first, -free[i].second / free[pivot].second);
    give(free[pivot].first, std::move(out));
  }

  // The terms in motions that are not given by others. A motion given later than the one that names it is looked up in turn; what is found
  // is kept, so that each row is worked out once.
  Terms in_free(const Terms& terms) {
    std::map<int, double> sum;
    for (const auto& [dof, c] : terms) {
      if (!known(dof)) {
        sum[dof] += c;
        continue;
      }
      for (const auto& [other, factor] : settled(dof)) sum[other] += c * factor;
    }
    Terms out;
    for (const auto& [dof, c] : sum)
      if (c != 0.0) out.emplace_back(dof, c);
    return out;
  }

  const Terms& settled(int dof) {
    Terms& own = *row[dof];
    bool open = false;
    for (const auto& [other, factor] : own) open = open || known(other);
    if (open) {
      const Terms as_given = std::move(own);
      own = in_free(as_given);
    }
    return own;
  }

 private:
  std::vector<std::optional<Terms>> row;
};

// The motion along a direction as terms; one that the node does not have is left out.
Terms support_terms(const FeSystem& system, const FeConstraint& c) {
  Terms out;
  if (c.direction.isZero(0.0)) {
    if (system.dof[c.node][c.dof] >= 0) out.emplace_back(system.dof[c.node][c.dof], 1.0);
    return out;
  }
  for (int d = 0; d < 3; ++d)
    if (const int row = system.dof[c.node][(c.dof < 3 ? 0 : 3) + d]; row >= 0 && c.direction(d) != 0.0)
      out.emplace_back(row, c.direction(d));
  return out;
}

Terms equation_terms(const FeModel& model, const FeSystem& system, const FeEquation& equation) {
  Terms out;
  for (const FeEquation::Term& t : equation.terms) {
    if (t.coefficient == 0.0) continue;
    const int row = system.dof[t.node][t.dof];
    if (row < 0)
      throw InputError(fmt::format("{}{}: an equation names motion {} of node {}, which has none", model.file,
                                   equation.line > 0 ? fmt::format(":{}", equation.line) : "", t.dof + 1, model.node_ids[t.node]));
    out.emplace_back(row, t.coefficient);
  }
  return out;
}

// Motion d of the arm's end by those of the reference point: u = u_m + theta x r.
Terms arm_terms(const FeSystem& system, const FeArm& arm, int d) {
  const std::array<int, 6>& from = system.dof[arm.reference];
  if (d >= 3) return {{from[d], 1.0}};
  const Mat3 turn = -skew(arm.arm);
  Terms out = {{from[d], 1.0}};
  for (int k = 0; k < 3; ++k)
    if (turn(d, k) != 0.0) out.emplace_back(from[3 + k], turn(d, k));
  return out;
}

// T and the matrices in the motions that are left.
void condense(const FeModel& model, const FeSystem& system, Dependents& dependents, FeReduced& out) {
  std::vector<int> column(system.size, -1);
  int count = 0;
  std::vector<Eigen::Triplet<double>> terms;
  out.own.clear();
  for (int d = 0; d < system.size; ++d)
    if (!dependents.known(d)) {
      terms.emplace_back(d, count, 1.0);
      out.own.push_back(d);
      column[d] = count++;
    }
  for (int d = 0; d < system.size; ++d)
    if (dependents.known(d))
      for (const auto& [other, factor] : dependents.settled(d)) terms.emplace_back(d, column[other], factor);
  if (count == 0) throw InputError(fmt::format("{}: supports and equations hold every motion of the model", model.file));
  out.T.resize(system.size, count);
  out.T.setFromTriplets(terms.begin(), terms.end());
  const bool held_alone = terms.size() == static_cast<size_t>(count);  // every motion that is left is the system's own
  const auto picked = [&](const SparseMatrix& lower) {
    SparseMatrix small(count, count);
    small.reserve(lower.nonZeros());
    for (int c = 0; c < count; ++c) {
      small.startVec(c);
      for (SparseMatrix::InnerIterator it(lower, out.own[c]); it; ++it)
        if (column[it.row()] >= 0) small.insertBack(column[it.row()], c) = it.value();
    }
    small.finalize();
    return small;
  };
  const auto project = [&](const SparseMatrix& lower) {
    if (held_alone) return picked(lower);
    const SparseMatrix full = lower.selfadjointView<Eigen::Lower>();
    const SparseMatrix half = full * out.T;
    const SparseMatrix small = out.T.transpose() * half;
    return SparseMatrix(small.triangularView<Eigen::Lower>());
  };
  out.small_K = project(system.K);
  out.small_M = project(system.M);
}

// A motion of a node that does nothing, and what holds it: `by` is one in `motion`.
struct Idle {
  int node = -1;
  Terms motion, by;
};

// Motions of a node, of those in `own`, that have neither stiffness nor mass. K is positive semi-definite: where a node's own block has no
// stiffness in a direction the whole row has none. Turns are measured by the length that makes them as stiff as translations.
void add_idle(int node, const std::vector<int>& own, const std::vector<bool>& turns, const std::vector<int>& column,
              const FeReduced& reduced, std::vector<Idle>& out) {
  const auto size = static_cast<Eigen::Index>(own.size());
  MatX K = MatX::Zero(size, size), M = K;
  double moved = 0.0, turned = 0.0;
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const int row = std::max(column[own[i]], column[own[j]]), col = std::min(column[own[i]], column[own[j]]);
      K(i, j) = K(j, i) = reduced.K().coeff(row, col);
      M(i, j) = M(j, i) = reduced.M().coeff(row, col);
    }
    double& largest = turns[i] ? turned : moved;
    largest = std::max(largest, K(i, i));
  }
  const double length = moved > 0.0 && turned > 0.0 ? std::sqrt(turned / moved) : 1.0;
  VecX scale = VecX::Ones(size);
  for (Eigen::Index i = 0; i < size; ++i)
    if (turns[i]) scale(i) = 1.0 / length;
  K = (scale.asDiagonal() * K * scale.asDiagonal()).eval();
  M = (scale.asDiagonal() * M * scale.asDiagonal()).eval();
  // What beams in other directions leave here is rounding.
  const SymmetricEigen eigen(K);
  const double least_K = 1e-13 * K.cwiseAbs().maxCoeff(), least_M = 1e-13 * M.cwiseAbs().maxCoeff();
  for (Eigen::Index k = 0; k < size && eigen.eigenvalues()(k) <= least_K; ++k) {
    const VecX v = eigen.eigenvectors().col(k);
    if (v.dot(M * v) > least_M) continue;
    Idle& idle = out.emplace_back();
    idle.node = node;
    for (Eigen::Index i = 0; i < size; ++i) {
      if (std::abs(v(i)) <= 1e-9) continue;
      idle.motion.emplace_back(own[i], v(i) * scale(i));
      idle.by.emplace_back(own[i], v(i) / scale(i));
    }
  }
}

// Of all nodes that may have some: rotations, and of reference points and nodes in equations all six motions together, since a point beside
// a line of nodes that it carries moves as it turns about that line. Translations of nodes of elements always have stiffness and mass.
std::vector<Idle> idle_motions(const FeModel& model, const FeSystem& system, const FeReduced& reduced) {
  std::vector<bool> asked(model.nodes.size(), false);
  for (const FeSpider& spider : model.spiders) asked[spider.node] = true;
  for (const FeEquation& equation : model.equations)
    for (const FeEquation::Term& t : equation.terms) asked[t.node] = true;
  std::vector<int> column(system.size, -1);
  for (int c = 0; c < reduced.size(); ++c) column[reduced.identity ? c : reduced.own[c]] = c;
  std::vector<Idle> out;
  for (size_t n = 0; n < model.nodes.size(); ++n) {
    std::vector<int> own;  // motions of the system that are left
    std::vector<bool> turns;
    for (int d = asked[n] ? 0 : 3; d < 6; ++d) {
      if (system.dof[n][d] < 0 || column[system.dof[n][d]] < 0) continue;
      own.push_back(system.dof[n][d]);
      turns.push_back(d >= 3);
    }
    if (!own.empty()) add_idle(static_cast<int>(n), own, turns, column, reduced, out);
  }
  return out;
}

}  // namespace

FeReduced eliminate(const FeModel& model, const FeSystem& system, const std::vector<FeConstraint>& held) {
  FeReduced out;
  out.system = &system;
  Dependents dependents(system.size);
  std::vector<Terms> later;  // a node tied twice: the second tie is an equation like others
  bool tied = false;
  for (const FeSpider& spider : model.spiders) {
    if (!spider.rigid) {
      // Where the reference point has motions of its own (a mass, a spring hangs on it) they are those of the fit.
      if (!moves(system.dof[spider.node])) continue;
      const FeAttachment fit = averaging_attachment(model, system, spider);
      for (int d = 0; d < 6; ++d) {
        if (system.dof[spider.node][d] < 0) continue;
        Terms terms = {{system.dof[spider.node][d], -1.0}};
        for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(fit.motion, d); it; ++it)
          terms.emplace_back(static_cast<int>(it.col()), it.value());
        later.push_back(std::move(terms));
      }
      continue;
    }
    for (int slave : spider.slaves) {
      if (system.dof[slave][0] < 0 || slave == spider.node) continue;
      const FeArm arm{slave, spider.node, model.nodes[slave] - model.nodes[spider.node]};
      tied = true;
      if (!dependents.known(system.dof[slave][0])) out.arms.push_back(arm);
      for (int d = 0; d < 6; ++d) {
        const int row = system.dof[slave][d];
        if (row < 0) continue;
        Terms terms = arm_terms(system, arm, d);
        // A reference point that is itself tied to what it carries would go round in circles: as an equation it does not.
        const bool own = dependents.known(system.dof[spider.node][0]);
        if (!own && !dependents.known(row)) {
          dependents.give(row, std::move(terms));
        } else {
          terms.insert(terms.begin(), {row, -1.0});
          later.push_back(std::move(terms));
        }
      }
    }
  }
  for (const FeEquation& equation : model.equations) later.push_back(equation_terms(model, system, equation));
  if (!tied && held.empty() && later.empty() && idle_motions(model, system, out).empty()) return out;
  out.identity = false;
  for (const FeConstraint& c : held)
    if (const Terms terms = support_terms(system, c); !terms.empty()) dependents.equation(terms);
  for (const Terms& terms : later)
    if (!terms.empty()) dependents.equation(terms);
  condense(model, system, dependents, out);
  if (std::vector<Idle> idle = idle_motions(model, system, out); !idle.empty()) {
    for (Idle& i : idle) {
      dependents.equation(i.by);
      out.idle.push_back(i.node);
      out.idle_motions.emplace_back(std::move(i.motion), std::move(i.by));
    }
    condense(model, system, dependents, out);
  }
  if (!out.arms.empty()) {
    std::vector<Eigen::Triplet<double>> pick;
    for (size_t i = 0; i < out.arms.size(); ++i)
      for (int d = 0; d < 3; ++d) pick.emplace_back(system.dof[out.arms[i].node][d], static_cast<int>(3 * i) + d, 1.0);
    SparseMatrix columns(system.size, 3 * static_cast<Eigen::Index>(out.arms.size()));
    columns.setFromTriplets(pick.begin(), pick.end());
    const SparseMatrix full = system.K.selfadjointView<Eigen::Lower>();
    out.arm_K = full * columns;
  }
  return out;
}

namespace {

// Rigid motions, rotations over `size`, that springs to the ground hold: they cost energy; against what the springs' diagonals alone would
// cost, most is rounding.
std::vector<Vec6> ground_rows(const FeSystem& system, const MatX& R, double size) {
  std::vector<Vec6> out;
  if (system.lumped_K.size() == 0) return out;
  MatX unit = R;
  unit.rightCols(3) /= size;
  const MatX energy = unit.transpose() * symmetric_product(system.lumped_K, unit);
  const double alone = (system.lumped_K.diagonal().transpose() * unit.cwiseAbs2()).maxCoeff();
  if (!(alone > 0.0)) return out;
  const SymmetricEigen eigen(0.5 / alone * (energy + energy.transpose()));
  for (int k = 0; k < 6; ++k)
    if (eigen.eigenvalues()(k) > 1e-9) out.emplace_back(eigen.eigenvectors().col(k));
  return out;
}

// Of the model about the origin.
double reach(const FeModel& model) {
  double size = 1e-300;
  for (const Vec3& x : model.nodes) size = std::max(size, x.norm());
  return size;
}

}  // namespace

bool has_ground_springs(const FeModel& model, const FeSystem& system) {
  return !ground_rows(system, rigid_motions(model, system), reach(model)).empty();
}

MatX rigid_residuals(const FeModel& model, const FeSystem& system, const std::vector<FeConstraint>& held, double size) {
  const MatX R = rigid_motions(model, system);
  std::vector<Vec6> rows;
  const auto add = [&](const Terms& terms) {
    double largest = 0.0;
    Vec6 r = Vec6::Zero();
    for (const auto& [dof, c] : terms) {
      r += c * R.row(dof).transpose();
      largest = std::max(largest, std::abs(c));
    }
    if (!(largest > 0.0)) return;
    r /= largest;
    r.tail<3>() /= size;
    rows.push_back(r);
  };
  for (const FeConstraint& c : held) add(support_terms(system, c));
  for (const FeEquation& equation : model.equations) add(equation_terms(model, system, equation));
  for (const Vec6& held_by_springs : ground_rows(system, R, size)) rows.push_back(held_by_springs);
  MatX out(rows.size(), 6);
  for (size_t k = 0; k < rows.size(); ++k) out.row(static_cast<Eigen::Index>(k)) = rows[k].transpose();
  return out;
}

MatX free_rigid_motions(const FeModel& model, const FeSystem& system, const FeReduced& reduced, const std::vector<FeConstraint>& held) {
  const MatX R = rigid_motions(model, system);
  // Translations and rotations alike, so that one tolerance serves.
  const double size = reach(model);
  const MatX rows = rigid_residuals(model, system, held, size);
  const MatX G = rows.transpose() * rows;
  MatX combinations = MatX::Identity(6, 6);
  if (model.matrices && rows.rows() == 0) {
    // Supports may be in the matrices: rigid is what costs no energy, against the energy the same motion would have if every unknown moved
    // alone.
    MatX unit = R;
    unit.rightCols(3) /= size;
    const MatX energy = product_tn(unit, symmetric_product(system.K, unit));
    const double alone = (system.K.diagonal().transpose() * unit.cwiseAbs2()).maxCoeff();
    SymmetricEigen eigen(0.5 * (energy + energy.transpose()));
    int count = 0;
    while (count < 6 && eigen.eigenvalues()(count) <= 1e-9 * alone) ++count;
    if (count < 6) combinations = eigen.eigenvectors().leftCols(count);
    if (count < 6) combinations.bottomRows(3) /= size;
  } else if (rows.rows() > 0) {
    // Residuals are of the order of one: where all are rounding nothing is held.
    SymmetricEigen eigen(G);
    int count = 0;
    while (count < 6 && eigen.eigenvalues()(count) <= 1e-10 * std::max(1.0, eigen.eigenvalues()(5))) ++count;
    combinations = eigen.eigenvectors().leftCols(count);
    combinations.bottomRows(3) /= size;
  }
  MatX full = R * combinations;
  if (reduced.identity) return full;
  // What is held of motions that do nothing is zero in rigid motions too.
  for (const auto& [motion, by] : reduced.idle_motions) {
    Eigen::RowVectorXd held_of = Eigen::RowVectorXd::Zero(full.cols());
    for (const auto& [dof, c] : by) held_of += c * full.row(dof);
    for (const auto& [dof, c] : motion) full.row(dof) -= c * held_of;
  }
  MatX q(reduced.size(), full.cols());
  for (int c = 0; c < reduced.size(); ++c) q.row(c) = full.row(reduced.own[c]);
  return q;
}

namespace {

constexpr int product_width = 8;

// Eight columns laid out row by row: the matrix is read once for all of them. Built for each vector unit; sums in the same order, without
// fused products: the same bits.
FLEXFRAME_WIDEST
void multiply_lower(long n, const int* outer, const int* inner, const double* value, const double* in, double* out) {
  for (long c = 0; c < n; ++c) {
    double xc[product_width], yc[product_width] = {};
    for (int j = 0; j < product_width; ++j) xc[j] = in[c * product_width + j];
    for (int k = outer[c]; k < outer[c + 1]; ++k) {
      const long r = inner[k];
      const double v = value[k];
      const double* source = in + r * product_width;
      for (int j = 0; j < product_width; ++j) yc[j] += v * source[j];
      if (r == c) continue;
      double* target = out + r * product_width;
      for (int j = 0; j < product_width; ++j) target[j] += v * xc[j];
    }
    double* target = out + c * product_width;
    for (int j = 0; j < product_width; ++j) target[j] += yc[j];
  }
}

}  // namespace

MatX symmetric_product(const SparseMatrix& lower, const MatX& x) {
  const Eigen::Index n = x.rows();
  MatX y(n, x.cols());
  // Kept between calls: fresh pages cost as much as the product itself.
  thread_local std::vector<double> in, out;
  if (x.cols() > 1 && in.size() < static_cast<size_t>(n) * product_width) {
    in.resize(static_cast<size_t>(n) * product_width);
    out.resize(in.size());
  }
  // Rows in strips that stay in the nearest cache while they are turned.
  constexpr Eigen::Index strip = 256;
  for (Eigen::Index first = 0; first < x.cols(); first += product_width) {
    const Eigen::Index count = std::min<Eigen::Index>(product_width, x.cols() - first);
    if (count == 1) {
      y.col(first).noalias() = lower.selfadjointView<Eigen::Lower>() * x.col(first);
      continue;
    }
    std::fill(out.begin(), out.begin() + n * product_width, 0.0);
    for (Eigen::Index low = 0; low < n; low += strip)
      for (Eigen::Index j = 0; j < product_width; ++j) {
        const double* column = &x.coeffRef(0, first + std::min(j, count - 1));
        for (Eigen::Index i = low; i < std::min(n, low + strip); ++i) in[i * product_width + j] = column[i];
      }
    multiply_lower(n, lower.outerIndexPtr(), lower.innerIndexPtr(), lower.valuePtr(), in.data(), out.data());
    for (Eigen::Index low = 0; low < n; low += strip)
      for (Eigen::Index j = 0; j < count; ++j) {
        double* column = &y.coeffRef(0, first + j);
        for (Eigen::Index i = low; i < std::min(n, low + strip); ++i) column[i] = out[i * product_width + j];
      }
  }
  return y;
}

MatX rigid_motions(const FeModel& model, const FeSystem& system) {
  MatX R = MatX::Zero(system.size, 6);
  for (size_t i = 0; i < model.nodes.size(); ++i) {
    Mat6 motion = Mat6::Identity();
    motion.topRightCorner<3, 3>() = -skew(model.nodes[i]);
    for (int d = 0; d < 6; ++d)
      if (system.dof[i][d] >= 0) R.row(system.dof[i][d]) = motion.row(d);
  }
  return R;
}

std::vector<std::pair<int, int>> unconnected_parts(const FeModel& model, const FeSystem& system) {
  std::vector<int> parent(model.nodes.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const FeElement& e : model.elements)
    for (int i = 1; i < e.count; ++i) parent[root(model.connectivity[e.first + i])] = root(model.connectivity[e.first]);
  for (const FeSpider& spider : model.spiders)
    if (spider.rigid || moves(system.dof[spider.node]))
      for (int slave : spider.slaves) parent[root(slave)] = root(spider.node);
  for (const FeEquation& equation : model.equations)
    for (const FeEquation::Term& t : equation.terms) parent[root(t.node)] = root(equation.terms[0].node);
  if (model.matrices) {
    std::vector<int> node_of(system.size);
    for (size_t i = 0; i < model.nodes.size(); ++i)
      for (int d : system.dof[i])
        if (d >= 0) node_of[d] = static_cast<int>(i);
    for (int c = 0; c < system.K.outerSize(); ++c)
      for (SparseMatrix::InnerIterator it(system.K, c); it; ++it) parent[root(node_of[it.row()])] = root(node_of[it.col()]);
  }
  std::map<int, std::pair<int, int>> found;
  for (int i = 0; i < static_cast<int>(model.nodes.size()); ++i)
    if (moves(system.dof[i])) ++found.try_emplace(root(i), 0, i).first->second.first;
  std::vector<std::pair<int, int>> out;
  for (const auto& entry : found) out.push_back(entry.second);
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  return out;
}

}  // namespace flexframe::sim
