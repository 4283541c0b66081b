// Work against precision beside equations written by hand: five mechanisms as scenes, and in minimal coordinates as a specialist would
// write them down for this one mechanism, under CVODE's Adams method with fixed-point iteration in both. The error is the largest over the
// samples, relative to the output's range, against the same side's run at the tightest tolerance; that both sides are one mechanism is
// checked by these two references. Textbook equations (Lagrange); no set-up and no error estimate in the times.
//
//   bench_by_hand [ROWS.csv]     ninja work_precision makes examples/studies/by_hand again
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"
#include "tests/bench/cpu.h"

#include <cvode/cvode.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

namespace sim = flexframe::sim;
constexpr double pi = 3.14159265358979323846, gravity = 9.81;
constexpr double tightest = 1e-13;

struct Mechanism {
  const char* name;
  std::string scene;   // without [simulation]
  const char* weight;  // gravity of the scene
  std::string column;  // output that is compared
  double duration, rate;
  std::vector<double> start;                                       // coordinates and rates, as rhs has them
  std::function<void(double t, const double* y, double* dy)> rhs;  // minimal equations of first order
  std::function<double(double t, const double* y)> output;         // the same quantity as the column
};

struct Run {
  std::vector<double> values;
  double seconds = 0.0;
  long evaluations = 0;
};

std::string rigid(const char* name, const std::string& rest) {
  return fmt::format("[[body]]\nname = \"{}\"\nkind = \"rigid\"\n{}\n", name, rest);
}

std::string joint(const char* name, const char* kind, const char* parent, const char* child, const std::string& rest = "") {
  return fmt::format("[[joint]]\nname = \"{}\"\nkind = \"{}\"\nparent = \"{}\"\nchild = \"{}\"\n{}\n", name, kind, parent, child, rest);
}

std::string output(const char* of, const char* quantity) {
  return fmt::format("[[output]]\nname = \"out\"\nof = \"{}\"\nquantity = \"{}\"\n", of, quantity);
}

// A uniform rod of 1 kg, 1 m, hinged at one end, from the horizontal.
Mechanism pendulum() {
  const std::string rod = "mass = 1\ninertia = [0, 0.0833333333333333333, 0.0833333333333333333]\ncentre_of_mass = [0.5, 0, 0]";
  return {"pendulum",
          rigid("rod", rod) + joint("pin", "revolute", "ground", "rod") + output("pin", "value"),
          "[0, -9.81, 0]",
          "out",
          10.0,
          200.0,
          {0.0, 0.0},
          [](double, const double* y, double* dy) {
            dy[0] = y[1];
            dy[1] = -1.5 * gravity * std::cos(y[0]);
          },
          [](double, const double* y) { return y[0]; }};
}

// Two such rods, both from the horizontal; angles from the horizontal as coordinates.
Mechanism double_pendulum() {
  const std::string rod =
      "mass = 1\ninertia = [0, 0.0833333333333333333, 0.0833333333333333333]\ncentre_of_mass = [0.5, 0, 0]\nframes = { end = [1, 0, 0] }";
  return {"double pendulum",
          rigid("upper", rod) + rigid("lower", rod) + joint("pin", "revolute", "ground", "upper") +
              joint("elbow", "revolute", "upper.end", "lower") + output("elbow", "value"),
          "[0, -9.81, 0]",
          "out",
          3.0,
          200.0,
          {0.0, 0.0, 0.0, 0.0},
          [](double, const double* y, double* dy) {
            const double c = 0.5 * std::cos(y[0] - y[1]), s = 0.5 * std::sin(y[0] - y[1]);
            const double f = -s * y[3] * y[3] - 1.5 * gravity * std::cos(y[0]), g = s * y[2] * y[2] - 0.5 * gravity * std::cos(y[1]);
            constexpr double a = 4.0 / 3.0, b = 1.0 / 3.0;
            const double d = a * b - c * c;
            dy[0] = y[2];
            dy[1] = y[3];
            dy[2] = (b * f - c * g) / d;
            dy[3] = (a * g - c * f) / d;
          },
          [](double, const double* y) { return y[1] - y[0]; }};
}

