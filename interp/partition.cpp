#include "interp/partition.h"

#include "interp/elastic.h"
#include "interp/parallel.h"
#include "interp/watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexframe::interp {
namespace {

// Share of a patch at a vertex: float is enough, the shares are normalised in double.
struct Share {
  int vertex;
  float value;
};

struct Cover {
  std::vector<std::vector<int>> node;     // nodes of each patch
  std::vector<std::vector<Share>> share;  // vertices of each patch
  std::vector<int> home;                  // of each node: the patch whose centre is nearest, relative to its radius
};

double wendland_c2(double r) { return r >= 1.0 ? 0.0 : std::pow(1.0 - r, 4) * (4.0 * r + 1.0); }

// A new patch is centred where no patch so far is nearer than this share of its radius.
constexpr double covered = 0.62;

Cover cover_mesh(const Weld& weld, const Graph& graph, int patch_nodes) {
  Cover cover;
  Search search;
  std::vector<char> done(graph.vertices, 0), node_done(graph.nodes, 0);
  cover.home.assign(graph.nodes, -1);
  std::vector<double> nearness(graph.nodes, std::numeric_limits<double>::infinity());
  auto add = [&](int start) {
    look();
    double radius = grow(graph, weld.positions, start, patch_nodes, search);
    const auto& distance = search.distance;
    if (!(radius < std::numeric_limits<double>::infinity())) {
      // All that hangs together: every vertex keeps a share.
      radius = 0.0;
      for (const int v : search.reached) radius = std::max(radius, distance[v]);
      for (const double d : search.node_distance) radius = std::max(radius, d);
      radius *= 1.5;
    }
    if (search.node.empty()) return;
    const int patch = static_cast<int>(cover.node.size());
    cover.node.push_back(search.node);
    std::sort(cover.node.back().begin(), cover.node.back().end());
    auto& share = cover.share.emplace_back();
    for (const int v : search.reached) {
      const double r = radius > 0.0 ? distance[v] / radius : 0.0;
      if (r <= covered) done[v] = 1;
      if (r < 1.0) share.push_back({v, static_cast<float>(wendland_c2(r))});
    }
    std::sort(share.begin(), share.end(), [](const Share& a, const Share& b) { return a.vertex < b.vertex; });
    for (size_t k = 0; k < search.node.size(); ++k) {
      const double r = radius > 0.0 ? search.node_distance[k] / radius : 0.0;
      const size_t i = search.node[k];
      if (r <= covered) node_done[i] = 1;
      if (r < nearness[i]) {
        nearness[i] = r;
        cover.home[i] = patch;
      }
    }
  };
  for (int i = 0; i < graph.nodes; ++i)
    if (!node_done[i]) add(graph.vertices + i);
  for (int v = 0; v < graph.vertices; ++v)
    if (!done[v]) add(v);
  return cover;
}

Cover cover_all(const Graph& graph) {
  Cover cover;
  cover.node.emplace_back();
  for (int i = 0; i < graph.nodes; ++i) cover.node[0].push_back(i);
  auto& share = cover.share.emplace_back();
  for (int v = 0; v < graph.vertices; ++v) share.push_back({v, 1.0f});
  cover.home.assign(graph.nodes, 0);
  return cover;
}

// Patches of each vertex, from the vertices of each patch.
struct Blend {
  std::vector<std::int64_t> begin;
  std::vector<int> patch;
  std::vector<float> value;
};

Blend transpose(const Cover& cover, int vertices) {
  Blend blend;
  blend.begin.assign(vertices + 1, 0);
  for (const auto& share : cover.share)
    for (const Share& s : share) ++blend.begin[s.vertex + 1];
  for (int v = 0; v < vertices; ++v) blend.begin[v + 1] += blend.begin[v];
  blend.patch.resize(blend.begin.back());
  blend.value.resize(blend.patch.size());
  std::vector<std::int64_t> fill(blend.begin.begin(), blend.begin.end() - 1);
  for (size_t p = 0; p < cover.share.size(); ++p)
    for (const Share& s : cover.share[p]) {
      const size_t at = fill[s.vertex]++;
      blend.patch[at] = static_cast<int>(p);
      blend.value[at] = s.value;
    }
  return blend;
}

// Rows of a range of vertices; the vertices of `chosen`, or all.
struct Rows {
  std::vector<int> count, column;
  std::vector<float> single;
  std::vector<double> precise;  // the same in double, if asked for
  std::vector<double> worst;    // of each patch: largest sum of |weight| where it has a share
  double lebesgue = 0.0;
  int lebesgue_vertex = -1;
};

struct Gather {
  std::vector<double> sum;  // per source
  std::vector<int> touched;
  std::vector<char> seen;
  Eigen::VectorXd scratch, weights;  // of the patch at hand
  explicit Gather(int sources) : sum(sources, 0.0), seen(sources, 0) {}
  void add(int source, double value) {
    const size_t i = source;
    if (!seen[i]) {
      seen[i] = 1;
      touched.push_back(source);
    }
    sum[i] += value;
  }
};

// What the rows of all vertices are made of.
struct RowMaker {
  const Points& positions;  // where the patches are evaluated
  const Points& beside;     // from there to the vertices, or no rows
  const Blend& blend;
  const std::vector<Patch>& patches;
  const std::vector<int>& director;  // 3 director sources of a node that carries arms, from this one; -1: none
  int nodes, sources;
  bool precise;
  std::span<const int> chosen;  // vertices that have rows, empty: all

