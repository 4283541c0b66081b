// Which things of a numbered set have come together, directly or by way of others.
#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

namespace flexframe::sim {

// Union-find with halved paths (Tarjan 1975).
class Groups {
 public:
  explicit Groups(int count) : of_(static_cast<size_t>(count)) { std::iota(of_.begin(), of_.end(), 0); }
  void add() { of_.push_back(static_cast<int>(of_.size())); }
  int find(int i) {
    while (of_[i] != i) i = of_[i] = of_[of_[i]];
    return i;
  }
  void join(int a, int b) { of_[find(a)] = find(b); }

 private:
  std::vector<int> of_;
};

}  // namespace flexframe::sim
