#include "render/film/vtk.h"

#include "render/base/file.h"
#include "render/base/html.h"
#include "render/film/survey.h"
#include "sim/base/error.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace flexframe::film {
namespace {

static_assert(std::endian::native == std::endian::little, "the files say LittleEndian");

// Everything of one picture.
struct Surface {
  std::vector<double> points;         // 3 n
  std::vector<float> displacement;    // 3 n
  std::vector<float> velocity;        // 3 n
  std::vector<float> stress;          // n, von Mises; 0 where a body has none
  std::vector<float> scalars;         // n, what the pictures colour by besides these; 0 where a body has none
  std::vector<std::int64_t> corners;  // 3 m
  std::vector<std::int32_t> body;     // m
};

bool has_scalars(ColorBy by) { return by == ColorBy::strain || by == ColorBy::mode; }

// Whether the body model knows stresses.
bool has_stress(const BodyModel& model, const sim::ResultBody& body) {
  return model.stress || model.beam_stress || (!model.vertex_nodes.empty() && body.node_von_mises.size() > 0);
}

// What colours by `by` are made of, a number (or, of vectors, three) a vertex.
void append_values(const Animation& animation, size_t b, double t, ColorBy by, const BodyMemory& memory, std::vector<float>& out) {
  const BodyModel& model = animation.bodies[b];
  RenderSettings settings = animation.settings;
  settings.color_by = by;
  ScalarMemory work;
  work.wanted = by == ColorBy::velocity;
  std::vector<float> scalars;
  update_scalars({model, *animation.results, b, settings}, t, memory, work, scalars);
  std::vector<float>& values = by == ColorBy::velocity ? work.components : scalars;
  values.resize((by == ColorBy::velocity ? 3 : 1) * model.mesh.positions.size(), 0.0f);
  for (float& value : values)
    if (!std::isfinite(value)) value = 0.0f;
  out.insert(out.end(), values.begin(), values.end());
}

void add_body(const Animation& animation, size_t b, double t, double scale, BodyMemory& memory, Surface& out) {
  const BodyModel& model = animation.bodies[b];
  const sim::ResultBody& body = animation.results->bodies[b];
  if (!model.visible || model.mesh.triangles.empty()) return;
  const SamplePlace place = find_sample(animation.results->times, t);
  const glm::dmat4 pose = body_pose(body, place);
  const glm::dmat3 turn(pose);
  if (model.flexible) update_displacement(model, body, place, memory);
  const auto first = static_cast<std::int64_t>(out.points.size() / 3);
  const ColorBy by = animation.settings.color_by;
  if (has_scalars(by)) append_values(animation, b, t, by, memory, out.scalars);
  append_values(animation, b, t, ColorBy::velocity, memory, out.velocity);
  if (has_stress(model, body)) append_values(animation, b, t, ColorBy::stress, memory, out.stress);
  else out.stress.resize(out.stress.size() + model.mesh.positions.size(), 0.0f);
  for (size_t v = 0; v < model.mesh.positions.size(); ++v) {
    const glm::dvec3 u = model.flexible
                             ? glm::dvec3(memory.displacement[3 * v], memory.displacement[3 * v + 1], memory.displacement[3 * v + 2])
                             : glm::dvec3(0.0);
    const glm::dvec3 p = glm::dvec3(pose * glm::dvec4(model.mesh.positions[v] + scale * u, 1.0)), d = turn * u;
    for (int c = 0; c < 3; ++c) {
      out.points.push_back(p[c]);
      out.displacement.push_back(static_cast<float>(d[c]));
    }
  }
  for (const glm::ivec3& triangle : model.mesh.triangles) {
    for (int c = 0; c < 3; ++c) out.corners.push_back(first + triangle[c]);
    out.body.push_back(static_cast<std::int32_t>(b));
  }
}

// Arrays of the appended section: each a 64-bit length and its bytes.
struct Appended {
  std::string header;
  std::vector<std::uint8_t> bytes;

  template <class T>
  std::string add(const char* type, const char* name, int components, const std::vector<T>& values) {
    const size_t offset = bytes.size();
    const std::uint64_t size = values.size() * sizeof(T);
    bytes.resize(offset + 8 + size);
    std::memcpy(bytes.data() + offset, &size, 8);
    if (size > 0) std::memcpy(bytes.data() + offset + 8, values.data(), size);
    return fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>\n", type, name,
                       components, offset);
  }
};

