#include "render/film/known_shapes.h"

#include "sim/base/error.h"

#include <fmt/format.h>

#include <charconv>
#include <map>

namespace flexframe::film {
namespace {

// "node[17]" -> 17.
std::optional<int> node_number(const std::string& name) {
  if (!name.starts_with("node[") || !name.ends_with("]")) return std::nullopt;
  int id = 0;
  const char* last = name.data() + name.size() - 1;
  const auto [end, error] = std::from_chars(name.data() + 5, last, id);
  return error == std::errc{} && end == last ? std::optional(id) : std::nullopt;
}

// Whether the nodes that both know move alike.
bool same_shapes(const sim::ResultBody& body, const sim::BodySurface& surface) {
  if (surface.phi.cols() != body.q.cols() || body.node_phi.cols() != body.q.cols()) return false;
  std::map<int, Eigen::Index> place;
  for (size_t i = 0; i < surface.ids.size(); ++i) place.emplace(surface.ids[i], static_cast<Eigen::Index>(i));
  const double scale = surface.phi.cwiseAbs().maxCoeff();
  for (size_t k = 0; k < body.nodes.size(); ++k) {
    const std::optional<int> id = node_number(body.nodes[k].name);
    const auto at = id ? place.find(*id) : place.end();
    if (at == place.end()) continue;
    // The numbers are copies of each other; only text in between could round them.
    constexpr double rounding = 1e-9;
    const auto row = 3 * static_cast<Eigen::Index>(k);
    if ((body.node_phi.middleRows(row, 3) - surface.phi.middleRows(3 * at->second, 3)).cwiseAbs().maxCoeff() > rounding * scale)
      return false;
  }
  return true;
}

}  // namespace

std::optional<sim::BodySurface> known_surface(const sim::ResultBody& body, const sim::BodyDef* def, std::string& why) {
  const auto* modal = def ? std::get_if<sim::ModalDef>(&def->kind) : nullptr;
  const std::string ending = modal ? modal->file.extension().string() : "";
  if (ending != ".h5" && ending != ".hdf5") return std::nullopt;
  const std::string kernel = "the kernel map moves its mesh by the nodes of the results instead of its finite elements' shapes";
  try {
    sim::BodySurface surface = sim::read_body_surface(modal->file);
    if (surface.faces.rows() == 0) return std::nullopt;
    if (same_shapes(body, surface)) return surface;
    why = fmt::format("its body file {} is not the one that was simulated: {}", modal->file.string(), kernel);
  } catch (const sim::InputError& error) {
    why = fmt::format("{}: {}", error.what(), kernel);
  }
  return std::nullopt;
}

interp::FaceMesh face_mesh(const sim::BodySurface& surface) { return {surface.points, surface.faces}; }

std::optional<std::vector<interp::FaceFoot>> feet_on_surface(const interp::FaceMesh& faces, const interp::MeshView& mesh, std::string& why,
                                                             std::string& note) {
  const double size = (faces.points.colwise().maxCoeff() - faces.points.colwise().minCoeff()).norm();
  std::vector<interp::FaceFoot> feet = interp::find_feet(faces, mesh.vertices);
  const interp::FaceGap gap = interp::measure_gap(feet);
  // A mesh in other units or at another place is farther off; a mesh finer than the elements, or thick round shells, is nearer.
  constexpr double another = 0.1, told = 0.01;
  if (!(gap.largest <= another * size)) {
    why = fmt::format(
        "vertices of its mesh lie up to {:.3g} m off the surface of its finite elements, which is {:.3g} m large: the kernel map moves it "
        "by the nodes of the results",
        gap.largest, size);
    return std::nullopt;
  }
  if (gap.largest > told * size)
    note = fmt::format(
        "vertices of its mesh lie up to {:.3g} m off the surface of its finite elements ({:.2g} of its size) and follow it by rigid arms",
        gap.largest, gap.largest / size);
  return feet;
}

}  // namespace flexframe::film
