#include "interp/modes.h"

#include "interp/parallel.h"

#include <fmt/format.h>

namespace flexframe::interp {

namespace {

// Below this many floats of work a second thread costs more than it saves (some 30 microseconds to start).
constexpr Eigen::Index worth_a_thread = 1 << 20;

int threads_for(const ModeColumns& columns, Eigen::Index frames, int asked) {
  return columns.rows() * columns.modes() * std::max<Eigen::Index>(1, frames / 4) < worth_a_thread ? 1 : thread_count(asked);
}

}  // namespace

ModeColumns::ModeColumns(const Eigen::MatrixXf& columns) : ModeColumns(columns.rows(), columns.cols()) {
  for (Eigen::Index k = 0; k < modes_; ++k)
    for (Eigen::Index i = 0; i < rows_; ++i) (*this)(i, k) = columns(i, k);
}

ModeColumns map_modes(const Map& map, const Eigen::Ref<const Eigen::MatrixXd>& phi, const Eigen::Ref<const Eigen::MatrixXd>& psi) {
  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(map.nodes);
  if (phi.rows() != rows) throw InputError(fmt::format("mode shapes have {} rows, {} nodes need {}", phi.rows(), map.nodes, rows));
  if (psi.size() > 0 && (psi.rows() != rows || psi.cols() != phi.cols()))
    throw InputError(fmt::format("mode rotations are {} x {}, mode shapes {} x {}", psi.rows(), psi.cols(), phi.rows(), phi.cols()));
  if (map.rotations && psi.size() == 0 && phi.cols() > 0)
    throw InputError("the map was made for nodes with rotations, the modes have none");
  if (!phi.allFinite() || !psi.allFinite()) throw InputError("mode shapes hold values that are not finite");
  ModeColumns out(3 * static_cast<Eigen::Index>(map.vertices), phi.cols());
  // Sources of all modes side by side, one sweep over the weights for each 16.
  constexpr Eigen::Index batch = 16;
  for (Eigen::Index first = 0; first < phi.cols(); first += batch) {
    const Eigen::Index width = std::min(batch, phi.cols() - first);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> sources(map.weights.cols, 3 * width);
    for (Eigen::Index m = 0; m < width; ++m)
      sources.middleCols(3 * m, 3) =
          mode_sources(map, phi.col(first + m), psi.size() > 0 ? Eigen::VectorXd(psi.col(first + m)) : Eigen::VectorXd());
    const RowsF single = sources.cast<float>();
    RowsF rows_out;
    multiply_rows(map.weights, single, rows_out, thread_count(0));
    for (Eigen::Index v = 0; v < map.vertices; ++v) {
      const float* row = rows_out.data() + map.welded[v] * rows_out.cols();
      for (Eigen::Index m = 0; m < width; ++m)
        for (int c = 0; c < 3; ++c) out(3 * v + c, first + m) = row[3 * m + c];
    }
  }
  return out;
}

void apply_modes(const ModeColumns& columns, std::span<const double> q, std::span<float> out, int threads) {
  const Eigen::Index n = columns.modes(), rows = columns.rows();
  if (static_cast<Eigen::Index>(q.size()) != n) throw InputError(fmt::format("{} coordinates given for {} modes", q.size(), n));
  if (static_cast<Eigen::Index>(out.size()) != rows) throw InputError(fmt::format("room for {} floats given, {} needed", out.size(), rows));
  std::vector<float> factor(q.begin(), q.end());
  constexpr int grain = 171 * tile_rows;
  parallel_chunks(static_cast<int>(rows), grain, threads_for(columns, 1, threads), [&](int first, int last) {
    combine_tiles(columns.tiles().data() + first * n, factor, out.subspan(first, last - first));
  });
}

void apply_modes_batch(const ModeColumns& columns, const Eigen::Ref<const Eigen::MatrixXd>& q, Eigen::MatrixXf& out, int threads) {
  const Eigen::Index n = columns.modes(), rows = columns.rows(), frames = q.cols();
  if (q.rows() != n) throw InputError(fmt::format("{} coordinates given for {} modes", q.rows(), n));
  out.resize(rows, frames);
  const Eigen::MatrixXf factor = q.cast<float>();
  parallel_chunks(static_cast<int>(rows), batch_rows(n), threads_for(columns, frames, threads), [&](int first, int last) {
    combine_tiles_batch(columns.tiles().data() + first * n, factor, out.data() + first, rows, last - first);
  });
}

}  // namespace flexframe::interp
