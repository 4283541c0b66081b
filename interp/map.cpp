#include "interp/map.h"

#include "interp/compare.h"
#include "interp/dense_solvers.h"
#include "interp/elastic.h"
#include "interp/graph.h"
#include "interp/lattice.h"
#include "interp/parallel.h"
#include "interp/partition.h"
#include "interp/residuals.h"
#include "interp/skeleton.h"
#include "interp/trial.h"
#include "interp/watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>

namespace flexframe::interp {
namespace {

constexpr int elastic_nodes = 40, thin_nodes = 100, most_elastic_nodes = 200, elastic_vertices = 12000, lattice_sources = 1500;

constexpr std::array<std::pair<Scheme, std::string_view>, 7> scheme_names{{{Scheme::automatic, "auto"},
                                                                           {Scheme::kernel, "kernel"},
                                                                           {Scheme::elastic, "elastic"},
                                                                           {Scheme::lattice, "lattice"},
                                                                           {Scheme::r3, "r3"},
                                                                           {Scheme::r, "r"},
                                                                           {Scheme::tps, "tps"}}};

std::string node_label(const Nodes& nodes, Eigen::Index i) {
  return static_cast<size_t>(i) < nodes.names.size() ? fmt::format("'{}'", nodes.names[i]) : fmt::format("{}", i);
}

void check_input(const Nodes& nodes, const MeshView& mesh) {
  if (nodes.positions.rows() == 0) throw InputError("no simulation nodes: at least one is needed to move the mesh");
  if (mesh.vertices.rows() == 0) throw InputError("the mesh has no vertices");
  for (Eigen::Index i = 0; i < nodes.positions.rows(); ++i)
    if (!nodes.positions.row(i).allFinite())
      throw InputError(fmt::format("simulation node {} has a coordinate that is not finite", node_label(nodes, i)));
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
    if (!mesh.vertices.row(v).allFinite()) throw InputError(fmt::format("vertex {} of the mesh has a coordinate that is not finite", v));
  if (mesh.triangles.rows() == 0) return;
  if (mesh.triangles.minCoeff() < 0 || mesh.triangles.maxCoeff() >= mesh.vertices.rows())
    throw InputError(fmt::format("a triangle refers to vertex {}, the mesh has {}",
                                 mesh.triangles.minCoeff() < 0 ? mesh.triangles.minCoeff() : mesh.triangles.maxCoeff(),
                                 mesh.vertices.rows()));
}

void check_motions(const Nodes& nodes, const NodeMotions& known) {
  const Eigen::Index n = known.displacement.cols(), rows = 3 * nodes.positions.rows();
  if (n == 0) return;
  if (known.displacement.rows() != rows || (nodes.rotations && (known.rotation.rows() != rows || known.rotation.cols() != n)))
    throw InputError(fmt::format("known motions of {} nodes need {} rows, of displacements{}, found {}", nodes.positions.rows(), rows,
                                 nodes.rotations ? " and of rotations alike" : "", known.displacement.rows()));
  if (!known.displacement.allFinite() || !known.rotation.allFinite()) throw InputError("a known motion of the nodes is not finite");
}

struct Box {
  Vec3 lower, upper;
  explicit Box(const Points& p) : lower(p.colwise().minCoeff().transpose()), upper(p.colwise().maxCoeff().transpose()) {}
  double diagonal() const { return (upper - lower).norm(); }
};

// Only vertices of triangles count for size and extent; the others follow. Of a cloud all.
Points drawn_vertices(const MeshView& mesh) {
  if (mesh.triangles.rows() == 0) return mesh.vertices;
  std::vector<char> used(mesh.vertices.rows(), 0);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) used[mesh.triangles(t, c)] = 1;
  Points vertices(std::count(used.begin(), used.end(), char{1}), 3);
  for (Eigen::Index v = 0, k = 0; v < mesh.vertices.rows(); ++v)
    if (used[v]) vertices.row(k++) = mesh.vertices.row(v);
  return vertices;
}

// Vertices are welded within a tenth of the merge distance: far below any edge worth drawing, above the rounding of text files.
constexpr double weld_share = 0.1;

// Nodes in other units or in another frame than the mesh: said with the numbers that show it.
void check_scale(const Points& nodes, const Points& vertices) {
  const Box n(nodes), m(vertices);
  const double size = m.diagonal();
  if (!(size > 0.0)) throw InputError("all vertices of the mesh are at one place");
  const Vec3 gap = (n.lower - m.upper).cwiseMax(m.lower - n.upper).cwiseMax(0.0);
  // Nodes hardly ever reach beyond the mesh they move; they may be few and crowded in a corner of it.
  const bool larger = n.diagonal() > 4.0 * size, apart = gap.norm() > size;
  const bool smaller = nodes.rows() > 3 && n.diagonal() < size / 200.0;
  // The unit that would bring the nodes into the mesh and spread them over more than half of it.
  double unit = 0.0, misfit = std::numeric_limits<double>::infinity();
  if (nodes.rows() > 3 && n.diagonal() > 0.0)
    for (const double u : {10.0, 25.4, 39.3701, 100.0, 1000.0, 0.1, 1.0 / 25.4, 1.0 / 39.3701, 0.01, 0.001}) {
      const double reach = 0.05 * size;
      const double off = std::abs(std::log(n.diagonal() * u / size));
      if (off < std::min(misfit, std::log(2.0)) && (n.lower * u - m.lower).minCoeff() > -reach &&
          (m.upper - n.upper * u).minCoeff() > -reach)
        unit = u, misfit = off;
    }
  const bool other_unit = unit > 0.0 && (n.diagonal() < size / 8.0 || larger);
  if (!larger && !apart && !smaller && !other_unit) return;
  const std::string hint = unit > 0.0 ? fmt::format("; the units may differ: multiplied by {:.4g} they would fit", unit) : "";
  throw InputError(fmt::format(
      "the simulation nodes do not belong to this mesh: they lie in x {:.4g}..{:.4g}, y {:.4g}..{:.4g}, z {:.4g}..{:.4g}, the mesh in "
      "x {:.4g}..{:.4g}, y {:.4g}..{:.4g}, z {:.4g}..{:.4g}{}",
      n.lower.x(), n.upper.x(), n.lower.y(), n.upper.y(), n.lower.z(), n.upper.z(), m.lower.x(), m.upper.x(), m.lower.y(), m.upper.y(),
      m.lower.z(), m.upper.z(), hint));
}

// Places of the points from the middle outward, each next one the farthest from all before, which is how patches cover a mesh best; few
// that make one patch, and those beyond 2000, as they come.
std::vector<int> spread_order(const Points& points) {
  const auto count = static_cast<int>(points.rows());
  std::vector<int> order;
  if (count <= 25) {
    order.resize(count);
    std::iota(order.begin(), order.end(), 0);
    return order;
  }
  const Eigen::RowVector3d middle = points.colwise().mean();
  int next = 0;
  (points.rowwise() - middle).rowwise().squaredNorm().minCoeff(&next);
  Eigen::VectorXd distance = Eigen::VectorXd::Constant(count, std::numeric_limits<double>::infinity());
  while (static_cast<int>(order.size()) < std::min(count, 2000)) {
    look();
    order.push_back(next);
    distance = distance.cwiseMin((points.rowwise() - points.row(next)).rowwise().squaredNorm());
    distance[next] = -1.0;
    distance.maxCoeff(&next);
  }
  for (int i = 0; i < count; ++i)
    if (distance[i] >= 0.0) order.push_back(i);
  return order;
}

// Nodes nearer than the distance become one at the place of the first. They are taken in the order of their coordinates and then spread, so
// that a map does not depend on the order in which the nodes are given.
void merge_nodes(const Points& nodes, double distance, Map& map) {
  std::vector<int> order(nodes.rows());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    const auto key = [&](int k) { return std::tuple(nodes(k, 0), nodes(k, 1), nodes(k, 2), k); };
    return key(i) < key(j);
  });
  const PointGrid grid(nodes);
  map.node_of.assign(nodes.rows(), -1);
  std::vector<int> near, first;
  for (const int i : order) {
    grid.within(nodes.row(i).transpose(), distance, near);
    int target = -1;
    for (const int j : near)
      if (const int known = map.node_of[j]; known >= 0 && first[known] == j && (target < 0 || known < target)) target = known;
    if (target < 0) {
      target = static_cast<int>(first.size());
      first.push_back(i);
      map.node_count.push_back(0);
    }
    map.node_of[i] = target;
    ++map.node_count[target];
  }
  Points merged(static_cast<Eigen::Index>(first.size()), 3);
  for (size_t k = 0; k < first.size(); ++k) merged.row(static_cast<Eigen::Index>(k)) = nodes.row(first[k]);
  const std::vector<int> spread = spread_order(merged);
  std::vector<int> place(first.size()), count(first.size());
  map.node_positions.resize(merged.rows(), 3);
  for (size_t k = 0; k < spread.size(); ++k) {
    const size_t from = spread[k];
    place[from] = static_cast<int>(k);
    count[k] = map.node_count[from];
    map.node_positions.row(static_cast<Eigen::Index>(k)) = merged.row(spread[k]);
  }
  map.node_count = std::move(count);
  for (int& k : map.node_of) k = place[k];
  map.report.merged_nodes = static_cast<int>(nodes.rows() - map.node_positions.rows());
}

