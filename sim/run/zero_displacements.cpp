#include "sim/run/zero_displacements.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {

void tell_of_zero_displacements(const Scene& scene, Results& results) {
  for (const OutputDef& output : scene.outputs) {
    if (output.quantity != Quantity::displacement) continue;
    const auto body =
        std::find_if(results.bodies.begin(), results.bodies.end(), [&](const ResultBody& b) { return b.name == output.of.body; });
    if (body == results.bodies.end() || body->displacement.size() == 0 || body->displacement.isZero(0.0)) continue;
    const auto zero = [&](const ResultOutput& column) {
      return !column.column.starts_with(output.name + ".") || column.values.isZero(0.0);
    };
    if (!std::all_of(results.outputs.begin(), results.outputs.end(), zero)) continue;
    const std::string frame = output.of.frame.empty() ? "root" : output.of.frame;
    results.statistics.notes.tell("", fmt::format("{} is zero all along: it is the displacement of '{}', from which the deformation of "
                                                  "'{}' is measured; name another frame of the body",
                                                  output.name, frame, output.of.body));
  }
}

}  // namespace flexframe::sim
