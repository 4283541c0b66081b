// Flexible bodies as files: HDF5 with all that is known of a reduced body, or SID text.
//
// A body file of flexframe (BODY.h5, "flexframe body") holds every number of FlexibleBody bit by bit, where it came from, and the surface
// of the finite element model with the displacement (and stress) of each elastic coordinate at all nodes of the surface, so that pictures
// need no guess between nodes. The layout stands in SID.md.
#pragma once

#include "sim/bodies/flexible_body.h"
#include "sim/bodies/sid.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace flexframe::sim {

// The outer surface of a finite element model with what its elements know there.
struct BodySurface {
  std::vector<int> ids;     // m: numbers of the nodes in the model
  Eigen::MatrixX3d points;  // m x 3, m, body frame
  Eigen::MatrixXi faces;    // k x 8: points of a face, corners first (counterclockwise from outside), then middles of its edges; -1: none
  MatX phi;                 // 3 m x n, displacement per elastic coordinate
  MatX stress;              // 6 m x n, Pa, xx yy zz xy yz xz per elastic coordinate, averaged over the elements of a node; or empty
  MatX load_stress;         // 6 m x 12, Pa, per InertiaLoads: the static stress that the coordinates leave out; or empty
  // Stress that points have besides: on a shell's other face, in other plates that meet there.
  std::vector<int> other_points;         // k, ascending, as often as a point has one
  MatX other_stress, other_load_stress;  // 6 k x n, 6 k x 12
};

// What inertia and weight load a body with, axes and origin of its coordinates' frame: weight less acceleration (3, m/s^2), angular
// acceleration with the other sign (3, rad/s^2), and of the angular velocity half of xx yy zz, then xy xz yz (6, rad^2/s^2).
using InertiaLoads = Eigen::Matrix<double, 12, 1>;

// What made a body, by name: "model", "model_sha256", "program", "request".
using BodyOrigin = std::vector<std::pair<std::string, std::string>>;

struct BodyFile {
  FlexibleBody body;
  std::string comment;             // first line of a SID file
  BodySurface surface;             // no points: unknown
  BodyOrigin origin;               // of HDF5 files
  std::vector<std::string> notes;  // what a file contradicts itself in, or holds and is not used
  SidLacks lacks = {};             // of SID files
  FurtherShapes further = {};      // of files that `flexframe reduce` made: what the coordinates leave out
};

// Whether the bytes are HDF5's; false where the file cannot be read.
bool is_hdf5(const std::filesystem::path& path);

// Whether the file is a body that write_body wrote, by its head; false where it cannot be read.
bool is_body_file(const std::filesystem::path& path);

// Triangles over the surface's points; faces with middles are divided there, quadrangles along the first diagonal.
Eigen::MatrixX3i surface_triangles(const BodySurface& surface);

// Either kind of file, told by its first bytes. name: of the body in messages. Throws InputError naming the file and what is wrong.
BodyFile read_body(const std::filesystem::path& path, const std::string& name);
// Of an HDF5 file the surface alone; no points where it has none. Throws as read_body.
BodySurface read_body_surface(const std::filesystem::path& path);

// Of either kind of file the further shapes alone; none where it has none. Throws as read_body.
FurtherShapes read_further_shapes(const std::filesystem::path& path);

// HDF5. Bodies with mass along an axis (FlexibleBody::axis) have no file. Throws InputError where a value is not finite or a size
// contradicts another, FileError where the file cannot be written.
void write_body(const BodyFile& file, const std::filesystem::path& path);

}  // namespace flexframe::sim
