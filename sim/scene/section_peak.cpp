#include "sim/scene/section_peak.h"

#include "sim/scene/section.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace flexframe::sim {
namespace {

// Where the walls of an outline meet or end, as shares of the way from p to q: the shear of forces has corners or jumps there.
std::vector<double> breaks(const Section& section, const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
  std::vector<double> out{0.0, 1.0};
  const int along = std::abs(q.x() - p.x()) > std::abs(q.y() - p.y()) ? 0 : 1;  // outlines run along y and z
  for (const std::vector<Eigen::Vector2d>& loop : section.outline)
    for (const Eigen::Vector2d& corner : loop) out.push_back((corner[along] - p[along]) / (q[along] - p[along]));
  std::erase_if(out, [](double share) { return share < 0.0 || share > 1.0; });
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end(), [](double a, double b) { return b - a < 1e-9; }), out.end());
  return out;
}

}  // namespace

SectionPeak::SectionPeak(const Section& section, double poisson) {
  if (const auto angle = section.size.find(section_angle); angle != section.size.end()) {
    // Its rows lie along its own axes.
    std::map<std::string, double> sizes = section.size;
    sizes.erase(section_angle);
    *this = SectionPeak(make_section(section.shape, sizes), poisson);
    for (Point& point : points_) point.at = turned(point.at, angle->second);
    return;
  }
  add(section, poisson, Eigen::Vector2d::Zero());
  if (is_round(section)) add_rings(section, poisson);
  else if (section.shape == "rectangle") add_grid(section, poisson);
  else add_walls(section, poisson);
}

void SectionPeak::add(const Section& section, double poisson, const Eigen::Vector2d& place) {
  points_.push_back({section_point(section, place.x(), place.y(), poisson)});
}

void SectionPeak::add_grid(const Section& section, double poisson) {
  constexpr int n = 12;
  const Eigen::Vector2d corner = section.outline.front().front();
  const int first = static_cast<int>(points_.size());
  const auto index = [&](int i, int j) { return first + i * (n + 1) + j; };
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) add(section, poisson, Eigen::Vector2d(corner.x() * (1.0 - 2.0 * i / n), corner.y() * (1.0 - 2.0 * j / n)));
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      if (i > 0 && i < n) join(0, index(i - 1, j), index(i, j), index(i + 1, j));
      if (j > 0 && j < n) join(1, index(i, j - 1), index(i, j), index(i, j + 1));
    }
}

void SectionPeak::add_rings(const Section& section, double poisson) {
  constexpr int rings = 8, around = 48;
  const SectionRadii radii = section_radii(section);
  // A tube's from its hole outwards; the first of a solid circle is its centre, which is there already.
  const bool solid = radii.inner == 0.0;
  const int first = static_cast<int>(points_.size());
  const auto index = [&](int ring, int k) { return ring < 0 ? 0 : first + ring * around + (k + around) % around; };
  const int count = solid ? rings : rings + 1;
  for (int ring = 0; ring < count; ++ring) {
    // Of a thick tube closer together at the hole, where the stress bends most.
    const double radius = solid ? radii.outer * (ring + 1) / rings : radii.inner * std::pow(radii.outer / radii.inner, 1.0 * ring / rings);
    for (int k = 0; k < around; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / around;
      add(section, poisson, radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
  }
  for (int ring = 0; ring < count; ++ring)
    for (int k = 0; k < around; ++k) {
      join(0, index(ring, k - 1), index(ring, k), index(ring, k + 1));
      if (ring + 1 < count && (ring > 0 || solid)) join(1, index(ring - 1, k), index(ring, k), index(ring + 1, k));
    }
}

void SectionPeak::add_walls(const Section& section, double poisson) {
  // Close enough for the largest one without a parabola: torsion falls off at the ends of a wall, where a parabola would shoot over.
  constexpr int n = 24;
  // Just inside each end of a piece: at the end itself the shear is that of one of the walls that meet there.
  constexpr double inside = 1e-6;
  for (const std::vector<Eigen::Vector2d>& loop : section.outline)
    for (size_t k = 0; k < loop.size(); ++k) {
      const Eigen::Vector2d p = loop[k], q = loop[(k + 1) % loop.size()];
      add(section, poisson, p);
      const std::vector<double> ends = breaks(section, p, q);
      for (size_t piece = 0; piece + 1 < ends.size(); ++piece) {
        for (int i = 0; i <= n; ++i) {
          const double share = std::clamp(1.0 * i / n, inside, 1.0 - inside);
          add(section, poisson, p + (ends[piece] + share * (ends[piece + 1] - ends[piece])) * (q - p));
        }
      }
    }
}

double SectionPeak::von_mises(const SectionStrains& strains, const Eigen::Vector2d& bend_rates, double youngs_modulus,
                              double shear_modulus) const {
  const auto at = [&](int k) { return section_von_mises(strains, bend_rates, youngs_modulus, shear_modulus, points_[k].at); };
  double largest = 0.0;
  int where = -1;
  for (int k = 0; k < static_cast<int>(points_.size()); ++k)
    if (const double here = at(k); here > largest) largest = here, where = k;
  if (where < 0) return largest;
  // Shares of the largest square: those of stresses could overflow.
  double peak = 1.0;
  for (const auto& [before, after] : points_[where].beside) {
    if (before < 0) continue;
    const double a = std::pow(at(before) / largest, 2), b = std::pow(at(after) / largest, 2), bend = 2.0 - a - b;
    if (bend > 0.0) peak += (a - b) * (a - b) / (8.0 * bend);
  }
  return largest * std::sqrt(peak);
}

}  // namespace flexframe::sim
