// Ears of a polygon: corners that can be cut off as triangles (Meisters, Polygons have ears, 1975).
#pragma once

#include <cstddef>
#include <vector>

namespace flexframe::render {

// The best ear of the ring, as a place in it; ring.size() where it has none (a polygon that crosses itself, or a flat one).
// ring: corners, counterclockwise. turn(a, b, c): twice the area of the triangle of these corners, > 0 if it runs counterclockwise.
// same(a, b): whether two corners are at one place. shape(a, b, c, turn): the larger the better, < 0 for no triangle to be cut, at least 1
// for one that is taken without looking further. Places are tried from `start` on.
template <class Turn, class Same, class Shape>
std::size_t find_ear(const std::vector<int>& ring, std::size_t start, Turn&& turn, Same&& same, Shape&& shape) {
  const std::size_t n = ring.size();
  std::size_t best = n;
  double best_shape = -1.0;
  for (std::size_t step = 0; step < n && best_shape < 1.0; ++step) {
    const std::size_t k = (start + step) % n;
    const int a = ring[(k + n - 1) % n], b = ring[k], c = ring[(k + 1) % n];
    const double area = turn(a, b, c), quality = shape(a, b, c, area);
    if (quality < 0.0 || quality <= best_shape) continue;
    bool empty = true;
    for (std::size_t j = 0; j < n && empty && area > 0.0; ++j) {
      const int p = ring[j];
      if (p == a || p == b || p == c || same(p, a) || same(p, b) || same(p, c)) continue;
      empty = !(turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0);
    }
    if (empty) best = k, best_shape = quality;
  }
  return best;
}

}  // namespace flexframe::render
