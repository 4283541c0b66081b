// gmsh meshes, formats 2.2 and 4.1, ASCII and binary. See read_msh in fe_model.h.
#include "sim/reduce/fe_model.h"

#include "sim/base/files_read.h"
#include "sim/base/plain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>
#include <unordered_map>

namespace flexframe::sim {
namespace {

// gmsh element type -> nodes, dimension, shape; order[i] is gmsh's place of our node i.
struct Type {
  int nodes = 0, dimension = 0;
  bool usable = false;
  FeShape shape = FeShape::point_mass;
  std::vector<int> order;
};

Type type_of(int number) {
  const auto plain = [](int n) {
    std::vector<int> o(n);
    for (int i = 0; i < n; ++i) o[i] = i;
    return o;
  };
  const auto other = [](int nodes, int dimension) {
    Type t;
    t.nodes = nodes;
    t.dimension = dimension;
    return t;
  };
  switch (number) {
    case 15:
      return other(1, 0);
    case 1:
      return other(2, 1);
    case 8:
      return other(3, 1);
    case 26:
      return other(4, 1);
    case 2:
      return {3, 2, true, FeShape::triangle3, plain(3)};
    case 3:
      return {4, 2, true, FeShape::quadrangle4, plain(4)};
    case 9:
      return {6, 2, true, FeShape::triangle6, plain(6)};
    case 16:
      return {8, 2, true, FeShape::quadrangle8, plain(8)};
    case 10:
      return other(9, 2);
    case 4:
      return {4, 3, true, FeShape::tetrahedron4, plain(4)};
    case 5:
      return {8, 3, true, FeShape::hexahedron8, plain(8)};
    case 6:
      return {6, 3, true, FeShape::wedge6, plain(6)};
    case 11:
      return {10, 3, true, FeShape::tetrahedron10, {0, 1, 2, 3, 4, 5, 6, 7, 9, 8}};
    case 17:
      return {20, 3, true, FeShape::hexahedron20, {0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15}};
    case 18:
      return {15, 3, true, FeShape::wedge15, {0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11}};
    case 7:
      return other(5, 3);
    case 12:
      return other(27, 3);
    case 13:
      return other(18, 3);
    case 14:
      return other(14, 3);
    case 19:
      return other(13, 3);
    default:
      return {};
  }
}

class Reader {
 public:
  Reader(const std::filesystem::path& path, const FeUnits& u) : units(u) {
    model.file = path.string();
    std::error_code error;
    std::ifstream in(path, std::ios::binary);
    if (!in || std::filesystem::is_directory(path, error)) throw InputError(fmt::format("{}: cannot be opened", path.string()));
    note_file_read(path);
    skip_byte_order_mark(in);
    data = read_rest(in, path);
  }

  FeModel read() {
    bool nodes = false, elements = false;
    for (std::string section = word(); !section.empty(); section = word()) {
      if (section == "$MeshFormat") read_format();
      else if (section == "$PhysicalNames") read_names();
      else if (section == "$Entities") read_entities();
      else if (section == "$PartitionedEntities") read_partitioned_entities();
      else if (section == "$Nodes") nodes = true, four ? read_nodes4() : read_nodes2();
      else if (section == "$Elements") {
        if (!nodes) fail("$Elements before $Nodes");
        elements = true;
        four ? read_elements4() : read_elements2();
      } else if (section.starts_with("$")) {
        const size_t end = data.find("$End" + section.substr(1), at);
        if (end == std::string::npos) fail(fmt::format("{} has no $End{}", section, section.substr(1)));
        at = end;
        word();
        continue;
      } else {
        fail(fmt::format("a section '$...' is expected, found '{}'", section.substr(0, 30)));
      }
      const std::string end = word();
      if (end != "$End" + section.substr(1)) fail(fmt::format("$End{} is expected, found '{}'", section.substr(1), end.substr(0, 30)));
    }
    if (!version) fail("no gmsh mesh: $MeshFormat is missing");
    if (!nodes || !elements) fail("the mesh has no nodes or no elements");
    finish();
    return std::move(model);
  }

