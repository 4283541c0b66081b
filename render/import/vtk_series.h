// Series of VTK files, each a mesh at a time: .vtu, .vtp, .pvd, .vtkhdf.
#pragma once

#include "render/import/nodal_series.h"

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace flexframe::imports {

struct VtkRequest {
  double unit = 1.0, stress = 1.0;  // m of a length, Pa of a stress in the files
  std::optional<double> step;       // s between files that hold no time
};

// Points that move, or point data "displacement" (also U, u, disp); stress of point data "von_mises" (also mises, S_Mises), or of
// components "stress". All files have the cells of the first. Layout: VTK XML formats of the VTK User's Guide. Throws sim::InputError.
NodalSeries read_vtk_xml(std::span<const std::filesystem::path> files, const VtkRequest& request);

// VTKHDF 1 and 2 of type UnstructuredGrid or PolyData, with its Steps. Layout: VTKHDF file format, docs.vtk.org. Throws sim::InputError.
NodalSeries read_vtkhdf(const std::filesystem::path& file, const VtkRequest& request);

// What both have of one time, as read.
struct VtkMoment {
  std::string file;  // for messages
  std::optional<double> time;
  std::vector<double> points;  // 3 n
  Cells cells;
  int left_out = 0;  // cells without a surface
  struct Field {
    std::string name;
    int components = 1;
    std::vector<double> values;
  };
  std::vector<Field> fields;  // point data
};

// One moment after another to a series: the first one's cells and points. Throws sim::InputError.
NodalSeries to_series(std::vector<VtkMoment> moments, const std::string& kind, const VtkRequest& request);

// Adds a cell of VTK's type number with these points; what has no surface counts in left_out. Throws sim::InputError for unknown types.
void add_vtk_cell(int type, const std::vector<int>& nodes, VtkMoment& moment);

}  // namespace flexframe::imports