// Kinematics of a slider-crank over the crank's angle: rod angle below the line b, and with primes their derivatives over the angle.
struct SliderCrank {
  double r = 0.1, l = 0.3;
  double b = 0, sb = 0, cb = 1, b1 = 0, b2 = 0, x = 0, x1 = 0, x2 = 0;
  explicit SliderCrank(double angle) {
    const double s = std::sin(angle), c = std::cos(angle);
    sb = r * s / l, cb = std::sqrt(1.0 - sb * sb), b = std::asin(sb);
    b1 = r * c / (l * cb);
    b2 = (-r * s + l * sb * b1 * b1) / (l * cb);
    x = r * c + l * cb;
    x1 = -r * s - l * sb * b1;
    x2 = -r * c - l * (cb * b1 * b1 + sb * b2);
  }
};

std::string slider_crank_joints(const std::string& drive) {
  return joint("drive", "revolute", "ground", "crank", drive) + joint("crank pin", "revolute", "crank.pin", "rod") +
         joint("wrist pin", "revolute", "rod.tip", "piston") +
         joint("bore", "prismatic", "ground", "piston", "axis = [1, 0, 0]\ninitial = { guess = 0.4 }");
}

// Crank of 1 kg as a uniform rod, rod and piston of 1 kg each; nothing drives it, it starts at 20 rad/s. One coordinate: the crank's angle.
Mechanism slider_crank() {
  const std::string crank =
      "mass = 1\ninertia = [0, 0.000833333333333333333, 0.000833333333333333333]\ncentre_of_mass = [0.05, 0, 0]\nframes = { pin = [0.1, 0, "
      "0] }";
  const std::string rod = "mass = 1\ninertia = [0, 0.0075, 0.0075]\ncentre_of_mass = [0.15, 0, 0]\nframes = { tip = [0.3, 0, 0] }";
  return {"rigid slider-crank",
          rigid("crank", crank) + rigid("rod", rod) + rigid("piston", "mass = 1\ninertia = [0.001, 0.001, 0.001]") +
              slider_crank_joints("initial = { value = 0, rate = 20 }") + output("bore", "value"),
          "[0, 0, 0]",
          "out",
          2.0,
          500.0,
          {0.0, 20.0},
          [](double, const double* y, double* dy) {
            const SliderCrank k(y[0]);
            const double s = std::sin(y[0]), c = std::cos(y[0]), h = 0.5 * k.l;
            const double cx1 = -k.r * s - h * k.sb * k.b1, cy1 = 0.5 * k.r * c;
            const double cx2 = -k.r * c - h * (k.cb * k.b1 * k.b1 + k.sb * k.b2), cy2 = -0.5 * k.r * s;
            const double inertia = 0.01 / 3.0 + cx1 * cx1 + cy1 * cy1 + 0.0075 * k.b1 * k.b1 + k.x1 * k.x1;
            const double half = cx1 * cx2 + cy1 * cy2 + 0.0075 * k.b1 * k.b2 + k.x1 * k.x2;
            dy[0] = y[1];
            dy[1] = -half / inertia * y[1] * y[1];
          },
          [](double, const double* y) { return SliderCrank(y[0]).x; }};
}

// The rod bends in four modes (pinned ends), the crank turns at 20 rad/s: the rigid motion is known, the modes are driven by it (as in the
// slider-crank of the IVP Test Set, Simeon 1996, without its stretching).
constexpr double crank_speed = 20.0;
Mechanism elastic_slider_crank() {
  const std::string crank = "mass = 1\ninertia = [0.001, 0.001, 0.001]\nframes = { pin = [0.1, 0, 0] }";
  const std::string rod =
      "[[body]]\nname = \"rod\"\nkind = \"beam\"\nlength = 0.3\nsection = { shape = \"circle\", diameter = 0.01 }\nmaterial = { density = "
      "2770.0, youngs_modulus = 5e8 }\nmodel = \"modal\"\nboundary = \"supported-supported\"\nmodes = { bending_xy = [1, 2, 3, 4] "
      "}\neffects "
      "= [\"bending_xy\"]\nframes = { middle = 0.5 }\n";
  return {"elastic slider-crank",
          rigid("crank", crank) + rod + rigid("piston", "mass = 1\ninertia = [0.001, 0.001, 0.001]") +
              slider_crank_joints(fmt::format("motion = \"{}*t\"", crank_speed)) + output("rod.middle", "displacement"),
          "[0, 0, 0]",
          "out.y",
          1.0,
          1000.0,
          std::vector<double>(8, 0.0),
          [](double t, const double* y, double* dy) {
            const SliderCrank k(crank_speed * t);
            const double w = crank_speed, turn = k.b1 * w, turned = -k.b2 * w * w;
            // Acceleration of the crank pin across the rod; the rod's axes are (cos b, -sin b) and (sin b, cos b).
            const double across = -k.r * w * w * (std::cos(w * t) * k.sb + std::sin(w * t) * k.cb);
            const double slow = std::pow(pi / k.l, 2) * std::sqrt(5e8 * 1e-4 / 16.0 / 2770.0);
            for (int i = 1; i <= 4; ++i) {
              const double frequency = i * i * slow, sign = i % 2 ? 1.0 : -1.0;
              const double even = (1.0 + sign) / (i * pi), linear = sign * k.l / (i * pi);
              dy[i - 1] = y[i + 3];
              dy[i + 3] = -(frequency * frequency - turn * turn) * y[i - 1] - 2.0 * (across * even + turned * linear);
            }
          },
          [](double, const double* y) { return y[0] - y[2]; }};
}