  Rows make(int first, int last) const;

 private:
  void add_patch(const Patch& patch, int vertex, double share, Gather& gather) const;
};

// Leaves the patch's weights in the gatherer.
void RowMaker::add_patch(const Patch& patch, int vertex, double share, Gather& gather) const {
  const Vec3 x = positions.row(vertex).transpose();
  const auto k = static_cast<Eigen::Index>(patch.node.size());
  gather.weights.resize(k);
  patch_weights(patch, x, gather.scratch, gather.weights);
  const auto dropped = patch.frame.rightCols(3 - patch.directions);
  Vec3 off = patch.arm > 0.0 ? Vec3(dropped * (dropped.transpose() * (x - patch.origin))) : Vec3(Vec3::Zero());
  if (beside.rows() > 0) off += beside.row(vertex).transpose();
  for (Eigen::Index i = 0; i < k; ++i) {
    const int node = patch.node[i];
    const double w = share * gather.weights[i];
    gather.add(node, w);
    if (patch.arm > 0.0 && director[node] >= 0) {
      const Vec3 arm = w * (off - patch.off.col(i));
      for (int c = 0; c < 3; ++c) gather.add(director[node] + c, arm[c]);
    }
  }
}

Rows RowMaker::make(int first, int last) const {
  Rows rows;
  rows.worst.assign(patches.size(), 0.0);
  Gather gather(sources);
  for (int row = first; row < last; ++row) {
    look();
    const int v = chosen.empty() ? row : chosen[row];
    const size_t begin = blend.begin[v], end = blend.begin[v + 1];
    double total = 0.0;
    for (size_t b = begin; b < end; ++b) total += static_cast<double>(blend.value[b]);
    for (size_t b = begin; b < end; ++b) {
      const size_t p = blend.patch[b];
      const double share = end - begin == 1 ? 1.0 : static_cast<double>(blend.value[b]) / total;
      if (share <= 0.0) continue;
      add_patch(patches[p], v, share, gather);
      // A patch answers for what it adds: its sum of weights, damped where its share is small.
      rows.worst[p] = std::max(rows.worst[p], std::min(1.0, 4.0 * share) * gather.weights.lpNorm<1>());
    }
    std::sort(gather.touched.begin(), gather.touched.end());
    double lebesgue = 0.0;
    for (const int s : gather.touched) {
      const size_t i = s;
      if (s < nodes) lebesgue += std::abs(gather.sum[i]);
      rows.column.push_back(s);
      rows.single.push_back(static_cast<float>(gather.sum[i]));
      if (precise) rows.precise.push_back(gather.sum[i]);
      gather.sum[i] = 0.0;
      gather.seen[i] = 0;
    }
    rows.count.push_back(static_cast<int>(gather.touched.size()));
    gather.touched.clear();
    if (!(lebesgue <= rows.lebesgue)) {
      rows.lebesgue = lebesgue;
      rows.lebesgue_vertex = v;
    }
  }
  return rows;
}

// Where the nodes span one direction only, how far they lie beside their line tells the turn about it: a second tangent across the line, as
// weights that no affine motion along it excites. Not where the arms are ten times as long: then it is not in the data.
void add_twist(const Patch& patch, const Points& nodes, ArmLift::Estimate& e) {
  constexpr double longest_arm = 10.0;
  const auto k = static_cast<Eigen::Index>(e.node.size());
  if (k < 3) return;
  Eigen::MatrixX3d beside(k, 3);
  Eigen::MatrixX2d affine(k, 2);
  for (Eigen::Index i = 0; i < k; ++i) {
    beside.row(i) = nodes.row(e.node[i]) - patch.origin.transpose();
    affine.row(i) << 1.0, beside.row(i).dot(patch.frame.col(0));
  }
  beside -= affine * (affine.colPivHouseholderQr().solve(beside));
  const Eigen::SelfAdjointEigenSolver<Mat3> spread(Mat3(beside.transpose() * beside));
  const double squares = spread.eigenvalues()(2);
  if (!(longest_arm * std::sqrt(squares) > patch.arm) || !(squares > 0.0)) return;
  e.gradient.conservativeResize(2, Eigen::NoChange);
  e.gradient.row(1) = (beside * spread.eigenvectors().col(2)).transpose() / squares;
  e.tangents = 2;
}

// Patch in the middle of a wall: its nodes and vertices lie beside.
void add_wall(const Graph& graph, std::span<const int> vertices, Patch& patch) {
  double nodes = 0.0, farthest = 0.0;
  for (size_t k = 0; k < patch.node.size(); ++k) {
    const Vec3 beside = graph.node_beside.row(patch.node[k]).transpose();
    patch.off.col(static_cast<Eigen::Index>(k)) += beside;
    nodes = std::max(nodes, beside.norm());
  }
  for (const int v : vertices) farthest = std::max(farthest, graph.beside.row(v).norm());
  patch.arm += nodes + farthest;
}

// Rotation of a node with arms: derivatives of its home patch's interpolant there. across: unit vector across the wall that it is on, or
// zero: along it nothing tells a derivative, where the nodes of a curved wall seem to have one.
ArmLift::Estimate make_estimate(const Patch& patch, const Points& nodes, const Vec3& x, const Vec3& across, bool wall) {
  ArmLift::Estimate e;
  e.frame = patch.frame;
  e.tangents = patch.directions;
  e.node = patch.node;
  e.gradient = patch_gradient(patch, x);
  if (e.tangents == 1) add_twist(patch, nodes, e);
  if (e.tangents == 3 && wall) {
    // Where the wall's direction is not known, or its nodes do not extend along it, that of the patch.
    const Eigen::MatrixXd whole = patch.frame * e.gradient;
    for (const Vec3& axis : {across, Vec3(patch.frame.col(2))}) {
      if (!(axis.squaredNorm() > 0.0)) continue;
      Mat3 axes;
      axes.col(0) = axis.unitOrthogonal();
      axes.col(1) = axis.cross(Vec3(axes.col(0)));
      e.gradient = axes.leftCols(2).transpose() * whole;
      e.tangents = 2;
      constexpr double least = 0.1;  // of what nodes that follow the tangents span
      Eigen::Matrix<double, 3, 2> spanned = Eigen::Matrix<double, 3, 2>::Zero();
      for (size_t k = 0; k < e.node.size(); ++k)
        spanned += (nodes.row(e.node[k]).transpose() - x) * e.gradient.col(static_cast<Eigen::Index>(k)).transpose();
      if (spanned.col(0).cross(Vec3(spanned.col(1))).norm() > least) break;
    }
  }
  // Tangents of the nodes' own surface, which need not be quite flat: then rigid motion of the nodes is seen as such.
  for (int t = 0; t < e.tangents; ++t) {
    e.frame.col(t).setZero();
    for (size_t k = 0; k < e.node.size(); ++k)
      e.frame.col(t) += e.gradient(t, static_cast<Eigen::Index>(k)) * (nodes.row(e.node[k]).transpose() - x);
  }
  if (e.tangents == 2) e.frame.col(2) = e.frame.col(0).cross(Vec3(e.frame.col(1))).normalized();
  return e;
}

// Residual of each node against the interpolant of the others in its home patch: (A^-1 u)_i / (A^-1)_ii.
LeaveOneOut make_leave_one_out(const std::vector<Patch>& patches, const std::vector<int>& home, const std::vector<int>& director, int nodes,
                               int sources) {
  LeaveOneOut out;
  SparseWeights& w = out.rows;
  w.rows = nodes;
  w.cols = sources;
  // Without a node that alone spans a direction the others tell nothing: its diagonal is rounding.
  constexpr double rounding = 1e-9;
  for (int i = 0; i < nodes; ++i) {
    const Patch& patch = patches[home[i]];
    const auto at = std::lower_bound(patch.node.begin(), patch.node.end(), i) - patch.node.begin();
    const double diagonal = patch.inverse_diagonal[at];
    // Too few others to predict from: no row. A repaired patch has none either.
    if (static_cast<int>(patch.node.size()) > 1 + patch.directions + 1 && std::isfinite(diagonal) &&
        std::abs(diagonal) > rounding * patch.inverse_diagonal.cwiseAbs().maxCoeff())
      for (size_t j = 0; j < patch.node.size(); ++j) {
        const double value = patch.inverse(at, static_cast<Eigen::Index>(j)) / diagonal;
        w.column.push_back(patch.node[j]);
        w.precise.push_back(value);
        const int d = director[patch.node[j]];
        if (d < 0 || patch.arm == 0.0) continue;
        const Vec3 arm = value * (patch.off.col(at) - patch.off.col(static_cast<Eigen::Index>(j)));
        for (int c = 0; c < 3; ++c)
          if (arm[c] != 0.0) {
            w.column.push_back(d + c);
            w.precise.push_back(arm[c]);
          }
      }
    w.begin.push_back(static_cast<std::int64_t>(w.column.size()));
  }
  return out;
}

// What the rows of a pass say of the patches.
struct Guard {
  double lebesgue = 0.0;
  int vertex = -1;
  std::vector<double> worst;  // of each patch, as Rows::worst
  explicit Guard(size_t patches) : worst(patches, 0.0) {}
  void add(const Rows& rows) {
    if (!(rows.lebesgue <= lebesgue)) {
      lebesgue = rows.lebesgue;
      vertex = rows.lebesgue_vertex;
    }
    for (size_t p = 0; p < worst.size(); ++p) worst[p] = std::max(worst[p], rows.worst[p]);
  }
};

// All rows as one table. What is still in pieces is a small part of it at any time.
SparseWeights make_rows(const RowMaker& maker, int count, int threads, Guard& guard) {
  SparseWeights w;
  w.rows = count;
  w.cols = maker.sources;
  w.begin.reserve(static_cast<size_t>(count) + 1);
  constexpr int grain = 2048, group = 32 * grain;
  for (int begin = 0; begin < count; begin += group) {
    const int end = std::min(count, begin + group);
    std::vector<Rows> rows((end - begin + grain - 1) / grain);
    parallel_chunks(end - begin, grain, threads,
                    [&](int first, int last) { rows[first / grain] = maker.make(begin + first, begin + last); });
    size_t entries = w.column.size();
    for (const Rows& r : rows) entries += r.column.size();
    if (entries > w.column.capacity()) {
      // For all rows, should the others be as long as these and a tenth longer.
      const auto wanted = static_cast<size_t>(static_cast<double>(entries) * (end < count ? 1.1 * count / end : 1.0));
      w.column.reserve(wanted);
      w.single.reserve(wanted);
      if (maker.precise) w.precise.reserve(wanted);
    }
    for (const Rows& r : rows) {
      guard.add(r);
      for (const int c : r.count) w.begin.push_back(w.begin.back() + c);
      w.column.insert(w.column.end(), r.column.begin(), r.column.end());
      w.single.insert(w.single.end(), r.single.begin(), r.single.end());
      w.precise.insert(w.precise.end(), r.precise.begin(), r.precise.end());
    }
  }
  return w;
}

// Of the welded vertices: the sum of their faces', whose length is twice their area; all outward, however the faces are given.
Points vertex_normals(const Weld& weld) {
  Points normals = Points::Zero(weld.positions.rows(), 3);
  const std::vector<int> sign = outward_signs(weld.positions, weld.triangles);
  for (Eigen::Index t = 0; t < weld.triangles.rows(); ++t) {
    const Eigen::Vector3i c = weld.triangles.row(t).transpose();
    const Vec3 a = weld.positions.row(c[0]).transpose(), b = weld.positions.row(c[1]).transpose();
    const Vec3 normal = sign[t] * (b - a).cross(Vec3(weld.positions.row(c[2]).transpose()) - a);
    for (int k = 0; k < 3; ++k) normals.row(c[k]) += normal.transpose();
  }
  return normals;
}

}  // namespace

