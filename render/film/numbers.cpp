#include "render/film/numbers.h"

#include "interp/hash.h"

namespace flexframe::film {

render::PictureNumbers picture_numbers(const render::Picture& picture) {
  render::PictureNumbers out;
  interp::Hash hash;
  render::Bounds box;
  bool scalars = false;
  for (const render::Surface& s : picture.surfaces) {
    out.vertices += static_cast<long>(s.positions.size());
    scalars = scalars || !s.scalars.empty();
    hash.add_bytes(s.positions.data(), s.positions.size_bytes());
    for (int c = 0; c < 4; ++c) hash.add(s.pose[c].x), hash.add(s.pose[c].y), hash.add(s.pose[c].z);
    if (s.positions.empty()) continue;
    glm::vec3 low = s.positions[0], high = s.positions[0];
    for (const glm::vec3& p : s.positions) low = glm::min(low, p), high = glm::max(high, p);
    for (int corner = 0; corner < 8; ++corner)
      box.add(glm::dvec3(s.pose * glm::dvec4(corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y, corner & 4 ? high.z : low.z, 1.0)));
  }
  out.hash = hash.hex();
  if (out.vertices > 0) out.lower = box.lower, out.upper = box.upper;
  if (scalars) out.colors = {picture.scalar_map.lower, picture.scalar_map.upper};
  return out;
}

}  // namespace flexframe::film
