#include "render/film/vtk.h"

#include "render/base/file.h"
#include "render/base/html.h"
#include "render/film/vtk_surface.h"
#include "sim/base/error.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace flexframe::film {
namespace {

static_assert(std::endian::native == std::endian::little, "the files say LittleEndian");

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
  std::string units = "points m; displacement m; velocity m/s";
  if (stress) units += "; stress Pa";
  for (const sim::ResultOutput& output : results.outputs) {
    number(output.column, output_at(results, output, t));
    if (!output.unit.empty()) units += fmt::format("; {} {}", output.column, output.unit);
  }
  return out + text_array("units", units) + "</FieldData>\n";
}

std::vector<std::uint8_t> to_file(const VtkSurface& s, const std::string& scalar_name, const std::string& fields) {
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
  const bool stress = has_stress(animation);
  for (int k = 0; k < animation.count; ++k) {
    const double t = picture_time(animation, k);
    const VtkSurface surface = vtk_surface(animation, t, scale, memory);
    render::write_file(folder / file_name(k), to_file(surface, scalar_name(animation), field_data(animation, t, stress)));
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