// How the nodes lie. A line: their extent across it is under 1e-3 of that along it, or under a third of the mesh's across it in both
// directions; and no two of them share a section.
struct Layout {
  bool point = false, axis = false, plane = false;
};

Layout find_layout(const Points& nodes, const Points& vertices) {
  Layout layout;
  if (nodes.rows() == 1) {
    layout.point = true;
    return layout;
  }
  const Vec3 centre = nodes.colwise().mean().transpose();
  const Points local = nodes.rowwise() - centre.transpose();
  const PrincipalAxes principal = principal_axes(local.transpose() * local);
  const Mat3 frame = principal.axes.rowwise().reverse();
  const Points along = local * frame, mesh_along = (vertices.rowwise() - centre.transpose()) * frame;
  const Vec3 extent = (along.colwise().maxCoeff() - along.colwise().minCoeff()).transpose();
  const Vec3 mesh = (mesh_along.colwise().maxCoeff() - mesh_along.colwise().minCoeff()).transpose();
  auto thin = [&](int d) { return extent[d] < 1e-3 * extent[0] || extent[d] < mesh[d] / 3.0; };
  layout.plane = extent[2] < 1e-3 * extent[0];
  if (!thin(1) || !thin(2)) return layout;
  // Across the line nodes may scatter only if they follow one another along it.
  std::vector<double> s;
  for (Eigen::Index i = 0; i < along.rows(); ++i) s.push_back(along(i, 0));
  std::sort(s.begin(), s.end());
  double least = std::numeric_limits<double>::infinity();
  for (size_t k = 0; k + 1 < s.size(); ++k) least = std::min(least, s[k + 1] - s[k]);
  const bool straight = extent[1] < 1e-3 * extent[0];
  const double mean = extent[0] / static_cast<double>(s.size() - 1);
  const double across = std::max(extent[1], extent[2]);
  layout.axis = straight ? least > 1e-6 * extent[0] : (least > 0.1 * mean && extent[0] > 3.0 * across && least > 0.5 * across);
  return layout;
}

