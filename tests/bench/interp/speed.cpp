// Speed of the kernel map, one thread, CPU time, best of several runs interleaved with the triad that they are measured against.
//   interp_speed              all rows
//   interp_speed --plot FILE  set-up and evaluation against the number of vertices for 100, 1000 and 10 000 nodes, as an SVG
//   interp_speed --evaluate   only the evaluation that scipy_rbf.py is compared with: 1000 nodes, 100 000 vertices
#include "interp/map.h"
#include "interp/modes.h"
#include "tests/bench/cpu.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <numbers>
#include <vector>

namespace {

using namespace flexframe::interp;

template <typename Work>
double once(const Work& work) {
  const double start = flexframe::test::process_seconds();
  work();
  return flexframe::test::process_seconds() - start;
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
      nodes.positions.row(i * across + j) =
          mesh.v.row(i * large / along * small + (j * small / across + (i % 2) * small / (2 * across)) % small);
  return nodes;
}

// Seconds of one multiplication and addition of the batched product where memory does not matter: tiles that stay in the cache.
double arithmetic() {
  constexpr int rows = 960, modes = 60, frames = 8, repeat = 200;
  const ModeColumns columns(Eigen::MatrixXf::Constant(rows, modes, 0.5f));
  const Eigen::MatrixXf q = Eigen::MatrixXf::Constant(modes, frames, 0.01f);
  Eigen::MatrixXf out(rows, frames);
  double best = 1e300;
  for (int run = 0; run < 20; ++run)
    best = std::min(best, once([&] {
                      for (int k = 0; k < repeat; ++k) combine_tiles_batch(columns.tiles().data(), q, out.data(), rows, rows);
                    }));
  return best / (static_cast<double>(rows) * modes * frames * repeat);
}

void products() {
  constexpr int frames = 32;
  fmt::print(
      "single and batched product ({} frames) against a triad (a = b + s c, floats, three streams); share: bytes moved per second against "
      "the triad's;\n"
      "written: a frame's displacements written alone (no modes); summed: its 3 M n multiplications and additions from the cache;\n"
      "at most: how many times faster than the single product a batch could be by the dearer of the two\n",
      frames);
  fmt::print("{:>9} {:>6} {:>11} {:>11} {:>11} {:>11} {:>11} {:>9} {:>9} {:>9}\n", "vertices", "modes", "triad GB/s", "single ms",
             "batched ms", "written ms", "summed ms", "share", "batch x", "at most x");
  const double sum = arithmetic();
  for (const int m : {5000, 100000, 1000000})
    for (const int n : {3, 20, 100}) {
      const ModeColumns columns(Eigen::MatrixXf::Constant(3 * m, n, 0.5f));
      const std::vector<double> q(static_cast<size_t>(n), 0.01);
      std::vector<float> out(static_cast<size_t>(3 * m));
      const Eigen::MatrixXd qs = Eigen::MatrixXd::Constant(n, frames, 0.01);
      Eigen::MatrixXf batch(3 * m, frames);
      const ModeColumns empty(3 * m, 0);
      const Eigen::MatrixXd no_q(0, frames);
      // The triad moves as much memory as the product: columns in, displacements out.
      const size_t length = static_cast<size_t>(3 * m) * static_cast<size_t>(n + 1) / 3 + 1;
      LargeVector<float> a(length, 0.0f), b(length, 1.0f), c(length, 2.0f);  // memory of the same kind
      const int repeat = std::max(1, 300000 / m);
      double triad = 1e300, single = 1e300, batched = 1e300, written = 1e300;
      for (int run = 0; run < 12; ++run) {
        triad = std::min(triad, once([&] {
                                  for (int k = 0; k < repeat; ++k) {
                                    float* __restrict to = a.data();
                                    const float *p = b.data(), *s = c.data();
                                    for (size_t i = 0; i < length; ++i) to[i] = p[i] + 3.0f * s[i];
                                    asm volatile("" : : "r"(to) : "memory");
                                  }
                                }) / repeat);
        single = std::min(single, once([&] {
                                    for (int k = 0; k < repeat; ++k) apply_modes(columns, q, out, 1);
                                  }) / repeat);
        batched = std::min(batched, once([&] { apply_modes_batch(columns, qs, batch, 1); }) / frames);
        written = std::min(written, once([&] { apply_modes_batch(empty, no_q, batch, 1); }) / frames);
      }
      const double summed = sum * 3.0 * m * n;
      const double rate = 12.0 * static_cast<double>(length) / triad;
      fmt::print("{:>9} {:>6} {:>11.1f} {:>11.4f} {:>11.4f} {:>11.4f} {:>11.4f} {:>8.0f}% {:>9.2f} {:>9.1f}\n", m, n, 1e-9 * rate,
                 1e3 * single, 1e3 * batched, 1e3 * written, 1e3 * summed, 100.0 * 12.0 * m * (n + 1.0) / single / rate, single / batched,
                 single / std::max(written, summed));
      std::fflush(stdout);
    }
}

void set_up() {
  fmt::print("\nset-up of the kernel map and evaluation of a nodal series, one thread\n{:>7} {:>9} {:>8} {:>12} {:>14} {:>10}\n", "nodes",
             "vertices", "patches", "set-up ms", "evaluation ms", "Lebesgue");
  for (const auto& [n, m] : {std::pair(97, 3442), std::pair(100, 100000), std::pair(1000, 10000), std::pair(1000, 100000),
                             std::pair(1000, 1000000), std::pair(10000, 100000), std::pair(10000, 1000000)}) {
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
    fmt::print("{:>7} {:>9} {:>8} {:>12.1f} {:>14.2f} {:>10.2f}\n", n, mesh.v.rows(), map.report.patches, 1e3 * time, 1e3 * evaluation,
               map.report.lebesgue);
    std::fflush(stdout);
  }
}

struct Cost {
  int nodes = 0, vertices = 0;
  double setup = 0.0, evaluation = 0.0;  // CPU s
};

// One panel: seconds against vertices, both logarithmic, a line for each number of nodes.
std::string panel(const std::vector<Cost>& costs, double Cost::*what, double left, const std::string& title) {
  constexpr double top = 46, width = 330, height = 300;
  double low = 1e300, high = 0.0;
  for (const Cost& c : costs) low = std::min(low, c.*what), high = std::max(high, c.*what);
  const double first = std::floor(std::log10(low)), last = std::ceil(std::log10(high));
  const auto x = [&](double m) { return left + width * (std::log10(m) - 3.9) / 2.3; };
  const auto y = [&](double s) { return top + height * (last - std::log10(s)) / (last - first); };
  std::string s = fmt::format("<text x=\"{}\" y=\"28\" text-anchor=\"middle\" font-size=\"14\">{}</text>\n", left + width / 2, title);
  for (double e = first; e <= last; ++e) {
    const double value = std::pow(10.0, e);
    const std::string label = e < -3  ? fmt::format("{:g} \u00b5s", 1e6 * value)
                              : e < 0 ? fmt::format("{:g} ms", 1e3 * value)
                                      : fmt::format("{:g} s", value);
    s += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5}</text>\n",
        left, left + width, y(value), left - 8, y(value) + 4, label);
  }
  for (const auto& [m, label] : {std::pair(1e4, "10 000"), std::pair(1e5, "100 000"), std::pair(1e6, "1 000 000")})
    s += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#eee\"/><text x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\">{4}</text>\n",
        x(m), top, top + height, top + height + 18, label);
  s += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">vertices</text>\n", left + width / 2, top + height + 40);
  const char* color[] = {"#1f5fa8", "#2f8f4e", "#c8501e"};
  int k = 0;
  for (size_t i = 0; i < costs.size(); ++k) {
    std::string points;
    size_t j = i;
    for (; j < costs.size() && costs[j].nodes == costs[i].nodes; ++j) {
      points += fmt::format("{:.1f},{:.1f} ", x(costs[j].vertices), y(costs[j].*what));
      s += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>\n", x(costs[j].vertices), y(costs[j].*what), color[k]);
    }
    s += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n", points, color[k]);
    s += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{} nodes</text>\n", left + 12, top + 20 + 18 * k, color[k], costs[i].nodes);
    i = j;
  }
  return s;
}

