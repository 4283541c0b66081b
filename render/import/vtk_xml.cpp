// VTK's XML files (.vtu, .vtp), lists of them (.pvd), and meshes of the former.
#include "render/import/fe_mesh.h"
#include "render/import/vtk_series.h"

#include "render/base/deflate.h"
#include "render/base/file.h"
#include "sim/base/words.h"

#include <fmt/format.h>
#include <pugixml.hpp>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <set>
#include <string_view>

namespace flexframe::imports {
namespace {

using sim::InputError;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint64_t most_bytes = std::uint64_t{16} << 30;

// The bytes of base64 text; pieces that end in padding may follow each other.
Bytes decode_base64(std::string_view text) {
  Bytes out;
  std::uint32_t word = 0;
  int digits = 0, padding = 0;
  for (const char c : text) {
    int value = 0;
    if (c >= 'A' && c <= 'Z') value = c - 'A';
    else if (c >= 'a' && c <= 'z') value = c - 'a' + 26;
    else if (c >= '0' && c <= '9') value = c - '0' + 52;
    else if (c == '+') value = 62;
    else if (c == '/') value = 63;
    else if (c == '=') ++padding;
    else continue;
    word = word << 6 | static_cast<std::uint32_t>(value);
    if (++digits < 4) continue;
    for (int k = 0; k < 3 - padding; ++k) out.push_back(static_cast<std::uint8_t>(word >> (16 - 8 * k)));
    word = 0;
    digits = padding = 0;
  }
  return out;
}

// One file of VTK's XML kind.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : name_(path.string()), bytes_(render::read_file(path)) {
    const std::string_view all(reinterpret_cast<const char*>(bytes_.data()), bytes_.size());
    // What is appended is no XML: it is cut off before the file is parsed.
    const auto begin = all.find("<AppendedData");
    std::string text(all.substr(0, begin));
    if (begin != all.npos) {
      const auto end_of_tag = all.find('>', begin), mark = all.find('_', std::min(end_of_tag, all.size()));
      if (mark == all.npos) fail("its appended data have no beginning '_'");
      appended_base64_ = all.substr(begin, end_of_tag - begin).find("base64") != all.npos;
      appended_ = all.substr(mark + 1);
      text += "</VTKFile>";
    }
    const pugi::xml_parse_result result = document_.load_buffer(text.data(), text.size());
    if (!result) fail(fmt::format("is no whole XML file: {} at byte {}", result.description(), result.offset));
    root_ = document_.child("VTKFile");
    if (!root_) fail("is no VTK file: its first element must be <VTKFile>");
    const std::string_view order = root_.attribute("byte_order").as_string("LittleEndian"),
                           header = root_.attribute("header_type").as_string("UInt32"),
                           compressor = root_.attribute("compressor").as_string("");
    swapped_ = order == "BigEndian";
    header_bytes_ = header == "UInt64" ? 8 : 4;
    compressed_ = !compressor.empty();
    if (compressed_ && compressor != "vtkZLibDataCompressor")
      fail(fmt::format("is compressed by {}; only vtkZLibDataCompressor is read", compressor));
  }

  [[noreturn]] void fail(const std::string& message) const { throw InputError(fmt::format("{}: {}", name_, message)); }
  pugi::xml_node root() const { return root_; }

  // Numbers of a DataArray, of any type.
  std::vector<double> numbers(const pugi::xml_node& array) const {
    const std::string_view format = array.attribute("format").as_string("ascii"), type = array.attribute("type").as_string("");
    if (format == "ascii") return ascii_numbers(array.text().get());
    const Bytes raw = format == "binary" ? unpack(decode_base64(array.text().get())) : appended_bytes(array);
    if (format != "binary" && format != "appended") fail(fmt::format("data of the format {} are not read", sim::quote(format)));
    if (type == "Float64") return convert<double>(raw);
    if (type == "Float32") return convert<float>(raw);
    if (type == "Int64") return convert<std::int64_t>(raw);
    if (type == "UInt64") return convert<std::uint64_t>(raw);
    if (type == "Int32") return convert<std::int32_t>(raw);
    if (type == "UInt32") return convert<std::uint32_t>(raw);
    if (type == "Int16") return convert<std::int16_t>(raw);
    if (type == "UInt16") return convert<std::uint16_t>(raw);
    if (type == "Int8") return convert<std::int8_t>(raw);
    if (type == "UInt8") return convert<std::uint8_t>(raw);
    fail(fmt::format("numbers of the type {} are not read", sim::quote(type)));
  }

