// libFuzzer entry: any bytes as a Wavefront file (render/picture/mesh.h). Build and run: tests/fuzz/fuzz.sh obj
#include "render/picture/mesh.h"
#include "tests/fuzz/scratch.h"

#include <cmath>

// assimp 5.2 does not close a material file whose content it refuses by an exception.
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp\n"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flexframe::render;
  try {
    const Mesh mesh = read_mesh(fuzz::scratch_file(data, size, ".obj"));
    // What was accepted keeps its promises.
    const int n = static_cast<int>(mesh.positions.size()), points = static_cast<int>(mesh.point_position.size());
    if (mesh.triangles.empty() || mesh.triangle_points.size() != mesh.triangles.size() ||
        mesh.triangle_material.size() != mesh.triangles.size())
      std::abort();
    for (const glm::dvec3& p : mesh.positions)
      if (!std::isfinite(p.x + p.y + p.z)) std::abort();
    for (std::size_t k = 0; k < mesh.triangles.size(); ++k)
      for (int c = 0; c < 3; ++c) {
        const int i = mesh.triangles[k][c], p = mesh.triangle_points[k][c];
        if (i < 0 || i >= n || p < 0 || p >= points || mesh.point_position[static_cast<std::size_t>(p)] != i) std::abort();
      }
    for (int group : mesh.point_group)
      if (group < 0 || group >= mesh.normal_groups) std::abort();
  } catch (const MeshError& e) {
    fuzz::require_answer(e.what(), "input.obj");
  }
  return 0;
}
