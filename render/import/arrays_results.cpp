// The documented layout of .npz files to results.
#include "render/import/arrays.h"

#include "render/import/rotations.h"
#include "render/import/table.h"
#include "sim/base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace flexframe::imports {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
constexpr size_t any = ~size_t{0};

const std::vector<std::string> body_words = {
    "position", "orientation", "rotation_matrix", "rotation_vector", "node_origin",    "displacement", "rotation", "q",
    "node_phi", "node_psi",    "triangles",       "surface",         "node_von_mises", "color",        "mesh"};

class Reader {
 public:
  Reader(const std::map<std::string, Array>& arrays, std::string file) : arrays_(arrays), file_(std::move(file)) {}

  [[noreturn]] void fail(const std::string& name, const std::string& message) const {
    throw InputError(fmt::format("{}: array '{}' {}", file_, name, message));
  }
  const Array* find(const std::string& name) const {
    const auto at = arrays_.find(name);
    return at == arrays_.end() ? nullptr : &at->second;
  }
  bool has(const std::string& name) const { return find(name) != nullptr; }

  // Rows x the product of the other dimensions. Where it is missing and may be: empty.
  sim::MatX numbers(const std::string& name, const std::vector<size_t>& shape, bool optional) const {
    const Array* array = find(name);
    if (!array && optional) return {};
    if (!array) fail(name, "is missing");
    bool fits = array->shape.size() == shape.size();
    for (size_t k = 0; fits && k < shape.size(); ++k) fits = shape[k] == any || shape[k] == array->shape[k];
    if (!fits) {
      std::vector<std::string> wanted;
      wanted.reserve(shape.size());
      for (const size_t d : shape) wanted.push_back(d == any ? "any" : fmt::format("{}", d));
      fail(name, fmt::format("has the shape ({}), ({}) is needed", fmt::join(array->shape, ", "), fmt::join(wanted, ", ")));
    }
    const auto rows = static_cast<Eigen::Index>(array->shape[0]);
    const Eigen::Index cols = rows > 0 ? std::ssize(array->values) / rows : 0;
    sim::MatX out = Eigen::Map<const RowMajor>(array->values.data(), rows, cols);
    if (!out.allFinite()) fail(name, "holds a value that is not finite");
    return out;
  }

 private:
  const std::map<std::string, Array>& arrays_;
  std::string file_;
};

Eigen::MatrixX4d orientation_of(const Reader& reader, const std::string& name, size_t nt) {
  const auto rows = static_cast<Eigen::Index>(nt);
  Eigen::MatrixX4d out(rows, 4);
  out.setZero();
  out.col(0).setOnes();
  TurnWriting writing;
  sim::MatX numbers;
  for (const auto& [word, form, count] :
       {std::tuple{"orientation", TurnForm::quaternion, size_t{4}}, std::tuple{"rotation_vector", TurnForm::vector, size_t{3}}})
    if (reader.has(name + "." + word)) {
      numbers = reader.numbers(name + "." + word, {nt, count}, false);
      writing.form = form;
    }
  if (reader.has(name + ".rotation_matrix")) {
    numbers = reader.numbers(name + ".rotation_matrix", {nt, 3, 3}, false);
    writing.form = TurnForm::matrix;
  }
  if (writing.form == TurnForm::none) return out;
  for (Eigen::Index i = 0; i < rows; ++i) {
    std::array<double, 9> row{};
    for (Eigen::Index k = 0; k < numbers.cols(); ++k) row[k] = numbers(i, k);
    const sim::Quat q = to_quaternion(writing, row, fmt::format("body '{}': the orientation of sample {} ", name, i));
    out.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  keep_hemisphere(out);
  return out;
}

// (nn, 3, n) as 3 nn x n.
sim::MatX node_columns(const sim::MatX& rows) {
  const Eigen::Index nn = rows.rows(), n = rows.cols() / 3;
  sim::MatX out(3 * nn, n);
  for (Eigen::Index i = 0; i < nn; ++i)
    for (Eigen::Index a = 0; a < 3; ++a) out.row(3 * i + a) = rows.row(i).segment(a * n, n);
  return out;
}

void add_nodes(const Reader& reader, const std::string& name, size_t nt, double unit, sim::ResultBody& body) {
  const sim::MatX origins = unit * reader.numbers(name + ".node_origin", {any, 3}, false);
  const size_t nn = origins.rows();
  for (Eigen::Index k = 0; k < origins.rows(); ++k) body.nodes.push_back({fmt::format("{}", k), origins.row(k).transpose()});
  body.kind = "modal";
  body.q = reader.numbers(name + ".q", {nt, any}, true);
  const size_t n = body.q.cols();
  body.node_phi = unit * node_columns(reader.numbers(name + ".node_phi", {nn, 3, n}, true));
  body.node_psi = node_columns(reader.numbers(name + ".node_psi", {nn, 3, n}, true));
  body.displacement = unit * reader.numbers(name + ".displacement", {nt, nn, 3}, body.node_phi.size() > 0);
  if (body.displacement.size() == 0) body.displacement = body.q * body.node_phi.transpose();
  body.rotation = reader.numbers(name + ".rotation", {nt, nn, 3}, true);
  if (body.rotation.size() == 0 && body.node_psi.size() > 0) body.rotation = body.q * body.node_psi.transpose();
  body.node_von_mises = reader.numbers(name + ".node_von_mises", {nt, nn}, true);
}

// Triangles of the nodes, or of points of their own.
void add_surface(const Reader& reader, const std::string& name, double unit, sim::ResultBody& body) {
  const sim::MatX triangles = reader.numbers(name + ".triangles", {any, 3}, false);
  sim::ResultSurface& surface = body.surface;
  const bool own = reader.has(name + ".surface");
  if (own) surface.points = unit * reader.numbers(name + ".surface", {any, 3}, false);
  else {
    surface.points.resize(std::ssize(body.nodes), 3);
    for (size_t k = 0; k < body.nodes.size(); ++k) {
      surface.points.row(static_cast<Eigen::Index>(k)) = body.nodes[k].origin.transpose();
      surface.nodes.push_back(static_cast<int>(k));
    }
  }
  for (const double at : triangles.reshaped())
    if (!(at >= 0.0 && at < static_cast<double>(surface.points.rows()) && at == std::floor(at)))
      reader.fail(name + ".triangles", fmt::format("must hold indices of the {} {}, found {}", surface.points.rows(),
                                                   own ? "points of 'surface'" : "nodes", at));
  surface.triangles = triangles.cast<int>();
}

}  // namespace