void plot(const char* file) {
  std::vector<Cost> costs;
  for (const int n : {100, 1000, 10000})
    for (const int m : {10000, 30000, 100000, 300000, 1000000}) {
      if (m < 3 * n) continue;
      const Mesh mesh = make_torus(m);
      const Nodes nodes = spread_nodes(mesh, n);
      Options options;
      options.scheme = Scheme::kernel;
      options.threads = 1;
      Map map;
      Cost c{n, static_cast<int>(mesh.v.rows()), 0.0, 1e300};
      c.setup = once([&] { map = make_map(nodes, mesh.view(), options); });
      const Points u = nodes.positions * 0.01;
      PointsF out;
      for (int k = 0; k < 3; ++k) c.evaluation = std::min(c.evaluation, once([&] { apply(map, u, Points(0, 3), out); }));
      fmt::print("{:>7} nodes {:>9} vertices: set-up {:.3f} s, evaluation {:.2f} ms\n", n, c.vertices, c.setup, 1e3 * c.evaluation);
      std::fflush(stdout);
      costs.push_back(c);
    }
  std::ofstream(file) << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"860\" height=\"405\" font-family=\"DejaVu Sans, sans-serif\" "
                         "font-size=\"12\">\n<rect width=\"860\" height=\"405\" fill=\"white\"/>\n"
                      << panel(costs, &Cost::setup, 80, "set-up of the kernel map, CPU")
                      << panel(costs, &Cost::evaluation, 510, "a picture of a nodal series, CPU") << "</svg>\n";
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
  if (argc > 2 && std::strcmp(argv[1], "--plot") == 0) {
    plot(argv[2]);
    return 0;
  }
  products();
  if (argc > 1 && std::strcmp(argv[1], "--products") == 0) return 0;
  set_up();
  return 0;
}