 private:
  std::vector<double> ascii_numbers(std::string_view text) const {
    std::vector<double> out;
    const char *at = text.data(), *end = text.data() + text.size();
    while (true) {
      while (at < end && (*at == ' ' || *at == '\n' || *at == '\t' || *at == '\r')) ++at;
      if (at == end) return out;
      double value = 0.0;
      const auto [next, error] = std::from_chars(at, end, value);
      if (error != std::errc())
        fail(fmt::format("holds {} where a number is needed", sim::quote(std::string_view(at, std::min<size_t>(20, end - at)))));
      out.push_back(value);
      at = next;
    }
  }

  template <class T>
  std::vector<double> convert(const Bytes& raw) const {
    std::vector<double> out(raw.size() / sizeof(T));
    for (size_t i = 0; i < out.size(); ++i) {
      std::uint8_t one[sizeof(T)];
      std::memcpy(one, raw.data() + i * sizeof(T), sizeof(T));
      if (swapped_) std::reverse(std::begin(one), std::end(one));
      T value;
      std::memcpy(&value, one, sizeof(T));
      out[i] = static_cast<double>(value);
    }
    return out;
  }

  std::uint64_t header_word(const Bytes& data, size_t index) const {
    if ((index + 1) * header_bytes_ > data.size()) fail("its data end in their header");
    std::uint64_t value = 0;
    for (size_t k = 0; k < header_bytes_; ++k) {
      const std::uint8_t byte = data[index * header_bytes_ + (swapped_ ? header_bytes_ - 1 - k : k)];
      value |= std::uint64_t{byte} << 8 * k;
    }
    return value;
  }

  // What stands behind the header: a length and bytes, or blocks of zlib streams.
  Bytes unpack(const Bytes& data) const {
    if (!compressed_) {
      const std::uint64_t length = header_word(data, 0);
      if (length > data.size() - header_bytes_)
        fail(fmt::format("says {} bytes of data and holds {}", length, data.size() - header_bytes_));
      const auto begin = data.begin() + static_cast<std::ptrdiff_t>(header_bytes_);
      return {begin, begin + static_cast<std::ptrdiff_t>(length)};
    }
    const std::uint64_t blocks = header_word(data, 0);
    if (blocks == 0) return {};
    const std::uint64_t size = header_word(data, 1), last = header_word(data, 2);
    if (blocks > data.size() || size > most_bytes / blocks) fail("its compressed data are damaged");
    Bytes out((blocks - 1) * size + (last > 0 ? last : size));
    size_t at = (3 + blocks) * header_bytes_, to = 0;
    for (std::uint64_t b = 0; b < blocks; ++b) {
      const std::uint64_t packed = header_word(data, 3 + b), unpacked = std::min<std::uint64_t>(size, out.size() - to);
      if (at > data.size() || packed > data.size() - at ||
          !render::decompress_zlib(std::span(data).subspan(at, packed), std::span(out).subspan(to, unpacked)))
        fail("its compressed data are damaged");
      at += packed;
      to += unpacked;
    }
    return out;
  }

  Bytes appended_bytes(const pugi::xml_node& array) const {
    const std::uint64_t offset = array.attribute("offset").as_ullong(appended_.size());
    if (offset >= appended_.size()) fail(fmt::format("its appended data end before {}", sim::quote(array.attribute("Name").as_string())));
    const std::string_view from = appended_.substr(offset);
    // Base64 ends at the first sign that is none: of the next array or of the tag.
    if (appended_base64_) return unpack(decode_base64(from.substr(0, from.find('<'))));
    return unpack({from.begin(), from.end()});
  }

