// Exaggeration of elastic displacements, which are given in the floating frame of the body (rigid motion is never scaled).
//
// linear: u * scale, what every tool does. It inflates sections: a section turned by theta grows by sqrt(1 + theta^2) for a
// scaled small rotation theta, 13 % at 30 degrees; a warning is due above 15 degrees.
// corotated: the rotation field of the displacement is scaled, its stretch too, and the positions are those whose gradient
// fits best (one prefactored Poisson solve a frame): R(scale theta) U(scale strain). Lengths are kept, sections nearly so.
// Sources: Sorkine and Alexa, As-rigid-as-possible surface modeling, 2007, eq. 8-9 (the Poisson system); Huang et al., Geometrically
// based potential energy for simulating deformable objects, 2006 (rotation-strain extrapolation of modes).
#pragma once

#include "interp/types.h"

#include <memory>
#include <span>
#include <string>

namespace flexframe::interp {

// Largest exaggerated displacement a tenth of the model's size, rounded down to 1, 2 or 5 times a power of ten; at least 1.
// maximum: largest |u| over all frames, size: diagonal of the model's box, both in m. 1 if nothing moves
// beyond rounding, 1e-12 of the size.
double auto_scale(double maximum, double size);

// Largest rotation of a triangle by the displacement, radians, area-weighted 99.9 % quantile (a sliver does not decide).
double largest_rotation(const MeshView& mesh, std::span<const float> displacement);

// The sentence for linear exaggeration above 15 degrees, or empty. rotation: largest_rotation of the unscaled displacement, radians.
std::string exaggeration_warning(double rotation, double scale);

// Reusable solver of the corotated exaggeration of one mesh.
class Corotated {
 public:
  // Factorises once and keeps a copy of the mesh.
  explicit Corotated(const MeshView& mesh);
  ~Corotated();
  Corotated(Corotated&&) noexcept;
  Corotated& operator=(Corotated&&) noexcept;
  // out = exaggerated displacement, 3 M floats each; the mean displacement of the vertices is scaled linearly.
  void apply(std::span<const float> displacement, double scale, std::span<float> out) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flexframe::interp