struct PartitionMaker::Covered {
  Cover cover;
  Blend blend;
};

PartitionMaker::PartitionMaker(const Weld& weld, const Graph& graph, const Points& nodes) : weld_(weld), graph_(graph), nodes_(nodes) {}
PartitionMaker::~PartitionMaker() = default;

const PartitionMaker::Covered& PartitionMaker::cover_by(int patch_nodes) {
  std::unique_ptr<Covered>& found = covered_[patch_nodes];
  if (!found) {
    // A quarter more than a patch still makes one patch.
    const bool single = patch_nodes <= 0 || (4 * nodes_.rows() <= 5 * Eigen::Index{patch_nodes} && graph_.pieces < 2);
    found = std::make_unique<Covered>();
    found->cover = single ? cover_all(graph_) : cover_mesh(weld_, graph_, patch_nodes);
    found->blend = transpose(found->cover, graph_.vertices);
  }
  return *found;
}

bool PartitionMaker::looks_like_sheet(const Patch& patch, std::span<const int> vertices) const {
  // Steeper than this (70 degrees) the wall stands; a tenth of the area may, such as the wall's own rim.
  constexpr double least = 0.34, standing = 0.1;
  double all = 0.0, steep = 0.0;
  for (const int v : vertices) {
    const double area = normals_.row(v).norm();
    all += area;
    if (std::abs(normals_.row(v).dot(patch.frame.col(2).transpose())) < least * area) steep += area;
  }
  return all > 0.0 && steep < standing * all;
}

