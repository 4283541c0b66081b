#include "sim/bodies/beam_pieces.h"

#include <algorithm>
#include <cmath>

namespace flexframe::sim {

int piece_count(const BeamDef& beam) {
  if (beam.model == BeamModel::lumped) return beam.elements + 1;
  return beam.model == BeamModel::mixed ? beam.volumes : 1;
}

double piece_start(const BeamDef& beam, int k) {
  if (beam.model == BeamModel::lumped) return k == 0 ? 0.0 : (k - 0.5) * (beam.length / beam.elements);
  return k * beam.length / piece_count(beam);
}

std::pair<int, double> locate_piece(const BeamDef& beam, double s) {
  const int pieces = piece_count(beam);
  if (beam.model == BeamModel::lumped) {
    int k = 0;
    while (k + 1 < pieces && s * beam.length >= piece_start(beam, k + 1)) ++k;
    return {k, 0.0};
  }
  const double at = s * pieces;
  const int k = std::clamp(static_cast<int>(std::ceil(at)) - 1, 0, pieces - 1);
  return {k, at - k};
}

BeamDef piece_of(const BeamDef& beam, int k, double time_constant) {
  BeamDef out = beam;
  const int pieces = piece_count(beam);
  out.length = beam.length / pieces;
  out.model = beam.model == BeamModel::mixed ? (beam.modes.empty() ? BeamModel::finite_element : BeamModel::modal) : beam.model;
  if (beam.model == BeamModel::mixed) {
    out.damping = {};
    out.damping.stiffness = time_constant;
  }
  out.frames.clear();
  for (const auto& [name, s] : beam.frames) {
    const auto [piece, local] = locate_piece(beam, s);
    if (piece == k) out.frames[name] = local;
  }
  return out;
}

}  // namespace flexframe::sim
