// Curves in space through points: the path of a point-on-curve joint, the profile of a cam, the axis of a curved beam.
//
// A twice continuously differentiable cubic spline runs through the points (table.h), by the length of their chords; it is then counted by
// its own length s, so that |dc/ds| = 1 up to the spline's error (1e-7 where a point stands every tenth of the radius of curvature).
#pragma once

#include "sim/base/types.h"

#include <vector>

namespace flexframe::sim {

class SpaceCurve {
 public:
  // Two points or more, of a closed curve three, no two neighbours the same; closed: the last is joined to the first. m. Throws InputError.
  SpaceCurve(const std::vector<Vec3>& points, bool closed);

  // Place (m), tangent and its derivative (1/m) at s (m). An open curve goes on straight beyond its ends.
  struct Jet {
    Vec3 place, tangent, bend;
  };
  Jet at(double s) const;
  double length() const { return length_; }
  bool closed() const { return closed_; }
  // s of the point nearest to p.
  double nearest(const Vec3& p) const;
  // s of the point farthest along a direction.
  double farthest(const Vec3& direction) const;
  // Points along it, dense enough for drawing and for searches.
  const std::vector<Vec3>& samples() const { return samples_; }
  // Area that it encloses in the xy plane, positive where it runs counterclockwise, m^2 (an open one closed by its chord).
  double area_xy() const;

 private:
  struct Reach {
    double low, high;
  };
  template <class Value>
  size_t least_sample(const Value& value) const;
  Reach reach_of(size_t sample) const;

  bool closed_;
  double length_ = 0.0;
  std::vector<double> s_;              // of the samples
  std::vector<Vec3> samples_, bends_;  // bends_: second derivatives at the samples
};

}  // namespace flexframe::sim