// A symmetric top of 1 kg about its tip, nutating: nutation and precession as coordinates, the spin about its axis is constant.
Mechanism top() {
  constexpr double a = 0.35, spin = 100.0, transverse = 0.002 + 0.15 * 0.15, axial = 0.004, weight = gravity * 0.15;
  const std::string body = "mass = 1\ninertia = [0.002, 0.002, 0.004]\ncentre_of_mass = [0, 0, 0.15]\nframes = { tip = [0, 0, 0.3] }";
  return {"heavy top",
          rigid("top", body) +
              joint("point", "spherical", "ground", "top",
                    fmt::format("initial = {{ value = [{}, 0, 0], rate = [0, {:.17g}, {:.17g}] }}", a, -spin * std::sin(a),
                                spin * std::cos(a))) +
              output("top.tip", "position"),
          "[0, 0, -9.81]",
          "out.x",
          2.0,
          500.0,
          {a, 0.0, 0.0, 0.0},
          [](double, const double* y, double* dy) {
            const double s = std::sin(y[0]), c = std::cos(y[0]);
            dy[0] = y[2];
            dy[1] = y[3];
            dy[2] = (transverse * y[3] * y[3] * c - axial * spin * y[3] + weight) * s / transverse;
            dy[3] = y[2] * (axial * spin - 2.0 * transverse * y[3] * c) / (transverse * s);
          },
          [](double, const double* y) { return 0.3 * std::sin(y[0]) * std::sin(y[1]); }};
}

void expect(int flag, const char* what) {
  if (flag < 0) throw std::runtime_error(fmt::format("{} failed with {}", what, flag));
}

struct ByHand {
  const Mechanism& mechanism;
  long evaluations = 0;
};

int by_hand_rate(sunrealtype t, N_Vector y, N_Vector dy, void* data) {
  auto* side = static_cast<ByHand*>(data);
  ++side->evaluations;
  side->mechanism.rhs(t, N_VGetArrayPointer(y), N_VGetArrayPointer(dy));
  return 0;
}

Run run_by_hand(const Mechanism& m, double tolerance) {
  Run out;
  ByHand side{m};
  SUNContext context = nullptr;
  expect(SUNContext_Create(nullptr, &context), "SUNContext_Create");
  N_Vector y = N_VNew_Serial(static_cast<sunindextype>(m.start.size()), context);
  std::copy(m.start.begin(), m.start.end(), N_VGetArrayPointer(y));
  const double begin = flexframe::test::process_seconds();
  void* solver = CVodeCreate(CV_ADAMS, context);
  expect(CVodeInit(solver, by_hand_rate, 0.0, y), "CVodeInit");
  expect(CVodeSStolerances(solver, tolerance, tolerance), "CVodeSStolerances");
  expect(CVodeSetUserData(solver, &side), "CVodeSetUserData");
  expect(CVodeSetMaxNumSteps(solver, 10000000), "CVodeSetMaxNumSteps");
  SUNNonlinearSolver iteration = SUNNonlinSol_FixedPoint(y, 0, context);
  expect(CVodeSetNonlinearSolver(solver, iteration), "CVodeSetNonlinearSolver");
  out.values.push_back(m.output(0.0, N_VGetArrayPointer(y)));
  const int samples = static_cast<int>(std::lround(m.duration * m.rate));
  for (int k = 1; k <= samples; ++k) {
    double t = 0.0;
    expect(CVode(solver, k / m.rate, y, &t, CV_NORMAL), "CVode");
    out.values.push_back(m.output(t, N_VGetArrayPointer(y)));
  }
  out.seconds = flexframe::test::process_seconds() - begin;
  out.evaluations = side.evaluations;
  SUNNonlinSolFree(iteration);
  CVodeFree(&solver);
  N_VDestroy(y);
  SUNContext_Free(&context);
  return out;
}