sim::Results results_of_arrays(const std::map<std::string, Array>& arrays, const std::string& file, double unit) {
  const Reader reader(arrays, file);
  sim::Results results;
  results.title = std::filesystem::path(file).stem().string();
  results.times = reader.numbers("times", {any}, false).reshaped();
  const size_t nt = results.times.size();
  if (nt == 0) reader.fail("times", "is empty");
  for (Eigen::Index i = 1; i < results.times.size(); ++i)
    if (!(results.times[i] > results.times[i - 1]))
      reader.fail("times", fmt::format("must increase, but value {} is {} after {}", i, results.times[i], results.times[i - 1]));
  std::set<std::string> bodies;
  for (const auto& [name, array] : arrays) {
    const auto dot = name.rfind('.');
    const std::string word = dot == std::string::npos ? "" : name.substr(dot + 1);
    if (std::find(body_words.begin(), body_words.end(), word) != body_words.end()) {
      bodies.insert(name.substr(0, dot));
    } else if (name != "times") {
      if (array.shape != std::vector<size_t>{nt})
        reader.fail(name, fmt::format("is none of {} of a body, and no output of shape ({}){}", sim::list_words(body_words), nt,
                                      sim::did_you_mean(word, body_words)));
      const auto [column, its_unit] = split_column_name(name);
      results.outputs.push_back({column, its_unit, reader.numbers(name, {nt}, false).reshaped()});
    }
  }
  if (bodies.empty()) throw InputError(fmt::format("{}: holds no body: an array 'NAME.position' of shape ({}, 3) is needed", file, nt));
  for (const std::string& name : bodies) {
    sim::ResultBody body;
    body.name = name;
    body.kind = "rigid";
    body.position = unit * reader.numbers(name + ".position", {nt, 3}, false);
    body.orientation = orientation_of(reader, name, nt);
    if (reader.has(name + ".node_origin")) add_nodes(reader, name, nt, unit, body);
    if (reader.has(name + ".triangles")) add_surface(reader, name, unit, body);
    const sim::MatX color = reader.numbers(name + ".color", {3}, true);
    for (const double part : color.reshaped()) body.color.push_back(std::clamp(part, 0.0, 1.0));
    if (const Array* mesh = reader.find(name + ".mesh"))
      body.mesh = std::filesystem::absolute(std::filesystem::path(file).parent_path() / mesh->text).lexically_normal().string();
    results.bodies.push_back(std::move(body));
  }
  return results;
}

}  // namespace flexframe::imports