// A text as VTK writes it: the numbers of its letters and a zero.
std::string text_array(const char* name, const std::string& text) {
  std::string out = fmt::format("<Array type=\"String\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">\n", name);
  for (const char letter : text) out += fmt::format("{} ", static_cast<int>(static_cast<unsigned char>(letter)));
  return out + "0\n</Array>\n";
}

// The time, the histories at that time and the units: what belongs to no point.
std::string field_data(const Animation& animation, double t, bool stress) {
  const sim::Results& results = *animation.results;
  std::string out = "<FieldData>\n";
  const auto number = [&](const std::string& name, double value) {
    out += fmt::format("<DataArray type=\"Float64\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">{}</DataArray>\n",
                       render::escape_html(name), value);
  };
  number("TimeValue", t);
  const SamplePlace at = find_sample(results.times, t);
  std::string units = "points m; displacement m; velocity m/s";
  if (stress) units += "; stress Pa";
  for (const sim::ResultOutput& output : results.outputs) {
    double value = output.values[at.index];
    if (at.share > 0.0) value += at.share * (output.values[at.index + 1] - value);
    number(output.column, value);
    if (!output.unit.empty()) units += fmt::format("; {} {}", output.column, output.unit);
  }
  return out + text_array("units", units) + "</FieldData>\n";
}

std::vector<std::uint8_t> to_file(const Surface& s, const std::string& scalar_name, const std::string& fields) {
  Appended data;
  std::vector<std::int64_t> ends(s.corners.size() / 3);
  for (size_t k = 0; k < ends.size(); ++k) ends[k] = static_cast<std::int64_t>(3 * (k + 1));
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<PolyData>\n{}"
      "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
      fields, s.points.size() / 3, s.body.size());
  text += "<PointData Vectors=\"displacement\">\n" + data.add("Float32", "displacement", 3, s.displacement);
  text += data.add("Float32", "velocity", 3, s.velocity);
  if (!s.stress.empty()) text += data.add("Float32", "stress", 1, s.stress);
  if (!s.scalars.empty()) text += data.add("Float32", scalar_name.c_str(), 1, s.scalars);
  text += "</PointData>\n";
  text += "<CellData Scalars=\"body\">\n" + data.add("Int32", "body", 1, s.body) + "</CellData>\n";
  text += "<Points>\n" + data.add("Float64", "Points", 3, s.points) + "</Points>\n";
  text += "<Polys>\n" + data.add("Int64", "connectivity", 1, s.corners) + data.add("Int64", "offsets", 1, ends) + "</Polys>\n";
  text += "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_";
  std::vector<std::uint8_t> out(text.begin(), text.end());
  out.insert(out.end(), data.bytes.begin(), data.bytes.end());
  constexpr std::string_view end = "\n</AppendedData>\n</VTKFile>\n";
  out.insert(out.end(), end.begin(), end.end());
  return out;
}

}  // namespace

VtkReport write_vtk(const Animation& animation, double scale, const std::filesystem::path& folder, const std::string& name,
                    const std::function<void(int, int)>& progress) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw FileError(fmt::format("{}: cannot create the folder: {}", folder.string(), error.message()));
  VtkReport report;
  report.index = folder / (name + ".pvd");
  // Without its index a sequence that is broken off is not taken for a whole one.
  fs::remove(report.index, error);
  render::remove_parts(folder, name);
  const auto file_name = [&](int k) { return fmt::format("{}_{:05d}.vtp", name, k); };

  std::string index = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n";
  BodyMemory memory;
  bool stress = false;
  for (size_t b = 0; b < animation.bodies.size(); ++b) stress = stress || has_stress(animation.bodies[b], animation.results->bodies[b]);
  for (int k = 0; k < animation.count; ++k) {
    const double t = picture_time(animation, k);
    Surface surface;
    for (size_t b = 0; b < animation.bodies.size(); ++b) add_body(animation, b, t, scale, memory, surface);
    if (!stress) surface.stress.clear();
    const std::string& scalars = color_by_words()[static_cast<size_t>(animation.settings.color_by)];
    render::write_file(folder / file_name(k), to_file(surface, scalars, field_data(animation, t, stress)));
    index += fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n", t, render::escape_html(file_name(k)));
    if (progress) progress(k + 1, animation.count);
  }
  for (int k = animation.count; fs::remove(folder / file_name(k), error); ++k) {}
  index += "</Collection>\n</VTKFile>\n";
  render::write_file(report.index, std::span(reinterpret_cast<const std::uint8_t*>(index.data()), index.size()));
  report.pictures = animation.count;
  return report;
}

}  // namespace flexframe::film
