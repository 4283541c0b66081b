// A sequence for ParaView and other readers of VTK's files (Kitware, VTK file formats): XML, one surface file a picture and an index; or
// one VTKHDF file.
#pragma once

#include "render/film/animation.h"

#include <filesystem>
#include <functional>

namespace flexframe::film {

struct VtkReport {
  int pictures = 0;
  std::filesystem::path index;  // NAME.pvd; of VTKHDF the file itself
};

// Writes folder/NAME_00000.vtp ... and then folder/NAME.pvd with the simulated times; files of an earlier, longer sequence are removed.
// Points in world axes, double, deformation multiplied by scale; point data `displacement` (elastic, world axes, in scale, m), `velocity`
// (of the points, world axes, m/s), `stress` (von Mises, Pa, 0 where a body has none) where a body of the animation knows its stress
// (color_by stress) and, where the pictures are coloured by it, `strain` or `mode` (m); field data: TimeValue, every output under its name
// and `units`, a text that names the unit of each; cell data
// `body` (number in the results). Each file appears whole. progress(done, all) may throw to stop. Throws FileError if a file
// cannot be written.
VtkReport write_vtk(const Animation& animation, double scale, const std::filesystem::path& folder, const std::string& name,
                    const std::function<void(int, int)>& progress = {});

// The same as one file with steps (VTKHDF 2.0, triangles as an unstructured grid; ParaView from 5.12, older ones see the first step): the
// mesh stands in it once, all numbers are packed, so that a long run takes a part of the space (slider-crank, 385 pictures: 46 MB, the
// series 204 MB). Point data as above; every output is field
// data under its name, "/" in it as "_"; each data set has its unit as an attribute. Appears whole. Throws as above.
VtkReport write_vtkhdf(const Animation& animation, double scale, const std::filesystem::path& file,
                       const std::function<void(int, int)>& progress = {});

}  // namespace flexframe::film