void check_data(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation) {
  if (displacement.rows() != map.nodes)
    throw InputError(fmt::format("displacements of {} nodes given, the map has {} nodes", displacement.rows(), map.nodes));
  if (rotation.rows() != 0 && rotation.rows() != map.nodes)
    throw InputError(fmt::format("rotations of {} nodes given, the map has {} nodes", rotation.rows(), map.nodes));
  if (map.rotations && rotation.rows() == 0) throw InputError("the map was made for nodes with rotations, none are given");
  for (Eigen::Index i = 0; i < displacement.rows(); ++i)
    if (!displacement.row(i).allFinite()) throw InputError(fmt::format("displacement of node {} is not finite", i));
  for (Eigen::Index i = 0; i < rotation.rows(); ++i)
    if (!rotation.row(i).allFinite()) throw InputError(fmt::format("rotation of node {} is not finite", i));
}

Points sources_of(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation, bool exact) {
  check_data(map, displacement, rotation);
  const Points u = merge_data(map, displacement);
  const Points theta = map.rotations ? merge_data(map, rotation) : Points(0, 3);
  return exact ? lift_exact(map.lift, u, theta) : lift_linear(map.lift, u, theta);
}

// Share of the nodes (of at most 48 of them) that have another nearer than the nodes' spacing in a straight line which is not among the 24
// nearest along the surface: across a slit, or through a thin wall.
double folded_share(const Points& nodes, const Weld& weld, const Graph& graph, double spacing) {
  const PointGrid grid(nodes);
  Search search;
  std::vector<int> near;
  const Eigen::Index step = std::max<Eigen::Index>(1, nodes.rows() / 48);
  int looked = 0, folded = 0;
  for (Eigen::Index i = 0; i < nodes.rows(); i += step, ++looked) {
    grid.within(nodes.row(i).transpose(), spacing, near);
    if (near.size() < 2) continue;
    grow(graph, weld.positions, graph.vertices + static_cast<int>(i), 24, search);
    folded += std::any_of(near.begin(), near.end(),
                          [&](int j) { return std::find(search.node.begin(), search.node.end(), j) == search.node.end(); });
  }
  return static_cast<double>(folded) / looked;
}

// Why the body is one for the elastic surface with more nodes too, or empty: the kernel has no notion of how it twists and opens. Limits:
// interp/README.md.
std::string thin_reason(const Points& nodes, const Weld& weld, const Graph& graph) {
  const Solidity solidity = measure_solidity(weld.positions, weld.triangles);
  if (!solidity.closed) return "an open surface";
  const double spacing = std::sqrt(solidity.area / static_cast<double>(nodes.rows()));
  if (2.0 * std::abs(solidity.volume) / solidity.area < 0.1 * spacing) return "a thin wall";
  if (folded_share(nodes, weld, graph, spacing) >= 0.15) return "a body with slits or thin walls";
  return {};
}

// Kernel or elastic, and why. Limits measured on the con rod (examples/accuracy-interp): with 20 nodes the elastic surface has half
// the error of the kernel, with 50 four fifths at 70 times the set-up; its factorisation stays near a second up to 12000 vertices.
// True: the kernel is chosen for its cost alone, the elastic surface may serve better.
bool choose_scheme(Map& map, const Weld& weld, const Graph& graph) {
  const int count = graph.nodes, vertices = graph.vertices;
  const Vec3 centre = weld.positions.colwise().mean().transpose();
  const Points local = weld.positions.rowwise() - centre.transpose();
  const PrincipalAxes principal = principal_axes(local.transpose() * local);
  const bool flat = principal.values[0] < 1e-10 * principal.values[2];
  const double size = weld.size;
  const auto inside = std::count_if(graph.off_mesh.begin(), graph.off_mesh.end(), [&](double d) { return d > 0.01 * size; });
  const std::string thin =
      weld.triangles.rows() > 0 && !flat && count > elastic_nodes && count <= thin_nodes && vertices <= elastic_vertices
          ? thin_reason(map.node_positions, weld, graph)
          : "";
  Report& report = map.report;
  report.scheme = Scheme::kernel;
  if (weld.triangles.rows() == 0)
    report.reason = fmt::format("{} nodes in a cloud of {} points without faces: partition of unity along nearest points", count, vertices);
  else if (flat) report.reason = fmt::format("{} nodes on a flat sheet: kernel in its plane", count);
  else if (count > elastic_nodes && thin.empty())
    report.reason = fmt::format("{} nodes are dense enough for the geodesic partition of unity (more than {})", count, elastic_nodes);
  else if (vertices > elastic_vertices)
    report.reason = fmt::format("{} vertices are too many for an elastic solution (more than {}): geodesic partition of unity", vertices,
                                elastic_vertices);
  else if (2 * inside > count) report.reason = fmt::format("{} of {} nodes lie off the surface: kernel with rigid arms", inside, count);
  else {
    report.scheme = Scheme::elastic;
    report.reason = thin.empty() ? fmt::format("{} nodes are sparse (up to {}): elastic surface", count, elastic_nodes)
                                 : fmt::format("{} nodes on {} (up to {}): elastic surface", count, thin, thin_nodes);
  }
  return report.scheme == Scheme::kernel && weld.triangles.rows() > 0 && !flat && count > elastic_nodes && count <= most_elastic_nodes &&
         vertices <= elastic_vertices && 2 * inside <= count;
}

// Vertices that stand for the rest: those that hold nodes, then any farther than the spacing from all so far.
std::vector<int> choose_sources(const Weld& weld, const Graph& graph, double area, int wanted) {
  std::vector<int> chosen;
  if (wanted >= graph.vertices) {
    chosen.resize(graph.vertices);
    std::iota(chosen.begin(), chosen.end(), 0);
    return chosen;
  }
  // Dense packing of discs: about 0.7 of the area is covered at radius spacing / 2.
  const double spacing = std::sqrt(area / (0.9 * wanted));
  const PointGrid grid(weld.positions);
  std::vector<char> shadowed(graph.vertices, 0);
  std::vector<int> near;
  auto take = [&](int v, double radius) {
    chosen.push_back(v);
    grid.within(weld.positions.row(v).transpose(), radius, near);
    for (const int w : near) shadowed[w] = 1;
  };
  for (const int v : graph.node_vertex)
    if (std::find(chosen.begin(), chosen.end(), v) == chosen.end()) take(v, 0.5 * spacing);
  for (int v = 0; v < graph.vertices; ++v)
    if (!shadowed[v]) take(v, spacing);
  return chosen;
}

