#include "render/film/detail.h"

#include "interp/watch.h"
#include "render/picture/adjacency.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace flexframe::film {
namespace {

// Of a level's triangles those near a place: a grid of cells, each with the triangles whose boxes touch it.
class TriangleGrid {
 public:
  // cell: m, about as large as a triangle.
  TriangleGrid(std::span<const glm::vec3> points, std::span<const glm::uvec3> triangles, float cell)
      : points_(points), triangles_(triangles), inverse_(1.0f / cell) {
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      const glm::vec3 &a = points[triangles[t].x], &b = points[triangles[t].y], &c = points[triangles[t].z];
      const glm::ivec3 low = cell_of(glm::min(glm::min(a, b), c)), high = cell_of(glm::max(glm::max(a, b), c));
      // One of very many cells is left out: what lies on it counts as farther off than it is, and the level is not taken.
      const glm::dvec3 extent(high - low + 1);
      if (!(extent.x * extent.y * extent.z <= 512.0)) continue;
      for (int x = low.x; x <= high.x; ++x)
        for (int y = low.y; y <= high.y; ++y)
          for (int z = low.z; z <= high.z; ++z) entries_.emplace_back(key({x, y, z}), t);
    }
    std::sort(entries_.begin(), entries_.end());
  }

  // The nearest point of the triangles in the cell of p, or in those around it where that has none near enough. False: there are none.
  bool nearest(const glm::vec3& p, DetailLevel::LeftOut& out, float& square) const {
    const glm::ivec3 cell = cell_of(p);
    square = std::numeric_limits<float>::infinity();
    look(key(cell), p, out, square);
    // A triangle of another cell is at least as far as the cell's nearest side.
    const glm::vec3 within = p * inverse_ - glm::vec3(cell), side = glm::min(within, 1.0f - within) / inverse_;
    const float reach = std::min({side.x, side.y, side.z});
    if (square <= reach * reach) return true;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (x || y || z) look(key(cell + glm::ivec3(x, y, z)), p, out, square);
    return square < std::numeric_limits<float>::infinity();
  }

 private:
  glm::ivec3 cell_of(const glm::vec3& p) const { return glm::ivec3(glm::floor(p * inverse_)); }
  static std::uint64_t key(const glm::ivec3& c) {
    constexpr std::uint64_t mask = (1u << 21) - 1;
    return (static_cast<std::uint64_t>(c.x) & mask) << 42 | (static_cast<std::uint64_t>(c.y) & mask) << 21 |
           (static_cast<std::uint64_t>(c.z) & mask);
  }

  void look(std::uint64_t of, const glm::vec3& p, DetailLevel::LeftOut& out, float& square) const {
    for (auto at = std::lower_bound(entries_.begin(), entries_.end(), std::pair(of, std::uint32_t{0}));
         at != entries_.end() && at->first == of; ++at) {
      const glm::uvec3& t = triangles_[at->second];
      const glm::vec3 shares = nearest_in_triangle(p, points_[t.x], points_[t.y], points_[t.z]);
      const glm::vec3 off = p - (shares.x * points_[t.x] + shares.y * points_[t.y] + shares.z * points_[t.z]);
      if (!(glm::dot(off, off) < square)) continue;
      square = glm::dot(off, off);
      out.corners = {t.x, t.y, t.z};
      out.shares = shares;
    }
  }

  // Barycentric coordinates of the point of a triangle nearest to p (Ericson, Real-time collision detection, 2005, 5.1.5).
  static glm::vec3 nearest_in_triangle(const glm::vec3& p, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    const glm::vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const float d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap), d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp), d5 = glm::dot(ab, cp),
                d6 = glm::dot(ac, cp);
    if (d1 <= 0.0f && d2 <= 0.0f) return {1.0f, 0.0f, 0.0f};
    if (d3 >= 0.0f && d4 <= d3) return {0.0f, 1.0f, 0.0f};
    if (d6 >= 0.0f && d5 <= d6) return {0.0f, 0.0f, 1.0f};
    const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f) return {1.0f - d1 / (d1 - d3), d1 / (d1 - d3), 0.0f};
    if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f) return {1.0f - d2 / (d2 - d6), 0.0f, d2 / (d2 - d6)};
    if (va <= 0.0f && d4 >= d3 && d5 >= d6) {
      const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
      return {0.0f, 1.0f - w, w};
    }
    const float sum = va + vb + vc;
    return {va / sum, vb / sum, vc / sum};
  }

  std::span<const glm::vec3> points_;
  std::span<const glm::uvec3> triangles_;
  float inverse_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> entries_;
};

