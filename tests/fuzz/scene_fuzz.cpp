// libFuzzer entry: any bytes as a scene file. Build:
//   clang++ -fsanitize=fuzzer,address,undefined -std=c++20 -I. -I/usr/include/eigen3 $(pkg-config --cflags tomlplusplus)
//   tests/fuzz/scene_fuzz.cpp
//     sim/{scene_reader,read_bodies,read_joints,toml_input,words,section,expression,expression_switches}.cpp -lfmt -ltomlplusplus
// Run with the examples as a start: ./a.out corpus examples
#include "sim/scene/expression.h"
#include "sim/scene/scene_reader.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexframe::sim;
  try {
    const Scene scene = parse_scene({reinterpret_cast<const char*>(data), size}, "fuzz.toml");
    // what was accepted keeps its promises
    if (!(scene.simulation.duration > 0.0) || scene.bodies.empty()) std::abort();
    for (const BodyDef& body : scene.bodies)
      if (const auto* beam = std::get_if<BeamDef>(&body.kind))
        if (!(beam->section.area > 0.0) || !std::isfinite(beam->section.j) || beam->elements < 1) std::abort();
    for (const JointDef& joint : scene.joints)
      if (std::abs(joint.axis.norm() - 1.0) > 1e-12) std::abort();
    for (const ForceDef& force : scene.forces) {
      Expression expression(force.value);
      try {
        const double live = expression.value(0.3);
        expression.freeze(0.3);
        if (!std::isfinite(live) || !std::isfinite(expression.jet(0.3).rate)) std::abort();
      } catch (const SimulationError&) {
        // not finite there
      }
    }
  } catch (const InputError& error) {
    // a refusal is an answer, of one line
    if (std::string_view(error.what()).find('\n') != std::string_view::npos) std::abort();
  }
  return 0;
}