// Elastic solution at sources, which then move the vertices: all vertices where the dense table of N columns stays small.
Partition make_green_map(Map& map, const Weld& weld, const Graph& graph, double thickness, PartitionOptions how) {
  const int count = graph.nodes;
  constexpr int table = 500000;  // vertices times nodes: 36 MB
  const int wanted = std::max(4 * count, std::min(graph.vertices, table / std::max(1, count)));
  const double area = measure_solidity(weld.positions, weld.triangles).area;
  const bool lattice = map.report.scheme == Scheme::lattice;
  const std::vector<int> chosen =
      choose_sources(weld, graph, area, lattice ? std::min(wanted, std::max(4 * count, lattice_sources)) : wanted);
  Green green = lattice ? lattice_green(weld, map.node_positions, chosen, how.threads)
                        : elastic_green(weld, graph, map.node_positions, chosen, {thickness, map.rotations, how.threads});
  DenseLift lift;
  lift.node_positions = map.node_positions;
  lift.source_positions.resize(static_cast<Eigen::Index>(chosen.size()), 3);
  for (size_t k = 0; k < chosen.size(); ++k) lift.source_positions.row(static_cast<Eigen::Index>(k)) = weld.positions.row(chosen[k]);
  Partition part;
  if (static_cast<int>(chosen.size()) == graph.vertices) {
    part.weights.rows = part.weights.cols = graph.vertices;
    part.weights.column = chosen;
    part.weights.single.assign(chosen.size(), 1.0f);
    if (how.precise) part.weights.precise.assign(chosen.size(), 1.0);
    part.weights.begin.resize(chosen.size() + 1);
    std::iota(part.weights.begin.begin(), part.weights.begin.end(), std::int64_t{0});
  } else {
    const Graph among = make_graph(weld, lift.source_positions, 8, false);
    how.patch_nodes = 24;
    how.rotations = false;
    how.arms = false;
    part = make_partition(weld, among, lift.source_positions, how);
  }
  // Sum of the norms of the 3 x 3 blocks of each source: how far the nodes' errors can grow.
  part.lebesgue = 0.0;
  for (Eigen::Index s = 0; s < green.displacement.rows() / 3; ++s) {
    double sum = 0.0;
    for (Eigen::Index i = 0; i < count; ++i) sum += green.displacement.block<3, 3>(3 * s, 3 * i).norm() / std::sqrt(3.0);
    if (!(sum <= part.lebesgue)) {
      part.lebesgue = sum;
      part.lebesgue_vertex = chosen[s];
    }
  }
  lift.displacement = std::move(green.displacement);
  lift.rotation = std::move(green.rotation);
  part.soft = std::move(green.soft);
  if (count > 2) {
    map.leave_one_out.dense = std::move(green.leave_one_out);
    map.leave_one_out.turn = std::move(green.leave_one_out_turn);
  }
  map.lift = std::move(lift);
  return part;
}

}  // namespace

Scheme scheme_from_name(std::string_view name) {
  for (const auto& [scheme, known] : scheme_names)
    if (known == name) return scheme;
  throw InputError(fmt::format("unknown scheme '{}'; known are auto, kernel, elastic, lattice, r3, r, tps", name));
}

std::string_view scheme_name(Scheme scheme) {
  for (const auto& [known, name] : scheme_names)
    if (known == scheme) return name;
  return "auto";
}

std::vector<int> weld_rows(const MeshView& mesh, const Options& options) {
  return weld_vertices(mesh, weld_share * options.merge_distance * Box(drawn_vertices(mesh)).diagonal()).row;
}

