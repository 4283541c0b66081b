// Modal bodies: the mode shapes are mapped to the vertices once; a frame is then u = columns * q.
//
// Stored in float32, 3 M x n (a column: x y z of vertex 0, of vertex 1, ...) in tiles of rows (cpu_kernels.h), computed in double. Columns
// of second order are ordinary columns: append them to phi and psi and their products q_i q_j to q. The products are bound by memory: both
// read the columns as one stream, the batched one once for all its frames.
#pragma once

#include "interp/cpu_kernels.h"
#include "interp/error_bar.h"
#include "interp/large_memory.h"
#include "interp/map.h"

#include <filesystem>
#include <span>

namespace flexframe::interp {

class ModeColumns {
 public:
  ModeColumns() = default;
  // rows x modes (rows: 3 M of displacements, 6 M of stresses), all zero.
  ModeColumns(Eigen::Index rows, Eigen::Index modes)
      : rows_(rows), modes_(modes), tiles_((rows + tile_rows - 1) / tile_rows * tile_rows * modes) {}
  explicit ModeColumns(const Eigen::MatrixXf& columns);

  Eigen::Index rows() const { return rows_; }
  int modes() const { return static_cast<int>(modes_); }
  float operator()(Eigen::Index row, Eigen::Index mode) const { return tiles_[tile_place(row, mode, modes_)]; }
  float& operator()(Eigen::Index row, Eigen::Index mode) { return tiles_[tile_place(row, mode, modes_)]; }
  // As stored, rows of the last tile that do not exist included (zero).
  std::span<const float> tiles() const { return tiles_; }
  std::span<float> tiles() { return tiles_; }

 private:
  Eigen::Index rows_ = 0, modes_ = 0;
  LargeVector<float> tiles_;
};

// phi 3 N x n displacements of the nodes per unit coordinate; psi 3 N x n rotations (linear), or 0 x 0.
// Throws InputError on wrong sizes or values that are not finite.
ModeColumns map_modes(const Map& map, const Eigen::Ref<const Eigen::MatrixXd>& phi, const Eigen::Ref<const Eigen::MatrixXd>& psi);

// out (rows of the columns) = columns * q. threads 0: all cores; the result does not depend on it.
void apply_modes(const ModeColumns& columns, std::span<const double> q, std::span<float> out, int threads = 1);

// out (rows x F, column-major, a frame a column) = columns * q, q n x F.
void apply_modes_batch(const ModeColumns& columns, const Eigen::Ref<const Eigen::MatrixXd>& q, Eigen::MatrixXf& out, int threads = 1);

// make_map and map_modes behind a cache on disk: the file's name is the hash of the mesh, the nodes, the modes, the options and
// the format, so a stale answer cannot be read. A damaged or foreign file is made anew. cache empty: no cache.
struct CachedModes {
  ModeColumns columns;
  ModeDoubt doubt;
  Report report;
  bool from_cache = false;
};
// phi, psi: as for map_modes. Throws what make_map throws; a cache that cannot be written is no error.
CachedModes cached_modes(const Nodes& nodes, const MeshView& mesh, const Options& options, const Eigen::Ref<const Eigen::MatrixXd>& phi,
                         const Eigen::Ref<const Eigen::MatrixXd>& psi, const std::filesystem::path& cache);

}  // namespace flexframe::interp
