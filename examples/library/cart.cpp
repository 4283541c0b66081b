// Control in a loop: a state feedback with a sampling time of 10 ms balances the pendulum of cart.toml.
//   cart cart.toml        prints t, x, angle, push at every tenth of a second
#include <flexframe/sim.h>

#include <cmath>
#include <cstdio>

int main(int argc, char** argv) try {
  using namespace flexframe;
  if (argc != 2) throw ArgumentError("usage: cart SCENE.toml");
  sim::Simulation cart(sim::read_scene(argv[1]));
  const sim::Simulation::State start = cart.state();
  for (int k = 0; k < 500; ++k) {
    // Gains by pole placement; angle > 0 leans to -x.
    const double push = 9.7 * cart.output("x") + 10.8 * cart.output("v") - 61.0 * cart.output("angle") - 13.9 * cart.output("turn");
    cart.set_input("push", push);
    cart.advance_to(0.01 * (k + 1));
    if (k % 10 == 9) std::printf("%.2f %.12g %.12g %.12g\n", cart.time(), cart.output("x"), cart.output("angle"), push);
  }
  const double end = cart.output("angle");
  // Back to the start: the same inputs give the same bits.
  cart.restore(start);
  cart.set_input("push", 0.0);
  cart.step(0.01);
  std::printf("upright within %.1e rad; without control it falls: %.6f rad after 10 ms\n", std::abs(end), cart.output("angle"));
  return 0;
} catch (const flexframe::Error& error) {
  std::fprintf(stderr, "cart: %s\n", error.what());
  return 1;
}