namespace {

void set_scheme(const Options& options, const Layout& layout, Eigen::Index vertices, Map& map) {
  Report& report = map.report;
  report.layout = layout.point ? "point" : layout.axis ? "axis" : layout.plane ? "surface" : "solid";
  report.scheme = options.scheme;
  report.reason = "asked for";
  if (options.scheme != Scheme::automatic) return;
  const int count = static_cast<int>(map.node_positions.rows());
  report.scheme = Scheme::kernel;
  report.reason = layout.point  ? "one node: the mesh follows it rigidly"
                  : layout.axis ? fmt::format("the {} nodes lie along a line: cubic spline of the axis with rigid sections", count)
                                : fmt::format("{} nodes on {} vertices: geodesic partition of unity", count, vertices);
}

void map_along_axis(const Nodes& nodes, const Weld& weld, bool precise, Map& map) {
  Report& report = map.report;
  AxisLift axis = make_axis(map.node_positions, nodes.rotations);
  axis.finite = nodes.finite;
  if (!nodes.shear.empty()) {
    std::vector<Mat3> merged(static_cast<size_t>(map.node_positions.rows()));
    for (size_t i = 0; i < nodes.shear.size(); ++i) merged[map.node_of[i]] = nodes.shear[i];
    set_shear(axis, merged);
  }
  const Eigen::VectorXd s = (weld.positions.rowwise() - axis.origin.transpose()) * axis.frame.col(0);
  report.lebesgue = axis_lebesgue(axis, s.minCoeff(), s.maxCoeff());
  map.weights = axis_weights(axis, weld.positions, precise);
  map.lift = std::move(axis);
  if (!nodes.rotations)
    report.warnings.push_back("the nodes lie on a line and have no rotations: torsion is unknown, sections are drawn without twist");
}

PartitionOptions partition_options(const Options& options, Scheme scheme, bool rotations) {
  PartitionOptions how;
  how.patch_nodes = scheme == Scheme::kernel ? std::clamp(options.patch_nodes, 8, 60) : 0;
  how.kernel = scheme == Scheme::r ? KernelType::linear : scheme == Scheme::tps ? KernelType::thin_plate : KernelType::cubic;
  how.rotations = rotations;
  how.lebesgue_limit = options.lebesgue_warn;
  how.precise = options.precise;
  how.threads = thread_count(options.threads);
  return how;
}

// By the surface's own elasticity or a lattice of its inside. loose: why what was chosen for its accuracy does not serve.
Partition map_by_elasticity(const Options& options, const Weld& weld, const Graph& graph, const PartitionOptions& how, Map& map,
                            std::string& loose) {
  Partition part;
  try {
    part = make_green_map(map, weld, graph, options.thickness, how);
    if (!(part.lebesgue <= options.lebesgue_warn)) loose = fmt::format("its Lebesgue constant is {:.3g}", part.lebesgue);
  } catch (const MapError& error) {
    if (options.scheme != Scheme::automatic) throw;
    part.lebesgue = std::numeric_limits<double>::infinity();
    loose = error.what();
  }
  return part;
}

// Along the lines that the nodes make inside a slender body. False: it is none.
bool map_along_curves(const Nodes& nodes, const Weld& weld, const Graph& graph, const Options& options, Map& map) {
  Report& report = map.report;
  std::optional<Skeleton> skeleton = find_skeleton(weld, graph, map.node_positions, nodes.rotations);
  if (!skeleton) return false;
  report.layout = "curve";
  report.scheme = Scheme::kernel;
  const size_t lines = skeleton->curves.chains.size();
  report.reason = fmt::format("the {} nodes lie along {} inside a slender body: spline of fifth degree with rigid sections", graph.nodes,
                              lines == 1 ? "a curved line" : fmt::format("{} lines", lines));
  report.lebesgue = curve_lebesgue(skeleton->curves);
  map.weights = skeleton_weights(*skeleton, weld, options.precise, thread_count(options.threads));
  map.lift = std::move(skeleton->curves);
  if (!nodes.rotations)
    report.warnings.push_back("the nodes lie along lines and have no rotations: torsion is unknown, sections are drawn without twist");
  return true;
}

// Parts that do not know how to move, and what they lack.
void tell_bridged(const Graph& graph, bool rotations, Report& report) {
  if (graph.bridged.empty()) return;
  const Graph::Bridged& first = graph.bridged.front();
  const std::string others = graph.bridged.size() > 1 ? fmt::format(" ({} parts in all, this is the largest)", graph.bridged.size()) : "";
  report.warnings.push_back(fmt::format(
      "a part of the mesh with {} vertices around ({:.4g}, {:.4g}, {:.4g}) holds {} of the nodes and moves with the nearest other part{}; "
      "{}",
      first.vertices, first.middle.x(), first.middle.y(), first.middle.z(), first.nodes, others,
      rotations ? "a node in it makes it move on its own" : "three nodes in it that are not on a line make it move on its own"));
}

// Of a kernel and an elastic surface: which moves the mesh.
struct Candidates {
  Partition elastic, kernel;
  std::string loose;    // why the elastic surface does not serve at all
  bool asked = false;   // the elastic surface was asked because the kernel may err
  double limit = 0.0;   // Lebesgue constant above which the kernel is no map
  double missed = 0.0;  // of the kernel: left_out_error, NaN: not known
};

// The map that the kernel would make, as far as leaving nodes out needs it.
Map kernel_alone(const Map& map, const Partition& kernel) {
  Map own;
  own.nodes = map.nodes;
  own.rotations = map.rotations;
  own.node_of = map.node_of;
  own.node_count = map.node_count;
  own.node_positions = map.node_positions;
  own.lift = kernel.lift;
  own.leave_one_out = kernel.leave_one_out;
  return own;
}

// How much of the mesh's motion the elastic surface (map.lift) makes, 0..1, the rest the kernel; and why. Where leaving nodes out of known
// motions ranks them, the blend of both that errs least; within a wider margin where smooth motions of the whole body speak for the kernel.
double elastic_share(const Weld& weld, const NodeMotions& known, const Candidates& both, const Map& map, std::string& reason) {
  // A blend this near to one of both is that one.
  constexpr double alike = 0.8, clearly = 0.6, little = 0.1;
  if (!both.loose.empty()) return both.kernel.lebesgue < both.elastic.lebesgue ? 0.0 : 1.0;
  reason = bends_worse(weld, map, both.elastic, both.kernel);
  const double own = std::isfinite(both.missed) ? left_out_error(map, weld, known) : std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(own)) return reason.empty() ? 1.0 : 0.0;
  if (!reason.empty() && own > clearly * both.missed) return 0.0;
  // Where no blend is known, the rule's choice stays unless the other one errs by much less.
  const bool kernel_rather = both.asked ? own > alike * both.missed : both.missed < clearly * own;
  BestBlend blend{!reason.empty() || !kernel_rather ? 1.0 : 0.0, own};
  const bool blends = reason.empty() && both.kernel.lebesgue <= both.limit;
  const Map other = kernel_alone(map, both.kernel);
  if (const BestBlend best = blends ? best_blend({other, both.kernel.weights}, {map, both.elastic.weights}, weld, known) : blend;
      std::isfinite(best.share))
    blend = best;
  const double share = blend.share < little ? 0.0 : blend.share > 1.0 - little ? 1.0 : blend.share;
  const bool kernel = share < 0.5;
  const double better = 100.0 * (kernel ? both.missed : own), worse = 100.0 * (kernel ? own : both.missed);
  const std::string_view first = kernel ? "kernel" : "elastic surface", second = kernel ? "elastic surface" : "kernel";
  reason = share > 0.0 && share < 1.0
               ? fmt::format(
                     "{} nodes: leaving nodes out of their own motion, {:.0f} % {} and {:.0f} % {} err by {:.2g} %, alone by {:.2g} and "
                     "{:.2g} %",
                     map.node_positions.rows(), 100.0 * (kernel ? 1.0 - share : share), first, 100.0 * (kernel ? share : 1.0 - share),
                     second, 100.0 * blend.error, better, worse)
               : fmt::format("{} nodes: leaving nodes out of their own motion, the {} errs by {:.2g} %, the {} by {:.2g} %",
                             map.node_positions.rows(), first, better, second, worse);
  return share;
}

