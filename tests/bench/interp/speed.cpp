// Speed of the kernel map, one thread, CPU time, best of several runs interleaved with the triad that they are measured against.
//   interp_speed              all rows
//   interp_speed --evaluate   only the evaluation that scipy_rbf.py is compared with: 1000 nodes, 100 000 vertices
#include "interp/map.h"
#include "interp/modes.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <ctime>
#include <limits>
#include <numbers>
#include <vector>

namespace {

using namespace flexframe::interp;

double cpu() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

template <typename Work>
double once(const Work& work) {
  const double start = cpu();
  work();
  return cpu() - start;
}

// Torus with about m vertices: closed, curved both ways.
struct Mesh {
  Points v;
  Triangles t;
  MeshView view() const { return {Eigen::Map<const Points>(v.data(), v.rows(), 3), Eigen::Map<const Triangles>(t.data(), t.rows(), 3)}; }
};
Mesh make_torus(int m) {
  const int small = static_cast<int>(std::sqrt(m / 3.0)), large = m / small;
  Mesh mesh;
  mesh.v.resize(small * large, 3);
  mesh.t.resize(2 * small * large, 3);
  for (int i = 0; i < large; ++i)
    for (int j = 0; j < small; ++j) {
      const double a = 2.0 * std::numbers::pi * i / large, b = 2.0 * std::numbers::pi * j / small, r = 1.0 + 0.35 * std::cos(b);
      mesh.v.row(i * small + j) << r * std::cos(a), r * std::sin(a), 0.35 * std::sin(b);
      const int p = i * small + j, q = i * small + (j + 1) % small, n = (i + 1) % large * small;
      mesh.t.row(2 * p) << p, n + j, n + (j + 1) % small;
      mesh.t.row(2 * p + 1) << p, n + (j + 1) % small, q;
    }
  return mesh;
}
// n nodes evenly spread: every so many rings and sides.
Nodes spread_nodes(const Mesh& mesh, int n) {
  const int m = static_cast<int>(mesh.v.rows()), small = static_cast<int>(std::sqrt(m / 3.0)), large = m / small;
  const int across = std::max(3, static_cast<int>(std::sqrt(n / 3.0))), along = n / across;
  Nodes nodes;
  nodes.positions.resize(across * along, 3);
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < across; ++j)
      nodes.positions.row(i * across + j) = mesh.v.row(i * large / along * small + (j * small / across + (i % 2) * small / (2 * across)) % small);
  return nodes;
}

void products() {
  constexpr int frames = 32;
  fmt::print("single and batched product ({} frames) against a triad (a = b + s c, floats, three streams); share: bytes moved per second against the triad's;\n"
             "written: a frame's displacements written alone (no modes), and how many times faster than the single product a batch could be at most\n", frames);
  fmt::print("{:>9} {:>6} {:>11} {:>11} {:>11} {:>11} {:>9} {:>9} {:>9}\n", "vertices", "modes", "triad GB/s", "single ms", "batched ms", "written ms", "share", "batch x", "at most x");
  for (const int m : {5000, 100000, 1000000})
    for (const int n : {3, 20, 100}) {
      ModeColumns columns;
      columns.vertices = m;
      columns.columns = Eigen::MatrixXf::Constant(3 * m, n, 0.5f);
      const std::vector<double> q(static_cast<size_t>(n), 0.01);
      std::vector<float> out(static_cast<size_t>(3 * m));
      const Eigen::MatrixXd qs = Eigen::MatrixXd::Constant(n, frames, 0.01);
      Eigen::MatrixXf batch(3 * m, frames);
      ModeColumns empty;
      empty.vertices = m;
      empty.columns.resize(3 * m, 0);
      const Eigen::MatrixXd no_q(0, frames);
      // The triad moves as much memory as the product: columns in, displacements out.
      const size_t length = static_cast<size_t>(3 * m) * static_cast<size_t>(n + 1) / 3 + 1;
      std::vector<float> a(length, 0.0f), b(length, 1.0f), c(length, 2.0f);
      const int repeat = std::max(1, 300000 / m);
      double triad = 1e300, single = 1e300, batched = 1e300, written = 1e300;
      for (int run = 0; run < 5; ++run) {
        triad = std::min(triad, once([&] {
                           for (int k = 0; k < repeat; ++k) {
                             float* __restrict to = a.data();
                             const float *p = b.data(), *s = c.data();
                             for (size_t i = 0; i < length; ++i) to[i] = p[i] + 3.0f * s[i];
                             asm volatile("" : : "r"(to) : "memory");
                           }
                         }) / repeat);
        single = std::min(single, once([&] { for (int k = 0; k < repeat; ++k) apply_modes(columns, q, out, 1); }) / repeat);
        batched = std::min(batched, once([&] { apply_modes_batch(columns, qs, batch, 1); }) / frames);
        written = std::min(written, once([&] { apply_modes_batch(empty, no_q, batch, 1); }) / frames);
      }
      const double rate = 12.0 * static_cast<double>(length) / triad;
      fmt::print("{:>9} {:>6} {:>11.1f} {:>11.4f} {:>11.4f} {:>11.4f} {:>8.0f}% {:>9.2f} {:>9.1f}\n", m, n, 1e-9 * rate, 1e3 * single, 1e3 * batched, 1e3 * written,
                 100.0 * 12.0 * m * (n + 1.0) / single / rate, single / batched, single / written);
      std::fflush(stdout);
    }
}

void set_up() {
  fmt::print("\nset-up of the kernel map and evaluation of a nodal series, one thread\n{:>7} {:>9} {:>8} {:>12} {:>14} {:>10}\n", "nodes", "vertices", "patches", "set-up ms",
             "evaluation ms", "Lebesgue");
  for (const auto& [n, m] : {std::pair(97, 3442), std::pair(100, 100000), std::pair(1000, 10000), std::pair(1000, 100000), std::pair(1000, 1000000), std::pair(10000, 100000), std::pair(10000, 1000000)}) {
    const Mesh mesh = make_torus(m);
    const Nodes nodes = spread_nodes(mesh, n);
    Options options;
    options.scheme = Scheme::kernel;
    options.threads = 1;
    Map map;
    const double time = once([&] { map = make_map(nodes, mesh.view(), options); });
    const Points u = nodes.positions * 0.01;
    PointsF out;
    double evaluation = 1e300;
    for (int k = 0; k < 3; ++k) evaluation = std::min(evaluation, once([&] { apply(map, u, Points(0, 3), out); }));
    fmt::print("{:>7} {:>9} {:>8} {:>12.1f} {:>14.2f} {:>10.2f}\n", n, mesh.v.rows(), map.report.patches, 1e3 * time, 1e3 * evaluation, map.report.lebesgue);
    std::fflush(stdout);
  }
}

void evaluate() {
  const Mesh mesh = make_torus(100000);
  const Nodes nodes = spread_nodes(mesh, 1000);
  Options options;
  options.scheme = Scheme::kernel;
  options.threads = 1;
  const Map map = make_map(nodes, mesh.view(), options);
  const Points u = nodes.positions * 0.01;
  PointsF out;
  double best = 1e300;
  for (int k = 0; k < 10; ++k) best = std::min(best, once([&] { apply(map, u, Points(0, 3), out); }));
  fmt::print("{} {} {:.9f}\n", nodes.positions.rows(), mesh.v.rows(), best);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::strcmp(argv[1], "--evaluate") == 0) {
    evaluate();
    return 0;
  }
  products();
  if (argc > 1 && std::strcmp(argv[1], "--products") == 0) return 0;
  set_up();
  return 0;
}
