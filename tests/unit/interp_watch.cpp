// Long calls that are given up: the watch of the caller's thread.
#include "interp/map.h"
#include "interp/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace flexframe::interp::test_watch {
namespace {

struct Stop {};

TEST(InterpWatch, IsAskedWithinItsLifeAndItsThread) {
  int outer = 0, inner = 0;
  look();
  {
    const Watch watch([&] { ++outer; });
    look();
    {
      const Watch second([&] { ++inner; });
      look();
    }
    std::thread([] { look(); }).join();
    look();
  }
  look();
  EXPECT_EQ(outer, 2);
  EXPECT_EQ(inner, 1);
}

// Chunks without end: all threads leave once the caller's gave up.
TEST(InterpWatch, StopsAllThreads) {
  for (const int threads : {1, 4}) {
    std::atomic<int> running{0};
    int asked = 0;
    const Watch watch([&] {
      if (++asked > 50) throw Stop{};
    });
    const auto work = [&](int, int) {
      ++running;
      struct Leave {
        std::atomic<int>& count;
        ~Leave() { --count; }
      } leave{running};
      for (;;) {
        look();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    };
    EXPECT_THROW(parallel_chunks(8, 1, threads, work), Stop);
    EXPECT_EQ(running, 0);
  }
}

TEST(InterpWatch, LeavesBesideWhatCannotLook) {
  std::atomic<bool>* ended = new std::atomic<bool>(false);  // the work may outlive the test's frame
  const auto begin = std::chrono::steady_clock::now();
  const auto work = [ended] {
    std::this_thread::sleep_for(std::chrono::seconds(1));
    *ended = true;
  };
  {
    const Watch watch([] { throw Stop{}; });
    EXPECT_THROW(look_beside(work), Stop);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(900));
    EXPECT_FALSE(*ended);
  }
  while (!*ended) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  delete ended;
  const Watch patient([] {});
  EXPECT_THROW(look_beside([] { throw MapError("of the work"); }), MapError);
}

// A sheet of n x n vertices; every third vertex of every third row holds a node.
struct Sheet {
  Points vertices, nodes;
  Triangles triangles;
};
Sheet sheet(int n) {
  Sheet s;
  s.vertices.resize(n * n, 3);
  for (int i = 0; i < n * n; ++i) {
    const double x = static_cast<double>(i / n) / n, y = static_cast<double>(i % n) / n;
    s.vertices.row(i) << x, y, 0.1 * std::sin(9.0 * x);
  }
  s.triangles.resize(2 * (n - 1) * (n - 1), 3);
  int t = 0;
  for (int i = 0; i + 1 < n; ++i)
    for (int j = 0; j + 1 < n; ++j) {
      s.triangles.row(t++) << i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1;
      s.triangles.row(t++) << i * n + j, (i + 1) * n + j + 1, i * n + j + 1;
    }
  std::vector<int> held;
  for (int i = 0; i < n; i += 3)
    for (int j = 0; j < n; j += 3) held.push_back(i * n + j);
  s.nodes.resize(static_cast<Eigen::Index>(held.size()), 3);
  for (size_t k = 0; k < held.size(); ++k) s.nodes.row(static_cast<Eigen::Index>(k)) = s.vertices.row(held[k]);
  return s;
}

// Every look of a map may be its last, and one that is never stopped is the map that nobody watched.
TEST(InterpWatch, MapsAreGivenUpOrTheSame) {
  const Sheet s = sheet(24);
  const MeshView mesh{Eigen::Map<const Points>(s.vertices.data(), s.vertices.rows(), 3),
                      Eigen::Map<const Triangles>(s.triangles.data(), s.triangles.rows(), 3)};
  for (const Scheme scheme : {Scheme::kernel, Scheme::elastic, Scheme::r3}) {
    Options options;
    options.scheme = scheme;
    options.threads = 1;  // the looks of one thread are always as many
    const Map alone = make_map({s.nodes, false, {}, false, {}}, mesh, options);
    long asked = 0;
    {
      const Watch watch([&] { ++asked; });
      const Map watched = make_map({s.nodes, false, {}, false, {}}, mesh, options);
      EXPECT_EQ(watched.weights.single, alone.weights.single);
    }
    EXPECT_GT(asked, 20);
    for (long stop = 1; 2 * stop < asked; stop = 3 * stop) {
      long count = 0;
      const Watch watch([&] {
        if (++count >= stop) throw Stop{};
      });
      EXPECT_THROW(make_map({s.nodes, false, {}, false, {}}, mesh, options), Stop) << stop << " of " << asked;
    }
  }
}

}  // namespace
}  // namespace flexframe::interp::test_watch