// The kernel's part, or the part of both, takes the place of the elastic surface's in the map.
Partition take_share(double share, Candidates& both, Map& map) {
  if (share == 1.0) return std::move(both.elastic);
  if (share == 0.0) {
    map.lift = std::move(both.kernel.lift);
    map.leave_one_out = std::move(both.kernel.leave_one_out);
    return std::move(both.kernel);
  }
  both.kernel.weights = join_weights(both.kernel.weights, both.elastic.weights, share);
  map.lift = BlendLift{std::move(both.kernel.lift), std::move(std::get<DenseLift>(map.lift)), share};
  map.leave_one_out.rows = std::move(both.kernel.leave_one_out.rows);
  // Not above what both have.
  if (both.elastic.lebesgue > both.kernel.lebesgue) both.kernel.lebesgue_vertex = both.elastic.lebesgue_vertex;
  both.kernel.lebesgue = share * both.elastic.lebesgue + (1.0 - share) * both.kernel.lebesgue;
  return std::move(both.kernel);
}

// Kernel, elastic surface or lattice, with the map's lift.
Partition map_by_scheme(const Weld& weld, const Graph& graph, const Options& options, const NodeMotions& known, bool doubtful, Map& map) {
  // A kernel that errs by less is good enough to leave the cost of an elastic surface; uneven nodes make a large Lebesgue constant.
  constexpr double worth = 0.02, uneven = 7.0;
  Report& report = map.report;
  const bool automatic = options.scheme == Scheme::automatic;
  bool green = report.scheme == Scheme::elastic || report.scheme == Scheme::lattice;
  PartitionOptions how = partition_options(options, report.scheme, map.rotations);
  Candidates both;
  both.limit = options.lebesgue_error;
  if (!green || automatic) {
    if (automatic) how.patch_nodes = std::clamp(options.patch_nodes, 8, 60);
    both.kernel = make_tried_partition(weld, graph, map.node_positions, how);
    both.missed = automatic && (green || doubtful) ? left_out_error(kernel_alone(map, both.kernel), weld, known) : 0.0;
    both.asked = automatic && doubtful && (std::isfinite(both.missed) ? both.missed > worth : both.kernel.lebesgue > uneven);
  }
  if (both.asked) {
    report.scheme = Scheme::elastic;
    green = true;
  }
  std::string reason;
  if (green) both.elastic = map_by_elasticity(options, weld, graph, how, map, both.loose);
  const double share = !green ? 0.0 : automatic ? elastic_share(weld, known, both, map, reason) : 1.0;
  const bool kernel = share < 0.5;
  if (green && automatic) {
    if (kernel && !both.loose.empty() && !both.asked)
      report.warnings.push_back(fmt::format("kernel instead of {}: {}", scheme_name(report.scheme), both.loose));
    if (!reason.empty()) report.reason = reason;
    else if (kernel && !both.asked) report.reason = fmt::format("{} nodes are too few for the elastic surface", map.node_positions.rows());
    else if (!kernel && both.asked) report.reason = fmt::format("{} nodes, unevenly spread: elastic surface", map.node_positions.rows());
  }
  if (green && kernel) report.scheme = Scheme::kernel;
  return take_share(share, both, map);
}

void map_over_surface(const Nodes& nodes, const Weld& weld, const Layout& layout, const Options& options, const NodeMotions& known,
                      Map& map) {
  Report& report = map.report;
  const Graph graph = make_graph(weld, map.node_positions, 8, nodes.rotations);
  if ((options.scheme == Scheme::automatic || options.scheme == Scheme::kernel) && !layout.point &&
      map_along_curves(nodes, weld, graph, options, map))
    return;
  const bool doubtful = options.scheme == Scheme::automatic && !layout.point && choose_scheme(map, weld, graph);
  tell_bridged(graph, nodes.rotations, report);
  if (weld.triangles.rows() == 0 && (report.scheme == Scheme::elastic || report.scheme == Scheme::lattice))
    throw InputError(fmt::format("scheme {} needs a mesh with faces; for a cloud of points take auto, kernel, r3, r or tps",
                                 scheme_name(report.scheme)));
  if (report.scheme == Scheme::lattice && !measure_solidity(weld.positions, weld.triangles).closed) {
    report.scheme = Scheme::elastic;
    report.warnings.push_back("the mesh is not closed, so that its inside has no lattice: elastic surface instead");
  }
  Partition part = map_by_scheme(weld, graph, options, known, doubtful, map);
  map.weights = std::move(part.weights);
  report.lebesgue = part.lebesgue;
  report.patches = part.patches;
  const auto* blend = std::get_if<BlendLift>(&map.lift);
  if (const ArmLift* arms = blend ? &blend->arms : std::get_if<ArmLift>(&map.lift)) {
    const auto unknown = std::count_if(arms->estimate.begin(), arms->estimate.end(), [](const auto& e) { return e.tangents < 2; });
    if (unknown > 0)
      report.warnings.push_back(
          fmt::format("{} of {} nodes lie nearly on a line with those around and have no rotations: the turn about it "
                      "is unknown, the mesh there is drawn without it",
                      unknown, map.node_positions.rows()));
  }
  for (size_t v = 0; v < map.welded.size() && report.lebesgue_vertex < 0; ++v)
    if (map.welded[v] == part.lebesgue_vertex) report.lebesgue_vertex = static_cast<int>(v);
  if (part.repaired > 0)
    report.warnings.push_back(
        fmt::format("{} of {} patches were simplified because they would amplify errors of the nodes (Lebesgue constant above {:g})",
                    part.repaired, part.patches, options.lebesgue_warn));
}

