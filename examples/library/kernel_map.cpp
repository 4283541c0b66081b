// The kernel map alone: eight nodes of some other program bend a mesh of one's own, here a plate of 101 x 21 vertices.
// Prints the largest displacement and the error against the rigid rotation that the nodes were given first.
#include <flexframe/interp.h>

#include <cmath>
#include <cstdio>

int main() try {
  using namespace flexframe;
  const int nx = 101, ny = 21;
  interp::Points vertices(nx * ny, 3);
  interp::Triangles triangles(2 * (nx - 1) * (ny - 1), 3);
  for (int j = 0, k = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      vertices.row(j * nx + i) << 0.01 * i, 0.01 * j, 0.0;
      if (i + 1 == nx || j + 1 == ny) continue;
      const int a = j * nx + i;
      triangles.row(k++) << a, a + 1, a + nx + 1;
      triangles.row(k++) << a, a + nx + 1, a + nx;
    }
  interp::Nodes nodes;
  nodes.positions.resize(8, 3);
  for (int n = 0; n < 8; ++n) nodes.positions.row(n) << (n / 2) / 3.0, (n % 2) * 0.2, 0.0;

  interp::Options options;
  options.precise = true;
  const interp::MeshView mesh{Eigen::Map<const interp::Points>(vertices.data(), vertices.rows(), 3),
                              Eigen::Map<const interp::Triangles>(triangles.data(), triangles.rows(), 3)};
  const interp::Map map = interp::make_map(nodes, mesh, options);
  std::printf("%d nodes move %d vertices by scheme %s\n", map.nodes, map.vertices,
              std::string(interp::scheme_name(map.report.scheme)).c_str());

  // A common rotation, however large, comes out exactly.
  const Eigen::AngleAxisd turn(1.3, Eigen::Vector3d(1, 2, 3).normalized());
  const auto turned = [&](const interp::Points& p) { return interp::Points(p * turn.toRotationMatrix().transpose() - p); };
  const interp::Points rigid = interp::apply_precise(map, turned(nodes.positions), interp::Points(0, 3));
  std::printf("rotation off by %.1e m\n", (rigid - turned(vertices)).cwiseAbs().maxCoeff());

  // Bending: the nodes follow z = 0.1 x^2.
  interp::Points bent = interp::Points::Zero(8, 3);
  bent.col(2) = 0.1 * nodes.positions.col(0).array().square();
  const interp::Points u = interp::apply_precise(map, bent, interp::Points(0, 3));
  std::printf("bent by %.6f m at the end\n", u.col(2).maxCoeff());
  return 0;
} catch (const flexframe::Error& error) {
  std::fprintf(stderr, "kernel_map: %s\n", error.what());
  return 1;
}
