// Modal bodies: the mode shapes are mapped to the vertices once; a frame is then u = columns * q.
//
// Stored in float32, column-major 3 M x n (a column: x y z of vertex 0, of vertex 1, ...), computed in double. Columns of second
// order are ordinary columns: append them to phi and psi and their products q_i q_j to q.
// The products are bound by memory: the single product sweeps blocks of rows that stay in the cache over all columns, the
// batched one reads the columns once for all its frames.
#pragma once

#include "interp/map.h"

#include <filesystem>
#include <span>

namespace flexframe::interp {

struct ModeColumns {
  int vertices = 0;           // M
  Eigen::MatrixXf columns;    // 3 M x n
  int modes() const { return static_cast<int>(columns.cols()); }
};

// phi 3 N x n displacements of the nodes per unit coordinate; psi 3 N x n rotations (linear), or 0 x 0.
// Throws InputError on wrong sizes or values that are not finite.
ModeColumns map_modes(const Map& map, const Eigen::Ref<const Eigen::MatrixXd>& phi, const Eigen::Ref<const Eigen::MatrixXd>& psi);

// out (3 M) = columns * q. threads 0: all cores; the result does not depend on it.
void apply_modes(const ModeColumns& columns, std::span<const double> q, std::span<float> out, int threads = 1);

// out (3 M x F, column-major, a frame a column) = columns * q, q n x F.
void apply_modes_batch(const ModeColumns& columns, const Eigen::Ref<const Eigen::MatrixXd>& q, Eigen::MatrixXf& out, int threads = 1);

// make_map and map_modes behind a cache on disk: the file's name is the hash of the mesh, the nodes, the modes, the options and
// the format, so a stale answer cannot be read. A damaged or foreign file is made anew. cache empty: no cache.
struct CachedModes {
  ModeColumns columns;
  Report report;
  bool from_cache = false;
};
CachedModes cached_modes(const Nodes& nodes, const MeshView& mesh, const Options& options, const Eigen::Ref<const Eigen::MatrixXd>& phi,
                         const Eigen::Ref<const Eigen::MatrixXd>& psi, const std::filesystem::path& cache);

}  // namespace flexframe::interp
