// Rigid elements of Nastran whose independent motions lie at several grids: RBE1, RBAR, RTRPLT; RROD.
#include "sim/reduce/fe_nastran_reader.h"

#include <algorithm>

namespace flexframe::sim {
namespace {

// A motion of a grid, which a rigid motion about `middle` (x: its translation, then its turn) gives as row . x.
struct GridMotion {
  int node = -1, dof = 0;
  Vec3 along = Vec3::Zero();
  Eigen::Matrix<double, 1, 6> row = Eigen::Matrix<double, 1, 6>::Zero();
};

void add_terms(const GridMotion& m, double coefficient, FeEquation& out) {
  Eigen::Index main = 0;
  m.along.cwiseAbs().maxCoeff(&main);
  for (int k = 0; k < 3; ++k) {
    const int axis = (static_cast<int>(main) + k) % 3;
    if (m.along(axis) != 0.0) out.terms.push_back({m.node, (m.dof < 3 ? 0 : 3) + axis, coefficient * m.along(axis)});
  }
}

}  // namespace

void NastranReader::add_rigid(const NastranCard& c, const std::vector<std::pair<int, std::vector<int>>>& independent,
                              const std::vector<std::pair<int, std::vector<int>>>& dependent) {
  Vec3 middle = Vec3::Zero();
  for (const auto& [n, dofs] : independent) middle += model.nodes[n] / static_cast<double>(independent.size());
  double size = 0.0;
  for (const auto* list : {&independent, &dependent})
    for (const auto& [n, dofs] : *list) size = std::max(size, (model.nodes[n] - middle).norm());
  if (size == 0.0) size = 1.0;
  const auto motion = [&](int n, int d) {
    GridMotion m{n, d, directions(c, n).col(d % 3), {}};
    // Turns times the size: rows of one dimension.
    if (d < 3) m.row << m.along.transpose(), (model.nodes[n] - middle).cross(m.along).transpose() / size;
    else m.row << 0.0, 0.0, 0.0, m.along.transpose() / size;
    return m;
  };
  std::vector<GridMotion> given;
  for (const auto& [n, dofs] : independent)
    for (int d : dofs) given.push_back(motion(n, d));
  if (given.size() != 6) deck.fail(c, fmt::format("six independent motions are expected, found {}", given.size()));
  Mat6 R;
  for (int i = 0; i < 6; ++i) R.row(i) = given[i].row;
  const Eigen::FullPivLU<Mat6> lu(R);
  if (lu.rank() < 6 || lu.rcond() < 1e-10) deck.fail(c, "its independent motions do not fix a rigid body");
  const Mat6 inverse = lu.inverse();
  for (const auto& [n, dofs] : dependent)
    for (int d : dofs) {
      if (d >= 3 && !turning(n)) continue;
      const GridMotion m = motion(n, d);
      const Eigen::Matrix<double, 1, 6> share = m.row * inverse;
      FeEquation e;
      e.line = c.line;
      add_terms(m, -1.0, e);
      for (int i = 0; i < 6; ++i)
        if (std::abs(share(i)) > 1e-12) add_terms(given[i], share(i), e);
      model.equations.push_back(std::move(e));
    }
}

void NastranReader::add_rbe1(const NastranCard& c) {
  std::vector<std::pair<int, std::vector<int>>> independent, dependent;
  bool second = false;
  // Pairs of a grid and its motions, the first field of a line blank or UM.
  for (size_t k = 1; k < c.fields.size();) {
    if (c.fields[k] == "UM") {
      second = true;
      ++k;
    } else if (deck.blank(c, k) || c.fields[k].find('.') != std::string::npos) {
      ++k;  // a thermal expansion has a point
    } else {
      (second ? dependent : independent).emplace_back(node(c, k), deck.components(c, k + 1));
      k += 2;
    }
  }
  if (dependent.empty()) deck.fail(c, "no dependent grids (UM)");
  add_rigid(c, independent, dependent);
}

// Grids with their independent motions; the dependent ones are given, or all others.
void NastranReader::add_rigid_bar(const NastranCard& c, size_t grids_there) {
  std::vector<std::pair<int, std::vector<int>>> independent, dependent;
  // RTRPLT has three grids and their independent motions in the first line, the dependent ones in the second.
  const size_t given = 1 + grids_there, chosen = given + grids_there;
  for (size_t k = 0; k < grids_there; ++k) {
    const int n = node(c, 1 + k);
    const std::vector<int> own = deck.components(c, given + k);
    std::vector<int> others = deck.components(c, grids_there == 3 ? 8 + k : chosen + k);
    bool any = false;
    for (size_t j = 0; j < grids_there; ++j) any = any || !deck.blank(c, grids_there == 3 ? 8 + j : chosen + j);
    if (!any) {
      others.clear();
      for (int d = 0; d < 6; ++d)
        if (std::find(own.begin(), own.end(), d) == own.end()) others.push_back(d);
    }
    if (!own.empty()) independent.emplace_back(n, own);
    if (!others.empty()) dependent.emplace_back(n, others);
  }
  add_rigid(c, independent, dependent);
}

// Two grids whose distance stays.
void NastranReader::add_rigid_rod(const NastranCard& c) {
  const int a = node(c, 1), b = node(c, 2);
  const Vec3 along = model.nodes[b] - model.nodes[a];
  if (!(along.norm() > 0.0)) deck.fail(c, "its grids are at one place");
  FeEquation e;
  e.line = c.line;
  GridMotion end{deck.blank(c, 3) ? b : a, 0, along.normalized(), {}};
  add_terms(end, 1.0, e);
  end.node = deck.blank(c, 3) ? a : b;
  add_terms(end, -1.0, e);
  model.equations.push_back(std::move(e));
}

}  // namespace flexframe::sim
