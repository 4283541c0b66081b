// KernelMap: sparse simulation nodes move the vertices of a dense mesh.
#include "interp/map.h"
#include "interp/error_bar.h"

#include "render/python/bindings.h"

#include <fmt/format.h>

namespace flexframe::python {
namespace {

// Rows of three numbers in C order: looked at where they are; another type or order is converted first.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<int, py::array::c_style | py::array::forcecast>;

void require_three(const py::array& a, const char* what) {
  if (a.ndim() != 2 || a.shape(1) != 3) throw ArgumentError(fmt::format("{} must be an array of shape (N, 3)", what));
}

Eigen::Map<const interp::Points> rows_of(const Numbers& a) { return {a.data(), a.shape(0), 3}; }

struct KernelMap {
  interp::Map map;

  KernelMap(const Numbers& nodes, const Numbers& vertices, const std::optional<Indices>& triangles, const std::string& scheme,
            bool rotations, bool precise) {
    require_three(nodes, "nodes");
    require_three(vertices, "vertices");
    if (triangles) require_three(*triangles, "triangles");
    interp::Options options;
    options.scheme = interp::scheme_from_name(scheme);
    options.precise = precise;
    const interp::MeshView mesh{rows_of(vertices), Eigen::Map<const interp::Triangles>(triangles ? triangles->data() : nullptr,
                                                                                       triangles ? triangles->shape(0) : 0, 3)};
    const py::gil_scoped_release free;
    map = interp::make_map({interp::Points(rows_of(nodes)), rotations, {}}, mesh, options);
  }

  py::array apply(const Numbers& displacement, const std::optional<Numbers>& rotation, std::optional<py::array> out) const {
    require_three(displacement, "displacement");
    if (rotation) require_three(*rotation, "rotation");
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
    if (rotation) require_three(*rotation, "rotation");
    const Eigen::Map<const interp::Points> r(rotation ? rotation->data() : nullptr, rotation ? rotation->shape(0) : 0, 3);
    const interp::Points u = interp::apply_precise(map, rows_of(displacement), r);
    py::array_t<double> out({static_cast<py::ssize_t>(u.rows()), py::ssize_t{3}});
    std::copy(u.data(), u.data() + u.size(), out.mutable_data());
    return out;
  }

  py::array_t<float> map_error(const Numbers& displacement, const Numbers& vertices, const std::optional<Numbers>& rotation) const {
    require_three(displacement, "displacement");
    require_three(vertices, "vertices");
    if (rotation) require_three(*rotation, "rotation");
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

KernelMap(nodes, vertices, triangles=None, scheme="auto", rotations=False, precise=False)
  nodes      (N, 3) float64, m, in the frame of the mesh
  vertices   (M, 3) float64, m; C-contiguous float64 is looked at in place, not copied
  triangles  (K, 3) int32, indices of vertices; None: a cloud of points
  scheme     auto, kernel, elastic, lattice, r3, r, tps (interp/README.md); elastic and lattice need triangles
  rotations  whether apply() gets rotation vectors too
  precise    keeps the weights in double as well, for apply_precise(); twice the memory

Raises InputError (no nodes, numbers that are not finite, indices out of range) and MapError (no map can serve).)")
      .def(py::init<const Numbers&, const Numbers&, const std::optional<Indices>&, const std::string&, bool, bool>(), py::arg("nodes"),
           py::arg("vertices"), py::arg("triangles") = py::none(), py::arg("scheme") = "auto", py::arg("rotations") = false,
           py::arg("precise") = false)
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
