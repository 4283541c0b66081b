// The surfaces of a picture with their data, for the files of VTK. Private to vtk.cpp and vtk_hdf.cpp.
#pragma once

#include "render/film/animation.h"

#include <cstdint>
#include <string>
#include <vector>

namespace flexframe::film {

// Everything of one picture.
struct VtkSurface {
  std::vector<double> points;         // 3 n
  std::vector<float> displacement;    // 3 n
  std::vector<float> velocity;        // 3 n
  std::vector<float> stress;          // n, von Mises; 0 where a body has none
  std::vector<float> scalars;         // n, what the pictures colour by besides these; 0 where a body has none
  std::vector<std::int64_t> corners;  // 3 m
  std::vector<std::int32_t> body;     // m
};

// Whether a body of the animation knows its stress.
bool has_stress(const Animation& animation);
// The name of `scalars`.
const std::string& scalar_name(const Animation& animation);
// All visible bodies at a time: points and corners are the same in number, and corners and bodies equal, at every time.
VtkSurface vtk_surface(const Animation& animation, double t, double scale, BodyMemory& memory);
// A history at a time, linear between samples.
double output_at(const sim::Results& results, const sim::ResultOutput& output, double t);

}  // namespace flexframe::film