Run run_scene(const Mechanism& m, const char* method, double tolerance) {
  const std::string head =
      fmt::format("[simulation]\nduration = {}\noutput_rate = {}\ngravity = {}\nmethod = \"{}\"\n", m.duration, m.rate, m.weight, method);
  const sim::Scene scene = sim::parse_scene(head + m.scene, "by_hand.toml");
  sim::SimulateOptions options;
  options.estimate_error = false;
  options.tolerance = tolerance;
  const sim::Results results = sim::simulate(scene, options);
  const auto found = std::find_if(results.outputs.begin(), results.outputs.end(), [&](const auto& o) { return o.column == m.column; });
  if (found == results.outputs.end()) throw std::runtime_error(fmt::format("{}: no column {}", m.name, m.column));
  Run out;
  out.values.assign(found->values.data(), found->values.data() + found->values.size());
  out.seconds = results.statistics.cpu_seconds;
  out.evaluations = static_cast<long>(results.statistics.evaluations);
  return out;
}

double error(const Run& run, const Run& reference) {
  const auto [low, high] = std::minmax_element(reference.values.begin(), reference.values.end());
  double worst = 0.0;
  for (std::size_t k = 0; k < reference.values.size(); ++k) worst = std::max(worst, std::abs(run.values.at(k) - reference.values[k]));
  return worst / (*high - *low);
}

// The least CPU time of five runs: what disturbs only adds.
Run quickest(const std::function<Run()>& run) {
  Run best = run();
  for (int k = 0; k < 4; ++k) best.seconds = std::min(best.seconds, run().seconds);
  return best;
}

}  // namespace

int main(int count, char** words) {
  std::FILE* file = count > 1 ? std::fopen(words[1], "w") : nullptr;
  if (count > 1 && !file) return std::perror(words[1]), 1;
  if (file) fmt::print(file, "mechanism,equations,tolerance,error,seconds,evaluations\n");
  for (const Mechanism& m : {pendulum(), double_pendulum(), slider_crank(), elastic_slider_crank(), top()}) {
    const Run hand = run_by_hand(m, tightest), ours = run_scene(m, "adams", tightest);
    fmt::print("{}: the two references differ by {:.1e} of the range\n", m.name, error(ours, hand));
    fmt::print("  {:<16} {:>9}  {:>9}  {:>9}  {:>11}  {:>14}\n", "equations", "tolerance", "error", "CPU ms", "evaluations",
               "us/evaluation");
    struct Side {
      const char* name;
      const Run& reference;
      std::function<Run(double)> run;
    };
    const Side sides[] = {{"by hand", hand, [&](double tolerance) { return run_by_hand(m, tolerance); }},
                          {"scene, adams", ours, [&](double tolerance) { return run_scene(m, "adams", tolerance); }},
                          {"scene, auto", ours, [&](double tolerance) { return run_scene(m, "auto", tolerance); }}};
    for (const Side& side : sides)
      for (double tolerance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}) {
        const Run run = quickest([&] { return side.run(tolerance); });
        const double off = error(run, side.reference);
        fmt::print("  {:<16} {:>9.0e}  {:>9.1e}  {:>9.3f}  {:>11}  {:>14.3f}\n", side.name, tolerance, off, 1e3 * run.seconds,
                   run.evaluations, 1e6 * run.seconds / static_cast<double>(std::max(1L, run.evaluations)));
        if (file) fmt::print(file, "{},\"{}\",{:.0e},{:.4g},{:.4g},{}\n", m.name, side.name, tolerance, off, run.seconds, run.evaluations);
      }
  }
  if (file) std::fclose(file);
}