// Length of the side of a mean triangle, m.
float mean_side(std::span<const glm::vec3> points, std::span<const glm::uvec3> triangles, std::size_t count) {
  double area = 0.0;
  for (const glm::uvec3& t : triangles)
    area += 0.5 * static_cast<double>(glm::length(glm::cross(points[t.y] - points[t.x], points[t.z] - points[t.x])));
  return static_cast<float>(std::sqrt(2.0 * area / static_cast<double>(count)));
}

// Height of the waves that are laid over a mesh, in sides of its triangles: as much as a surface bends that a body of ten triangles around
// has.
constexpr float wave = 0.05f;

// Where the points that the level's triangles leave out lie on them. place: of each point the first at its position. False: a point has
// none near.
bool add_left_out(std::span<const glm::vec3> rest, const std::vector<int>& place, float side, DetailLevel& level) {
  std::vector<std::uint8_t> used(rest.size(), 0);
  for (const glm::uvec3& t : level.triangles)
    for (int k = 0; k < 3; ++k) used[static_cast<std::size_t>(place[t[k]])] = 1;
  const TriangleGrid grid(rest, level.triangles, side);
  float most = 0.0f;
  for (std::size_t p = 0; p < rest.size(); ++p) {
    if (p % 1024 == 0) interp::look();
    if (static_cast<std::size_t>(place[p]) != p || used[p]) continue;
    DetailLevel::LeftOut one{static_cast<std::uint32_t>(p), {}, glm::vec3(0.0f)};
    float square = 0.0f;
    if (!grid.nearest(rest[p], one, square)) return false;
    most = std::max(most, square);
    level.left_out.push_back(one);
  }
  level.away = std::sqrt(static_cast<double>(most));
  return true;
}

// Whether all lie near enough and have nearly the colours of what stands for them.
bool stands_for_all(const DetailLevel& level, std::span<const glm::vec3> positions, bool moved, double length,
                    std::span<const float> scalars, double value) {
  if (!moved && scalars.empty()) return true;
  const auto square = static_cast<float>(length * length), most = static_cast<float>(value);
  for (const DetailLevel::LeftOut& one : level.left_out) {
    const auto& [a, b, c] = one.corners;
    const glm::vec3& s = one.shares;
    if (moved) {
      const glm::vec3 off = positions[one.point] - (s.x * positions[a] + s.y * positions[b] + s.z * positions[c]);
      if (!(glm::dot(off, off) <= square)) return false;
    }
    // No number is drawn grey: only where none around is one either.
    if (!scalars.empty()) {
      const float off = scalars[one.point] - (s.x * scalars[a] + s.y * scalars[b] + s.z * scalars[c]);
      if (!(std::abs(off) <= most) && !(std::isnan(scalars[one.point]) && std::isnan(scalars[a] + scalars[b] + scalars[c]))) return false;
    }
  }
  return true;
}

}  // namespace

namespace {

using Triangles = std::vector<glm::uvec3>;

Triangles simplify(const Triangles& all, std::span<const glm::vec3> points, std::size_t wanted, unsigned options) {
  Triangles out(all.size());
  const std::size_t left = meshopt_simplify(&out[0].x, &all[0].x, 3 * all.size(), &points[0].x, points.size(), sizeof(glm::vec3),
                                            3 * wanted, 1.0f, options, nullptr);
  out.resize(left / 3);
  return out;
}

// Of large meshes piece by piece, each with its rim as it is: a piece fits the cache. Pieces are triangles that follow each other, as
// meshers write neighbours; where they do not, rims are all there is and too many triangles stay.
Triangles simplify_pieces(const Triangles& all, std::span<const glm::vec3> points, std::size_t share) {
  constexpr std::size_t piece = 1 << 16;
  Triangles out;
  std::vector<std::uint32_t> local(points.size(), ~0u);
  std::vector<std::uint32_t> original;
  std::vector<glm::vec3> corners;
  for (std::size_t first = 0; first < all.size(); first += piece) {
    interp::look();
    Triangles part(all.begin() + static_cast<std::ptrdiff_t>(first),
                   all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), first + piece)));
    original.clear();
    corners.clear();
    for (glm::uvec3& t : part)
      for (int k = 0; k < 3; ++k) {
        std::uint32_t& index = local[t[k]];
        if (index == ~0u) {
          index = static_cast<std::uint32_t>(original.size());
          original.push_back(t[k]);
          corners.push_back(points[t[k]]);
        }
        t[k] = index;
      }
    for (const std::uint32_t p : original) local[p] = ~0u;
    for (const glm::uvec3& t : simplify(part, corners, part.size() / share, meshopt_SimplifyLockBorder))
      out.emplace_back(original[t.x], original[t.y], original[t.z]);
  }
  return out;
}

}  // namespace

