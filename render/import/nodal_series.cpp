#include "render/import/nodal_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>

namespace flexframe::imports {
namespace {

// Faces of a cell: corners counterclockwise from outside, each followed (quadratic) by the local nodes of the edges that begin there.
struct Face {
  std::vector<int> corners, middles;
};

const std::vector<Face>& faces_of(CellShape shape) {
  static const std::map<CellShape, std::vector<Face>> all = {
      {CellShape::triangle, {{{0, 1, 2}, {3, 4, 5}}}},
      {CellShape::quad, {{{0, 1, 2, 3}, {4, 5, 6, 7}}}},
      {CellShape::tetrahedron, {{{0, 2, 1}, {6, 5, 4}}, {{0, 1, 3}, {4, 8, 7}}, {{1, 2, 3}, {5, 9, 8}}, {{2, 0, 3}, {6, 7, 9}}}},
      {CellShape::pyramid,
       {{{0, 3, 2, 1}, {8, 7, 6, 5}},
        {{0, 1, 4}, {5, 10, 9}},
        {{1, 2, 4}, {6, 11, 10}},
        {{2, 3, 4}, {7, 12, 11}},
        {{3, 0, 4}, {8, 9, 12}}}},
      {CellShape::wedge,
       {{{0, 2, 1}, {8, 7, 6}},
        {{3, 4, 5}, {9, 10, 11}},
        {{0, 1, 4, 3}, {6, 13, 9, 12}},
        {{1, 2, 5, 4}, {7, 14, 10, 13}},
        {{2, 0, 3, 5}, {8, 12, 11, 14}}}},
      {CellShape::hexahedron,
       {{{0, 3, 2, 1}, {11, 10, 9, 8}},
        {{4, 5, 6, 7}, {12, 13, 14, 15}},
        {{0, 1, 5, 4}, {8, 17, 12, 16}},
        {{1, 2, 6, 5}, {9, 18, 13, 17}},
        {{2, 3, 7, 6}, {10, 19, 14, 18}},
        {{3, 0, 4, 7}, {11, 16, 15, 19}}}}};
  static const std::vector<Face> none;
  const auto at = all.find(shape);
  return at == all.end() ? none : at->second;
}

bool is_shell(CellShape shape) { return shape == CellShape::triangle || shape == CellShape::quad || shape == CellShape::polygon; }

// Triangles of a face; with middles the corners are cut off and the polygon of the middles is left.
void cut_face(std::span<const int> corners, std::span<const int> middles, std::vector<Eigen::Vector3i>& out) {
  const size_t n = corners.size();
  if (middles.empty()) {
    for (size_t k = 1; k + 1 < n; ++k) out.emplace_back(corners[0], corners[k], corners[k + 1]);
    return;
  }
  for (size_t k = 0; k < n; ++k) out.emplace_back(corners[k], middles[k], middles[(k + n - 1) % n]);
  for (size_t k = 1; k + 1 < n; ++k) out.emplace_back(middles[0], middles[k], middles[k + 1]);
}

// Six times the volume between the faces of a cell and the origin of its first corner: negative where its nodes wind the other way.
double signed_volume(const Cells& cells, int cell, const sim::MatX& points) {
  const int* nodes = cells.nodes.data() + cells.begin[cell];
  const sim::Vec3 origin = points.row(nodes[0]).transpose();
  double volume = 0.0;
  for (const Face& face : faces_of(cells.shapes[cell]))
    for (size_t k = 1; k + 1 < face.corners.size(); ++k) {
      const auto at = [&](int corner) { return sim::Vec3(points.row(nodes[corner]).transpose() - origin); };
      volume += at(face.corners[0]).dot(at(face.corners[k]).cross(at(face.corners[k + 1])));
    }
  return volume;
}

}  // namespace

void Cells::add(CellShape shape, bool is_quadratic, const std::vector<int>& of_cell) {
  shapes.push_back(shape);
  quadratic.push_back(is_quadratic);
  nodes.insert(nodes.end(), of_cell.begin(), of_cell.end());
  begin.push_back(static_cast<int>(nodes.size()));
}

int corner_count(CellShape shape) {
  static const std::map<CellShape, int> counts = {{CellShape::triangle, 3}, {CellShape::quad, 4},  {CellShape::tetrahedron, 4},
                                                  {CellShape::pyramid, 5},  {CellShape::wedge, 6}, {CellShape::hexahedron, 8}};
  const auto at = counts.find(shape);
  return at == counts.end() ? 0 : at->second;
}

int quadratic_count(CellShape shape) {
  static const std::map<CellShape, int> counts = {{CellShape::triangle, 6}, {CellShape::quad, 8},   {CellShape::tetrahedron, 10},
                                                  {CellShape::pyramid, 13}, {CellShape::wedge, 15}, {CellShape::hexahedron, 20}};
  const auto at = counts.find(shape);
  return at == counts.end() ? 0 : at->second;
}

std::vector<Eigen::Vector3i> skin_of(const Cells& cells, const sim::MatX& points) {
  struct Seen {
    int cell = 0, face = 0, times = 0;
  };
  std::map<std::array<int, 4>, Seen> seen;  // by the sorted corners
  std::vector<Eigen::Vector3i> out;
  for (int c = 0; c < cells.count(); ++c) {
    const CellShape shape = cells.shapes[c];
    if (is_shell(shape)) continue;
    const int* nodes = cells.nodes.data() + cells.begin[c];
    const std::vector<Face>& faces = faces_of(shape);
    for (size_t f = 0; f < faces.size(); ++f) {
      std::array<int, 4> key{-1, -1, -1, -1};
      for (size_t k = 0; k < faces[f].corners.size(); ++k) key[k] = nodes[faces[f].corners[k]];
      std::sort(key.begin(), key.end());
      Seen& at = seen[key];
      at = {c, static_cast<int>(f), at.times + 1};
    }
  }
  const auto add = [&](int cell, const Face& face) {
    const int* nodes = cells.nodes.data() + cells.begin[cell];
    std::vector<int> corners, middles;
    for (const int k : face.corners) corners.push_back(nodes[k]);
    if (cells.quadratic[cell])
      for (const int k : face.middles) middles.push_back(nodes[k]);
    const size_t first = out.size();
    cut_face(corners, middles, out);
    // Nodes in the order of a mirror image: the faces look inwards.
    if (!is_shell(cells.shapes[cell]) && signed_volume(cells, cell, points) < 0.0)
      for (size_t t = first; t < out.size(); ++t) std::swap(out[t][1], out[t][2]);
  };
  for (const auto& [key, at] : seen)
    if (at.times == 1) add(at.cell, faces_of(cells.shapes[at.cell])[at.face]);
  for (int c = 0; c < cells.count(); ++c) {
    const CellShape shape = cells.shapes[c];
    if (!is_shell(shape)) continue;
    if (shape != CellShape::polygon) {
      add(c, faces_of(shape).front());
      continue;
    }
    const auto first = static_cast<size_t>(cells.begin[c]), last = static_cast<size_t>(cells.begin[c + 1]);
    cut_face(std::span(cells.nodes).subspan(first, last - first), {}, out);
  }
  return out;
}

sim::ResultBody to_body(const NodalSeries& series, const std::string& name) {
  const std::vector<Eigen::Vector3i> skin = skin_of(series.cells, series.points);
  if (skin.empty())
    throw sim::InputError(fmt::format("{}: holds no solid or shell elements, so that there is no surface to draw ({} cells, {} points)",
                                      series.file, series.cells.count(), series.points.rows()));
  std::vector<int> place(series.points.rows(), -1);
  std::vector<int> kept;
  for (const Eigen::Vector3i& t : skin)
    for (const int node : t)
      if (int& at = place[node]; at < 0) {
        at = 0;
        kept.push_back(node);
      }
  std::sort(kept.begin(), kept.end());
  const Eigen::Index nt = series.times.size(), nn = std::ssize(kept);
  sim::ResultBody body;
  body.name = name;
  body.kind = "modal";
  body.position.setZero(nt, 3);
  body.orientation.setZero(nt, 4);
  body.orientation.col(0).setOnes();
  body.surface.points.resize(nn, 3);
  body.displacement.resize(nt, 3 * nn);
  if (series.von_mises.size() > 0) body.node_von_mises.resize(nt, nn);
  for (Eigen::Index k = 0; k < nn; ++k) {
    const int node = kept[k];
    place[node] = static_cast<int>(k);
    const sim::Vec3 origin = series.points.row(node).transpose();
    body.nodes.push_back({series.node_names.empty() ? fmt::format("{}", node + 1) : series.node_names[node], origin});
    body.surface.points.row(k) = origin.transpose();
    body.surface.nodes.push_back(static_cast<int>(k));
    body.displacement.middleCols(3 * k, 3) = series.displacement.middleCols(3 * Eigen::Index{node}, 3);
    if (series.von_mises.size() > 0) body.node_von_mises.col(k) = series.von_mises.col(node);
  }
  body.surface.triangles.resize(std::ssize(skin), 3);
  for (size_t t = 0; t < skin.size(); ++t)
    for (int a = 0; a < 3; ++a) body.surface.triangles(static_cast<Eigen::Index>(t), a) = place[skin[t][a]];
  return body;
}

double von_mises(const double* s) {
  const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
  return std::sqrt(0.5 * (a * a + b * b + c * c) + 3.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

}  // namespace flexframe::imports
