#include "render/import/surfaces.h"

#include "render/picture/mesh.h"

namespace flexframe::imports {

void embed_mesh(double unit, sim::ResultBody& body) {
  if (body.mesh.empty()) return;
  render::Mesh mesh = render::read_mesh(body.mesh);
  render::drop_unused_positions(mesh);
  sim::ResultSurface& surface = body.surface;
  surface.points.resize(std::ssize(mesh.positions), 3);
  for (size_t i = 0; i < mesh.positions.size(); ++i)
    for (int a = 0; a < 3; ++a) surface.points(static_cast<Eigen::Index>(i), a) = unit * mesh.positions[i][a];
  const Eigen::Index count = std::ssize(mesh.triangles);
  surface.triangles.resize(count, 3);
  if (mesh.materials.size() > 1 || !mesh.materials.front().name.empty()) surface.colors.resize(count, 3);
  for (Eigen::Index k = 0; k < count; ++k) {
    const size_t at = k;
    for (int a = 0; a < 3; ++a) surface.triangles(k, a) = mesh.triangles[at][a];
    if (surface.colors.rows() == 0) continue;
    const render::MeshMaterial& material = mesh.materials[mesh.triangle_material[at]];
    for (int a = 0; a < 3; ++a) surface.colors(k, a) = static_cast<double>(material.look.color[a]);
  }
  body.mesh.clear();
}

void check_mesh(const std::string& file) { render::read_mesh(file); }

}  // namespace flexframe::imports
