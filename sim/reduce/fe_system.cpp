// Numbering, assembly, elimination. See fe_system.h.
#include "sim/reduce/fe_system.h"

#include "sim/base/spatial.h"
#include "sim/base/wide.h"
#include "sim/reduce/fe_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>

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

FeSystem assemble(const FeModel& model) {
  if (model.matrices) return from_matrices(model);
  FeSystem s;
  const size_t nodes = model.nodes.size();
  std::vector<int> motions(nodes, 0);
  for (const FeElement& e : model.elements)
    for (int i = 0; i < e.count; ++i) {
      int& m = motions[model.connectivity[e.first + i]];
      m = std::max(m, fe_is_shell(e.shape) ? 6 : 3);
    }
  for (const FeSpider& spider : model.spiders)
    if (spider.rigid) motions[spider.node] = 6;
  s.dof.assign(nodes, {-1, -1, -1, -1, -1, -1});
  for (size_t i = 0; i < nodes; ++i)
    for (int d = 0; d < motions[i]; ++d) s.dof[i][d] = s.size++;

  const Neighbours nb = neighbours(model);
  Layout K = full_layout(s, nb, false), M = full_layout(s, nb, true);

  MatX Ke, Me;
  Mat3X X;
  for (const FeElement& e : model.elements) {
    X.resize(3, e.count);
    for (int i = 0; i < e.count; ++i) X.col(i) = model.nodes[model.connectivity[e.first + i]];
    const bool shell = fe_is_shell(e.shape);
    const int per_node = shell ? 6 : 3;
    if (e.shape == FeShape::point_mass) {
      Ke.setZero(3, 3);
      Me.setConstant(1, 1, e.thickness);
    } else {
      try {
        if (shell) {
          shell_matrices(e.shape, X, e.thickness, model.materials[e.material], e.id, Ke, Me);
        } else {
          solid_stiffness(e.shape, e.formulation, X, model.materials[e.material], e.id, Ke);
          solid_mass(e.shape, X, model.materials[e.material], e.id, Me);
        }
      } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", place_of(model, e), error.what()));
      }
    }
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
  return s;
}

FeReduced eliminate(const FeModel& model, const FeSystem& system, const std::vector<FeConstraint>& held) {
  FeReduced out;
  out.system = &system;
  std::vector<int> master(model.nodes.size(), -1);
  bool tied = false;
  for (const FeSpider& spider : model.spiders) {
    if (!spider.rigid) continue;
    for (int slave : spider.slaves) {
      if (system.dof[slave][0] < 0) continue;
      if (master[slave] >= 0 && master[slave] != spider.node)
        throw InputError(fmt::format("{}: node {} is tied rigidly to two reference points, {} and {}", model.file, model.node_ids[slave],
                                     model.node_ids[master[slave]], model.node_ids[spider.node]));
      master[slave] = spider.node;
      tied = true;
    }
  }
  for (const FeSpider& spider : model.spiders)
    if (spider.rigid && master[spider.node] >= 0)
      throw InputError(fmt::format("{}: the reference point {} of '{}' is itself tied to another", model.file, model.node_ids[spider.node],
                                   spider.name));
  if (!tied && held.empty()) return out;
  out.identity = false;
  std::set<int> fixed;
  for (const FeConstraint& c : held) {
    if (master[c.node] >= 0)
      throw InputError(fmt::format("{}: node {} is held and tied rigidly; hold its reference point", model.file, model.node_ids[c.node]));
    if (system.dof[c.node][c.dof] >= 0) fixed.insert(system.dof[c.node][c.dof]);
  }
  std::vector<int> column(system.size, -1);
  std::vector<bool> slave_dof(system.size, false);
  for (size_t i = 0; i < model.nodes.size(); ++i)
    if (master[i] >= 0)
      for (int d : system.dof[i])
        if (d >= 0) slave_dof[d] = true;
  int count = 0;
  std::vector<Eigen::Triplet<double>> terms;
  for (int d = 0; d < system.size; ++d)
    if (!slave_dof[d] && !fixed.contains(d)) {
      terms.emplace_back(d, count, 1.0);
      out.own.push_back(d);
      column[d] = count++;
    }
  // u = u_m + theta x r.
  for (size_t i = 0; i < model.nodes.size(); ++i) {
    if (master[i] < 0) continue;
    const std::array<int, 6>&dof = system.dof[i], &from = system.dof[master[i]];
    const Mat3 turn = -skew(model.nodes[i] - model.nodes[master[i]]);
    const auto put = [&](int row, int source, double factor) {
      if (row >= 0 && source >= 0 && column[source] >= 0 && factor != 0.0) terms.emplace_back(row, column[source], factor);
    };
    for (int d = 0; d < 3; ++d) {
      put(dof[d], from[d], 1.0);
      for (int k = 0; k < 3; ++k) put(dof[d], from[3 + k], turn(d, k));
      put(dof[3 + d], from[3 + d], 1.0);
    }
  }
  out.T.resize(system.size, count);
  out.T.setFromTriplets(terms.begin(), terms.end());
  const auto project = [&](const SparseMatrix& lower) {
    const SparseMatrix full = lower.selfadjointView<Eigen::Lower>();
    const SparseMatrix half = full * out.T;
    const SparseMatrix small = out.T.transpose() * half;
    return SparseMatrix(small.triangularView<Eigen::Lower>());
  };
  out.small_K = project(system.K);
  out.small_M = project(system.M);
  return out;
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

int count_parts(const FeModel& model, const FeSystem& system) {
  std::vector<int> parent(model.nodes.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const FeElement& e : model.elements)
    for (int i = 1; i < e.count; ++i) parent[root(model.connectivity[e.first + i])] = root(model.connectivity[e.first]);
  for (const FeSpider& spider : model.spiders)
    if (spider.rigid)
      for (int slave : spider.slaves) parent[root(slave)] = root(spider.node);
  if (model.matrices) {
    std::vector<int> node_of(system.size);
    for (size_t i = 0; i < model.nodes.size(); ++i)
      for (int d : system.dof[i])
        if (d >= 0) node_of[d] = static_cast<int>(i);
    for (int c = 0; c < system.K.outerSize(); ++c)
      for (SparseMatrix::InnerIterator it(system.K, c); it; ++it) parent[root(node_of[it.row()])] = root(node_of[it.col()]);
  }
  std::set<int> roots;
  for (size_t i = 0; i < model.nodes.size(); ++i)
    if (moves(system.dof[i])) roots.insert(root(static_cast<int>(i)));
  return static_cast<int>(roots.size());
}

}  // namespace flexframe::sim
