// Kernel against elastic by number of nodes, on bodies whose truth is a finite element solution: what the limits of `auto` come from
// (interp/README.md).
//   interp_schemes            error of three modes in per cent, kernel / elastic, and CPU seconds of elastic at 97 nodes
#include "interp/map.h"
#include "tests/bench/cpu.h"
#include "tests/unit/interp_bodies.h"

#include <fmt/format.h>

namespace {

using namespace flexframe;
using interp::Points;

template <class Modes>
void row(const char* name, const test::Body& body, const Modes& modes, const std::vector<int>& given) {
  std::string line = fmt::format("| {} |", name);
  double setup = 0.0;
  std::string chosen;
  for (const int n : {20, 40, 60, 97, 200}) {
    const std::vector<int> pick = given.empty() ? test::farthest_points(body.v, n) : given;
    double error[2];
    for (const bool elastic : {false, true}) {
      interp::Options options;
      options.scheme = elastic ? interp::Scheme::elastic : interp::Scheme::kernel;
      options.precise = true;
      options.threads = 1;
      const double start = test::process_seconds();
      const interp::Map map = interp::make_map(test::nodes_at(body.v, pick, n), body.view(), options);
      if (elastic && n == 97) setup = test::process_seconds() - start;
      test::FieldError e;
      for (const Points& mode : modes) e.add(interp::apply_linear(map, test::rows_at(mode, pick, n), Points(0, 3)), mode, pick, n);
      error[elastic] = 100.0 * e.relative();
    }
    line += fmt::format(" {:.2g} / {:.2g} |", error[0], error[1]);
    chosen += fmt::format(" {}", interp::scheme_name(interp::make_map(test::nodes_at(body.v, pick, n), body.view()).report.scheme));
  }
  fmt::print("{} {:.1f} s | auto:{}\n", line, setup, chosen);
}

}  // namespace

int main() {
  fmt::print("| body | 20 nodes | 40 | 60 | 97 | 200 | elastic set-up |\n|---|---|---|---|---|---|---|\n");
  const test::FeBody channel = test::read_fe_body("channel"), fork = test::read_fe_body("fork");
  row("open frame of sheet", channel.body, channel.mode, {});
  row("fork with a slit", fork.body, fork.mode, {});
  const test::ConRod rod = test::read_conrod();
  row("con rod", rod.body, rod.mode, rod.order);
  // Half a tube bent with rigid sections: no twist.
  const test::Body tube = test::half_tube();
  const test::Cantilever bend(1);
  Points mode(tube.v.rows(), 3);
  for (Eigen::Index i = 0; i < mode.rows(); ++i)
    mode.row(i) << -tube.v(i, 1) * bend.slope(tube.v(i, 0) / 2.0) / 2.0, bend.value(tube.v(i, 0) / 2.0), 0.0;
  row("half tube, bent", tube, std::vector<Points>{mode}, {});
  return 0;
}
