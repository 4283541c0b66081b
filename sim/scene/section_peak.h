// The largest von Mises stress in the section of a beam (section_stress.h), wherever in the section it is.
//
// Bending peaks on the outline, the shear of forces along the section inside it, and both together with a pull anywhere between. Rectangle,
// circle and tube: at points of a grid or of rings on the true radii; a parabola through the squares at the largest one and the points
// beside it tells what lies between them. Others: at points close together along their walls, whose shear is the mean over the thickness.
#pragma once

#include "sim/scene/section_stress.h"

#include <array>
#include <vector>

namespace flexframe::sim {

class SectionPeak {
 public:
  SectionPeak() = default;
  // Of a section with has_stress. poisson: the material's.
  SectionPeak(const Section& section, double poisson);

  // Pa, from strains 1, 1/m, 1/m, rad/m, bend_rates v''' and w''' 1/m^2, moduli Pa. 0 before a section is given.
  double von_mises(const SectionStrains& strains, const Eigen::Vector2d& bend_rates, double youngs_modulus, double shear_modulus) const;

 private:
  struct Point {
    SectionPoint at;
    std::array<std::array<int, 2>, 2> beside{{{-1, -1}, {-1, -1}}};  // before and after it in up to two rows; -1: the row ends here
  };
  void add(const Section& section, double poisson, const Eigen::Vector2d& place);
  void join(int row, int before, int at, int after) { points_[at].beside[row] = {before, after}; }
  void add_grid(const Section& section, double poisson);
  void add_rings(const Section& section, double poisson);
  void add_walls(const Section& section, double poisson);

  std::vector<Point> points_;
};

}  // namespace flexframe::sim
