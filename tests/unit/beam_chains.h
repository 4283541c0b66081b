// Beams of several pieces as tests look at them.
#pragma once

#include "sim/bodies/beam.h"
#include "sim/bodies/beam_pieces.h"

#include <fmt/format.h>

#include <vector>

namespace flexframe::sim {

// The volumes of a mixed beam of finite elements on their mean axes, root to tip.
inline std::vector<BeamPiece> mixed_pieces(const BeamDef& def, const BeamEffects& effects) {
  BeamDef beam = def;
  beam.model = BeamModel::mixed;
  const double tau = chain_time_constant(beam, effects);
  std::vector<BeamPiece> pieces;
  for (int k = 0; k < piece_count(beam); ++k) {
    BeamDef volume = piece_of(beam, k, tau);
    volume.boundary = Boundary::free_free;
    pieces.push_back({fmt::format("volume[{}]", k), make_fe_beam(volume, effects), piece_start(beam, k)});
  }
  return pieces;
}

// d moments / d theta of a lumped beam's springs, 3 links x 3 links, angles ordered link by link.
inline MatX link_stiffness(const BeamLinks& links, int count) {
  MatX k(3 * count, 3 * count);
  for (int j = 0; j < 3 * count; ++j) {
    Mat3X theta = Mat3X::Zero(3, count);
    theta(j % 3, j / 3) = 1.0;
    const Mat3X moments = link_moments(links, theta);
    k.col(j) = -Eigen::Map<const VecX>(moments.data(), moments.size());
  }
  return k;
}

}  // namespace flexframe::sim
