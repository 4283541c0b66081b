// Results: histories, motion of the bodies, and writing those of other programs.
#include "render/python/bindings.h"
#include "sim/base/words.h"
#include "sim/results/csv.h"
#include "sim/results/results_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

namespace flexframe::python {
namespace {

using Shared = std::shared_ptr<sim::Results>;

// Files of results without the GIL, one at a time: not every HDF5 is made for threads.
template <class Work>
auto with_files(const Work& work) {
  static std::mutex turn;
  const py::gil_scoped_release free;
  const std::lock_guard lock(turn);
  return work();
}

// A body or joint within results, which it keeps alive.
struct BodyMotion {
  Shared results;
  std::size_t at;
  const sim::ResultBody& operator*() const { return results->bodies[at]; }
};
struct JointMotion {
  Shared results;
  std::size_t at;
  const sim::ResultJoint& operator*() const { return results->joints[at]; }
};

py::object column(const py::object& self, const std::string& name) {
  const Shared r = self.cast<Shared>();
  std::vector<std::string> known;
  std::vector<const sim::ResultOutput*> parts;
  for (const sim::ResultOutput& o : r->outputs) {
    if (o.column == name) return view_matrix(o.values, self);
    if (o.column.starts_with(name + ".")) parts.push_back(&o);
    known.push_back(o.column);
  }
  if (parts.empty()) {
    const std::string hint = sim::did_you_mean(name, known);
    throw py::key_error(
        fmt::format("{} is no output{}{} there are {}", sim::quote(name), hint, hint.empty() ? ";" : "", sim::list_words(known)));
  }
  py::array_t<double> out({static_cast<py::ssize_t>(r->times.size()), static_cast<py::ssize_t>(parts.size())});
  auto to = out.mutable_unchecked<2>();
  for (py::ssize_t k = 0; k < to.shape(1); ++k)
    for (py::ssize_t i = 0; i < to.shape(0); ++i) to(i, k) = parts[k]->values[i];
  return out;
}

template <class Item>
py::dict by_name(const Shared& r, std::size_t count, auto&& list) {
  py::dict out;
  for (std::size_t k = 0; k < count; ++k) out[py::str(list[k].name)] = Item{r, k};
  return out;
}

py::dict shares(const sim::PictureShares& p) {
  py::dict out;
  out["asked"] = p.asked;
  out["unit"] = p.unit;
  out["allowed"] = p.allowed;
  out["total"] = p.total;
  out["time"] = p.time;
  out["space"] = p.space;
  out["effects"] = p.effects;
  out["map"] = p.map;
  out["samples"] = p.samples;
  out["raster"] = p.raster;
  out["body"] = p.body;
  return out;
}

py::dict statistics(const sim::Results& r) {
  const sim::SolverStatistics& s = r.statistics;
  py::dict out;
  out["method"] = s.method;
  out["tolerance"] = s.tolerance;
  out["steps"] = s.steps;
  out["evaluations"] = s.evaluations;
  out["events"] = s.events;
  out["jacobians"] = s.jacobians;
  out["restarts"] = s.restarts;
  out["cpu_seconds"] = s.cpu_seconds;
  if (s.error_estimate >= 0.0) {
    out["error_estimate"] = s.error_estimate;
    out["error_column"] = s.error_column;
  }
  if (s.accuracy) {
    out["asked"] = s.accuracy->asked;
    out["chosen"] = s.accuracy->chosen;
    out["error_time"] = s.accuracy->time;
    out["error_space"] = s.accuracy->space;
    out["error_effects"] = s.accuracy->effects;
    out["half_cost"] = s.accuracy->half_cost;
    out["search_cpu_seconds"] = s.accuracy->search_cpu;
    if (s.accuracy->picture) out["picture"] = shares(*s.accuracy->picture);
  }
  return out;
}

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

// Shapes that hold `rows` x `columns` numbers in the order that is meant: rows of three numbers may be a dimension of their own, and one
// column none. Others of as many numbers would be read in another order.
bool has_shape(const Array& a, Eigen::Index rows, Eigen::Index columns) {
  if (a.ndim() < 1 || a.shape(0) != rows || a.size() != rows * columns) return false;
  return a.ndim() == 2 || (a.ndim() == 1 && columns == 1) || (a.ndim() == 3 && a.shape(2) == 3);
}

// A key's array of nt rows and `columns` columns.
template <class Matrix>
void take(const py::dict& from, const char* key, const std::string& body, Eigen::Index rows, Eigen::Index columns, Matrix& to) {
  if (!from.contains(key)) return;
  const Array a = from[key].cast<Array>();
  if (!has_shape(a, rows, columns))
    throw ArgumentError(fmt::format("body '{}': '{}' must have {} x {} numbers, found the shape {}", body, key, rows, columns,
                                    py::str(a.attr("shape")).cast<std::string>()));
  to = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(a.data(), rows, columns);
}

// Numbers from 0 to below `count`.
void check_numbers(const sim::MatX& values, Eigen::Index count, const char* key, const std::string& body) {
  for (const double x : values.reshaped())
    if (!(x >= 0.0 && x < static_cast<double>(count)) || x != std::floor(x))
      throw ArgumentError(fmt::format("body '{}': '{}' must hold whole numbers from 0 to {}, found {:g}", body, key, count - 1, x));
}

// A surface that comes with the results: "points" (m, 3) and "triangles" (k, 3), colours and nodes of the points where they are given.
void take_surface(const py::dict& given, sim::ResultBody& b) {
  const bool some = given.contains("points") || given.contains("triangles");
  if (!some) return;
  if (!given.contains("points") || !given.contains("triangles"))
    throw ArgumentError(fmt::format("body '{}': a surface needs 'points' and 'triangles'", b.name));
  if (!b.mesh.empty()) throw ArgumentError(fmt::format("body '{}': 'mesh' and 'points' are two surfaces", b.name));
  const auto rows = [&](const char* key) { return given[key].cast<Array>().shape(0); };
  take(given, "points", b.name, rows("points"), 3, b.surface.points);
  sim::MatX triangles, nodes;
  take(given, "triangles", b.name, rows("triangles"), 3, triangles);
  check_numbers(triangles, b.surface.points.rows(), "triangles", b.name);
  b.surface.triangles = triangles.cast<int>();
  take(given, "colors", b.name, triangles.rows(), 3, b.surface.colors);
  take(given, "point_nodes", b.name, b.surface.points.rows(), 1, nodes);
  check_numbers(nodes, static_cast<Eigen::Index>(b.nodes.size()), "point_nodes", b.name);
  for (const double node : nodes.reshaped()) b.surface.nodes.push_back(static_cast<int>(node));
}

void write_foreign(const std::filesystem::path& path, const Array& t, const py::dict& bodies, const py::dict& outputs,
                   const std::string& title, const std::string& scene_text) {
  sim::Results r;
  r.title = title;
  r.scene_text = scene_text;
  if (t.ndim() != 1)
    throw ArgumentError(fmt::format("t must be a row of times, found the shape {}", py::str(t.attr("shape")).cast<std::string>()));
  r.times = Eigen::Map<const sim::VecX>(t.data(), t.size());
  const Eigen::Index nt = r.times.size();
  for (const auto& [name, value] : bodies) {
    if (!py::isinstance<py::dict>(value))
      throw ArgumentError(fmt::format("body '{}' must be a dict of arrays, found {}", py::str(name).cast<std::string>(),
                                      py::repr(value).cast<std::string>()));
    const auto given = value.cast<py::dict>();
    sim::ResultBody b;
    b.name = name.cast<std::string>();
    for (const auto& [key, ignored] : given) {
      const std::string word = key.cast<std::string>();
      const std::vector<std::string> known{"position", "orientation", "nodes",  "node_names", "displacement", "rotation",
                                           "mesh",     "points",      "colors", "triangles",  "point_nodes",  "von_mises"};
      if (std::find(known.begin(), known.end(), word) == known.end())
        throw ArgumentError(fmt::format("body '{}': key '{}' is unknown{}; allowed: {}", b.name, word, sim::did_you_mean(word, known),
                                        sim::list_words(known)));
    }
    b.position = Eigen::MatrixX3d::Zero(nt, 3);
    b.orientation = Eigen::MatrixX4d::Zero(nt, 4);
    b.orientation.col(0).setOnes();
    take(given, "position", b.name, nt, 3, b.position);
    take(given, "orientation", b.name, nt, 4, b.orientation);
    if (given.contains("nodes")) {
      const Array nodes = given["nodes"].cast<Array>();
      if (nodes.ndim() != 2 || nodes.shape(1) != 3) throw ArgumentError(fmt::format("body '{}': 'nodes' must be N x 3", b.name));
      for (py::ssize_t k = 0; k < nodes.shape(0); ++k)
        b.nodes.push_back({fmt::format("{}", k), sim::Vec3(nodes.at(k, 0), nodes.at(k, 1), nodes.at(k, 2))});
      const Eigen::Index columns = 3 * static_cast<Eigen::Index>(b.nodes.size());
      b.displacement = sim::MatX::Zero(nt, columns);
      take(given, "displacement", b.name, nt, columns, b.displacement);
      take(given, "rotation", b.name, nt, columns, b.rotation);
      take(given, "von_mises", b.name, nt, columns / 3, b.node_von_mises);
      if (given.contains("node_names")) {
        const auto names = given["node_names"].cast<std::vector<std::string>>();
        if (names.size() != b.nodes.size())
          throw ArgumentError(fmt::format("body '{}': 'node_names' must be {} words, found {}", b.name, b.nodes.size(), names.size()));
        for (std::size_t k = 0; k < names.size(); ++k) b.nodes[k].name = names[k];
      }
    } else {
      for (const char* key : {"displacement", "rotation", "von_mises", "node_names", "point_nodes"})
        if (given.contains(key)) throw ArgumentError(fmt::format("body '{}': '{}' belongs to 'nodes', which are missing", b.name, key));
    }
    b.kind = b.nodes.empty() ? "rigid" : "modal";
    if (given.contains("mesh")) b.mesh = std::filesystem::absolute(given["mesh"].cast<std::filesystem::path>()).string();
    take_surface(given, b);
    r.bodies.push_back(std::move(b));
  }
  for (const auto& [name, value] : outputs) {
    const Array a = value.cast<Array>();
    if (a.size() != nt)
      throw ArgumentError(fmt::format("output '{}' must have {} numbers, found {}", name.cast<std::string>(), nt, a.size()));
    r.outputs.push_back({name.cast<std::string>(), "", Eigen::Map<const sim::VecX>(a.data(), nt)});
  }
  for (sim::VecX* energy : {&r.kinetic, &r.strain, &r.potential, &r.supplied, &r.dissipated}) *energy = sim::VecX::Zero(nt);
  with_files([&] { sim::write_results(r, path); });
}

// A property of a body or joint: an array that looks at the results' memory, or a copy.
template <class Motion, class Item, class Value>
auto view(Value Item::*member) {
  return [member](const py::object& self) { return view_matrix((*self.cast<const Motion&>()).*member, self); };
}
template <class Motion, class Item, class Value>
auto copy(Value Item::*member) {
  return [member](const Motion& motion) { return (*motion).*member; };
}

// What a body's motion is drawn and stressed by.
void bind_shapes(py::class_<BodyMotion>& motion) {
  motion.def_property_readonly("mesh", copy<BodyMotion>(&sim::ResultBody::mesh), "Absolute path of the mesh file; empty: none.")
      .def_property_readonly("length", copy<BodyMotion>(&sim::ResultBody::length), "Of a beam, m; others 0.")
      .def_property_readonly("labels", copy<BodyMotion>(&sim::ResultBody::labels), "Of the elastic coordinates; empty: they have none.")
      .def_property_readonly("node_phi", view<BodyMotion>(&sim::ResultBody::node_phi),
                             "(3 nn, n) displacement of the nodes per elastic coordinate of a modal body, m; empty: not linear in them.")
      .def_property_readonly("node_psi", view<BodyMotion>(&sim::ResultBody::node_psi),
                             "(3 nn, n) rotation of the nodes per elastic coordinate, rad; empty: unknown.")
      .def_property_readonly("stress_nodes", copy<BodyMotion>(&sim::ResultBody::stress_nodes),
                             "Numbers (from 0) of the nodes that know their stress.")
      .def_property_readonly("node_stress", view<BodyMotion>(&sim::ResultBody::node_stress),
                             "(6 ns, n) stress at stress_nodes per elastic coordinate, Pa: xx yy zz xy yz xz of each node; empty: unknown.")
      .def_property_readonly("von_mises", view<BodyMotion>(&sim::ResultBody::node_von_mises),
                             "(nt, nn) von Mises stress of the nodes that another program computed, Pa; empty: unknown.")
      .def_property_readonly(
          "points", [](const py::object& s) { return view_matrix((*s.cast<const BodyMotion&>()).surface.points, s); },
          "(m, 3) corners of the surface that came with the results, body frame, m; empty: none.")
      .def_property_readonly(
          "triangles",
          [](const BodyMotion& b) {
            const Eigen::MatrixX3i& from = (*b).surface.triangles;
            py::array_t<int> out({static_cast<py::ssize_t>(from.rows()), py::ssize_t{3}});
            for (Eigen::Index k = 0; k < from.rows(); ++k)
              for (Eigen::Index d = 0; d < 3; ++d) out.mutable_at(k, d) = from(k, d);
            return out;
          },
          "(k, 3) points (from 0) of its triangles, counterclockwise seen from outside.");
}

void bind_motions(py::module_& m) {
  py::class_<BodyMotion> motion(
      m, "ResultBody", "Motion of a body: arrays of nt rows, one a time of Results.t; SI units. They look at the results' memory.");
  motion.def_property_readonly("name", copy<BodyMotion>(&sim::ResultBody::name), "As in the scene.")
      .def_property_readonly("kind", copy<BodyMotion>(&sim::ResultBody::kind), "rigid, beam, modal or statespace.")
      .def_property_readonly("position", view<BodyMotion>(&sim::ResultBody::position), "(nt, 3) origin of the body frame in world axes, m.")
      .def_property_readonly("orientation", view<BodyMotion>(&sim::ResultBody::orientation),
                             "(nt, 4) unit quaternion w x y z, body to world.")
      .def_property_readonly("q", view<BodyMotion>(&sim::ResultBody::q), "(nt, n) elastic coordinates.")
      .def_property_readonly("qd", view<BodyMotion>(&sim::ResultBody::qd), "(nt, n) their rates, 1/s.")
      .def_property_readonly("displacement", view<BodyMotion>(&sim::ResultBody::displacement),
                             "(nt, 3 nn) displacement of the nodes in the body frame, m: ux uy uz of node 0, of node 1, ...")
      .def_property_readonly("rotation", view<BodyMotion>(&sim::ResultBody::rotation),
                             "(nt, 3 nn) rotation vectors of the nodes, rad; empty: unknown.")
      .def_property_readonly(
          "nodes",
          [](const BodyMotion& b) {
            py::array_t<double> out({static_cast<py::ssize_t>((*b).nodes.size()), py::ssize_t{3}});
            for (std::size_t k = 0; k < (*b).nodes.size(); ++k)
              for (int d = 0; d < 3; ++d) out.mutable_at(static_cast<py::ssize_t>(k), d) = (*b).nodes[k].origin[d];
            return out;
          },
          "(nn, 3) undeformed places of the nodes in the body frame, m.")
      .def_property_readonly(
          "node_names",
          [](const BodyMotion& b) {
            std::vector<std::string> out;
            for (const sim::ResultNode& node : (*b).nodes) out.push_back(node.name);
            return out;
          },
          "Names of frames, or numbers, of the nodes.");
  bind_shapes(motion);
  py::class_<JointMotion>(m, "ResultJoint", "Motion of a joint: arrays of nt rows; SI units.")
      .def_property_readonly("name", copy<JointMotion>(&sim::ResultJoint::name), "As in the scene.")
      .def_property_readonly("kind", copy<JointMotion>(&sim::ResultJoint::kind), "revolute, prismatic, ...")
      .def_property_readonly("position", view<JointMotion>(&sim::ResultJoint::position),
                             "(nt, 3) of its frame on the parent, in world axes, m.")
      .def_property_readonly("orientation", view<JointMotion>(&sim::ResultJoint::orientation),
                             "(nt, 4) of that frame, unit quaternion w x y z.")
      .def_property_readonly("value", view<JointMotion>(&sim::ResultJoint::value), "(nt, n) coordinates, m and rad.")
      .def_property_readonly("rate", view<JointMotion>(&sim::ResultJoint::rate), "(nt, n) rates, m/s and rad/s.");
}

}  // namespace

void bind_results(py::module_& m) {
  bind_motions(m);
  py::class_<sim::Results, Shared>(m, "Results",
                                   R"(What a simulation leaves behind. Arrays are read-only views of its memory; row i belongs to t[i].

r["slider.x"] is a column of the histories, (nt,); r["slider"] all columns of an output, (nt, k).)")
      .def_property_readonly(
          "t", [](const py::object& s) { return view_matrix(s.cast<Shared>()->times, s); }, "(nt,) times, s.")
      .def_property_readonly(
          "title", [](const sim::Results& r) { return r.title; }, "That of the scene.")
      .def_property_readonly(
          "scene_file", [](const sim::Results& r) { return r.scene_file; }, "Path of the scene file; empty: unknown.")
      .def_property_readonly(
          "scene_text", [](const sim::Results& r) { return r.scene_text; }, "TOML text of the scene.")
      .def_property_readonly(
          "columns",
          [](const sim::Results& r) {
            std::vector<std::string> out;
            for (const sim::ResultOutput& o : r.outputs) out.push_back(o.column);
            return out;
          },
          "Names of the histories' columns.")
      .def_property_readonly(
          "units",
          [](const sim::Results& r) {
            py::dict out;
            for (const sim::ResultOutput& o : r.outputs) out[py::str(o.column)] = o.unit;
            return out;
          },
          "Units of the columns, by name.")
      .def_property_readonly(
          "descriptions",
          [](const sim::Results& r) {
            py::dict out;
            for (const sim::ResultOutput& o : r.outputs) out[py::str(o.column)] = o.description;
            return out;
          },
          "What the columns are, by name; empty: not told.")
      .def("__getitem__", &column, py::arg("name"))
      .def("__contains__",
           [](const sim::Results& r, const std::string& name) {
             return std::any_of(r.outputs.begin(), r.outputs.end(),
                                [&](const sim::ResultOutput& o) { return o.column == name || o.column.starts_with(name + "."); });
           })
      .def("__contains__", [](const sim::Results&, const py::object&) { return false; })
      .def("__iter__",
           [](const sim::Results& r) {
             py::list out;
             for (const sim::ResultOutput& o : r.outputs) out.append(o.column);
             return py::iter(out);
           })
      .def_property_readonly(
          "bodies", [](const Shared& r) { return by_name<BodyMotion>(r, r->bodies.size(), r->bodies); }, "Bodies by name.")
      .def_property_readonly(
          "joints", [](const Shared& r) { return by_name<JointMotion>(r, r->joints.size(), r->joints); }, "Joints by name.")
      .def_property_readonly(
          "energy",
          [](const py::object& s) {
            const Shared r = s.cast<Shared>();
            return py::dict(py::arg("kinetic") = view_matrix(r->kinetic, s), py::arg("strain") = view_matrix(r->strain, s),
                            py::arg("potential") = view_matrix(r->potential, s), py::arg("supplied") = view_matrix(r->supplied, s),
                            py::arg("dissipated") = view_matrix(r->dissipated, s));
          },
          "Energies and work of the system by name, (nt,) each, J.")
      .def_property_readonly(
          "statistics", &statistics,
          R"(Method, tolerance, counts of the solver, estimated error, CPU time; of an asked accuracy its parts and what was chosen.

Of a distance in pictures (accuracy="0.5 px") also "picture": the largest distance "total" of those "allowed" and its shares "time",
"space", "effects", "map", "samples", "raster", all in "unit" (px or m), and the "body" where it is largest.)")
      .def_property_readonly(
          "warnings", [](const sim::Results& r) { return r.statistics.notes.texts(sim::Severity::warning); },
          "What may be wrong by more than was asked, one sentence each.")
      .def_property_readonly(
          "notes", [](const sim::Results& r) { return r.statistics.notes.texts(sim::Severity::note); }, "What was chosen and why.")
      .def(
          "save", [](const sim::Results& r, const std::filesystem::path& path) { with_files([&] { sim::write_results(r, path); }); },
          py::arg("path"), "Writes the results as HDF5 (layout: sim/RESULTS.md), whole or not at all. Raises FileError.")
      .def("csv", &sim::histories_csv, "The histories as CSV text.");

  m.def(
      "read_results",
      [](const std::filesystem::path& path) { return with_files([&] { return std::make_shared<sim::Results>(sim::read_results(path)); }); },
      py::arg("path"), "Results from a file (HDF5). Raises InputError that names what is wrong with it.");
  m.def("_write_results", &write_foreign, py::arg("path"), py::arg("t"), py::arg("bodies"), py::arg("outputs"), py::arg("title"),
        py::arg("scene_text"));
}

}  // namespace flexframe::python
