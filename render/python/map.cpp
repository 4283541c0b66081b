// KernelMap: sparse simulation nodes move the vertices of a dense mesh.
#include "interp/map.h"
#include "interp/error_bar.h"
#include "interp/known.h"
#include "interp/watch.h"

#include "render/python/bindings.h"

#include <fmt/format.h>

#include <limits>

namespace flexframe::python {
namespace {

// Rows of three numbers in C order: looked at where they are; another type or order is converted first.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<int, py::array::c_style | py::array::forcecast>;

// Triangles as they are given: whole numbers of any size. A conversion alone would cut 1.5 to 1 and wrap what is too large.
std::optional<Indices> indices(const py::object& list) {
  if (list.is_none()) return std::nullopt;
  const py::array given = py::array::ensure(list);
  if (!given) {
    PyErr_Clear();
    throw ArgumentError("triangles must be an array of whole numbers of shape (N, 3)");
  }
  if (given.dtype().kind() != 'i' && given.dtype().kind() != 'u')
    throw ArgumentError(fmt::format("triangles must be whole numbers, found an array of {}", py::str(given.dtype()).cast<std::string>()));
  if (py::isinstance<py::array_t<int>>(given)) return Indices(given);
  const py::array_t<std::int64_t, py::array::c_style | py::array::forcecast> wide(given);
  for (py::ssize_t k = 0; k < wide.size(); ++k)
    if (wide.data()[k] < 0 || wide.data()[k] > std::numeric_limits<int>::max())
      throw InputError(fmt::format("a triangle refers to vertex {}", wide.data()[k]));
  return Indices(given);
}

void require_three(const py::array& a, const char* what) {
  if (a.ndim() == 2 && a.shape(1) == 3) return;
  throw ArgumentError(fmt::format("{} must be an array of shape (N, 3), found {}", what, py::str(a.attr("shape")).cast<std::string>()));
}

Eigen::Map<const interp::Points> rows_of(const Numbers& a) { return {a.data(), a.shape(0), 3}; }

// Arrays of one row a node, as columns of 3 N numbers.
Eigen::MatrixXd columns_of(const std::vector<Numbers>& list, const char* what, const Numbers& nodes) {
  Eigen::MatrixXd columns(list.empty() ? 0 : 3 * nodes.shape(0), list.size());
  for (size_t k = 0; k < list.size(); ++k) {
    require_three(list[k], what);
    if (list[k].shape(0) != nodes.shape(0)) throw ArgumentError(fmt::format("{} must have a row for each node, {}", what, nodes.shape(0)));
    columns.col(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::VectorXd>(list[k].data(), list[k].size());
  }
  return columns;
}

struct KernelMap {
  interp::Map map;
  bool with_rotations = false;

  // Parameters: those of Python's call.
  KernelMap(const Numbers& nodes, const Numbers& vertices, const py::object& faces, const std::string& scheme, bool rotations, bool precise,
            const std::vector<Numbers>& motions, const std::vector<Numbers>& turns)
      : with_rotations(rotations) {
    const std::optional<Indices> triangles = indices(faces);
    require_three(nodes, "nodes");
    require_three(vertices, "vertices");
    if (triangles) require_three(*triangles, "triangles");
    interp::Options options;
    options.scheme = interp::scheme_from_name(scheme);
    options.precise = precise;
    const interp::MeshView mesh{rows_of(vertices), Eigen::Map<const interp::Triangles>(triangles ? triangles->data() : nullptr,
                                                                                       triangles ? triangles->shape(0) : 0, 3)};
    const interp::NodeMotions known{columns_of(motions, "motions", nodes), columns_of(turns, "turns", nodes), true};
    Watcher watcher{py::none()};
    const interp::Watch watch([&] { watcher.look(); });
    const py::gil_scoped_release free;
    map = interp::make_map_for({interp::Points(rows_of(nodes)), rotations, {}, false, {}}, mesh, options, known);
  }

  // Rotations that the map would leave aside would be a motion other than the one that was given.
  void check_rotation(const std::optional<Numbers>& rotation) const {
    if (!rotation) return;
    require_three(*rotation, "rotation");
    if (!with_rotations) throw ArgumentError("rotation is given, but the map was made without: KernelMap(..., rotations=True)");
  }

  py::array apply(const Numbers& displacement, const std::optional<Numbers>& rotation, std::optional<py::array> out) const {
    require_three(displacement, "displacement");
    check_rotation(rotation);
    if (!out) out = py::array_t<float>({static_cast<py::ssize_t>(map.vertices), py::ssize_t{3}});
    if (!py::isinstance<py::array_t<float, py::array::c_style>>(*out) || !out->writeable() || out->ndim() != 2 ||
        out->shape(0) != map.vertices || out->shape(1) != 3)
      throw ArgumentError(fmt::format("out must be a writeable float32 array of shape ({}, 3) in C order", map.vertices));
    const std::span<float> to(static_cast<float*>(out->mutable_data()), static_cast<std::size_t>(out->size()));
    const Eigen::Map<const interp::Points> u = rows_of(displacement);
    const Eigen::Map<const interp::Points> r(rotation ? rotation->data() : nullptr, rotation ? rotation->shape(0) : 0, 3);
    {
      const py::gil_scoped_release free;
      interp::apply(map, u, r, to);
    }
    return *out;
  }

  py::array_t<double> apply_precise(const Numbers& displacement, const std::optional<Numbers>& rotation) const {
    require_three(displacement, "displacement");
    check_rotation(rotation);
    const Eigen::Map<const interp::Points> r(rotation ? rotation->data() : nullptr, rotation ? rotation->shape(0) : 0, 3);
    const interp::Points u = interp::apply_precise(map, rows_of(displacement), r);
    py::array_t<double> out({static_cast<py::ssize_t>(u.rows()), py::ssize_t{3}});
    std::copy(u.data(), u.data() + u.size(), out.mutable_data());
    return out;
  }

  py::array_t<float> map_error(const Numbers& displacement, const Numbers& vertices, const std::optional<Numbers>& rotation) const {
    require_three(displacement, "displacement");
    require_three(vertices, "vertices");
    check_rotation(rotation);
    if (vertices.shape(0) != map.vertices) throw ArgumentError(fmt::format("vertices must be those of the map, {}", map.vertices));
    const Eigen::Map<const interp::Points> r(rotation ? rotation->data() : nullptr, rotation ? rotation->shape(0) : 0, 3);
    const interp::ErrorBar bar(map, {rows_of(vertices), Eigen::Map<const interp::Triangles>(nullptr, 0, 3)});
    if (!bar.known()) return py::array_t<float>(0);
    py::array_t<float> out(map.vertices);
    bar.evaluate(map, rows_of(displacement), r, std::span<float>(out.mutable_data(), static_cast<std::size_t>(map.vertices)));
    return out;
  }
};

}  // namespace

void bind_map(py::module_& m) {
  py::class_<KernelMap>(m, "KernelMap",
                        R"(The kernel map: displacements (and rotations) of N simulation nodes to those of M vertices of a mesh.

KernelMap(nodes, vertices, triangles=None, scheme="auto", rotations=False, precise=False, motions=[], turns=[])
  nodes      (N, 3) float64, m, in the frame of the mesh
  vertices   (M, 3) float64, m; C-contiguous float64 is looked at in place, not copied
  triangles  (K, 3) int32, or other whole numbers: indices of vertices; None: a cloud of points
  scheme     auto, kernel, elastic, lattice, r3, r, tps (interp/README.md); elastic and lattice need triangles
  rotations  whether apply() gets rotation vectors too
  precise    keeps the weights in double as well, for apply_precise(); twice the memory
  motions    a list of (N, 3): what the nodes will do, such as mode shapes of any scale; scheme "auto" then takes the one that predicts
             each node best from the others. turns: their rotations, with rotations=True

Raises InputError (no nodes, numbers that are not finite, indices out of range) and MapError (no map can serve).)")
      .def(py::init<const Numbers&, const Numbers&, const py::object&, const std::string&, bool, bool, const std::vector<Numbers>&,
                    const std::vector<Numbers>&>(),
           py::arg("nodes"), py::arg("vertices"), py::arg("triangles") = py::none(), py::arg("scheme") = "auto",
           py::arg("rotations") = false, py::arg("precise") = false, py::arg("motions") = std::vector<Numbers>{},
           py::arg("turns") = std::vector<Numbers>{})
      .def("apply", &KernelMap::apply, py::arg("displacement"), py::arg("rotation") = py::none(), py::arg("out") = py::none(),
           R"(Displacement of the vertices, (M, 3) float32, m.

displacement (N, 3), m; rotation (N, 3) rotation vectors, rad, may be large. out: written in place and returned. Raises InputError.)")
      .def("apply_precise", &KernelMap::apply_precise, py::arg("displacement"), py::arg("rotation") = py::none(),
           "The same in double, (M, 3) float64; needs precise=True.")
      .def("map_error", &KernelMap::map_error, py::arg("displacement"), py::arg("vertices"), py::arg("rotation") = py::none(),
           R"(Error bar of each vertex, (M,) float32, m: what leaving nodes out makes, carried to the vertices around.

vertices: as given to the map. Empty where the layout has no estimate. Raises InputError.)")
      .def_property_readonly(
          "nodes", [](const KernelMap& k) { return k.map.nodes; }, "N")
      .def_property_readonly(
          "vertices", [](const KernelMap& k) { return k.map.vertices; }, "M")
      .def_property_readonly(
          "scheme", [](const KernelMap& k) { return std::string(interp::scheme_name(k.map.report.scheme)); }, "The scheme that is used.")
      .def_property_readonly(
          "reason", [](const KernelMap& k) { return k.map.report.reason; }, "Why this scheme.")
      .def_property_readonly(
          "lebesgue", [](const KernelMap& k) { return k.map.report.lebesgue; },
          "Lebesgue constant: the largest sum over the nodes of |weight|; 1 is best.")
      .def_property_readonly(
          "warnings", [](const KernelMap& k) { return k.map.report.warnings; }, "What the map may get wrong, one sentence each.");
}

}  // namespace flexframe::python