  std::string name_;
  Bytes bytes_;
  std::string_view appended_;
  bool appended_base64_ = false, swapped_ = false, compressed_ = false;
  size_t header_bytes_ = 4;
  pugi::xml_document document_;
  pugi::xml_node root_;
};

pugi::xml_node named(const pugi::xml_node& parent, const char* name) { return parent.find_child_by_attribute("DataArray", "Name", name); }

// Calls use(VTK's type, points) for each cell of one piece: connectivity, offsets and types; polygons have no types.
template <class Use>
void each_cell(const Reader& reader, const pugi::xml_node& from, bool polygons, int first_point, const Use& use) {
  if (!from) return;
  const pugi::xml_node connectivity = named(from, "connectivity"), offsets = named(from, "offsets"), types = named(from, "types");
  if (!connectivity || !offsets || (!polygons && !types)) reader.fail("its cells lack connectivity, offsets or types");
  const std::vector<double> nodes = reader.numbers(connectivity), ends = reader.numbers(offsets);
  const std::vector<double> kinds = polygons ? std::vector<double>(ends.size(), 7.0) : reader.numbers(types);
  if (kinds.size() != ends.size()) reader.fail(fmt::format("has {} cells and {} types of cells", ends.size(), kinds.size()));
  size_t at = 0;
  std::vector<int> of_cell;
  for (size_t c = 0; c < ends.size(); ++c) {
    if (!(ends[c] >= static_cast<double>(at) && ends[c] <= static_cast<double>(nodes.size())))
      reader.fail("the ends of its cells do not rise");
    of_cell.clear();
    for (; at < static_cast<size_t>(ends[c]); ++at) {
      if (!(nodes[at] >= 0.0 && nodes[at] < 2e9)) reader.fail(fmt::format("a cell names point {}", nodes[at]));
      of_cell.push_back(first_point + static_cast<int>(nodes[at]));
    }
    use(static_cast<int>(kinds[c]), of_cell);
  }
}

void add_fields(const Reader& reader, const pugi::xml_node& piece, VtkMoment& moment) {
  for (const pugi::xml_node& array : piece.child("PointData").children("DataArray")) {
    if (std::string_view(array.attribute("type").as_string()) == "String") continue;
    const std::string name = array.attribute("Name").as_string("");
    auto field = std::find_if(moment.fields.begin(), moment.fields.end(), [&](const VtkMoment::Field& f) { return f.name == name; });
    if (field == moment.fields.end()) {
      moment.fields.push_back({.name = name, .components = array.attribute("NumberOfComponents").as_int(1), .values = {}});
      field = moment.fields.end() - 1;
    }
    if (field->components < 1 || field->components > 1000)
      reader.fail(fmt::format("point data {} have {} components", sim::quote(name), field->components));
    const std::vector<double> values = reader.numbers(array);
    field->values.insert(field->values.end(), values.begin(), values.end());
  }
}