 private:
  FeUnits units;
  FeModel model;
  std::string data;
  size_t at = 0;
  bool binary = false, four = false, version = false;
  std::unordered_map<long, int> node_index;
  std::map<std::pair<int, int>, std::string> physical_names;          // (dimension, tag)
  std::map<std::pair<int, int>, std::vector<int>> entity_physicals;   // format 4
  std::map<std::pair<int, int>, std::vector<int>> parts_of_entities;  // of a mesh cut into partitions, whose elements name these
  struct Raw {
    long id;
    int type;
    std::vector<int> more;  // its physical groups
    std::vector<long> nodes;
    int line;
  };
  std::vector<Raw> raw;
  size_t lines_to = 0;  // `lines` is the line of this byte
  int lines = 1;

  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", model.file,
                                 1 + std::count(data.begin(), data.begin() + static_cast<long>(std::min(at, data.size())), '\n'), message));
  }
  [[noreturn]] void fail(const Raw& element, const std::string& message) const {
    throw InputError(element.line > 0 ? fmt::format("{}:{}: {}", model.file, element.line, message)
                                      : fmt::format("{}: {}", model.file, message));
  }
  std::string word() {
    while (at < data.size() && std::isspace(static_cast<unsigned char>(data[at]))) ++at;
    const size_t begin = at;
    while (at < data.size() && !std::isspace(static_cast<unsigned char>(data[at]))) ++at;
    return data.substr(begin, at - begin);
  }
  template <class T>
  T raw_value() {
    T v;
    if (data.size() - at < sizeof v) fail("the file is cut short");
    std::memcpy(&v, data.data() + at, sizeof v);
    at += sizeof v;
    return v;
  }
  long text_integer() {
    const std::string w = word();
    char* end = nullptr;
    const long v = std::strtol(w.c_str(), &end, 10);
    if (w.empty() || *end) fail(fmt::format("an integer is expected, found '{}'", w.substr(0, 30)));
    return v;
  }
  double text_real() {
    const std::string w = word();
    const char* end = nullptr;
    const double v = leading_number(w.c_str(), &end);
    if (w.empty() || *end || !std::isfinite(v)) fail(fmt::format("a number is expected, found '{}'", w.substr(0, 30)));
    return v;
  }
  long int4() { return binary ? raw_value<int>() : text_integer(); }
  long size8() { return binary ? static_cast<long>(raw_value<std::uint64_t>()) : text_integer(); }
  double real() {
    const double v = binary ? raw_value<double>() : text_real();
    if (!std::isfinite(v)) fail("a coordinate is no finite number");
    return v;
  }
  // Counts are believed only as far as the file can back them.
  size_t counted(long n) {
    if (n < 0 || static_cast<size_t>(n) > data.size()) fail(fmt::format("a count of {} cannot be: the file has {} bytes", n, data.size()));
    return n;
  }
  void line_end() {
    while (at < data.size() && data[at] != '\n') ++at;
    if (at < data.size()) ++at;
  }

  void read_format() {
    const std::string number = word();
    binary = text_integer() == 1;
    const long size = text_integer();
    version = true;
    four = number == "4.1";
    if (!four && number != "2.2" && number != "2.1" && number != "2")
      fail(fmt::format("format {} cannot be read: 2.2 and 4.1 can (gmsh -format msh22, msh41)", number));
    if (size != 8) fail(fmt::format("data size {} cannot be read: 8 can", size));
    if (binary) {
      line_end();
      if (raw_value<int>() != 1) fail("the file was written on a machine of other byte order");
    }
  }

  void read_names() {
    const size_t count = counted(text_integer());
    for (size_t i = 0; i < count; ++i) {
      const int dimension = static_cast<int>(text_integer()), tag = static_cast<int>(text_integer());
      const size_t open = data.find('"', at), close = open == std::string::npos ? open : data.find('"', open + 1);
      if (close == std::string::npos) fail("a name in quotes is expected");
      std::string name = data.substr(open + 1, close - open - 1);
      for (char& c : name) c = plain_upper(c);
      physical_names[{dimension, tag}] = name;
      at = close + 1;
    }
  }

  void read_entities() {
    if (binary) line_end();
    size_t counts[4];
    for (size_t& c : counts) c = counted(size8());
    for (int dimension = 0; dimension < 4; ++dimension)
      for (size_t i = 0; i < counts[dimension]; ++i) {
        const int tag = static_cast<int>(int4());
        for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) real();
        const size_t physicals = counted(size8());
        for (size_t k = 0; k < physicals; ++k) entity_physicals[{dimension, tag}].push_back(static_cast<int>(int4()));
        if (dimension > 0)
          for (size_t k = counted(size8()); k > 0; --k) int4();
      }
  }

  // Parts of entities, which have the physical groups of those that they are parts of.
  void read_partitioned_entities() {
    if (binary) line_end();
    size8();  // partitions
    for (size_t k = counted(size8()); k > 0; --k) int4(), int4();
    size_t counts[4];
    for (size_t& c : counts) c = counted(size8());
    for (int dimension = 0; dimension < 4; ++dimension)
      for (size_t i = 0; i < counts[dimension]; ++i) {
        const int tag = static_cast<int>(int4()), parent_dimension = static_cast<int>(int4()), parent = static_cast<int>(int4());
        for (size_t k = counted(size8()); k > 0; --k) int4();
        for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) real();
        std::vector<int> own;
        for (size_t k = counted(size8()); k > 0; --k) own.push_back(static_cast<int>(int4()));
        if (const auto whole = entity_physicals.find({parent_dimension, parent});
            own.empty() && parent_dimension == dimension && whole != entity_physicals.end())
          own = whole->second;
        parts_of_entities[{dimension, tag}] = std::move(own);
        if (dimension > 0)
          for (size_t k = counted(size8()); k > 0; --k) int4();
      }
  }

  void add_node(long id, double x, double y, double z) {
    if (id < 1 || id > 2147483647L) fail(fmt::format("node number {} is out of range", id));
    if (!node_index.try_emplace(id, static_cast<int>(model.nodes.size())).second) fail(fmt::format("node {} is defined twice", id));
    model.node_ids.push_back(static_cast<int>(id));
    model.nodes.emplace_back(Vec3(x, y, z) * units.length);
  }

  void read_nodes2() {
    const size_t count = counted(text_integer());
    if (binary) line_end();
    for (size_t i = 0; i < count; ++i) {
      const long id = int4();
      const double x = real(), y = real(), z = real();
      add_node(id, x, y, z);
    }
  }
  void read_nodes4() {
    if (binary) line_end();
    const size_t blocks = counted(size8());
    size8(), size8(), size8();
    for (size_t b = 0; b < blocks; ++b) {
      const long dimension = int4();
      int4();
      const bool parametric = int4() != 0;
      std::vector<long> ids(counted(size8()));
      for (long& id : ids) id = size8();
      for (long id : ids) {
        const double x = real(), y = real(), z = real();
        if (parametric)
          for (long k = 0; k < dimension; ++k) real();
        add_node(id, x, y, z);
      }
    }
  }

  void add_element(long id, int type, const std::vector<int>& physicals, std::vector<long> nodes) {
    if (!binary) {
      lines += static_cast<int>(std::count(data.begin() + static_cast<long>(lines_to), data.begin() + static_cast<long>(at), '\n'));
      lines_to = at;
    }
    raw.push_back({id, type, physicals, std::move(nodes), binary ? 0 : lines});
  }
  Type known_type(long number) {
    Type t = type_of(static_cast<int>(number));
    if (t.nodes == 0)
      fail(fmt::format(
          "gmsh element type {} is of a higher order or not known; those of first and second order can be read (gmsh -order 2)", number));
    return t;
  }

  void read_elements2() {
    size_t left = counted(text_integer());
    if (binary) line_end();
    while (left > 0) {
      size_t group = 1;
      long type = 0, tags = 0, id = 0;
      if (binary) {
        type = int4();
        group = counted(int4());
        tags = int4();
        if (group == 0 || group > left) fail("an element group of wrong size");
      }
      for (size_t g = 0; g < group; ++g, --left) {
        id = int4();
        if (!binary) {
          type = int4();
          tags = int4();
        }
        std::vector<int> physicals;
        for (long k = 0; k < static_cast<long>(counted(tags)); ++k) {
          const int tag = static_cast<int>(int4());
          if (k == 0 && tag != 0) physicals.push_back(tag);
        }
        std::vector<long> nodes(known_type(type).nodes);
        for (long& n : nodes) n = int4();
        add_element(id, static_cast<int>(type), physicals, std::move(nodes));
      }
    }
  }
  void read_elements4() {
    if (binary) line_end();
    const size_t blocks = counted(size8());
    size8(), size8(), size8();
    for (size_t b = 0; b < blocks; ++b) {
      const int dimension = static_cast<int>(int4()), entity = static_cast<int>(int4()), type = static_cast<int>(int4());
      const Type t = known_type(type);
      const auto& groups = parts_of_entities.empty() ? entity_physicals : parts_of_entities;
      const auto physicals = groups.find({dimension, entity});
      for (size_t k = counted(size8()); k > 0; --k) {
        const long id = size8();
        std::vector<long> nodes(t.nodes);
        for (long& n : nodes) n = size8();
        add_element(id, type, physicals == groups.end() ? std::vector<int>{} : physicals->second, std::move(nodes));
      }
    }
  }

  bool has_several_groups(int dimension) const {
    std::set<int> groups;
    for (const Raw& r : raw)
      if (type_of(r.type).dimension == dimension) groups.insert(r.more.begin(), r.more.end());
    return groups.size() > 1;
  }

  // The nodes of an element, as the model counts them.
  std::vector<int> nodes_of_element(const Raw& r) const {
    std::vector<int> nodes;
    for (long n : r.nodes) {
      const auto it = node_index.find(n);
      if (it == node_index.end()) fail(r, fmt::format("element {}: node {} is not there", r.id, n));
      nodes.push_back(it->second);
    }
    return nodes;
  }

  void add_fe_element(const Raw& r, const Type& t, const std::vector<int>& nodes) {
    if (!t.usable)
      fail(r, fmt::format("element {}: gmsh type {} ({} nodes) cannot be used: tetrahedra of 4 or 10 nodes, hexahedra of 8 or 20, wedges "
                          "of 6 or 15, shells of 3, 4, 6 or 8 can",
                          r.id, r.type, t.nodes));
    FeElement e;
    e.id = static_cast<int>(r.id);
    e.shape = t.shape;
    if (t.shape == FeShape::hexahedron8) e.formulation = FeFormulation::incompatible;
    if (t.shape == FeShape::hexahedron20) e.formulation = FeFormulation::reduced;
    e.first = static_cast<int>(model.connectivity.size());
    e.count = t.nodes;
    e.line = r.line;
    for (int i = 0; i < t.nodes; ++i) model.connectivity.push_back(nodes[t.order[i]]);
    model.elements.push_back(e);
  }

  void finish() {
    int dimension = 0;
    for (const Raw& r : raw) dimension = std::max(dimension, type_of(r.type).dimension);
    if (dimension < 2) fail("the mesh has neither volume nor surface elements");
    std::map<std::string, std::set<int>> nodes_of, elements_of;
    // Format 2 repeats an element for each further physical group that it belongs to.
    std::map<std::vector<int>, int> written;
    const bool repeats = !four && has_several_groups(dimension);
    std::vector<std::vector<int>> lower;
    for (const Raw& r : raw) {
      const Type t = type_of(r.type);
      std::vector<int> nodes = nodes_of_element(r);
      std::vector<std::string> names;
      for (int p : r.more) {
        const auto it = physical_names.find({t.dimension, std::abs(p)});
        names.push_back(it != physical_names.end() ? it->second : fmt::format("{}", std::abs(p)));
        for (int n : nodes) nodes_of[names.back()].insert(n);
      }
      if (t.dimension != dimension) {
        if (t.dimension > 0) lower.push_back(std::move(nodes));
        continue;
      }
      auto index = static_cast<int>(model.elements.size());
      if (repeats) {
        std::vector<int> key = nodes;
        std::sort(key.begin(), key.end());
        index = written.try_emplace(std::move(key), index).first->second;
      }
      for (const std::string& name : names) elements_of[name].insert(index);
      if (index == static_cast<int>(model.elements.size())) add_fe_element(r, t, nodes);
    }
    for (auto& [name, set] : nodes_of) model.node_sets[name].assign(set.begin(), set.end());
    for (auto& [name, set] : elements_of) model.element_sets[name].assign(set.begin(), set.end());
    warn_of_loose_cells(model, lower);
  }
};

}  // namespace

FeModel read_msh(const std::filesystem::path& path, const FeUnits& units) { return Reader(path, units).read(); }

}  // namespace flexframe::sim
