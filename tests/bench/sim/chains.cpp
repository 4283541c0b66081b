// CPU seconds of one evaluation of the equations of motion: chains of n links, rigid and flexible, one mixed beam of n
// volumes, one modal beam of k modes: tables, the exponents of the growth, and, with a file name, the rows as CSV
// for a plot.
//
//   bench_chains [ROWS.csv]
#include "sim/scene/scene_reader.h"
#include "sim/start/make_system.h"
#include "tests/bench/cpu.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

namespace {

using namespace flexframe::sim;

std::string chain(int n, bool flexible) {
  std::string scene = "[simulation]\nduration = 1\ngravity = [0, -9.81, 0]\n";
  for (int k = 0; k < n; ++k) {
    const std::string name = fmt::format("link{}", k);
    if (flexible)
      scene += fmt::format(
          "[[body]]\nname = \"{}\"\nkind = \"beam\"\nlength = 0.1\nsection = {{ shape = \"circle\", diameter = 0.01 }}\nmaterial = {{ "
          "density = 2700.0, youngs_modulus = 7e9 }}\n"
          "model = \"modal\"\nboundary = \"supported-supported\"\nmodes = {{ bending_xy = [1, 2] }}\n",
          name);
    else
      scene += fmt::format(
          "[[body]]\nname = \"{}\"\nkind = \"rigid\"\nmass = 0.02\ninertia = [1e-7, 2e-5, 2e-5]\ncentre_of_mass = [0.05, 0, 0]\nframes = "
          "{{ tip = [0.1, 0, 0] }}\n",
          name);
  }
  for (int k = 0; k < n; ++k)
    scene += fmt::format(
        "[[joint]]\nname = \"j{}\"\nkind = \"revolute\"\nparent = \"{}\"\nchild = \"link{}\"\ninitial = {{ value = 0.01, rate = 0.1 }}\n",
        k, k == 0 ? "ground" : fmt::format("link{}.tip", k - 1), k);
  return scene;
}

// A thin beam of n volumes in space, with or without its twist, turned into its gravity.
std::string volumes(int n, bool torsion) {
  return fmt::format(
      "[simulation]\nduration = 1\ngravity = [0, -9.81, 0]\n[[body]]\nname = \"beam\"\nkind = \"beam\"\nmodel = \"mixed\"\nvolumes = "
      "{}\nelements = 1\n"
      "length = {}\nsection = {{ shape = \"circle\", diameter = 0.01 }}\nmaterial = {{ density = 2700.0, youngs_modulus = 7e9 }}\n"
      "effects = [\"bending_xy\", {}\"stiffening\"]\n[[joint]]\nname = \"clamp\"\nkind = \"weld\"\nparent = \"ground\"\nchild = "
      "\"beam.root\"\n",
      n, 0.1 * n, torsion ? "\"bending_xz\", \"torsion\", " : "");
}

// A hinged beam with k modes.
std::string modes(int k) {
  std::string list;
  for (int i = 1; i <= k; ++i) list += fmt::format("{}{}", i > 1 ? ", " : "", i);
  return fmt::format(
      "[simulation]\nduration = 1\ngravity = [0, -9.81, 0]\n[[body]]\nname = \"beam\"\nkind = \"beam\"\nmodel = \"modal\"\nmodes = {{ "
      "bending_xy = [{}] }}\n"
      "length = 1.0\nboundary = \"supported-supported\"\nsection = {{ shape = \"circle\", diameter = 0.01 }}\nmaterial = {{ density = "
      "2700.0, youngs_modulus = 7e9 }}\n"
      "[[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nparent = \"ground\"\nchild = \"beam.root\"\ninitial = {{ rate = 0.1 }}\n",
      list);
}

// Least mean of several rounds: what disturbs only adds.
double per_evaluation(int n, const std::string& scene) {
  System system = make_system(parse_scene(scene, "chain.toml"));
  const VecX y = pack_state(system, Eigen::Vector2d::Zero());
  VecX dy(y.size());
  double least = 1e9;
  for (int round = 0; round < 7; ++round) {
    const int repeats = std::max(2, 4000 / n);
    const double start = flexframe::test::process_seconds();
    for (int k = 0; k < repeats; ++k) state_rate(system, 0.0, y.data(), dy.data());
    least = std::min(least, (flexframe::test::process_seconds() - start) / repeats);
  }
  return least;
}

}  // namespace

int main(int count, char** words) {
  std::FILE* file = count > 1 ? std::fopen(words[1], "w") : nullptr;
  if (file) fmt::print(file, "links,kind,seconds\n");
  struct Kind {
    const char* name;
    std::vector<int> sizes;
    std::string (*scene)(int);
  };
  const std::vector<int> chain_sizes = {10, 20, 50, 100, 200, 500, 1000};
  const std::vector<Kind> kinds = {{"rigid links", chain_sizes, [](int n) { return chain(n, false); }},
                                   {"flexible links", chain_sizes, [](int n) { return chain(n, true); }},
                                   {"volumes of a beam in the plane", chain_sizes, [](int n) { return volumes(n, false); }},
                                   {"volumes of a beam in space", chain_sizes, [](int n) { return volumes(n, true); }},
                                   {"modes of one beam", {1, 2, 5, 10, 20, 40, 60}, modes}};
  for (const Kind& kind : kinds) {
    fmt::print("{}\n  {:>5}  {:>14}  {:>12}\n", kind.name, "n", "us/evaluation", "us/n");
    // Least squares of log t over log n.
    double sx = 0, sy = 0, sxx = 0, sxy = 0, m = 0;
    for (const int n : kind.sizes) {
      const double t = per_evaluation(n, kind.scene(n));
      fmt::print("  {:>5}  {:>14.1f}  {:>12.3f}\n", n, 1e6 * t, 1e6 * t / n);
      if (file) fmt::print(file, "{},{},{:.6g}\n", n, kind.name, t);
      const double x = std::log(n), z = std::log(t);
      sx += x, sy += z, sxx += x * x, sxy += x * z, m += 1;
    }
    fmt::print("  exponent {:.3f}\n", (m * sxy - sx * sy) / (m * sxx - sx * sx));
  }
  if (file) std::fclose(file);
}
