// Of large meshes: positions that coincide, and edges with the triangles that meet in them. Time goes with the number of triangles.
#pragma once

#include <glm/glm.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace flexframe::render {

// First position with the same coordinates, for each position: seams repeat positions bit by bit. Coordinates must be finite.
template <class Vector>
std::vector<int> weld_equal(std::span<const Vector> positions) {
  // A table with open addresses, at most half full.
  const std::size_t size = std::bit_ceil(2 * positions.size() + 2);
  std::vector<int> slots(size, -1), welded(positions.size());
  for (std::size_t v = 0; v < positions.size(); ++v) {
    std::uint64_t h = 0;
    for (int k = 0; k < 3; ++k) {
      h = (h ^ std::bit_cast<std::uint64_t>(static_cast<double>(positions[v][k]) + 0.0)) * 0x9e3779b97f4a7c15ull;  // + 0: no -0
      h ^= h >> 29;
    }
    std::size_t at = h & (size - 1);
    while (slots[at] >= 0 && positions[slots[at]] != positions[v]) at = (at + 1) & (size - 1);
    if (slots[at] < 0) slots[at] = static_cast<int>(v);
    welded[v] = slots[at];
  }
  return welded;
}

// One triangle at an edge: the edge runs from the triangle's corner `corner` (0..2) to the next one.
struct EdgeSide {
  int high, triangle;  // the edge's greater place
  std::uint8_t corner;
  bool upwards;  // from the lesser place to the greater
};

// Calls visit(low, sides) for every edge, by rising places: the sides of one edge lie side by side, by rising triangle. place: of each
// index of the triangles, 0 .. place.size() - 1. A bucket a place, so time goes with the number of triangles.
template <class Triangles, class Visit>
void for_each_edge(const Triangles& triangles, const std::vector<int>& place, Visit visit) {
  const std::size_t corners = 3 * triangles.size();
  const auto end_of = [&](std::size_t c) { return place[triangles[c / 3][static_cast<int>(c % 3)]]; };
  const auto next_of = [](std::size_t c) { return c % 3 == 2 ? c - 2 : c + 1; };
  std::vector<std::size_t> begin(place.size() + 1, 0);
  for (std::size_t c = 0; c < corners; ++c) ++begin[static_cast<std::size_t>(std::min(end_of(c), end_of(next_of(c)))) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> at(corners);
  {
    std::vector<std::size_t> fill(begin.begin(), begin.end() - 1);
    for (std::size_t c = 0; c < corners; ++c)
      at[fill[static_cast<std::size_t>(std::min(end_of(c), end_of(next_of(c))))]++] = static_cast<std::uint32_t>(c);
  }
  std::vector<EdgeSide> sides;
  for (std::size_t low = 0; low < place.size(); ++low) {
    sides.clear();
    for (std::size_t i = begin[low]; i < begin[low + 1]; ++i) {
      const std::size_t c = at[i];
      const int a = end_of(c), b = end_of(next_of(c));
      sides.push_back({std::max(a, b), static_cast<int>(c / 3), static_cast<std::uint8_t>(c % 3), a < b});
    }
    std::sort(sides.begin(), sides.end(), [](const EdgeSide& p, const EdgeSide& q) {
      return p.high != q.high ? p.high < q.high : p.triangle != q.triangle ? p.triangle < q.triangle : p.corner < q.corner;
    });
    for (std::size_t i = 0; i < sides.size();) {
      std::size_t end = i + 1;
      while (end < sides.size() && sides[end].high == sides[i].high) ++end;
      visit(static_cast<int>(low), std::span<const EdgeSide>(&sides[i], end - i));
      i = end;
    }
  }
}

}  // namespace flexframe::render
