// Drawing alone: one's own triangles, coloured by a number at each vertex, to a PNG file.
//   drawing out.png
#include <flexframe/render.h>

#include <cmath>
#include <cstdio>
#include <vector>

int main(int argc, char** argv) try {
  using namespace flexframe;
  if (argc != 2) throw ArgumentError("usage: drawing OUT.png");
  const int n = 120;
  std::vector<glm::vec3> positions, normals;
  std::vector<float> scalars;
  std::vector<glm::uvec3> triangles;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const float x = 4.0f * i / n - 2.0f, y = 4.0f * j / n - 2.0f, r2 = x * x + y * y,
                  z = std::cos(3.0f * std::sqrt(r2)) * std::exp(-0.5f * r2);
      const float r = std::sqrt(r2) + 1e-6f, slope = (-3.0f * std::sin(3.0f * r) - r * std::cos(3.0f * r)) * std::exp(-0.5f * r2) / r;
      positions.push_back({x, z, -y});
      normals.push_back(glm::normalize(glm::vec3(-slope * x, 1.0f, slope * y)));
      scalars.push_back(z);
      if (i == n || j == n) continue;
      const unsigned a = static_cast<unsigned>(j * (n + 1) + i), b = a + static_cast<unsigned>(n) + 1;
      triangles.push_back({a, a + 1, b + 1});
      triangles.push_back({a, b + 1, b});
    }
  render::Picture picture;
  picture.size = {960, 540};
  picture.camera.position = {3.2, 2.6, 4.2};
  picture.camera.target = {0.0, 0.0, 0.0};
  render::Surface surface;
  surface.positions = positions;
  surface.normals = normals;
  surface.triangles = triangles;
  surface.scalars = scalars;
  picture.surfaces.push_back(surface);
  picture.scalar_map.lower = -0.4;
  picture.scalar_map.upper = 1.0;
  picture.overlay.title = "A wave that nobody simulated";
  picture.overlay.scalar_bar = render::ScalarBar{"height", "m", 1.0};
  picture.ground = render::Ground{{0.0, -0.6, 0.0}, {0.0, 1.0, 0.0}};

  render::Renderer renderer;
  render::write_png(argv[1], renderer.draw(picture));
  std::printf("%s: %d x %d, drawn by %s\n", argv[1], picture.size.width, picture.size.height, renderer.info().renderer.c_str());
  return 0;
} catch (const flexframe::Error& error) {
  std::fprintf(stderr, "drawing: %s\n", error.what());
  return 1;
}