Partition PartitionMaker::make(const PartitionOptions& options, std::span<const int> vertices, std::span<const Repair> start) {
  Partition out;
  const int count = static_cast<int>(nodes_.rows());
  const Covered& covered_by = cover_by(options.patch_nodes);
  const Cover& cover = covered_by.cover;
  const Blend& blend = covered_by.blend;
  const size_t number = cover.node.size();
  out.patches = static_cast<int>(number);

  std::vector<Patch> patches(number);
  std::vector<Repair> repair(number, Repair::none);
  if (start.size() == number) repair.assign(start.begin(), start.end());
  std::vector<char> stale(number, 1), sheet(number, 0);
  if (options.sheets && normals_.rows() == 0) normals_ = vertex_normals(weld_);
  const bool wall = in_wall(options);
  if (wall && middle_.rows() == 0) {
    middle_ = weld_.positions - graph_.beside;
    node_middle_ = nodes_ - graph_.node_beside;
  }
  const Points none(0, 3);
  const Points &positions = wall ? middle_ : weld_.positions, &nodes = wall ? node_middle_ : nodes_;
  std::vector<int> director;
  int sources = 0;
  for (int pass = 0;; ++pass) {
    parallel_chunks(static_cast<int>(number), 1, options.threads, [&](int first, int last) {
      for (int p = first; p < last; ++p) {
        const size_t i = p;
        if (!stale[i]) continue;
        std::vector<int> evaluated;
        for (const Share& s : cover.share[i]) evaluated.push_back(s.vertex);
        PatchKind kind{options.kernel, repair[i]};
        patches[i] = make_patch(nodes, cover.node[i], positions, evaluated, kind);
        kind.sheet = options.sheets && patches[i].directions == 3 && looks_like_sheet(patches[i], evaluated);
        if (kind.sheet) patches[i] = make_patch(nodes, cover.node[i], positions, evaluated, kind);
        if (wall) add_wall(graph_, evaluated, patches[i]);
        sheet[i] = kind.sheet;
        if (!options.arms) patches[i].arm = 0.0;
      }
    });
    // Nodes of patches with arms get directors.
    std::vector<char> armed(count, 0);
    for (const Patch& p : patches)
      if (p.arm > 0.0)
        for (const int i : p.node) armed[i] = 1;
    director.assign(count, -1);
    out.lift = ArmLift{};
    out.lift.nodes = count;
    out.lift.given = options.rotations;
    for (int i = 0; i < count; ++i)
      if (armed[i]) {
        director[i] = count + 3 * static_cast<int>(out.lift.director_node.size());
        out.lift.director_node.push_back(i);
      }
    sources = source_count(Lift(out.lift));

    Guard guard(number);
    const RowMaker maker{positions, wall ? graph_.beside : none, blend, patches, director, count, sources, options.precise, vertices};
    out.weights = {};
    out.weights = make_rows(maker, vertices.empty() ? graph_.vertices : static_cast<int>(vertices.size()), options.threads, guard);
    out.lebesgue = guard.lebesgue;
    out.lebesgue_vertex = guard.vertex;
    if (out.lebesgue <= options.lebesgue_limit || pass == 2 || options.patch_nodes <= 0) break;
    bool any = false;
    for (size_t p = 0; p < number; ++p) {
      stale[p] = !(guard.worst[p] <= options.lebesgue_limit) && repair[p] != Repair::local_residual;
      if (!stale[p]) continue;
      any = true;
      repair[p] = repair[p] == Repair::none && patches[p].directions > 1 ? Repair::fewer_directions : Repair::local_residual;
    }
    if (!any) break;
  }
  for (const Repair r : repair) out.repaired += r != Repair::none;
  out.sheets = static_cast<int>(std::count(sheet.begin(), sheet.end(), 1));

  if (!options.rotations)
    for (const int i : out.lift.director_node)
      out.lift.estimate.push_back(make_estimate(patches[cover.home[i]], nodes_, nodes.row(i).transpose(),
                                                wall ? Vec3(graph_.node_normal.row(i).transpose()) : Vec3(Vec3::Zero()), wall));
  out.leave_one_out = make_leave_one_out(patches, cover.home, director, count, sources);
  out.repairs = std::move(repair);
  return out;
}

Partition make_partition(const Weld& weld, const Graph& graph, const Points& nodes, const PartitionOptions& options) {
  return PartitionMaker(weld, graph, nodes).make(options);
}

}  // namespace flexframe::interp
