// Masses of Nastran bulk data in some directions (CMASS1, CMASS2), as whole matrices (CONM1).
#include "sim/reduce/fe_nastran_reader.h"

namespace flexframe::sim {

void NastranReader::add_scalar_mass(const NastranCard& c) {
  double m = 0.0;
  if (c.name == "CMASS2") {
    m = deck.real(c, 1);
  } else {
    const auto p = scalar_masses.find(deck.integer(c, 1));
    if (p == scalar_masses.end()) deck.fail(c, fmt::format("property {} is not there", deck.integer(c, 1)));
    // Up to four properties a card, each a number and a mass.
    m = deck.real(*p->second.first, p->second.second + 1);
  }
  const std::vector<std::pair<int, int>> ends = scalar_ends(c);
  // Moments of inertia over mass.
  m *= units.mass * weight_to_mass * (ends[0].second >= 3 ? units.length * units.length : 1.0);
  std::vector<int> nodes;
  bool turns = false;
  const VecX b = between(c, ends, nodes, turns);
  lump(c, nodes, MatX::Zero(b.size(), b.size()), m * b * b.transpose(), turns);
}

// The lower triangle row by row: M11, M21, M22, ..., M66, about the grid, in the directions of a coordinate system.
void NastranReader::add_mass_matrix(const NastranCard& c) {
  const int at = node(c, 1);
  MatX M = MatX::Zero(6, 6);
  size_t field = 3;
  bool turns = false;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) {
      const double length = (i >= 3 ? units.length : 1.0) * (j >= 3 ? units.length : 1.0);
      M(i, j) = M(j, i) = deck.real(c, field++) * units.mass * weight_to_mass * length;
      turns = turns || (i >= 3 && M(i, j) != 0.0);
    }
  const Mat3 Q = coordinates(c, deck.integer(c, 2)).directions(model.nodes[at]);
  MatX turn = MatX::Zero(6, 6);
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = Q;
  lump(c, {at}, MatX::Zero(6, 6), turn * M * turn.transpose(), turns);
}

}  // namespace flexframe::sim