std::vector<DetailLevel> make_levels(std::span<const glm::vec3> rest, std::span<const glm::uvec3> triangles, std::size_t pieces_from) {
  std::vector<DetailLevel> levels;
  const std::vector<int> place = render::weld_equal(rest);
  std::vector<glm::uvec3> all(triangles.begin(), triangles.end());
  std::vector<glm::vec3> waved(rest.size());
  for (const std::size_t share : {8u, 64u}) {
    // A flat or straight part, of which two triangles would do at rest, bends: it is given waves as long as a few triangles, so that they
    // are about equally large everywhere.
    const float side = mean_side(rest, triangles, triangles.size() / share);
    if (!(side > 0.0f)) break;
    for (std::size_t p = 0; p < rest.size(); ++p) {
      const glm::vec3 s = glm::sin(rest[p] * (2.0f * std::numbers::pi_v<float> / (4.0f * side)));
      waved[p] = rest[p] + wave * side * glm::vec3(s.y + s.z, s.z + s.x, s.x + s.y);
    }
    interp::look();
    DetailLevel level;
    const std::size_t wanted = triangles.size() / share;
    if (all.size() > pieces_from) level.triangles = simplify_pieces(all, waved, all.size() / wanted);
    if (level.triangles.empty() || 2 * level.triangles.size() > 3 * wanted) level.triangles = simplify(all, waved, wanted, 0);
    // What does not pay.
    if (level.triangles.empty() || 3 * level.triangles.size() > 2 * all.size()) break;
    if (!add_left_out(rest, place, side, level)) break;
    all = level.triangles;
    levels.insert(levels.begin(), std::move(level));
  }
  return levels;
}

double unseen_length(const render::Picture& picture, const glm::dmat4& pose, std::span<const glm::vec3> positions) {
  double zoom = 1.0, least = std::numeric_limits<double>::infinity();
  // An inset's camera is turned towards its point: depths along its axis are up to a third less.
  for (const render::Inset& inset : picture.insets) zoom = std::max(zoom, 1.5 * inset.zoom);
  std::vector<render::Camera> cameras{picture.camera};
  if (!picture.views.empty()) cameras.clear();
  for (const render::View& view : picture.views) cameras.push_back(view.camera);
  for (const render::Camera& camera : cameras) {
    double pixel = camera.height;
    if (camera.projection == render::Projection::perspective) {
      const glm::dvec3 ahead = glm::normalize(camera.target - camera.position);
      const glm::vec3 across(glm::transpose(glm::dmat3(pose)) * ahead);
      const auto start = static_cast<float>(glm::dot(ahead, glm::dvec3(pose[3]) - camera.position));
      float nearest = std::numeric_limits<float>::infinity();
      for (const glm::vec3& p : positions) nearest = std::min(nearest, glm::dot(across, p));
      pixel = 2.0 * std::tan(0.5 * glm::radians(camera.fov)) * std::max(0.0, static_cast<double>(nearest + start));
    }
    least = std::min(least, pixel / picture.size.height);
  }
  return 0.5 * least / zoom;
}

const DetailLevel* fitting_level(std::span<const DetailLevel> levels, std::span<const glm::vec3> positions, bool moved, double length,
                                 std::span<const float> scalars, double value) {
  for (const DetailLevel& level : levels)
    if (level.away <= length && stands_for_all(level, positions, moved, length, scalars, value)) return &level;
  return nullptr;
}

}  // namespace flexframe::film
