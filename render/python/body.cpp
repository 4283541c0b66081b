// Body: flexible bodies from SID files and finite element models.
#include "render/python/bindings.h"

#include "sim/bodies/sid.h"
#include "sim/reduce/reduce.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexframe::python {
namespace {

struct Body {
  sim::FlexibleBody body;
  std::string name, comment;
  std::vector<std::string> notes, warnings;
  sim::VecX frequencies;  // Hz
  std::string surface;    // Wavefront text, or empty
};
using Shared = std::shared_ptr<Body>;

Shared from_sid(const std::filesystem::path& path) {
  auto out = std::make_shared<Body>();
  const sim::SidReading reading = sim::read_sid(path);
  out->notes = reading.notes;
  out->name = path.stem().string();
  out->comment = reading.file.comment;
  out->body = sim::to_flexible_body(reading.file, out->name, &out->notes);
  // Of the free elastic coordinates: Ke x = omega^2 Me x.
  const Eigen::GeneralizedSelfAdjointEigenSolver<sim::MatX> modes(out->body.Ke, out->body.Me, Eigen::EigenvaluesOnly);
  out->frequencies = modes.eigenvalues().cwiseMax(0.0).cwiseSqrt() / (2.0 * M_PI);
  return out;
}

int node_of(const sim::FeModel& model, int id) {
  const auto at = std::find(model.node_ids.begin(), model.node_ids.end(), id);
  if (at == model.node_ids.end()) throw InputError(fmt::format("{}: node {} is not there", model.file, id));
  return static_cast<int>(at - model.node_ids.begin());
}

// A node's number, or the name of a spider (RBE2, RBE3, *COUPLING).
sim::ReduceInterface interface_of(const sim::FeModel& model, const std::string& name, const std::variant<int, std::string>& what) {
  sim::ReduceInterface out;
  out.name = name;
  if (const int* id = std::get_if<int>(&what)) {
    out.node = node_of(model, *id);
    for (std::size_t i = 0; i < model.spiders.size(); ++i)
      if (model.spiders[i].node == out.node) return {-1, static_cast<int>(i), name};
    return out;
  }
  std::string wanted = std::get<std::string>(what);
  std::transform(wanted.begin(), wanted.end(), wanted.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  for (std::size_t i = 0; i < model.spiders.size(); ++i)
    if (model.spiders[i].name == wanted) out.spider = static_cast<int>(i);
  if (out.spider < 0) throw InputError(fmt::format("{}: there is no spider '{}'", model.file, wanted));
  return out;
}

sim::FeModel read_model(const std::filesystem::path& path, const std::string& units) {
  const auto known = sim::units_named(units);
  if (!known)
    throw ArgumentError(fmt::format("units '{}' are unknown; allowed: m, mm, mm-kg-s, mm-kg-ms, mm-g-ms, cm-g-s, in-lbf-s", units));
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending == ".inp") return sim::read_inp(path, *known);
  if (ending == ".msh") return sim::read_msh(path, *known);
  if (ending == ".bdf" || ending == ".nas" || ending == ".dat") return sim::read_nastran(path, *known);
  throw InputError(fmt::format("{}: '{}' is no known kind of model; .inp, .bdf, .nas, .dat and .msh can be read", path.string(), ending));
}

sim::ReduceMethod reduce_method(const std::string& word) {
  const std::vector<std::string> words{"auto", "eigen", "guyan", "craig-bampton", "response"};
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end()) throw ArgumentError(fmt::format("method '{}' is unknown; allowed: {}", word, fmt::join(words, ", ")));
  return static_cast<sim::ReduceMethod>(found - words.begin());
}

Shared reduce(const std::filesystem::path& path, const std::string& method, int modes, double highest,
              const std::map<std::string, std::variant<int, std::string>>& interfaces, bool hold, const py::dict& more) {
  sim::ReduceOptions options;
  options.method = reduce_method(method);
  options.modes = modes;
  options.highest = highest;
  std::string units = "m";
  for (const auto& [key, value] : more) {
    const std::string word = key.cast<std::string>();
    if (word == "units") units = value.cast<std::string>();
    else if (word == "stress") options.stress = value.cast<bool>();
    else if (word == "stiffening") options.stiffening = value.cast<bool>();
    else if (word == "damping") options.damping = value.cast<double>();
    else if (word == "node_count") options.node_count = value.cast<int>();
    else throw ArgumentError(fmt::format("reduce: '{}' is unknown; allowed: units, stress, stiffening, damping, node_count", word));
  }
  auto out = std::make_shared<Body>();
  Watcher watcher{py::none()};
  const py::gil_scoped_release free;
  const sim::FeModel model = read_model(path, units);
  out->warnings = sim::unit_warnings(model, *sim::units_named(units));
  for (const auto& [name, what] : interfaces) options.interfaces.push_back(interface_of(model, name, what));
  if (hold) options.held = model.constraints;
  sim::Reduction reduced = sim::reduce(model, options, [&](const std::string&) { watcher.look(); });
  out->body = std::move(reduced.body);
  out->name = path.stem().string();
  out->comment = fmt::format("made by flexframe reduce from {}", path.filename().string());
  out->frequencies = reduced.report.frequencies;
  out->notes = reduced.report.notes;
  out->warnings.insert(out->warnings.end(), reduced.report.warnings.begin(), reduced.report.warnings.end());
  out->surface = sim::surface_obj(model);
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
      .def_static("from_sid", &from_sid, py::arg("path"), "From a SID file. Raises InputError with file and line.")
      .def_property_readonly("name", [](const Body& b) { return b.name; })
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
      .def_property_readonly("node_names",
                             [](const Body& b) {
                               std::vector<std::string> out;
                               for (const sim::FlexibleNode& node : b.body.nodes) out.push_back(node.name);
                               return out;
                             })
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
      .def_property_readonly("notes", [](const Body& b) { return b.notes; })
      .def_property_readonly("warnings", [](const Body& b) { return b.warnings; })
      .def_property_readonly(
          "surface", [](const Body& b) { return b.surface; }, "Outer surface of the model it was reduced from, Wavefront text; or empty.")
      .def(
          "write_sid",
          [](const Body& b, const std::filesystem::path& path) { sim::write_sid(sim::from_flexible_body(b.body, b.comment), path); },
          py::arg("path"), "Writes the body as SID file; reading it gives the same bits. Raises InputError.");
  m.def("_reduce", &reduce, py::arg("path"), py::arg("method"), py::arg("modes"), py::arg("highest"), py::arg("interfaces"),
        py::arg("hold"), py::arg("more"));
}

}  // namespace flexframe::python
