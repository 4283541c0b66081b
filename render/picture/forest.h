// Disjoint sets of numbers, each named by its least.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace flexframe::render {

struct Forest {
  std::vector<int> parent;
  explicit Forest(std::size_t n) : parent(n) { std::iota(parent.begin(), parent.end(), 0); }
  int root(int a) {
    while (parent[a] != a) {
      parent[a] = parent[parent[a]];
      a = parent[a];
    }
    return a;
  }
  void join(int a, int b) {
    a = root(a);
    b = root(b);
    if (a != b) parent[std::max(a, b)] = std::min(a, b);
  }
};

}  // namespace flexframe::render
