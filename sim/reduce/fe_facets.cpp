// The surface between facets. See fe_facets.h.
#include "sim/reduce/fe_facets.h"

#include "sim/reduce/fe_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

namespace flexframe::sim {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double largest_kink = 62.0 * degree, largest_turn = 50.0 * degree, small_kink = 2.0 * degree;

using FacetEdge = std::pair<int, int>;
FacetEdge edge_between(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

struct Facet {
  int element = 0;
  std::vector<int> corners;
  Vec3 normal, middle;
  std::array<int, 4> neighbour{-1, -1, -1, -1};  // across its edges, where the surface goes on
  std::array<double, 4> side{};                  // -1: its normal looks the other way
  Mat3 curvature = Mat3::Zero();  // of the surface along directions in the facet, 1/m, above 0 where the normal looks outward
  double beside = 0.0;            // of the heights of the corners around the share that no one curvature gives
};

class FacetMesh {
 public:
  explicit FacetMesh(const FeModel& m) : model(m) {
    for (size_t i = 0; i < model.elements.size(); ++i) add(model.elements[i], static_cast<int>(i));
    for (const auto& [edge, at] : edges) join(at);
  }

  // Elements that go on in each other and whose normals look opposite ways.
  std::vector<std::pair<int, int>> opposite_neighbours() const {
    std::vector<std::pair<int, int>> out;
    for (const Facet& f : facets)
      for (size_t k = 0; k < f.corners.size(); ++k)
        if (const int other = f.neighbour[k]; other >= 0 && f.side[k] < 0.0 && f.element < facets[other].element)
          out.emplace_back(f.element, facets[other].element);
    return out;
  }

  std::map<FacetEdge, Vec3> rises() {
    for (Facet& f : facets) fit(f);
    separate_folds();
    for (Facet& f : facets) fit(f);
    for (const auto& [edge, at] : edges)
      if (at.size() == 1) {
        rim[edge.first].push_back(edge.second);
        rim[edge.second].push_back(edge.first);
      }
    constexpr double rounding = 1e-5;  // of the edge: what coordinates of a few digits make of a plane
    std::map<FacetEdge, Vec3> out;
    for (const auto& [edge, at] : edges) {
      const double length = (model.nodes[edge.second] - model.nodes[edge.first]).norm();
      const Vec3 rise = rise_of(edge, at);
      if (rise.norm() > rounding * length && !has_middle(edge, rise)) out[edge] = rise;
    }
    return out;
  }

 private:
  struct Place {
    int facet, edge;
  };

  const FeModel& model;
  std::vector<Facet> facets;
  std::map<FacetEdge, std::vector<Place>> edges;
  std::map<FacetEdge, int> middles;     // nodes of quadratic shells
  std::map<int, std::vector<int>> rim;  // of a node on an edge of the mesh: the next ones along it

  void add(const FeElement& e, int index) {
    if (!fe_is_shell(e.shape)) return;
    const int count = e.shape == FeShape::triangle3 || e.shape == FeShape::triangle6 ? 3 : 4;
    Facet f;
    f.element = index;
    f.corners.assign(model.connectivity.begin() + e.first, model.connectivity.begin() + e.first + count);
    Mat3X X(3, count);
    for (int i = 0; i < count; ++i) X.col(i) = model.nodes[f.corners[i]];
    f.normal = count == 3 ? Vec3((X.col(1) - X.col(0)).cross(X.col(2) - X.col(0))) : Vec3((X.col(2) - X.col(0)).cross(X.col(3) - X.col(1)));
    if (!(f.normal.norm() > 0.0)) return;  // refused elsewhere
    f.normal.normalize();
    f.middle = X.rowwise().mean();
    for (int k = 0; k < count; ++k) {
      const int a = f.corners[k], b = f.corners[(k + 1) % count];
      if (a == b) continue;  // a triangle written as a quadrangle
      edges[edge_between(a, b)].push_back({static_cast<int>(facets.size()), k});
      if (const int m = fe_middle(e.shape, k, (k + 1) % count); m >= 0) middles[edge_between(a, b)] = model.connectivity[e.first + m];
    }
    facets.push_back(std::move(f));
  }

  // Normals look the same way where the edge is passed in opposite directions.
  double side_of(const Place& a, const Place& b) const {
    return facets[a.facet].corners[a.edge] == facets[b.facet].corners[b.edge] ? -1.0 : 1.0;
  }

  double kink(const Place& a, const Place& b) const {
    return std::acos(std::clamp(side_of(a, b) * facets[a.facet].normal.dot(facets[b.facet].normal), -1.0, 1.0));
  }

  // Of several plates at an edge (a rib on a skin) those that go on most nearly straight belong together.
  void join(const std::vector<Place>& at) {
    double least = largest_kink;
    const Place *one = nullptr, *other = nullptr;
    for (const Place& a : at)
      for (const Place& b : at)
        if (&a < &b && kink(a, b) < least) {
          least = kink(a, b);
          one = &a;
          other = &b;
        }
    if (!one) return;
    facets[one->facet].neighbour[one->edge] = other->facet;
    facets[other->facet].neighbour[other->edge] = one->facet;
    facets[one->facet].side[one->edge] = facets[other->facet].side[other->edge] = side_of(*one, *other);
  }

  static bool shares_corner(const Facet& f, const Facet& to) {
    return std::any_of(to.corners.begin(), to.corners.end(),
                       [&](int n) { return std::find(f.corners.begin(), f.corners.end(), n) != f.corners.end(); });
  }

  // Corners of f and of the facets that it joins at smooth edges; of a triangle, whose neighbours say too little, of those too that share a
  // corner with it and are reached across smooth edges.
  std::set<int> corners_around(const Facet& f) const {
    std::set<int> out(f.corners.begin(), f.corners.end());
    std::set<const Facet*> met = {&f};
    std::vector<const Facet*> next = {&f};
    while (!next.empty()) {
      const Facet& from = *next.back();
      next.pop_back();
      for (const int index : from.neighbour) {
        if (index < 0) continue;
        const Facet& to = facets[index];
        if (!shares_corner(f, to) || !met.insert(&to).second) continue;
        out.insert(to.corners.begin(), to.corners.end());
        if (f.corners.size() == 3) next.push_back(&to);
      }
    }
    return out;
  }

  bool goes_straight_on(const Facet& f, const Vec3& normal) const {
    constexpr double even = 1e-4;
    return std::all_of(f.neighbour.begin(), f.neighbour.end(),
                       [&](int k) { return k < 0 || normal.cross(facets[k].normal).norm() < even; });
  }

  // A quadrangle without warp whose neighbours go straight on, or a triangle whose next ones do too: most of what is flat.
  bool lies_in_a_plane(const Facet& f) const {
    constexpr double even = 1e-4;
    for (const int n : f.corners) {
      const Vec3 way = model.nodes[n] - f.middle;
      if (std::abs(f.normal.dot(way)) > even * way.norm()) return false;
    }
    return goes_straight_on(f, f.normal) && (f.corners.size() == 4 || std::all_of(f.neighbour.begin(), f.neighbour.end(), [&](int k) {
                                               return k < 0 || goes_straight_on(facets[k], f.normal);
                                             }));
  }

  // By least squares over the corners around; along directions that they say nothing of the surface is flat.
  void fit(Facet& f) const {
    f.curvature.setZero();
    f.beside = 0.0;
    if (lies_in_a_plane(f)) return;
    const std::set<int> corners = corners_around(f);
    const Vec3 t1 = f.normal.unitOrthogonal(), t2 = f.normal.cross(t1);
    const Eigen::Index count = std::ssize(corners);
    MatX place(count, 2);
    VecX height(count);
    Eigen::Index row = 0;
    for (const int n : corners) {
      // A circle through the facet's middle: the way along it and the parabola that has its curvature.
      const Vec3 way = model.nodes[n] - f.middle;
      const Eigen::Vector2d flat(t1.dot(way), t2.dot(way));
      const double up = std::atan2(f.normal.dot(way), flat.norm()), along = way.norm() * (up == 0.0 ? 1.0 : up / std::sin(up));
      place.row(row) = flat.norm() > 0.0 ? Eigen::RowVector2d(along / flat.norm() * flat.transpose()) : Eigen::RowVector2d::Zero();
      height(row++) = up * along;
    }
    // Of the size of one along both axes.
    place.rowwise() -= place.colwise().mean();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> spread(place.transpose() * place / static_cast<double>(count));
    if (!(spread.eigenvalues()(0) > 1e-8 * spread.eigenvalues()(1))) return;
    const Eigen::Matrix2d scale = spread.eigenvectors() * spread.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal();
    const MatX q = place * scale;
    MatX plane(count, 3), bent(count, 3);
    plane << VecX::Ones(count), q;
    bent << 0.5 * q.col(0).cwiseAbs2(), q.col(0).cwiseProduct(q.col(1)), 0.5 * q.col(1).cwiseAbs2();
    const Mat3 inside = (plane.transpose() * plane).inverse();
    bent -= plane * (inside * (plane.transpose() * bent)).eval();
    height -= plane * (inside * (plane.transpose() * height)).eval();
    constexpr double unseen = 0.01;
    const Eigen::SelfAdjointEigenSolver<Mat3> normal(bent.transpose() * bent);
    const double least = unseen * static_cast<double>(count);
    const Vec3 inverse = normal.eigenvalues().unaryExpr([&](double v) { return v > least ? 1.0 / v : 0.0; });
    const Vec3 S = normal.eigenvectors() * inverse.asDiagonal() * normal.eigenvectors().transpose() * (bent.transpose() * height);
    if (height.norm() > 0.0) f.beside = (bent * S - height).norm() / height.norm();
    Eigen::Matrix2d H;
    H << S(0), S(1), S(1), S(2);
    Eigen::Matrix<double, 3, 2> axes;
    axes << t1, t2;
    f.curvature = -axes * scale * H * scale.transpose() * axes.transpose();
  }

  // Angle at which the facet goes on across its edge k, above 0 where its normal looks outward.
  double bend_across(const Facet& f, size_t k) const {
    const Facet& o = facets[f.neighbour[k]];
    const double angle = std::acos(std::clamp(f.side[k] * f.normal.dot(o.normal), -1.0, 1.0));
    return f.normal.dot(o.middle - f.middle) < 0.0 ? angle : -angle;
  }

  // The largest such angle at the facet's next edges that lie as edge k does, and at those that continue them; nullopt: there are none.
  std::optional<double> next_bend(const Facet& f, size_t k) const {
    constexpr double along = 0.8;
    const int a = f.corners[k], b = f.corners[(k + 1) % f.corners.size()];
    const Vec3 axis = (model.nodes[b] - model.nodes[a]).normalized();
    std::optional<double> out;
    std::set<const Facet*> met = {&f, &facets[f.neighbour[k]]};
    std::vector<std::pair<const Facet*, double>> next = {{&f, 1.0}};
    while (!next.empty()) {
      const auto [from, side] = next.back();
      next.pop_back();
      for (size_t i = 0; i < from->corners.size(); ++i) {
        if (from->neighbour[i] < 0) continue;
        const int p = from->corners[i], q = from->corners[(i + 1) % from->corners.size()];
        const auto beyond = [&](int n) { return n != a && n != b && std::find(f.corners.begin(), f.corners.end(), n) != f.corners.end(); };
        const bool touches = p == a || p == b || q == a || q == b;
        if (!touches && (beyond(p) || beyond(q)) && std::abs((model.nodes[q] - model.nodes[p]).normalized().dot(axis)) > along)
          if (const double bend = side * bend_across(*from, i); !out || std::abs(bend) > std::abs(*out)) out = bend;
        const Facet& to = facets[from->neighbour[i]];
        if (shares_corner(f, to) && met.insert(&to).second) next.emplace_back(&to, side * from->side[i]);
      }
    }
    return out;
  }

  // A fold between plates: the surface turns at once there and not beside it, where it is flat or turns the other way.
  void separate_folds() {
    constexpr double alike = 0.25;  // a fold between plates has 0.4
    std::vector<std::pair<Facet*, size_t>> folds;
    for (Facet& f : facets)
      for (size_t k = 0; k < f.corners.size(); ++k) {
        if (f.neighbour[k] < 0) continue;
        const Facet& o = facets[f.neighbour[k]];
        const double bend = bend_across(f, k);
        if (std::abs(bend) <= small_kink || std::max(f.beside, o.beside) <= alike) continue;
        const size_t back = std::find(o.neighbour.begin(), o.neighbour.end(), &f - facets.data()) - o.neighbour.begin();
        const std::optional<double> here = next_bend(f, k), there = next_bend(o, back);
        const auto flat = [&](const std::optional<double>& next) { return next && std::abs(*next) < alike * std::abs(bend); };
        const auto on = [&](const std::optional<double>& next, double side) { return next && side * *next * bend > 0.0; };
        const bool known = here || there;
        if (flat(here) || flat(there) || (known && !on(here, 1.0) && !on(there, f.side[k]))) folds.emplace_back(&f, k);
      }
    for (const auto& [f, k] : folds) f->neighbour[k] = -1;  // each is found from both sides
  }

  // Angle by which an edge of the mesh turns at a node: none (below 0) where it branches or has a corner.
  double turn_at(int node) const {
    const auto found = rim.find(node);
    if (found == rim.end() || found->second.size() != 2) return -1.0;
    const Vec3 in = (model.nodes[node] - model.nodes[found->second[0]]).normalized(),
               out = (model.nodes[found->second[1]] - model.nodes[node]).normalized();
    const double angle = std::acos(std::clamp(in.dot(out), -1.0, 1.0));
    return angle <= largest_turn ? angle : -1.0;
  }

  // Curvature of an edge of the mesh at a node, 1/m, towards its middle; nullopt at corners: it turns there and not at the next nodes.
  std::optional<Vec3> bend_at(int node) const {
    constexpr double alike = 1.0 / 3.0;
    const double angle = turn_at(node);
    if (angle < 0.0) return std::nullopt;
    const auto& ends = rim.at(node);
    if (std::max(turn_at(ends[0]), turn_at(ends[1])) < alike * angle) return std::nullopt;
    const Vec3 in = model.nodes[node] - model.nodes[ends[0]], out = model.nodes[ends[1]] - model.nodes[node];
    const Vec3 turn = out.normalized() - in.normalized();
    return turn.norm() > 0.0 ? Vec3(turn * (angle / turn.norm() / (0.5 * (in.norm() + out.norm())))) : Vec3::Zero();
  }

  // In the facet's plane, across its edge.
  double rise_in_plane(const FacetEdge& edge, const Vec3& across, double square) const {
    double sum = 0.0, ends = 0.0;
    for (const int n : {edge.first, edge.second})
      if (const std::optional<Vec3> bend = bend_at(n)) {
        sum -= bend->dot(across);
        ends += 1.0;
      }
    return ends > 0.0 ? sum / ends * square / 8.0 : 0.0;
  }

  // The displacement along the normals of all plates there that each of them wants: the least one. Of facets that go on smoothly along
  // the mean of their normals.
  Vec3 rise_of(const FacetEdge& edge, const std::vector<Place>& at) const {
    const Vec3 d = model.nodes[edge.second] - model.nodes[edge.first];
    Mat3 A = Mat3::Zero();
    Vec3 b = Vec3::Zero();
    const auto want = [&](const Vec3& n, double rise) {
      A += n * n.transpose();
      b += rise * n;
    };
    for (const Place& p : at) {
      const Facet& f = facets[p.facet];
      const double rise = d.dot(f.curvature * d) / 8.0;
      const int other = f.neighbour[p.edge];
      if (other < 0) want(f.normal, rise);
      else if (p.facet < other) {
        const Facet& o = facets[other];
        want((f.normal + f.side[p.edge] * o.normal).normalized(), 0.5 * (rise + f.side[p.edge] * d.dot(o.curvature * d) / 8.0));
      }
    }
    if (at.size() == 1) {
      const Vec3 across = d.cross(facets[at[0].facet].normal).normalized();
      want(across, rise_in_plane(edge, across, d.squaredNorm()));
    }
    constexpr double apart = 0.1;  // plates at less than some 35 degrees have their mean
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(A);
    Vec3 inverse = solver.eigenvalues();
    for (double& v : inverse) v = v > apart * solver.eigenvalues()(2) ? 1.0 / v : 0.0;
    return solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose() * b;
  }

  // Whether a quadratic shell has its middle node where the surface is, not on the straight line.
  bool has_middle(const FacetEdge& edge, const Vec3& rise) const {
    constexpr double straight = 0.2;
    const auto found = middles.find(edge);
    if (found == middles.end()) return false;
    const Vec3 beside = model.nodes[found->second] - 0.5 * (model.nodes[edge.first] + model.nodes[edge.second]);
    const Vec3 d = (model.nodes[edge.second] - model.nodes[edge.first]).normalized();
    return (beside - d * d.dot(beside)).norm() > straight * rise.norm();
  }
};

void add_triangle(double mass, const Vec3& a, const Vec3& b, const Vec3& c, double& sum, Mat3& second) {
  Mat3 corners;
  corners << a, b, c;
  const double part = mass * 0.5 * (b - a).cross(c - a).norm();
  const Vec3 all = corners.rowwise().sum();
  sum += part;
  second += part / 12.0 * (corners * corners.transpose() + all * all.transpose());
}

// A flat shell as it is and in four; a warped quadrangle's mean plane is what the program takes the mass of.
void add_flat(const FacetRises& rises, const int* nodes, double mass, const Mat3X& X, FacetMoments& out) {
  const Eigen::Index n = X.cols();
  double whole = 0.0, parts = 0.0;
  Mat3 whole_second = Mat3::Zero(), parts_second = Mat3::Zero();
  Mat3X middle(3, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index next = (k + 1) % n;
    middle.col(k) = 0.5 * (X.col(k) + X.col(next)) + rises.of(nodes[k], nodes[next]);
  }
  if (n == 3) {
    add_triangle(mass, X.col(0), X.col(1), X.col(2), whole, whole_second);
    for (Eigen::Index k = 0; k < n; ++k) add_triangle(mass, X.col(k), middle.col(k), middle.col((k + 2) % 3), parts, parts_second);
    add_triangle(mass, middle.col(0), middle.col(1), middle.col(2), parts, parts_second);
  } else {
    const Vec3 centre = X.rowwise().mean() + rises.of_middle(nodes);
    const auto quadrangle = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, double& sum, Mat3& second) {
      double area = 0.0;
      Mat3 moment = Mat3::Zero();
      add_triangle(1.0, a, b, c, area, moment);
      add_triangle(1.0, a, c, d, area, moment);
      const double flat = area > 0.0 ? mass * 0.5 * (c - a).cross(d - b).norm() / area : 0.0;
      sum += flat * area;
      second += flat * moment;
    };
    quadrangle(X.col(0), X.col(1), X.col(2), X.col(3), whole, whole_second);
    for (Eigen::Index k = 0; k < n; ++k) quadrangle(X.col(k), middle.col(k), centre, middle.col((k + 3) % 4), parts, parts_second);
  }
  // Half the size leaves a quarter of what is missing.
  out.mass += whole;
  out.second += whole_second;
  out.smooth_mass += parts + (parts - whole) / 3.0;
  out.smooth_second += parts_second + (parts_second - whole_second) / 3.0;
}

// What is not the same from both sides of a shell: heights above its nodes of the middles of its mass and of its stiffness (invariants of A
// and B), m, which change their sign with its normal, and whether layers are turned about it.
struct Sides {
  double mass = 0.0, stiffness = 0.0;
  bool turned = false;
};
Sides sides_of(const FeModel& model, const FeElement& e) {
  Mat3X X(3, e.count);
  for (int i = 0; i < e.count; ++i) X.col(i) = model.nodes[model.connectivity[e.first + i]];
  double area = 0.0;
  const FeShellLaw law = shell_law(model, e, shell_axes(e.shape, X, e.id, area));
  const auto whole = [](const Mat3& m) { return m(0, 0) + m(1, 1) + 2.0 * m(0, 1); };
  Sides out;
  out.mass = law.m0 > 0.0 ? law.m1 / law.m0 : 0.0;
  out.stiffness = whole(law.B) / whole(law.A);
  if (e.section >= 0)
    for (const FeLayer& l : model.layups[e.section].layers) out.turned = out.turned || std::abs(std::sin(2.0 * l.angle)) > 1e-6;
  return out;
}

std::string opposite_shells(const FeModel& model) {
  constexpr double same = 1e-3;  // of the thickness
  int count = 0;
  std::pair<int, int> first;
  for (const auto& [a, b] : FacetMesh(model).opposite_neighbours()) {
    const FeElement &one = model.elements[a], &other = model.elements[b];
    if (one.section < 0 && other.section < 0) continue;
    const Sides p = sides_of(model, one), q = sides_of(model, other);
    const double thickness = std::max(one.thickness, other.thickness);
    if (std::max(std::abs(p.mass + q.mass), std::abs(p.stiffness + q.stiffness)) <= same * thickness && !p.turned && !q.turned) continue;
    if (count++ == 0) first = {a, b};
  }
  if (count == 0) return {};
  return fmt::format(
      "{}: the normals of {} pairs of neighbouring shells look opposite ways (elements {} and {} for one) though their walls are beside "
      "their nodes (OFFSET, ZOFFS, Z0) or their layers are not the same from both sides: these change sides there, and mass, stiffness and "
      "frequencies with them; turn the order of nodes of one of the two around",
      model.file, count, model.elements[first.first].id, model.elements[first.second].id);
}

std::string doubled_shells(const FeModel& model) {
  std::map<std::vector<int>, std::vector<int>> met;
  int count = 0;
  std::pair<int, int> first;
  for (size_t i = 0; i < model.elements.size(); ++i) {
    const FeElement& e = model.elements[i];
    if (!fe_is_shell(e.shape)) continue;
    std::vector<int> nodes(model.connectivity.begin() + e.first, model.connectivity.begin() + e.first + e.count);
    std::sort(nodes.begin(), nodes.end());
    std::vector<int>& others = met[nodes];
    // A skin and what stiffens it may share nodes: then they are not the same.
    for (const int k : others)
      if (const FeElement& o = model.elements[k]; o.material == e.material && o.thickness == e.thickness && o.section == e.section) {
        if (count++ == 0) first = {static_cast<int>(i), k};
        break;
      }
    others.push_back(static_cast<int>(i));
  }
  if (count == 0) return {};
  return fmt::format(
      "{}: {} shells lie on the same nodes as others of the same thickness and material (element {} on those of element {}): their mass "
      "and stiffness count twice; take them out if they were written twice",
      model.file, count, model.elements[first.first].id, model.elements[first.second].id);
}

}  // namespace