void judge_lebesgue(const Options& options, Report& report) {
  if (!(report.lebesgue <= options.lebesgue_error))
    throw MapError(
        fmt::format("the nodes do not determine the motion of the mesh: at vertex {1} it amplifies errors of the nodes {0:.3g} times "
                    "(Lebesgue constant, limit {2:g}); add nodes there, or give rotations",
                    report.lebesgue, report.lebesgue_vertex, options.lebesgue_error));
  if (report.lebesgue > options.lebesgue_warn)
    report.warnings.push_back(
        fmt::format("errors of the nodes' data are amplified up to {:.3g} times at vertex {} (Lebesgue constant); add nodes there",
                    report.lebesgue, report.lebesgue_vertex));
}

}  // namespace

Points merge_data(const Map& map, const Eigen::Ref<const Points>& data) {
  if (data.rows() == 0) return Points(0, 3);
  Points out = Points::Zero(map.node_positions.rows(), 3);
  for (Eigen::Index i = 0; i < data.rows(); ++i) {
    const int k = map.node_of[i];
    out.row(k) += data.row(i) / map.node_count[k];
  }
  return out;
}

Map make_map(const Nodes& nodes, const MeshView& mesh, const Options& options) { return make_map_for(nodes, mesh, options, {}); }

Map make_map_for(const Nodes& nodes, const MeshView& mesh, const Options& options, const NodeMotions& known) {
  const auto start = std::chrono::steady_clock::now();
  check_input(nodes, mesh);
  check_motions(nodes, known);
  Map map;
  Report& report = map.report;
  map.nodes = static_cast<int>(nodes.positions.rows());
  map.vertices = static_cast<int>(mesh.vertices.rows());
  map.rotations = nodes.rotations;

  const Points vertices = drawn_vertices(mesh);
  check_scale(nodes.positions, vertices);
  const double size = Box(vertices).diagonal();
  merge_nodes(nodes.positions, options.merge_distance * size, map);
  if (report.merged_nodes > 0)
    report.warnings.push_back(fmt::format("{} simulation node(s) lie within {:.1e} of another and were merged with it", report.merged_nodes,
                                          options.merge_distance * size));
  Weld weld = weld_vertices(mesh, weld_share * options.merge_distance * size);
  map.welded = weld.row;
  drop_fins(weld);
  const Points body = points_without_strays(weld);
  weld.size = Box(body).diagonal();

  const Layout layout = find_layout(map.node_positions, body);
  set_scheme(options, layout, weld.positions.rows(), map);
  if (layout.axis && report.scheme == Scheme::kernel) map_along_axis(nodes, weld, options.precise, map);
  else map_over_surface(nodes, weld, layout, options, known, map);
  judge_lebesgue(options, report);
  report.setup_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return map;
}

void apply(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation, std::span<float> out) {
  if (out.size() != 3 * static_cast<size_t>(map.vertices))
    throw InputError(fmt::format("room for {} floats given, {} vertices need {}", out.size(), map.vertices, 3 * map.vertices));
  // Beyond this the sums of single precision are not finite any more.
  constexpr double most = 1e30;
  if (displacement.size() > 0 && !(displacement.cwiseAbs().maxCoeff() < most)) {
    check_data(map, displacement, rotation);
    throw InputError(
        fmt::format("a node is displaced by {:g}: single precision holds less than {:g}", displacement.cwiseAbs().maxCoeff(), most));
  }
  const PointsF sources = sources_of(map, displacement, rotation, true).cast<float>();
  multiply_single(map.weights, sources, map.welded, out, 1);
}

void apply(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation, PointsF& out) {
  out.resize(map.vertices, 3);
  apply(map, displacement, rotation, std::span<float>(out.data(), out.size()));
}

Points apply_precise(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation) {
  return multiply_precise(map.weights, sources_of(map, displacement, rotation, true), map.welded);
}

Points apply_linear(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation) {
  return multiply_precise(map.weights, sources_of(map, displacement, rotation, false), map.welded);
}

Points mode_sources(const Map& map, const Eigen::VectorXd& phi, const Eigen::VectorXd& psi) {
  return sources_of(map, Eigen::Map<const Points>(phi.data(), phi.size() / 3, 3), Eigen::Map<const Points>(psi.data(), psi.size() / 3, 3),
                    false);
}

namespace {

// Each inner node of a chain, at most 64 of them, from the chain of the others.
void leave_out_of_curves(const Map& map, const CurveLift& curves, const Points& u, const Points& theta, Points& residual) {
  for (int c = 0; c < static_cast<int>(curves.chains.size()); ++c) {
    const Chain& chain = curves.chains[c];
    const auto n = static_cast<int>(chain.node.size());
    for (int k = 0; k < n; k += std::max(1, n / 64)) {
      const std::optional<CurveLift> others = without_node(curves, c, k);
      if (!others) continue;
      const int node = chain.node[k];
      const Vec3 x = map.node_positions.row(node).transpose();
      const Foot foot = find_foot(*others, 0, 0, static_cast<int>(others->chains[0].span.size()), x);
      std::vector<std::pair<int, double>> entries;
      add_foot(*others, foot, 1.0, x, entries);
      const Points sources = lift_exact(Lift(*others), u, theta);
      residual.row(node) = -u.row(node);
      for (const auto& [source, weight] : entries) residual.row(node) += weight * sources.row(source);
    }
  }
}

// In the frame that follows the nodes.
Points residuals_of_points(const Map& map, const Points& u, const Points& theta) {
  const LocalMotion local = local_motion(map.node_positions, u, theta);
  Eigen::VectorXd r = map.leave_one_out.dense * Eigen::Map<const Eigen::VectorXd>(local.displacement.data(), local.displacement.size());
  if (map.leave_one_out.turn.size() > 0 && theta.rows() > 0)
    r += map.leave_one_out.turn * Eigen::Map<const Eigen::VectorXd>(local.rotation.data(), local.rotation.size());
  return Eigen::Map<const Points>(r.data(), u.rows(), 3);
}

// Of the nodes that patches predict; kept: share of what stands there already.
void residuals_of_rows(const Map& map, const Points& u, const Points& theta, double kept, Points& residual) {
  const Points sources = lift_exact(map.lift, u, theta);
  const SparseWeights& w = map.leave_one_out.rows;
  for (Eigen::Index i = 0; i < u.rows(); ++i) {
    const size_t begin = w.begin[i], end = w.begin[i + 1];
    if (begin == end) continue;
    Vec3 sum = Vec3::Zero();
    for (size_t k = begin; k < end; ++k) sum += w.precise[k] * sources.row(w.column[k]).transpose();
    if (kept > 0.0) residual.row(i) = kept * residual.row(i) + (1.0 - kept) * sum.transpose();
    else residual.row(i) = sum.transpose();
  }
}

}  // namespace

