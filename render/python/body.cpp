// Body: flexible bodies from SID files and finite element models.
#include "render/python/bindings.h"

#include "sim/base/eigen_solvers.h"
#include "sim/bodies/body_file.h"
#include "sim/bodies/sid.h"
#include "sim/reduce/reduce_request.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>

namespace flexframe::python {
namespace {

struct Body {
  sim::FlexibleBody body;
  std::string name, comment;
  std::vector<std::string> notes, warnings;
  sim::VecX frequencies;  // Hz
  std::string surface;    // Wavefront text, or empty
  sim::FurtherShapes further;
  std::optional<double> static_error;
};
using Shared = std::shared_ptr<Body>;

Shared from_sid(const std::filesystem::path& path) {
  auto out = std::make_shared<Body>();
  sim::BodyFile file = sim::read_body(path, path.stem().string());
  out->notes = std::move(file.notes);
  out->name = path.stem().string();
  out->comment = std::move(file.comment);
  out->body = std::move(file.body);
  out->further = std::move(file.further);
  // Of the free elastic coordinates: Ke x = omega^2 Me x.
  const sim::GeneralizedEigen modes(out->body.Ke, out->body.Me, Eigen::EigenvaluesOnly);
  out->frequencies = modes.eigenvalues().cwiseMax(0.0).cwiseSqrt() / (2.0 * M_PI);
  return out;
}

// The words of ff.reduce() by name, in their place in the request.
void take_words(const py::dict& words, sim::ReduceRequest& request) {
  sim::ReduceOptions& o = request.options;
  const std::map<std::string, std::function<void(const py::handle&)>> takers{
      {"method", [&](const py::handle& v) { request.method = v.cast<std::string>(); }},
      {"modes", [&](const py::handle& v) { o.modes = v.cast<int>(); }},
      {"highest", [&](const py::handle& v) { o.highest = v.cast<double>(); }},
      {"lowest", [&](const py::handle& v) { o.lowest = v.cast<double>(); }},
      {"cut_off", [&](const py::handle& v) { o.cut_off = v.cast<double>(); }},
      {"static_error", [&](const py::handle& v) { o.static_error = v.cast<double>(); }},
      {"interfaces", [&](const py::handle& v) { request.interfaces = v.cast<std::vector<std::string>>(); }},
      {"hold", [&](const py::handle& v) { request.hold = v.cast<std::string>(); }},
      {"units", [&](const py::handle& v) { request.units = v.cast<std::string>(); }},
      {"materials", [&](const py::handle& v) { request.materials = v.cast<std::vector<std::string>>(); }},
      {"densities", [&](const py::handle& v) { request.densities = v.cast<std::vector<std::string>>(); }},
      {"elastics", [&](const py::handle& v) { request.elastics = v.cast<std::vector<std::string>>(); }},
      {"contact", [&](const py::handle& v) { request.contact = v.cast<std::string>(); }},
      {"thickness", [&](const py::handle& v) { request.thickness = v.cast<double>(); }},
      {"nodes", [&](const py::handle& v) { request.nodes = v.cast<std::vector<int>>(); }},
      {"node_sets", [&](const py::handle& v) { request.node_sets = v.cast<std::vector<std::string>>(); }},
      {"node_count", [&](const py::handle& v) { o.node_count = v.cast<int>(); }},
      {"stiffening", [&](const py::handle& v) { o.stiffening = v.cast<bool>(); }},
      {"stiffening_forced", [&](const py::handle& v) { o.stiffening_forced = v.cast<bool>(); }},
      {"stress", [&](const py::handle& v) { o.stress = v.cast<bool>(); }},
      {"damping", [&](const py::handle& v) { o.damping = v.cast<double>(); }},
      {"mass", [&](const py::handle& v) { request.mass = v.cast<std::filesystem::path>(); }},
      {"node_table", [&](const py::handle& v) { request.node_table = v.cast<std::filesystem::path>(); }},
      {"dofs", [&](const py::handle& v) { request.dofs = v.cast<std::filesystem::path>(); }},
      {"threads", [&](const py::handle& v) { o.threads = v.cast<int>(); }},
      {"scratch", [&](const py::handle& v) { o.scratch = v.cast<std::filesystem::path>(); }},
      {"memory", [&](const py::handle& v) { o.memory_limit = 1e9 * v.cast<double>(); }}};
  for (const auto& [key, value] : words) {
    const std::string word = key.cast<std::string>();
    try {
      takers.at(word)(value);
    } catch (const py::cast_error&) {
      throw py::type_error(fmt::format("reduce: '{}' cannot be {}", word, py::repr(value).cast<std::string>()));
    }
  }
}

Shared reduce(const std::filesystem::path& path, const py::dict& words, const py::object& progress) {
  sim::ReduceRequest request;
  request.model = path;
  take_words(words, request);
  auto out = std::make_shared<Body>();
  Watcher teller(progress), watcher(py::none{});
  const py::gil_scoped_release free;
  auto [model, reduced] = sim::reduce(
      request, [&](const std::string& text) { teller.look(text); }, [&] { watcher.look(); });
  out->body = std::move(reduced.body);
  out->further = std::move(reduced.further);
  out->name = path.stem().string();
  out->comment = sim::reduced_comment(path.filename().string(), reduced.report.lacks);
  out->frequencies = reduced.report.frequencies;
  out->notes = reduced.report.notes;
  out->warnings = reduced.report.warnings;
  out->surface = sim::surface_obj(model);
  if (reduced.report.compliance_error >= 0.0) out->static_error = reduced.report.compliance_error;
  return out;
}

}  // namespace

void bind_body(py::module_& m) {
  const auto matrix = [](sim::MatX sim::FlexibleBody::*member) {
    return [member](const py::object& self) { return view_matrix(self.cast<const Body&>().body.*member, self); };
  };
  py::class_<Body, Shared>(
      m, "Body", R"(A flexible body: constants of its kinetic and strain energy (Wallrapp 1994; Heckmann et al. 2006 eq. 6). SI units.

Arrays are read-only views; n elastic coordinates.)")
      .def_static("from_sid", &from_sid, py::arg("path"),
                  "From a SID file, or a body file of `flexframe reduce -o BODY.h5`. Raises InputError with file and line.")
      .def_property_readonly(
          "name", [](const Body& b) { return b.name; }, "Of its file, without the ending.")
      .def_property_readonly(
          "n", [](const Body& b) { return b.body.n; }, "Number of elastic coordinates.")
      .def_property_readonly(
          "mass", [](const Body& b) { return b.body.mass; }, "kg")
      .def_property_readonly(
          "centre_of_mass",
          [](const Body& b) {
            const sim::Vec3 c = b.body.mass > 0.0 ? sim::Vec3(b.body.md0 / b.body.mass) : sim::Vec3(sim::Vec3::Zero());
            return std::vector<double>{c.x(), c.y(), c.z()};
          },
          "Undeformed, in the body frame, m.")
      .def_property_readonly(
          "inertia", [](const py::object& s) { return view_matrix(s.cast<const Body&>().body.J0, s); },
          "(6,) inertia tensor about the body frame's origin, xx yy zz xy xz yz, kg m^2.")
      .def_property_readonly(
          "frequencies", [](const py::object& s) { return view_matrix(s.cast<const Body&>().frequencies, s); },
          "Of the elastic coordinates with the body frame held, Hz.")
      .def_property_readonly("Me", matrix(&sim::FlexibleBody::Me), "(n, n) structural mass.")
      .def_property_readonly("Ke", matrix(&sim::FlexibleBody::Ke), "(n, n) structural stiffness.")
      .def_property_readonly("De", matrix(&sim::FlexibleBody::De), "(n, n) structural damping; empty: none.")
      .def_property_readonly(
          "labels", [](const Body& b) { return b.body.labels; }, "What each elastic coordinate is.")
      .def_property_readonly(
          "node_names",
          [](const Body& b) {
            std::vector<std::string> out;
            for (const sim::FlexibleNode& node : b.body.nodes) out.push_back(node.name);
            return out;
          },
          "Names of the nodes, nn.")
      .def_property_readonly(
          "nodes",
          [](const Body& b) {
            py::array_t<double> out({static_cast<py::ssize_t>(b.body.nodes.size()), py::ssize_t{3}});
            for (std::size_t k = 0; k < b.body.nodes.size(); ++k)
              for (int d = 0; d < 3; ++d) out.mutable_at(static_cast<py::ssize_t>(k), d) = b.body.nodes[k].origin[d];
            return out;
          },
          "(nn, 3) undeformed places of the nodes, m.")
      .def(
          "phi",
          [](const py::object& s, std::size_t node) {
            const Body& b = s.cast<const Body&>();
            if (node >= b.body.nodes.size()) throw py::index_error("no such node");
            return view_matrix(b.body.nodes[node].phi, s);
          },
          py::arg("node"), "(3, n) displacement of a node per elastic coordinate.")
      .def_property_readonly(
          "static_error", [](const Body& b) { return b.static_error; },
          "Largest error of the static deflection at the interfaces under unit loads there, relative to the full model's; None: not known.")
      .def_property_readonly(
          "notes", [](const Body& b) { return b.notes; }, "What was chosen and why, one sentence each.")
      .def_property_readonly(
          "warnings", [](const Body& b) { return b.warnings; }, "What may be other than wanted, one sentence each.")
      .def_property_readonly(
          "surface", [](const Body& b) { return b.surface; }, "Outer surface of the model it was reduced from, Wavefront text; or empty.")
      .def(
          "write_sid",
          [](const Body& b, const std::filesystem::path& path) {
            sim::SidFile sid = sim::from_flexible_body(b.body, b.comment);
            sid.further = b.further;
            sim::write_sid(sid, path);
          },
          py::arg("path"), "Writes the body as SID file; reading it gives the same bits. Raises InputError.");
  m.def("_reduce", &reduce, py::arg("path"), py::arg("words"), py::arg("progress"));
}

}  // namespace flexframe::python