std::vector<std::string> shells_in_doubt(const FeModel& model) {
  std::vector<std::string> out;
  if (model.matrices) return out;
  for (std::string text : {doubled_shells(model), opposite_shells(model)})
    if (!text.empty()) out.push_back(std::move(text));
  return out;
}

FacetRises::FacetRises(const FeModel& model) {
  if (std::any_of(model.elements.begin(), model.elements.end(), [](const FeElement& e) { return fe_is_shell(e.shape); }))
    rises = FacetMesh(model).rises();
}

Vec3 FacetRises::of(int a, int b) const {
  const auto found = rises.find(edge_between(a, b));
  return found == rises.end() ? Vec3::Zero() : found->second;
}

Vec3 FacetRises::of_middle(const int* corners) const {
  return 0.5 * (of(corners[0], corners[1]) + of(corners[1], corners[2]) + of(corners[2], corners[3]) + of(corners[3], corners[0]));
}

FacetMoments facet_moments(const FeModel& model, const Vec3& centre) {
  FacetMoments out;
  if (model.matrices) return out;
  const FacetRises rises(model);
  for (const FeElement& e : model.elements) {
    if (!fe_is_shell(e.shape)) continue;
    const int* nodes = &model.connectivity[e.first];
    Mat3X X(3, e.count);
    for (int i = 0; i < e.count; ++i) X.col(i) = model.nodes[nodes[i]] - centre;
    double area = 0.0;
    const double mass = shell_law(model, e, shell_axes(e.shape, X, e.id, area)).m0;
    if (e.count < 6) {
      add_flat(rises, nodes, mass, X, out);
      continue;
    }
    const auto add = [&](double& sum, Mat3& second) {
      for (const FeShellPoint& p : shell_points(e.shape, X, e.id)) {
        const Vec3 at = X * p.N;
        sum += mass * p.area;
        second += mass * p.area * at * at.transpose();
      }
    };
    add(out.mass, out.second);
    const int corners = e.count / 2;
    for (int k = 0; k < corners; ++k)
      if (const int m = fe_middle(e.shape, k, (k + 1) % corners); m >= 0) X.col(m) += rises.of(nodes[k], nodes[(k + 1) % corners]);
    add(out.smooth_mass, out.smooth_second);
  }
  return out;
}

}  // namespace flexframe::sim