Points node_residuals(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation) {
  check_data(map, displacement, rotation);
  const Points u = merge_data(map, displacement);
  const Points theta = map.rotations ? merge_data(map, rotation) : Points(0, 3);
  const Eigen::Index n = u.rows();
  Points residual = Points::Constant(n, 3, std::numeric_limits<double>::quiet_NaN());
  if (const auto* axis = std::get_if<AxisLift>(&map.lift); axis != nullptr && n >= 4) {
    // Interior nodes, at most 64 of them, from the spline of the others.
    const Eigen::Index step = std::max<Eigen::Index>(1, (n - 2) / 64);
    for (Eigen::Index k = 1; k + 1 < n; k += step) {
      Points c(n - 1, 3), d(n - 1, 3), r(theta.rows() > 0 ? n - 1 : 0, 3);
      for (Eigen::Index j = 0; j < n - 1; ++j) {
        const int i = axis->order[j < k ? j : j + 1];
        c.row(j) = map.node_positions.row(i);
        d.row(j) = u.row(i);
        if (theta.rows() > 0) r.row(j) = theta.row(i);
      }
      const int left_out = axis->order[k];
      AxisLift others = make_axis(c, map.rotations);
      others.finite = axis->finite;
      const SparseWeights at = axis_weights(others, map.node_positions.row(left_out), true);
      const std::array<int, 1> only{0};
      residual.row(left_out) = multiply_precise(at, lift_exact(Lift(std::move(others)), d, r), only).row(0) - u.row(left_out);
    }
  } else if (const auto* curves = std::get_if<CurveLift>(&map.lift); curves != nullptr) {
    leave_out_of_curves(map, *curves, u, theta, residual);
  } else {
    const Points dense = map.leave_one_out.dense.size() > 0 ? residuals_of_points(map, u, theta) : Points(0, 3);
    if (dense.rows() == n) residual = dense;
    if (map.leave_one_out.rows.rows == n) {
      const auto* blend = std::get_if<BlendLift>(&map.lift);
      residuals_of_rows(map, u, theta, blend && dense.rows() == n ? blend->share : 0.0, residual);
    }
  }
  return residual;
}

LeaveOneOutError leave_one_out(const Map& map, const Eigen::Ref<const Points>& displacement, const Eigen::Ref<const Points>& rotation) {
  const Points residual = node_residuals(map, displacement, rotation);
  const Points u = merge_data(map, displacement);
  const Points theta = map.rotations ? merge_data(map, rotation) : Points(0, 3);
  const Eigen::Index n = u.rows();
  LeaveOneOutError error;
  const RigidMotion rigid = best_rigid_motion(map.node_positions, u, theta);
  double squares = 0.0, reference = 0.0;
  int counted = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    reference += (u.row(i).transpose() - rigid.displacement(map.node_positions.row(i).transpose())).squaredNorm() / static_cast<double>(n);
    const double r = residual.row(i).norm();
    if (!std::isfinite(r)) continue;
    ++counted;
    squares += r * r;
    if (r > error.maximum) {
      error.maximum = r;
      for (size_t given = 0; given < map.node_of.size(); ++given)
        if (map.node_of[given] == i) {
          error.node = static_cast<int>(given);
          break;
        }
    }
  }
  if (counted == 0) {
    error.relative = std::numeric_limits<double>::quiet_NaN();
    return error;
  }
  // A rigid motion leaves only rounding on both sides.
  const double scale = u.cwiseAbs().maxCoeff();
  error.relative = reference > 1e-24 * scale * scale ? std::sqrt(squares / counted / reference) : 0.0;
  return error;
}

std::string merged_nodes_differ(const Map& map, const Nodes& nodes, const Eigen::Ref<const Points>& displacement) {
  if (map.report.merged_nodes == 0) return {};
  std::vector<int> first(map.node_count.size(), -1);
  double worst = 0.0;
  Eigen::Index a = 0, b = 0;
  for (Eigen::Index i = 0; i < displacement.rows(); ++i) {
    int& f = first[map.node_of[i]];
    if (f < 0) {
      f = static_cast<int>(i);
      continue;
    }
    const double d = (displacement.row(i) - displacement.row(f)).norm();
    if (d > worst) {
      worst = d;
      a = f;
      b = i;
    }
  }
  // Equal up to the rounding of printed data.
  if (worst <= 1e-6 * displacement.cwiseAbs().maxCoeff()) return {};
  return fmt::format("nodes {} and {} are at one place but their displacements differ by {:.3g} m; their mean is used",
                     node_label(nodes, a), node_label(nodes, b), worst);
}

}  // namespace flexframe::interp