void add_points(const Reader& reader, const pugi::xml_node& piece, std::vector<double>& points) {
  const pugi::xml_node array = piece.child("Points").child("DataArray");
  if (!array) reader.fail("its points are missing");
  const std::vector<double> more = reader.numbers(array);
  if (more.size() % 3 != 0 || more.size() > 3'000'000'000) reader.fail(fmt::format("has {} coordinates of points", more.size()));
  points.insert(points.end(), more.begin(), more.end());
}

// Integers of the cells as sets "NAME:VALUE"; `first`: the mesh's cell that is the piece's first.
void add_cell_sets(const Reader& reader, const pugi::xml_node& piece, int first, CellMesh& mesh) {
  constexpr size_t most_values = 1000;  // more are numbers of cells or the like
  const int count = mesh.cells() - first;
  for (const pugi::xml_node& array : piece.child("CellData").children("DataArray")) {
    const std::string_view type = array.attribute("type").as_string("");
    if (type.find("Int") == type.npos || array.attribute("NumberOfComponents").as_int(1) != 1) continue;
    const std::string name = array.attribute("Name").as_string("");
    const std::vector<double> values = reader.numbers(array);
    if (std::ssize(values) != count)
      reader.fail(fmt::format("cell data {} have {} values for {} cells", sim::quote(name), values.size(), count));
    if (std::set<double>(values.begin(), values.end()).size() > most_values) continue;
    for (int c = 0; c < count; ++c) mesh.cell_sets[fmt::format("{}:{:.0f}", name, values[static_cast<size_t>(c)])].push_back(first + c);
  }
}

VtkMoment read_file(const std::filesystem::path& path) {
  const Reader reader(path);
  const std::string_view type = reader.root().attribute("type").as_string();
  if (type != "UnstructuredGrid" && type != "PolyData")
    reader.fail(fmt::format("holds {}; an UnstructuredGrid (.vtu) or PolyData (.vtp) is needed", sim::quote(type)));
  const pugi::xml_node grid = reader.root().child(std::string(type).c_str());
  VtkMoment moment;
  moment.file = path.string();
  for (const pugi::xml_node& array : grid.child("FieldData").children("DataArray"))
    if (std::string_view(array.attribute("Name").as_string()) == "TimeValue")
      if (const std::vector<double> value = reader.numbers(array); !value.empty()) moment.time = value.front();
  for (const pugi::xml_node& piece : grid.children("Piece")) {
    const auto first = static_cast<int>(moment.points.size() / 3);
    add_points(reader, piece, moment.points);
    const bool polygons = type == "PolyData";
    each_cell(reader, piece.child(polygons ? "Polys" : "Cells"), polygons, first,
              [&](int kind, const std::vector<int>& nodes) { add_vtk_cell(kind, nodes, moment); });
    add_fields(reader, piece, moment);
  }
  if (moment.points.empty()) reader.fail("holds no points");
  return moment;
}

}  // namespace

CellMesh read_vtu_cells(const std::filesystem::path& path) {
  const Reader reader(path);
  if (std::string_view(reader.root().attribute("type").as_string()) != "UnstructuredGrid")
    reader.fail(fmt::format("holds {}; an UnstructuredGrid is needed", sim::quote(reader.root().attribute("type").as_string())));
  CellMesh mesh;
  mesh.file = path.string();
  for (const pugi::xml_node& piece : reader.root().child("UnstructuredGrid").children("Piece")) {
    const int first_point = static_cast<int>(mesh.points.size() / 3), first_cell = mesh.cells();
    add_points(reader, piece, mesh.points);
    each_cell(reader, piece.child("Cells"), false, first_point, [&](int kind, const std::vector<int>& nodes) { mesh.add(kind, nodes); });
    add_cell_sets(reader, piece, first_cell, mesh);
  }
  return mesh;
}

NodalSeries read_vtk_xml(std::span<const std::filesystem::path> files, const VtkRequest& request) {
  std::vector<VtkMoment> moments;
  for (const std::filesystem::path& file : files) {
    if (file.extension() != ".pvd") {
      moments.push_back(read_file(file));
      continue;
    }
    const Reader reader(file);
    for (const pugi::xml_node& set : reader.root().child("Collection").children("DataSet")) {
      const double time = set.attribute("timestep").as_double();
      if (set.attribute("part").as_int() != 0) reader.fail("lists parts beside each other; one part is read: give its files");
      moments.push_back(read_file(file.parent_path() / set.attribute("file").as_string()));
      moments.back().time = time;
    }
    if (moments.empty()) reader.fail("lists no files");
  }
  return to_series(std::move(moments), "VTK series", request);
}

}  // namespace flexframe::imports
